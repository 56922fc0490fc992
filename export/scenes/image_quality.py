"""How far an image is from a photo, pixel by pixel: PSNR and SSIM. Every pixel counts, background too."""

from __future__ import annotations

import cv2
import numpy as np

MIN_SQUARED_ERROR = 1e-10  # so that equal images have a PSNR, 100 dB
WINDOW_PX, SIGMA_PX = 11, 1.5
C1, C2 = 0.01**2, 0.03**2


def psnr_db(picture: np.ndarray, target: np.ndarray) -> float:
    """PSNR of RGB in 0..1, any equal shapes: -10 log10 of the mean squared difference."""
    return float(-10 * np.log10(max(np.square(picture.astype(np.float64) - target).mean(), MIN_SQUARED_ERROR)))


def ssim(picture: np.ndarray, target: np.ndarray) -> float:
    """Structural similarity of RGB [H, W, 3] in 0..1: the mean over channels and over pixels whose window is inside.

    Wang, Bovik, Sheikh and Simoncelli 2004 (equation 13; K1 = 0.01, K2 = 0.03), with their window: 11 x 11, Gaussian,
    sigma 1.5, population variances. So the outermost 5 pixels count through their neighbours' windows alone. Theirs
    are grey images; here each channel is one. Raises ValueError for other shapes, or images smaller than a window.
    """
    if picture.shape != target.shape or picture.ndim != 3 or min(picture.shape[:2]) < WINDOW_PX:
        raise ValueError(
            f"SSIM compares two pictures of one size, {WINDOW_PX} pixels or more a side; these have the shapes "
            f"{picture.shape} and {target.shape}"
        )
    a, b = picture.astype(np.float64), target.astype(np.float64)
    mean_a, mean_b = _blurred(a), _blurred(b)
    var_a, var_b = _blurred(a * a) - mean_a**2, _blurred(b * b) - mean_b**2
    covariance = _blurred(a * b) - mean_a * mean_b
    likeness = (2 * mean_a * mean_b + C1) * (2 * covariance + C2)
    likeness /= (mean_a**2 + mean_b**2 + C1) * (var_a + var_b + C2)
    inside = slice(WINDOW_PX // 2, -(WINDOW_PX // 2))
    return float(likeness[inside, inside].mean())


def _blurred(image: np.ndarray) -> np.ndarray:
    return cv2.GaussianBlur(image, (WINDOW_PX, WINDOW_PX), SIGMA_PX, borderType=cv2.BORDER_REFLECT)
