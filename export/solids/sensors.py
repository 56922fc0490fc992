"""Models of depth cameras: noise, steps, holes, and flying pixels across depth jumps.

A sensor takes exact depth (float [H, W], metres, 0 where nothing is) and the focal length in pixels and returns what
the camera would report, float32, 0 where it reports nothing. Nothing else of the scene is asked for: slopes and
silhouettes come from the depth itself. Sources of the metrics stand beside them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

JUMP = 0.02  # neighbours whose depths differ by more than that share are on two surfaces


def lateral_slope(depth: np.ndarray, focal_px: float) -> np.ndarray:
    """|slope| of the surface, metres of depth a metre sideways, the smaller of the two sides in each axis, so that
    a silhouette does not tilt what lies beside it. 0 where depth is unknown."""
    squares = np.zeros(depth.shape, np.float32)
    for axis in (0, 1):
        before = np.abs(np.diff(depth, axis=axis, prepend=np.nan))
        after = np.abs(np.diff(depth, axis=axis, append=np.nan))
        squares += np.nan_to_num(np.fmin(before, after)) ** 2
    known = depth > 0
    return np.where(known, np.sqrt(squares) * focal_px / np.where(known, depth, 1), 0).astype(np.float32)


def _smooth_noise(rng: np.random.Generator, shape: tuple[int, int], sigma_px: float) -> np.ndarray:
    """Normal noise of standard deviation 1, correlated over a Gaussian of sigma_px pixels."""
    noise = rng.standard_normal(shape, np.float32)
    if sigma_px <= 0:
        return noise
    # The mean of squares of a Gaussian's weights is 1 / (4 pi sigma^2) where it is sampled finely enough.
    kernel = cv2.getGaussianKernel(2 * int(np.ceil(3 * sigma_px)) + 1, sigma_px).astype(np.float32)
    return cv2.sepFilter2D(noise, -1, kernel, kernel, borderType=cv2.BORDER_REFLECT_101) / float((kernel**2).sum())


def _blobs(rng: np.random.Generator, shape: tuple[int, int], share: float, size_px: float) -> np.ndarray:
    """A mask that covers about `share` of an image, in blobs of about size_px."""
    if share <= 0:
        return np.zeros(shape, bool)
    field = _smooth_noise(rng, shape, size_px)
    return field > np.quantile(field, 1 - min(share, 1.0))


@dataclass(frozen=True)
class Plain:
    """The paper's noise: normal, along the ray, of so many footprints (arXiv 2011.15081: 1/8 to 4)."""

    sigma_r: float

    def __call__(self, depth: np.ndarray, focal_px: float, rng: np.random.Generator) -> np.ndarray:
        noise = rng.standard_normal(depth.shape, np.float32)
        return (depth * (1 + self.sigma_r / focal_px * noise)).clip(0).astype(np.float32)


@dataclass(frozen=True)
class Stereo:
    """Two cameras and block matching.

    A block's disparity is one value for all of it: noise is correlated over the block, the foreground is fattened by
    half of it, and beside the foreground's left rim the other camera sees nothing. The error in depth is
    z^2 sigma / (focal baseline): 5 mm at 1 m for a D435 (librealsense #10133 says 2.5 to 5).
    """

    sigma_px: float = 0.08
    window_px: int = 7
    baseline_m: float = 0.05
    step_px: float = 1 / 32
    holes: float = 0.01  # textureless places and speckles, share of the image

    def __call__(self, depth: np.ndarray, focal_px: float, rng: np.random.Generator) -> np.ndarray:
        strength = focal_px * self.baseline_m
        known = depth > 0
        disparity = np.where(known, strength / np.where(known, depth, 1), 0).astype(np.float32)
        width = depth.shape[1]
        # A block sees the nearest surface in it, where that one fills enough of it: fattened by 0 to half a block,
        # more here and less there.
        reach = self.window_px // 2
        if reach:
            amount = _smooth_noise(rng, depth.shape, self.window_px)
            near = disparity
            for step in range(1, reach + 1):
                wider = cv2.dilate(near, np.ones((3, 3), np.uint8))
                grows = (wider > near * (1 + JUMP) + 1e-6) & (amount > 1.2 * (2 * step / (reach + 1) - 1))
                near = np.where(grows, wider, near)
            disparity = near
        # Half-occlusion: the right camera, along the row, sees something nearer there.
        right = np.arange(width, dtype=np.float32) - disparity
        nearest = np.minimum.accumulate(right[:, ::-1], 1)[:, ::-1]
        hidden = right > nearest + 1
        noise = _smooth_noise(rng, depth.shape, self.window_px / 4)
        # Steep surfaces shear the block: matching gets worse with the slope.
        steep = 1 + 0.5 * np.minimum(lateral_slope(depth, focal_px), 6)
        disparity = disparity + self.sigma_px * noise * steep
        disparity = np.rint(disparity / self.step_px) * self.step_px
        lost = hidden | _blobs(rng, depth.shape, self.holes, 3) | (disparity <= 0.5)
        return np.where(lost, 0, strength / np.where(lost, 1, disparity)).astype(np.float32)


