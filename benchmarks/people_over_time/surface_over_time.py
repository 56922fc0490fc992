"""Surfaces of clips beside the truth: parts, sides, and how much they flicker and tremble from frame to frame."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from export.surface import LIMB_SIDE
from export.surface_grid import SurfaceGrid

STEP = 2  # every second pixel each way is looked at
MOVES_CM = 0.5  # a pixel shows motion if its true surface point moves by this or more in a frame
_MAX_ERROR_CM = 25.0  # a farther point is another part's: counted by the parts, not as a tremble


@dataclass
class SurfaceScores:
    """Sums over the frames of one clip or several, for `figures`."""

    asked: int = 0
    right: int = 0
    limb: int = 0
    same_side: int = 0
    kept_s: float = 0.0
    flips: int = 0
    trembles_cm: list[np.ndarray] = field(default_factory=list)
    errors_cm: list[np.ndarray] = field(default_factory=list)
    lags_cm: list[np.ndarray] = field(default_factory=list)

    def figures(self) -> dict[str, float]:
        """part: share of the people's pixels with the right part; pixels that are not painted are wrong. left/right:
        share of the limb pixels painted as a limb that have the right side. error: mean distance from the true surface
        point, where the part is right, cm.

        Pixels without motion: flips: changes of the painted part in a second. tremble p50, p90: change of the
        surface's error from frame to frame, cm. Pixels with motion: lag: mean error along the motion, cm. Above 0, the
        painted surface is at an earlier place.
        """
        tremble, error, lag = (_all_of(parts) for parts in (self.trembles_cm, self.errors_cm, self.lags_cm))
        return {
            "part": self.right / max(self.asked, 1),
            "left/right": self.same_side / max(self.limb, 1),
            "flips": self.flips / max(self.kept_s, 1e-9),
            "tremble p50": float(np.median(tremble)),
            "tremble p90": float(np.quantile(tremble, 0.9)),
            "error": float(error.mean()),
            "lag": float(lag.mean()),
        }


def _all_of(parts: list[np.ndarray]) -> np.ndarray:
    """NaN without any, which then is every mean and quantile."""
    values = np.concatenate(parts) if parts else np.empty(0)
    return values if len(values) else np.array([np.nan])


@dataclass(frozen=True, eq=False)
class _Seen:
    """One frame: true and painted part [H, W], true person [H, W], true surface point and its error [H, W, 3] in cm;
    NaN where the painted part is not the true one."""

    part: np.ndarray
    painted: np.ndarray
    person: np.ndarray
    point_cm: np.ndarray
    error_cm: np.ndarray


def _seen(label: np.ndarray, iuv: np.ndarray, must: np.ndarray, grid: SurfaceGrid) -> _Seen:
    label, iuv = label[::STEP, ::STEP], iuv[::STEP, ::STEP]
    counts = np.concatenate([[False], must])[np.minimum(label[..., 3], len(must))] & (label[..., 0] > 0)
    part = np.where(counts, label[..., 0], 0)
    point, error = (np.full((*part.shape, 3), np.nan, np.float32) for _ in range(2))
    true = _points_cm(part[counts], label[counts], grid)
    point[counts] = true
    same = counts & (part == iuv[..., 0])
    error[same] = _points_cm(part[same], iuv[same], grid) - point[same]
    error[np.linalg.norm(np.nan_to_num(error), axis=-1) > _MAX_ERROR_CM] = np.nan
    return _Seen(part, iuv[..., 0], label[..., 3], point, error)


def _points_cm(part: np.ndarray, iuv: np.ndarray, grid: SurfaceGrid) -> np.ndarray:
    return 100 * grid.point_of(part, iuv[:, 1:3] / np.float32(255)) if len(part) else np.empty((0, 3), np.float32)


def rate(
    scores: SurfaceScores, frames: Iterable[tuple[np.ndarray, np.ndarray, np.ndarray]], fps: float, grid: SurfaceGrid
) -> None:
    """Adds a clip. frames: true label uint8 [H, W, 4], painted uint8 [H, W, 3] (I, U*255, V*255), and which people must
    be found, bool [people]."""
    before = None
    for label, iuv, must in frames:
        now = _seen(label, iuv, must, grid)
        _add_frame(scores, now)
        if before is not None:
            _add_change(scores, before, now, fps)
        before = now


def _add_frame(scores: SurfaceScores, now: _Seen) -> None:
    asked = now.part > 0
    scores.asked += int(asked.sum())
    scores.right += int((now.part == now.painted)[asked].sum())
    side, painted = LIMB_SIDE[now.part], LIMB_SIDE[np.minimum(now.painted, len(LIMB_SIDE) - 1)]
    limb = (side > 0) & (painted > 0)
    scores.limb += int(limb.sum())
    scores.same_side += int((side == painted)[limb].sum())
    error = np.linalg.norm(now.error_cm, axis=-1)
    scores.errors_cm.append(error[np.isfinite(error)].astype(np.float32))


def _add_change(scores: SurfaceScores, before: _Seen, now: _Seen, fps: float) -> None:
    same = (now.part > 0) & (now.part == before.part) & (now.person == before.person)
    moved = now.point_cm - before.point_cm
    length = np.linalg.norm(moved, axis=-1)
    still = same & (length < MOVES_CM)
    kept = still & (now.painted > 0) & (before.painted > 0)
    scores.kept_s += kept.sum() / fps
    scores.flips += int((now.painted != before.painted)[kept].sum())
    change = np.linalg.norm(now.error_cm - before.error_cm, axis=-1)[still]
    scores.trembles_cm.append(change[np.isfinite(change)].astype(np.float32))
    moves = same & (length >= MOVES_CM) & (length < _MAX_ERROR_CM)
    along = -(now.error_cm * moved).sum(-1)[moves] / length[moves]
    scores.lags_cm.append(along[np.isfinite(along)].astype(np.float32))
