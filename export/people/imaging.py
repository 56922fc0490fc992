"""Camera artefacts of an image: lens, motion, exposure, colour, sharpening, noise. Labels move with the pixels."""

from __future__ import annotations

import cv2
import numpy as np


def lens_map(rng: np.random.Generator, width: int, height: int) -> np.ndarray:
    """Where each pixel comes from under mild radial distortion, float32 [H, W, 2] (x, y).

    One-coefficient model r' = r (1 + k r^2), r in half diagonals; scaled so that no pixel comes from outside.
    """
    k = rng.uniform(-0.12, 0.1)
    x, y = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    centre = np.array([(width - 1) / 2, (height - 1) / 2], np.float32)
    offset = np.stack([x, y], -1) - centre
    r2 = (offset**2).sum(-1, keepdims=True) / (centre**2).sum()
    scale = (1 + k * r2) / (1 + max(k, 0))
    return (centre + offset * scale).astype(np.float32)


def through_lens(image: np.ndarray, source: np.ndarray, labels: bool) -> np.ndarray:
    """The image as `lens_map` says; labels are picked, never mixed."""
    how = cv2.INTER_NEAREST if labels else cv2.INTER_LINEAR
    return cv2.remap(image, source[..., 0], source[..., 1], how, borderMode=cv2.BORDER_REPLICATE)


def points_through_lens(points: np.ndarray, source: np.ndarray) -> np.ndarray:
    """Where an image through `lens_map` shows what its source shows at `points` [N, 2]; pixel k covers [k, k + 1).

    The map is smooth and near the identity: a few steps of a fixed-point iteration invert it. Points outside of the
    image are moved as the nearest pixel is.
    """
    height, width = source.shape[:2]
    moved = np.array(points, np.float64)
    for _ in range(8):
        x, y = np.clip(np.nan_to_num(np.floor(moved)), 0, (width - 1, height - 1)).astype(int).T
        moved = points - (source[y, x] - np.stack([x, y], -1))
    return moved


def motion_kernel(length_px: float, degrees: float) -> np.ndarray:
    """A straight stroke through the middle, so that what is blurred stays where its label is: float32, sums to 1."""
    side = int(np.ceil(length_px)) // 2 * 2 + 3
    kernel = np.zeros((side, side), np.float32)
    middle, reach = (side - 1) / 2, length_px / 2 * np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
    for t in np.linspace(-1, 1, 4 * side):  # symmetric samples, shared among the four pixels around each
        x, y = middle + t * reach
        x0, y0 = int(np.floor(x)), int(np.floor(y))
        fx, fy = x - x0, y - y0
        kernel[y0 : y0 + 2, x0 : x0 + 2] += np.outer([1 - fy, fy], [1 - fx, fx])[: side - y0, : side - x0]
    return kernel / kernel.sum()


def camera_faults(rng: np.random.Generator, image: np.ndarray) -> np.ndarray:
    """Motion, focus, exposure, tone curve, white balance, low resolution, sharpening, noise: BGR float -> uint8."""
    u = rng.uniform
    height, width = image.shape[:2]
    image = image.astype(np.float32)
    if u() < 0.12:
        image = cv2.filter2D(image, -1, motion_kernel(u(2, 9), u(0, 180)))
    if u() < 0.35:
        image = cv2.GaussianBlur(image, (0, 0), u(0.3, 1.2))
    if u() < 0.35:  # vignetting: light falls off towards the corners, about as cos^4 of the angle
        x, y = np.meshgrid(np.linspace(-1, 1, width, dtype=np.float32), np.linspace(-1, 1, height, dtype=np.float32))
        image = image * ((1 + u(0.05, 0.35) * (x * x + y * y) / 2) ** -2)[..., None]
    if u() < 0.6:  # automatic exposure: most photographs are neither dark nor burnt out
        image = image * np.clip((u(80, 140) / max(float(image.mean()), 1)) ** u(0.4, 0.9), 0.6, 2.5)
    image = 255 * np.clip(image * u(0.7, 1.2) / 255, 0, 1) ** u(0.8, 1.25)
    image = (image - 128) * u(0.75, 1.15) + 128
    if u() < 0.06:
        image = np.repeat(image.mean(-1, keepdims=True), 3, -1)
    else:
        image = image * (1 + rng.normal(0, 0.05, 3))
    image = image.astype(np.float32)
    if u() < 0.2:
        share = u(0.35, 0.8)
        small = cv2.resize(image, (int(width * share), int(height * share)), interpolation=cv2.INTER_AREA)
        if u() < 0.5:  # webcams compress before anybody scales
            quality = [cv2.IMWRITE_JPEG_QUALITY, int(u(25, 80))]
            small = cv2.imdecode(cv2.imencode(".jpg", np.clip(small, 0, 255).astype(np.uint8), quality)[1], 1)
        image = cv2.resize(small, (width, height)).astype(np.float32)
    if u() < 0.2:
        image = image + u(0.3, 1.2) * (image - cv2.GaussianBlur(image, (0, 0), u(0.7, 1.5)))
    if u() < 0.5:
        image = image + _noise(rng, image)
    return np.clip(image, 0, 255).astype(np.uint8)


def _noise(rng: np.random.Generator, image: np.ndarray) -> np.ndarray:
    """White noise, or what denoising has left of it: coarser and with more colour than brightness."""
    noise = rng.standard_normal(image.shape, np.float32) * np.float32(rng.uniform(1, 9))
    if rng.random() < 0.4:
        noise = 1.8 * cv2.GaussianBlur(noise, (0, 0), rng.uniform(0.5, 1))
    if rng.random() < 0.5:  # shot noise grows with the square root of the light
        noise *= np.sqrt(np.clip(image, 8, 255) / 128)
    return noise