@dataclass(frozen=True)
class TimeOfFlight:
    """Light's time there and back: noise grows with distance and slope, a pixel that sees two surfaces reports a
    depth between them ("flying pixels"), light that comes by way of the other wall rounds concave corners."""

    sigma_m: float = 0.002  # at 1 m, seen head-on; grows with the square (Azure Kinect's sheet: random error <= 17 mm)
    mixing_px: float = 0.5  # of the Gaussian that a pixel gathers light by
    rounding_px: float = 2.0
    holes: float = 0.003

    def __call__(self, depth: np.ndarray, focal_px: float, rng: np.random.Generator) -> np.ndarray:
        known = depth > 0
        slope = lateral_slope(depth, focal_px)
        reflectance = np.exp(0.35 * _smooth_noise(rng, depth.shape, 12))  # smooth patches, not per surface
        light = np.where(known, reflectance / (np.where(known, depth, 1) ** 2 * np.sqrt(1 + slope**2)), 0)
        light = light.astype(np.float32)
        rounded = depth
        if self.rounding_px > 0:
            weight = cv2.GaussianBlur(known.astype(np.float32), (0, 0), self.rounding_px)
            mean = cv2.GaussianBlur(depth, (0, 0), self.rounding_px) / np.maximum(weight, 1e-6)
            apart = np.abs(mean - depth) > JUMP * depth
            concave = known & ~apart & (mean < depth) & (weight > 0.5)
            rounded = np.where(concave, mean, depth)
        mixed_light = cv2.GaussianBlur(light, (0, 0), self.mixing_px)
        mixed = cv2.GaussianBlur(light * rounded, (0, 0), self.mixing_px) / np.maximum(mixed_light, 1e-9)
        sigma = self.sigma_m * mixed**2 * np.sqrt(1 + np.minimum(slope, 10) ** 2) / np.sqrt(reflectance)
        out = mixed + sigma * _smooth_noise(rng, depth.shape, 0.4)
        dim = mixed_light < 0.02 * np.median(light[known]) if known.any() else ~known
        lost = ~known | dim | (slope > 12) | _blobs(rng, depth.shape, self.holes, 2)
        return np.where(lost, 0, out.clip(0)).astype(np.float32)


@dataclass(frozen=True)
class StructuredLight:
    """A projected pattern, one camera (Nguyen, Izadi and Lovell 2012, Kinect v1, their equations for depth and
    sideways), in steps of an eighth of a pixel of disparity, with a shadow as in stereo."""

    scale: float = 1.0  # of the published noise
    baseline_m: float = 0.075
    holes: float = 0.01

    def __call__(self, depth: np.ndarray, focal_px: float, rng: np.random.Generator) -> np.ndarray:
        height, width = depth.shape
        angle = np.arctan(np.minimum(lateral_slope(depth, focal_px), 8))
        lean = angle / (np.pi / 2 - angle)
        sideways_px = self.scale * (0.8 + 0.035 * lean)
        x, y = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
        moved = [
            (axis + sideways_px * 0.6 * _smooth_noise(rng, depth.shape, 0.7)).astype(np.float32) for axis in (x, y)
        ]
        seen = cv2.remap(depth, *moved, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE)
        known = seen > 0
        z = np.where(known, seen, 1)
        sigma = 0.0012 + 0.0019 * (z - 0.4) ** 2 + 0.0001 / np.sqrt(z) * lean**2
        z = (z + self.scale * sigma * rng.standard_normal(depth.shape, np.float32)).clip(0.01)
        strength = focal_px * self.baseline_m
        disparity = np.rint(8 * strength / z) / 8
        right = np.where(known, np.arange(width) - disparity, np.inf)
        shadow = right > np.minimum.accumulate(right[:, ::-1], 1)[:, ::-1] + 1.5
        lost = ~known | shadow | (disparity <= 0) | (angle > 1.4) | _blobs(rng, depth.shape, self.holes, 3)
        return np.where(lost, 0, strength / np.where(lost, 1, disparity)).astype(np.float32)


