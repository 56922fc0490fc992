"""How much joints and boxes tremble in clips: the change of their error from frame to frame.

The motion of the person is in the truth, so it does not count.
"""

from __future__ import annotations

import numpy as np

from export.keypoints import COUNT, TORSO


class Jitter:
    """Adds up people, frame by frame. A change counts where the person is added in both frames."""

    def __init__(self) -> None:
        self._before: dict[tuple[str, int], tuple[int, np.ndarray, np.ndarray]] = {}
        self._joints: list[np.ndarray] = []
        self._boxes: list[float] = []

    def add(
        self, clip: str, frame: int, person: int, keypoint: np.ndarray, point: np.ndarray, visible: np.ndarray,
        box: np.ndarray, true_box: np.ndarray,
    ) -> None:  # fmt: skip
        """keypoint [33, 3] and box [4] that were found; point [33, 2], visible [33] and true_box [4] of the truth."""
        error = np.full((COUNT, 2), np.nan)
        shown = visible > 0
        error[shown] = keypoint[shown, :2] - point[shown]
        box_error = np.asarray(box, float) - true_box
        before = self._before.get((clip, person))
        self._before[clip, person] = frame, error, box_error
        if before is None or before[0] != frame - 1:
            return
        size = true_box[2:] - true_box[:2]
        self._boxes.append(float(np.linalg.norm(box_error - before[2]) / max(np.linalg.norm(size), 1)))
        left, right, *hips = point[list(TORSO)]
        torso = np.linalg.norm((left + right) / 2 - np.mean(hips, 0))
        if (visible[list(TORSO)] > 0).all() and torso >= 1:
            change = np.linalg.norm(error - before[1], axis=1) / torso
            self._joints.append(change[np.isfinite(change)])

    def metrics(self) -> dict[str, float]:
        """Fractions a frame: of the torso's length for joints, of the box's diagonal for boxes; NaN of nothing."""
        joints = np.concatenate(self._joints) if self._joints else np.empty(0)
        found = {}
        for name, values in (("joint_jitter", joints), ("box_jitter", np.array(self._boxes))):
            for p in (50, 90):
                found[f"{name}_p{p}"] = float(np.percentile(values, p)) if len(values) else float("nan")
        return found
