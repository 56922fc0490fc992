"""Cameras rotated upright, and images warped from one to another that differs by frame and roll."""

from __future__ import annotations

import math
from dataclasses import replace

import cv2
import numpy as np

from export.camera import Camera

FAINTEST = 0.05  # where the world's up is nearly along the axis, the rotation fades out (pinhole_camera.cpp)


def rotated_upright(camera: Camera, up: np.ndarray) -> Camera:
    """The camera rotated about its optical axis so that `up` [3] of the world points up in the image.

    Section 3.2 of NPBG++ (arXiv 2203.13318), as the SDK's `rotated_upright`: as it is where up is along the axis, and
    continuous near that.
    """
    length = float(np.linalg.norm(up))
    if not (length > 0 and math.isfinite(length)):
        return camera
    across, down, _ = camera.rotation @ (np.asarray(up, np.float64) / length)
    angle = math.atan2(across, -down) * min(1.0, math.hypot(across, down) / FAINTEST)
    cosine, sine = math.cos(angle), math.sin(angle)
    roll = np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]])
    return replace(camera, rotation=roll @ camera.rotation)


def upright(camera: Camera, up: np.ndarray, multiple: int) -> Camera:
    """The camera rotated upright, with the smallest frame that holds its whole image and has sides that are multiples
    of `multiple`. The paper rotates inside of a square as wide as the diagonal: up to twice the pixels."""
    rotated = rotated_upright(camera, up)
    right, bottom = camera.width_px - 0.5, camera.height_px - 0.5
    corners = np.array([[-0.5, -0.5, 1], [right, -0.5, 1], [-0.5, bottom, 1], [right, bottom, 1]])
    seen = corners @ between(camera, rotated).T
    # A rotation by an angle of rounding size must not widen the frame by a pixel.
    first = np.floor(seen.min(0) + 0.5 + 1e-6).astype(int)
    size = np.ceil(seen.max(0) + 0.5 - 1e-6).astype(int) - first
    width, height = (-(-int(side) // multiple) * multiple for side in size)
    return rotated.reframed(int(first[0]), int(first[1]), width, height)


def between(source: Camera, target: Camera) -> np.ndarray:
    """[2, 3]: pixels of `source` to pixels of `target`, two cameras that differ by frame and roll."""
    whole = target.intrinsics @ target.rotation @ source.rotation.T @ np.linalg.inv(source.intrinsics)
    return (whole / whole[2, 2])[:2]


def moves(source: Camera, target: Camera) -> bool:
    """Whether a corner of the image is elsewhere in the other one, by more than interpolation shows (1/64 pixel)."""
    right, bottom = source.width_px, source.height_px
    corners = np.array([[0, 0, 1], [right, 0, 1], [0, bottom, 1], [right, bottom, 1]], np.float64)
    return bool(np.abs(corners @ between(source, target).T - corners[:, :2]).max() > 1 / 64)


def warped(image: np.ndarray, source: Camera, target: Camera, outside: int = cv2.BORDER_REPLICATE) -> np.ndarray:
    """The image that `source` took, as `target` would have (see `between`); bilinear. image: [H, W] or [H, W, C].

    Beyond the border the last pixels are repeated: an edge between image and black would be a feature.
    """
    size = target.width_px, target.height_px
    return cv2.warpAffine(image, between(source, target), size, flags=cv2.INTER_LINEAR, borderMode=outside)