@dataclass(frozen=True)
class Phone:
    """Depth of a phone: few pixels, smoothed, then enlarged to the image (ARCore, ARKit: 160 x 90 to 256 x 192)."""

    factor: int = 2
    sigma: float = 0.004  # of the depth, correlated
    smoothing_px: float = 1.0  # in the small image

    def __call__(self, depth: np.ndarray, focal_px: float, rng: np.random.Generator) -> np.ndarray:
        height, width = depth.shape
        size = max(1, width // self.factor), max(1, height // self.factor)
        known = cv2.resize((depth > 0).astype(np.float32), size, interpolation=cv2.INTER_AREA)
        small = cv2.resize(depth, size, interpolation=cv2.INTER_AREA)
        known, small = (cv2.GaussianBlur(plane, (0, 0), self.smoothing_px) for plane in (known, small))
        small = small / np.maximum(known, 1e-6) * (1 + self.sigma * _smooth_noise(rng, small.shape, 1.5))
        full = cv2.resize(small, (width, height), interpolation=cv2.INTER_LINEAR)
        sure = cv2.resize(known, (width, height), interpolation=cv2.INTER_LINEAR) > 0.6
        return np.where(sure & (full > 0), full, 0).astype(np.float32)


Sensor = Callable[[np.ndarray, float, np.random.Generator], np.ndarray]


def clean(depth: np.ndarray, focal_px: float, rng: np.random.Generator) -> np.ndarray:
    """Exact depth."""
    return depth.astype(np.float32)


@dataclass(frozen=True)
class Steps:
    """A sensor whose depth is stored in 16 bits, in whole units: 1 mm (OAK, Kinect, most RealSense), 0.25 mm (L515),
    0.1 mm (D405). What does not fit into 65,534 units is unknown."""

    unit_m: float = 0.001
    of: Sensor = clean

    def __call__(self, depth: np.ndarray, focal_px: float, rng: np.random.Generator) -> np.ndarray:
        units = np.rint(np.asarray(self.of(depth, focal_px, rng), np.float64) / self.unit_m)
        return np.where(units < 65535, units * self.unit_m, 0).astype(np.float32)


@dataclass(frozen=True)
class Outliers:
    """A sensor of whose known pixels a share, alone or a few together, are wrong by up to half: bad matches, dust."""

    share: float = 0.01
    size_px: float = 0.5  # of the Gaussian that makes neighbours wrong together; 0: single pixels
    of: Sensor = clean

    def __call__(self, depth: np.ndarray, focal_px: float, rng: np.random.Generator) -> np.ndarray:
        seen = np.asarray(self.of(depth, focal_px, rng), np.float32)
        wrong = _blobs(rng, seen.shape, self.share, self.size_px)
        return np.where(wrong, seen * rng.uniform(0.5, 1.5, seen.shape), seen).astype(np.float32)


# Named levels: what evaluation reports.
LEVELS: dict[str, Sensor] = {
    "clean": clean,
    "plain-1/8": Plain(1 / 8),
    "plain-1/2": Plain(1 / 2),
    "plain-1": Plain(1),
    "plain-4": Plain(4),
    "stereo": Stereo(),
    "stereo-coarse": Stereo(sigma_px=0.15, window_px=9, step_px=1 / 8, holes=0.04),
    "tof": TimeOfFlight(),
    "tof-dim": TimeOfFlight(sigma_m=0.006, rounding_px=3, holes=0.02),
    "structured-light": StructuredLight(),
    "phone": Phone(),
    "steps-0.1mm": Steps(0.0001),
    "steps-0.25mm": Steps(0.00025),
    "steps-1mm": Steps(0.001),
    "stereo-1mm": Steps(0.001, Stereo()),
}


def drawn(rng: np.random.Generator) -> Sensor:
    """A sensor to train on, of any kind and strength between the named levels and a little beyond; one in five with
    wrong pixels, since no level has them and a network must not take each for an edge."""
    sensor = _without_outliers(rng)
    if rng.random() < 0.8:
        return sensor
    return Outliers(float(2 ** rng.uniform(-9, -4)), float(rng.choice([0, 0.5, 1])), sensor)


def _without_outliers(rng: np.random.Generator) -> Sensor:
    kind = rng.choice(6, p=[0.15, 0.1, 0.3, 0.25, 0.1, 0.1])
    if kind == 0:
        return clean
    if kind == 1:
        return Plain(float(2 ** rng.uniform(-4, 1.5)))
    if kind == 2:
        return Stereo(
            sigma_px=float(2 ** rng.uniform(-5.5, -2.5)),
            window_px=int(rng.choice([3, 5, 7, 9])),
            baseline_m=float(rng.uniform(0.04, 0.12)),
            step_px=float(rng.choice([1 / 64, 1 / 32, 1 / 16, 1 / 8])),
            holes=float(rng.choice([0, 0.01, 0.05])),
        )
    if kind == 3:
        return TimeOfFlight(
            sigma_m=float(2 ** rng.uniform(-11, -7)),
            mixing_px=float(rng.uniform(0.3, 0.8)),
            rounding_px=float(rng.uniform(0, 3)),
            holes=float(rng.choice([0, 0.003, 0.02])),
        )
    if kind == 4:
        return StructuredLight(scale=float(rng.uniform(0.3, 1)), holes=float(rng.choice([0, 0.01, 0.04])))
    return Phone(int(rng.choice([2, 3])), float(2 ** rng.uniform(-10, -7)), float(rng.uniform(0.6, 1.4)))
