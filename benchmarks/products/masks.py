"""Boxes of people, and one plane for all of them, from the masks of single people. Needs numpy and OpenCV alone."""

from __future__ import annotations

import cv2
import numpy as np

SHOWN = 0.5  # from this probability on a pixel belongs to a mask
_VISIBLE = 0.5


def frontmost(masks: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """uint8 [H, W]: 1 + the mask [n, H, W] that is most probable in each pixel; 0 where none is probable."""
    if not len(masks):
        return np.zeros(shape, np.uint8)
    return np.where(masks.max(0) > SHOWN, masks.argmax(0) + 1, 0).astype(np.uint8)


def box_of(k: int, masks: np.ndarray, keypoint: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """MediaPipe gives no boxes: the box of the largest region of the person's mask. Without a mask: of the visible
    landmarks in the image."""
    if len(masks) > k and (masks[k] > SHOWN).any():
        _, _, regions, _ = cv2.connectedComponentsWithStats((masks[k] > SHOWN).astype(np.uint8))
        x, y, width, height, _ = regions[1 + regions[1:, cv2.CC_STAT_AREA].argmax()]
        return np.array([x, y, x + width, y + height], np.float32)
    point = keypoint[keypoint[:, 2] >= _VISIBLE, :2] if (keypoint[:, 2] >= _VISIBLE).any() else keypoint[:, :2]
    inside = np.clip(point, 0, [shape[1], shape[0]])
    return np.concatenate([inside.min(0), inside.max(0)])
