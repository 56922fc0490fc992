"""The 33 keypoints of a person, by BlazePose's names and order ("BlazePose: On-device Real-time Body Pose Tracking",
2020); the 17 of COCO are among them."""

from __future__ import annotations

import numpy as np

NAMES = (
    "nose", "left eye inner", "left eye", "left eye outer", "right eye inner", "right eye", "right eye outer",
    "left ear", "right ear", "mouth left", "mouth right", "left shoulder", "right shoulder", "left elbow",
    "right elbow", "left wrist", "right wrist", "left little finger", "right little finger", "left index finger",
    "right index finger", "left thumb", "right thumb", "left hip", "right hip", "left knee", "right knee",
    "left ankle", "right ankle", "left heel", "right heel", "left toe", "right toe",
)  # fmt: skip
COUNT = len(NAMES)
_OTHER_SIDE = {"left": "right", "right": "left"}
# For each keypoint, the one that the mirrored image shows in its place.
MIRROR = np.array([NAMES.index(" ".join(_OTHER_SIDE.get(word, word) for word in name.split())) for name in NAMES])
# In COCO's order: nose, eyes, ears, shoulders, elbows, wrists, hips, knees, ankles.
COCO = np.array([0, 2, 5, 7, 8, 11, 12, 13, 14, 15, 16, 23, 24, 25, 26, 27, 28])
TORSO = tuple(NAMES.index(name) for name in ("left shoulder", "right shoulder", "left hip", "right hip"))


def mirrored(keypoint: np.ndarray, width: float) -> np.ndarray:
    """Keypoints [..., 33, 3] (x, y, visible) of the mirrored image, which is `width` pixels wide."""
    out = keypoint[..., MIRROR, :].copy()
    out[..., 0] = width - out[..., 0]
    return out


def mapped(keypoint: np.ndarray, into: np.ndarray) -> np.ndarray:
    """Keypoints [..., 33, 3] after the affine map `into` [2, 3] of the image."""
    out = keypoint.copy()
    out[..., :2] = keypoint[..., :2] @ into[:, :2].T + into[:, 2]
    return out
