"""Cameras that look at something, and paths of cameras around a thing or through a room."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from export.camera import Camera


@dataclass(frozen=True)
class Lens:
    """Properties that the cameras of an environment share: size in pixels, field of view of the longer side, offset of
    the principal point from the middle in pixels."""

    width: int
    height: int
    degrees: float
    offset: tuple[float, float] = (0.0, 0.0)

    def intrinsics(self, zoom: float = 1.0) -> np.ndarray:
        focal = zoom * max(self.width, self.height) / 2 / np.tan(np.radians(self.degrees) / 2)
        x, y = (self.width - 1) / 2 + self.offset[0], (self.height - 1) / 2 + self.offset[1]
        return np.array([[focal, 0, x], [0, focal, y], [0, 0, 1.0]])


def looking(lens: Lens, eye: np.ndarray, target: np.ndarray, roll_degrees: float = 0.0, zoom: float = 1.0) -> Camera:
    """A camera at `eye` [3] with `target` [3] on its optical axis, upright before it is rolled."""
    forward = np.asarray(target, np.float64) - eye
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0, 0, 1.0])
    if np.linalg.norm(right) < 1e-6:
        right = np.array([1.0, 0, 0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    rotation = Rotation.from_euler("z", roll_degrees, degrees=True).as_matrix() @ rotation
    return Camera.of_intrinsics(lens.width, lens.height, lens.intrinsics(zoom), rotation, eye)


def draw_lens(rng: np.random.Generator, small: bool) -> Lens:
    """Sizes as phones and webcams give them, 40 to 75 degrees; small: a quarter of the pixels."""
    sizes = ((640, 480), (640, 480), (480, 640), (640, 360), (512, 512))
    width, height = sizes[rng.integers(len(sizes))]
    if small:
        width, height = width // 2, height // 2
    offset = rng.normal(0, 0.01, 2) * (width, height) if rng.random() < 0.5 else (0.0, 0.0)
    return Lens(width, height, float(rng.uniform(40, 75)), tuple(map(float, offset)))


def arc(rng: np.random.Generator, count: int, middle: np.ndarray, radius: float, whole: bool) -> list[np.ndarray]:
    """Places for the eye around `middle` [3]: half turns to whole ones, at one to three heights, with jitter."""
    span = 2 * np.pi if whole else np.radians(rng.uniform(70, 200))
    start = rng.uniform(0, 2 * np.pi)
    rounds = int(rng.integers(1, 4))
    low, high = np.sort(np.radians(rng.uniform(4, 58, 2)))
    eyes = []
    for k in range(count):
        share = k * rounds / count
        # There and back again where it is no whole turn, so that neighbours in time are neighbours in space.
        turn = share % 1 if whole or int(share) % 2 == 0 else 1 - share % 1
        azimuth = start + span * turn + rng.normal(0, 0.03)
        height = low + (high - low) * (int(share) + 0.5) / rounds + rng.normal(0, 0.03)
        distance = radius * np.exp(rng.normal(0, 0.05))
        ray = np.array([np.cos(height) * np.cos(azimuth), np.cos(height) * np.sin(azimuth), np.sin(height)])
        eyes.append(middle + distance * ray)
    return eyes
