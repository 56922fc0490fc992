"""Finds sharp pixels without a network: Canny on depth, angles between normals, surface variation.

Each method gives a strength per pixel. Its settings and threshold have the smallest RMSE on validation views, level by
level. The field is the distance in the image to the nearest sharp pixel, in r of the pixel; distances in space were no
better.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from export.edges.config import EPS_R

QUANTILES = np.linspace(0.5, 0.998, 20)  # quantiles of a strength, tried as thresholds on validation views
CANNY_STEPS = np.geomspace(0.2, 400, 28)  # thresholds of an edge, in r of depth a pixel
_CANNY_UNIT = 64  # scale of the 16-bit gradients of cv2.Canny


def canny(depth: np.ndarray, focal_px: float, sigma_px: float, cuts: Sequence[float]) -> np.ndarray:
    """Runs cv2.Canny on the gradient of log depth, in r a pixel, after a Gaussian that ignores unknown depth: [H, W],
    the highest threshold at which a pixel is an edge, 0 for no edge. Hysteresis continues edges down to half of a
    threshold."""
    known = (depth > 0).astype(np.float32)
    weight = cv2.GaussianBlur(known, (0, 0), sigma_px)
    log = np.log(np.where(depth > 0, depth, 1)).astype(np.float32) * known
    log = cv2.GaussianBlur(log, (0, 0), sigma_px) / np.maximum(weight, 1e-6)
    # A Sobel filter returns 8 times the gradient.
    scale = focal_px / 8 * _CANNY_UNIT
    x, y = (np.clip(cv2.Sobel(log, cv2.CV_32F, *o, scale=scale), -32000, 32000) for o in ((1, 0), (0, 1)))
    x, y = x.astype(np.int16), y.astype(np.int16)
    strength = np.zeros(depth.shape, np.float32)
    for cut in sorted(cuts):
        strength[cv2.Canny(x, y, cut * _CANNY_UNIT / 2, cut * _CANNY_UNIT, L2gradient=True) > 0] = cut
    return strength * known


def points_of(depth: np.ndarray, focal_px: float) -> np.ndarray:
    """Returns points [H, W, 3] in metres, relative to the middle of the frame; 0 for unknown depth."""
    height, width = depth.shape
    x, y = np.meshgrid(np.arange(width) - (width - 1) / 2, np.arange(height) - (height - 1) / 2)
    return np.stack([x * depth / focal_px, y * depth / focal_px, depth], -1).astype(np.float32)


def normals_of(depth: np.ndarray, focal_px: float, method: str) -> np.ndarray:
    """Returns normals of cv2.RgbdNormals, [H, W, 3], 0 if it finds none. method: "FALS" (fits windows of 5 px) or
    "LINEMOD"."""
    height, width = depth.shape
    matrix = np.array([[focal_px, 0, (width - 1) / 2], [0, focal_px, (height - 1) / 2], [0, 0, 1]], np.float32)
    number = getattr(cv2, f"RgbdNormals_RGBD_NORMALS_METHOD_{method}")
    maker = cv2.RgbdNormals_create(height, width, cv2.CV_32F, matrix, 5, 50, number)
    points = np.where((depth > 0)[..., None], points_of(depth, focal_px), np.float32(np.nan))
    return np.nan_to_num(maker.apply(np.dstack([points, np.zeros_like(depth)]))[..., :3])


def normals_angle(depth: np.ndarray, focal_px: float, method: str, cuts: Sequence[float]) -> np.ndarray:
    """Returns degrees between the normals 2 px on either side of a pixel, the larger of both directions."""
    normals, angle = normals_of(depth, focal_px, method), np.zeros(depth.shape)
    for axis in (0, 1):
        before, after = np.roll(normals, 2, axis), np.roll(normals, -2, axis)
        both = (np.abs(before).sum(-1) > 0) & (np.abs(after).sum(-1) > 0)
        cosine = np.clip((before * after).sum(-1), -1, 1)
        angle = np.maximum(angle, np.where(both, np.degrees(np.arccos(cosine)), 0))
    for border in (angle[:2], angle[-2:], angle[:, :2], angle[:, -2:]):  # unknown beyond the border
        border[:] = 0
    return np.where(depth > 0, angle, 0)


def surface_variation(
    depth: np.ndarray, focal_px: float, radii_px: tuple[int, ...], cuts: Sequence[float]
) -> np.ndarray:
    """Returns the smallest eigenvalue of the covariance of the points around a pixel, divided by the sum of all three
    (Pauly, Keiser and Gross 2003); its root is averaged over windows of several radii."""
    known = (depth > 0).astype(np.float64)
    # Coordinates are relative to one depth, so that float64 keeps the digits of the covariance.
    points = points_of(depth, focal_px).astype(np.float64)
    points[..., 2] -= float(np.median(depth[depth > 0])) * known if known.any() else 0
    pairs = [(i, j) for i in range(3) for j in range(i, 3)]
    planes = [known, *(points[..., i] for i in range(3)), *(points[..., i] * points[..., j] for i, j in pairs)]
    total = np.zeros(depth.shape)
    for radius in radii_px:
        size = (2 * radius + 1, 2 * radius + 1)
        count, *rest = (cv2.boxFilter(plane, -1, size, normalize=False) for plane in planes)
        mean = [m / np.maximum(count, 1) for m in rest]
        xx, xy, xz, yy, yz, zz = (mean[3 + k] - mean[i] * mean[j] for k, (i, j) in enumerate(pairs))
        total += np.sqrt(_smallest_fraction(xx, xy, xz, yy, yz, zz))
    return np.where(depth > 0, total / len(radii_px), 0)


def _smallest_fraction(xx: np.ndarray, xy: np.ndarray, xz: np.ndarray, yy: np.ndarray, yz: np.ndarray, zz: np.ndarray):
    """Returns the smallest eigenvalue of symmetric 3 x 3 matrices divided by their trace, in closed form (Smith
    1961)."""
    trace = np.maximum(xx + yy + zz, 1e-30)
    q = trace / 3
    a, b, c = xx - q, yy - q, zz - q
    p = np.sqrt(np.maximum((a * a + b * b + c * c + 2 * (xy * xy + xz * xz + yz * yz)) / 6, 1e-60))
    determinant = a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz)
    angle = np.arccos(np.clip(determinant / (2 * p**3), -1, 1)) / 3
    return np.clip((q + 2 * p * np.cos(angle + 2 * np.pi / 3)) / trace, 0, 1)


@dataclass(frozen=True)
class Baseline:
    """strength(depth, focal_px, setting, cuts); settings: tried values; cuts: tried thresholds, or none if they are
    quantiles of the strength. needs: a name of cv2 that the method requires."""

    strength: Callable[[np.ndarray, float, object, Sequence[float]], np.ndarray]
    settings: tuple
    cuts: Sequence[float] = ()
    needs: str = ""

    def missing(self) -> str:
        return (
            f"this OpenCV ({cv2.__version__}) has no {self.needs}"
            if self.needs and not hasattr(cv2, self.needs)
            else ""
        )


BASELINES: dict[str, Baseline] = {
    "depth-Canny": Baseline(canny, (1.0, 1.5, 2.5), CANNY_STEPS),
    "angles between normals": Baseline(normals_angle, ("FALS", "LINEMOD"), needs="RgbdNormals"),
    "surface variation": Baseline(surface_variation, ((1, 2, 4), (2, 4, 8))),
}


@dataclass(frozen=True)
class TunedBaseline:
    baseline: Baseline
    setting: object
    cut: float

    def run(self, depth: np.ndarray, focal_px: float) -> tuple[np.ndarray, float]:
        """Returns the distance [H, W] in r, and the run time in milliseconds."""
        start = time.perf_counter()
        strength = self.baseline.strength(depth, focal_px, self.setting, (self.cut,))
        distance = field(strength >= self.cut)
        return distance, 1000 * (time.perf_counter() - start)


def field(sharp: np.ndarray) -> np.ndarray:
    """Returns the distance in pixels to the nearest set pixel of a mask [H, W], at most EPS_R."""
    if not sharp.any():
        return np.full(sharp.shape, EPS_R, np.float32)
    return np.minimum(cv2.distanceTransform((~sharp).astype(np.uint8), cv2.DIST_L2, 5), EPS_R)


def tuned(baseline: Baseline, seen: Sequence[np.ndarray], focal_px: Sequence[float], truth: Sequence[np.ndarray],
          counts: Sequence[np.ndarray]) -> TunedBaseline:  # fmt: skip
    """Returns the setting and threshold with the smallest RMSE, mean over frames. truth: distance in r; counts:
    mask."""
    best = (np.inf, baseline.settings[0], 0.0)
    for setting in baseline.settings:
        strengths = [baseline.strength(d, f, setting, baseline.cuts) for d, f in zip(seen, focal_px, strict=True)]
        cuts = baseline.cuts
        if not len(cuts):
            sample = np.concatenate([s.ravel()[::31] for s in strengths])
            cuts = np.unique(np.quantile(sample[sample > 0], QUANTILES)) if (sample > 0).any() else [1.0]
        for cut in cuts:
            rmse = [_rmse(field(s >= cut), t, c) for s, t, c in zip(strengths, truth, counts, strict=True)]
            best = min(best, (float(np.nanmean(rmse)), setting, float(cut)), key=lambda found: found[0])
    return TunedBaseline(baseline, best[1], best[2])


def _rmse(distance: np.ndarray, truth: np.ndarray, counts: np.ndarray) -> float:
    return float(np.sqrt(np.mean((distance - truth)[counts] ** 2))) if counts.any() else np.nan
