"""Which points of a frame the next frame shows, and a frame moved by its motion."""

from __future__ import annotations

import cv2
import numpy as np


def _grid(height: int, width: int) -> np.ndarray:
    """Centres of pixels: float32 [H, W, 2], x and y."""
    return np.stack(np.meshgrid(np.arange(width), np.arange(height)), -1).astype(np.float32)


def visible_next(
    motion: np.ndarray, next_depth: np.ndarray, thing: np.ndarray, depth_then: np.ndarray, thing_then: np.ndarray
) -> np.ndarray:
    """Whether the next frame shows what this one shows: bool [H, W].

    motion [H, W, 2] px; next_depth [H, W]: depth that the points have in the next frame; thing [H, W]: number of the
    thing; depth_then, thing_then [H, W]: what the next frame's pixels show. A point is visible where one of the four
    pixels around it shows the same thing at its depth, to 2 %.
    """
    height, width = thing.shape
    at = _grid(height, width) + motion
    inside = (at >= -0.5).all(-1) & (at[..., 0] < width - 0.5) & (at[..., 1] < height - 0.5) & (next_depth > 0)
    low = np.floor(np.where(inside[..., None], at, 0)).astype(int)
    found = np.zeros_like(inside)
    for right in (0, 1):
        for down in (0, 1):
            x, y = np.clip(low[..., 0] + right, 0, width - 1), np.clip(low[..., 1] + down, 0, height - 1)
            near = np.abs(depth_then[y, x] - next_depth) < 0.02 * np.abs(next_depth)
            found |= near & (thing_then[y, x] == thing)
    return inside & found


def fetched_from_next(next_frame: np.ndarray, motion: np.ndarray) -> np.ndarray:
    """For each pixel of this frame, the colour that the next frame has where its point went, bilinear: [H, W, C]."""
    at = _grid(*motion.shape[:2]) + motion.astype(np.float32)
    return cv2.remap(next_frame, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)


def painted_motion(motion: np.ndarray, full_px: float) -> np.ndarray:
    """Motion as colour, uint8 [H, W, 3] RGB: direction as hue, length as brightness up to `full_px`."""
    angle = np.degrees(np.arctan2(motion[..., 1], motion[..., 0])) % 360
    length = np.clip(np.hypot(motion[..., 0], motion[..., 1]) / full_px, 0, 1)
    hsv = np.stack([angle / 2, np.full_like(angle, 255), 255 * length], -1).astype(np.uint8)
    return cv2.cvtColor(hsv, cv2.COLOR_HSV2RGB)
