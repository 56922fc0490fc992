"""Runs OpenCV's optical flow (DIS, preset medium), and extrapolates it at constant velocity."""

from __future__ import annotations

import cv2
import numpy as np


class Dis:
    """Optical flow for frames of one size."""

    def __init__(self, height_px: int, width_px: int) -> None:
        self.flow = cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
        self.y, self.x = np.mgrid[:height_px, :width_px].astype(np.float32)

    def motion(self, frame: np.ndarray, other: np.ndarray) -> np.ndarray:
        """Returns the motion from each pixel of a frame, BGR uint8 [H, W, 3], to the other frame: float32 [H, W, 2],
        pixels."""
        return self.flow.calc(*(cv2.cvtColor(one, cv2.COLOR_BGR2GRAY) for one in (frame, other)), None)

    def moved(self, frame: np.ndarray, to_before: np.ndarray, frames: float) -> np.ndarray:
        """Returns the frame extrapolated by `frames`, warped backward along its motion to the frame before it."""
        x, y = self.x + frames * to_before[..., 0], self.y + frames * to_before[..., 1]
        return cv2.remap(frame, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
