"""Keypoints of photographs, against the landmarks of BlazePose heavy (`export.teachers`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from export.evaluation.surface_accuracy import fraction
from export.keypoints import MIRROR, NAMES, TORSO

MIN_VISIBLE = 0.6  # of a landmark that is asked for
NEAR = 0.1  # torso lengths from the landmark: a keypoint is right
TOLD_APART = 0.3  # torso lengths between a landmark and its mirror, from which on the side can be told
TAKEN_FOR = 0.3  # torso lengths within which a keypoint is taken for a landmark or its mirror
_OF_LIMBS = ("elbow", "wrist", "finger", "thumb", "knee", "ankle", "heel", "toe")
LIMBS = frozenset(k for k, name in enumerate(NAMES) if any(part in name for part in _OF_LIMBS))


@dataclass(frozen=True)
class KeypointMetrics:
    """Fractions 0..1; NaN: nothing to measure. people: with a torso that the landmarks show. pck: of the visible
    landmarks of all these people, those with a keypoint closer than 0.1 torsos; people who are not found count as
    wrong. left_right: of the limbs' keypoints near a landmark or its mirror, those nearer to the landmark. by_name: pck
    of each landmark."""

    people: int
    pck: float
    left_right: float
    by_name: dict[str, float]


class KeypointTally:
    """Adds up people."""

    def __init__(self) -> None:
        self._people = 0
        self._near: dict[int, list[bool]] = {k: [] for k in range(len(NAMES))}
        self._sides: list[bool] = []

    def add(self, found: np.ndarray | None, point: np.ndarray, visible: np.ndarray) -> None:
        """found: keypoints [33, 3] of the person, None where nobody was found; point [33, 2], visible [33]: landmarks.
        People without a visible torso have no scale and are left out."""
        if (visible[list(TORSO)] < MIN_VISIBLE).any():
            return
        left, right, *hips = point[list(TORSO)].astype(np.float64)
        torso = float(np.linalg.norm((left + right) / 2 - np.mean(hips, 0)))
        if torso < 1:
            return
        self._people += 1
        shown = visible >= MIN_VISIBLE
        for k in np.flatnonzero(shown):
            off = np.inf if found is None else np.linalg.norm(found[k, :2] - point[k]) / torso
            self._near[int(k)].append(bool(off <= NEAR))
            if found is None or k not in LIMBS:
                continue
            mirror = point[MIRROR[k]]
            to_mirror = np.linalg.norm(found[k, :2] - mirror) / torso
            apart = np.linalg.norm(point[k] - mirror) / torso
            if apart >= TOLD_APART and min(off, to_mirror) <= TAKEN_FOR:
                self._sides.append(bool(off < to_mirror))

    def metrics(self) -> KeypointMetrics:
        every = [near for names in self._near.values() for near in names]
        return KeypointMetrics(
            people=self._people,
            pck=fraction(sum(every), len(every)),
            left_right=fraction(sum(self._sides), len(self._sides)),
            by_name={NAMES[k]: fraction(sum(near), len(near)) for k, near in self._near.items()},
        )
