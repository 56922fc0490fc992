"""Depth of a posed photo from its neighbours: a sweep of planes, compared by correlation, smoothed along four ways.

Sweep: Collins, "A space-sweep approach to true multi-image matching" (CVPR 1996). Smoothing: semi-global matching,
Hirschmueller (PAMI 2008), section 2.3.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from export.camera import Camera

PLANES = 128
WINDOW_PX = 7
_MIN_SPREAD = 2.0  # grey levels: where less is to be seen, nothing matches
_SMALL_STEP, _LARGE_STEP = 0.08, 0.5  # costs of a depth one plane away from its neighbour's, and of more
_WORST_COST = 0.75  # 1 - correlation


@dataclass(frozen=True, eq=False)
class GreyView:
    """grey: float32 [H, W]. mask: bool [H, W], where depth is wanted."""

    camera: Camera
    grey: np.ndarray
    mask: np.ndarray


def depth_of(view: GreyView, others: list[GreyView], near: float, far: float) -> np.ndarray:
    """float32 [H, W], along the optical axis, in the world's unit; 0 where it is not known or not wanted."""
    depth = np.zeros(view.grey.shape, np.float32)
    if not view.mask.any():
        return depth
    rows, columns = (_span(view.mask.any(axis), view.mask.shape[1 - axis]) for axis in (1, 0))
    grey, mask = view.grey[rows, columns], view.mask[rows, columns]
    inverse = np.linspace(1 / far, 1 / near, PLANES)
    costs = np.stack([_cost_at(view, others, 1 / w, rows, columns, grey) for w in inverse], -1)
    total = sum(_along(costs, way) for way in ((0, 1), (0, -1), (1, 1), (1, -1)))
    best = total.argmin(-1)
    # A parabola through the three costs around the least one places it between planes.
    middle = np.clip(best, 1, PLANES - 2)[..., None]
    before, at, after = (np.take_along_axis(total, middle + k, -1)[..., 0] for k in (-1, 0, 1))
    bend = before - 2 * at + after
    shift = np.where(bend > 1e-6, np.clip(0.5 * (before - after) / np.maximum(bend, 1e-6), -0.5, 0.5), 0)
    found = 1 / (1 / far + (middle[..., 0] + shift) * (inverse[1] - inverse[0]))
    sure = np.take_along_axis(costs, best[..., None], -1)[..., 0] < _WORST_COST
    sure &= (best > 0) & (best < PLANES - 1) & mask
    depth[rows, columns] = np.where(sure, found, 0)
    return depth


def _span(present: np.ndarray, size: int) -> slice:
    at = np.flatnonzero(present)
    return slice(max(at[0] - WINDOW_PX, 0), min(at[-1] + 1 + WINDOW_PX, size))


def _cost_at(view: GreyView, others: list[GreyView], depth: float, rows: slice, columns: slice, grey) -> np.ndarray:
    """1 - correlation with the half of the others that fit best, float32 [h, w]: what hides in one shows in another."""
    first = view.camera
    to_ray = np.linalg.inv(first.intrinsics) @ np.array([[1, 0, columns.start], [0, 1, rows.start], [0, 0, 1.0]])
    mean, spread = _moments(grey)
    costs = []
    for other in others:
        turn = other.camera.rotation @ first.rotation.T
        shift = other.camera.rotation @ (first.centre - other.camera.centre)
        # A plane at `depth` before the first camera: x' = K' (R + t n^T / depth) K^-1 x.
        plane = other.camera.intrinsics @ (turn + np.outer(shift, [0, 0, 1 / depth])) @ to_ray
        size = grey.shape[1], grey.shape[0]
        seen = cv2.warpPerspective(other.grey, plane, size, flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
        other_mean, other_spread = _moments(seen)
        together = cv2.boxFilter(grey * seen, -1, (WINDOW_PX, WINDOW_PX)) - mean * other_mean
        costs.append(1 - together / (spread * other_spread))
    ordered = np.sort(np.stack(costs), 0)
    return ordered[: (len(costs) + 1) // 2].mean(0)


def _moments(grey: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    mean = cv2.boxFilter(grey, -1, (WINDOW_PX, WINDOW_PX))
    square = cv2.boxFilter(grey * grey, -1, (WINDOW_PX, WINDOW_PX))
    return mean, np.sqrt(np.maximum(square - mean * mean, 0) + _MIN_SPREAD**2)


def _along(costs: np.ndarray, way: tuple[int, int]) -> np.ndarray:
    """Costs [h, w, planes] with those of the path that leads to each pixel along one axis, forwards or backwards."""
    axis, step = way
    lines = np.moveaxis(costs, axis, 0)[::step]
    out = np.empty_like(lines)
    out[0] = lines[0]
    for k in range(1, len(lines)):
        last = out[k - 1]
        least = last.min(-1, keepdims=True)
        path = np.minimum(last, least + _LARGE_STEP)
        path[..., 1:] = np.minimum(path[..., 1:], last[..., :-1] + _SMALL_STEP)
        path[..., :-1] = np.minimum(path[..., :-1], last[..., 1:] + _SMALL_STEP)
        out[k] = lines[k] + path - least
    return np.moveaxis(out[::step], 0, axis)
