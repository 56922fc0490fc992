"""Rivals without a network: sharp pixels by steps of depth, or by the angle between normals, and the distance to them.

Each gives a strength per pixel; where it is cut is chosen on validation frames, as for the network. Their field is the
distance to the pixels that are left, along the picture, in r of the pixel (a surface seen head-on).
"""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from export.edges.config import EPS_R


def depth_canny(depth: np.ndarray, focal_px: float) -> np.ndarray:
    """Steps of log depth after a Gaussian of 1.5 px, thinned along their direction as in Canny's method: [H, W]."""
    known = (depth > 0).astype(np.float32)
    weight = cv2.GaussianBlur(known, (0, 0), 1.5)
    log = cv2.GaussianBlur(np.log(np.where(depth > 0, depth, 1)) * known, (0, 0), 1.5) / np.maximum(weight, 1e-6)
    x, y = cv2.Sobel(log, cv2.CV_32F, 1, 0), cv2.Sobel(log, cv2.CV_32F, 0, 1)
    strength = np.hypot(x, y)
    horizontal = np.abs(x) >= np.abs(y)
    ridge = np.zeros(depth.shape, bool)
    for mask, axis in ((horizontal, 1), (~horizontal, 0)):
        higher = (strength >= np.roll(strength, 1, axis)) & (strength >= np.roll(strength, -1, axis))
        ridge |= mask & higher
    return np.where(ridge & (known > 0), strength, 0) * focal_px


def normals_angle(depth: np.ndarray, focal_px: float) -> np.ndarray:
    """Degrees between the planes fitted on both sides of a pixel (windows of 5 px, 3 px away), and 90 at jumps."""
    height, width = depth.shape
    known = (depth > 0).astype(np.float32)
    inverse = known / np.where(depth > 0, depth, 1)
    weight = cv2.GaussianBlur(known, (0, 0), 2)
    smooth = cv2.GaussianBlur(inverse, (0, 0), 2) / np.maximum(weight, 1e-6)
    # A plane's inverse depth is a x + b y + c, its normal (a f, b f, c - a x0 - b y0).
    a, b = (cv2.Sobel(smooth, cv2.CV_32F, *order, scale=1 / 8) for order in ((1, 0), (0, 1)))
    x, y = np.meshgrid(np.arange(width) - (width - 1) / 2, np.arange(height) - (height - 1) / 2)
    normal = np.stack([a * focal_px, b * focal_px, smooth - a * x - b * y], -1)
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-12)
    angle = np.zeros((height, width))
    for axis in (0, 1):
        cosine = (np.roll(normal, 3, axis) * np.roll(normal, -3, axis)).sum(-1)
        angle = np.maximum(angle, np.degrees(np.arccos(np.clip(cosine, -1, 1))))
    return np.where(depth > 0, angle, 0)


STRENGTHS: dict[str, Callable[[np.ndarray, float], np.ndarray]] = {
    "depth-canny": depth_canny,
    "normals": normals_angle,
}


def field(strength: np.ndarray, threshold: float) -> np.ndarray:
    """Distance in pixels to where the strength reaches the threshold, cut off at EPS_R: [H, W]."""
    sharp = strength >= threshold
    if not sharp.any():
        return np.full(strength.shape, EPS_R, np.float32)
    return np.minimum(cv2.distanceTransform((~sharp).astype(np.uint8), cv2.DIST_L2, 5), EPS_R)
