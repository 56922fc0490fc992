"""Samples properties of synthetic heads and their images beside shape: tones, light, clothes, glasses, cameras.

This module takes numpy alone, so that other renderers than Embree can use the same heads and cameras.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from export.camera import Camera
from export.heads.head_shards import CROP_SIDES, SIDE

_TONES = np.array(
    [(255, 222, 196), (244, 200, 165), (228, 176, 132), (200, 140, 98), (150, 95, 62), (100, 64, 44), (66, 42, 32)],
    float,
)  # fmt: skip
_IRIS = np.array([(70, 45, 25), (95, 65, 35), (60, 85, 110), (75, 95, 65), (40, 28, 20)], float)


def sample_tones(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """RGB [3], 0..255, of a head's skin and of its irises."""
    tone = rng.uniform(0, len(_TONES) - 1)
    skin = np.array([np.interp(tone, range(len(_TONES)), _TONES[:, c]) for c in range(3)])
    skin = np.clip(skin * (1 + rng.normal(0, 0.025, 3)), 20, 255)
    return skin, _IRIS[rng.integers(len(_IRIS))] * rng.uniform(0.7, 1.2)


@dataclass(frozen=True)
class Lamps:
    """Light in the head's frame: `ambient` RGB [3], `directions` [K, 3] towards the lights, their `colours` [K, 3]."""

    ambient: np.ndarray
    directions: np.ndarray
    colours: np.ndarray
    gloss: float = 0.1

    def on(self, normals: np.ndarray, lit: np.ndarray | None = None) -> np.ndarray:
        """RGB [N, 3] that reaches surfaces with these normals [N, 3]; `lit` [N, K] is 0 in the shadow of a lamp."""
        cosine = np.maximum(normals @ self.directions.T, 0)
        if lit is not None:
            cosine = cosine * lit
        # A little more from above than from below.
        return self.ambient * (1 + 0.25 * normals[:, 2:]) + cosine @ self.colours


def sample_lamps(rng: np.random.Generator) -> Lamps:
    """From flat light to a hard lamp at one side."""
    count = int(rng.integers(1, 3))
    directions = rng.normal(size=(count, 3)) + [0, -0.8, 0.6]
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    share = rng.uniform(0.25, 0.85)
    tint = np.exp(rng.normal(0, 0.035, (count + 1, 3)))
    power = rng.dirichlet(np.ones(count))[:, None]
    return Lamps(share * tint[0], directions, (1.25 - share) * power * tint[1:] * 1.3, float(rng.uniform(0, 0.3)))


@dataclass(frozen=True)
class Extras:
    """Clothes below the head and glasses, which an image shows and the head's surface does not include."""

    cloth: np.ndarray  # RGB
    collar: float  # dm: skin ends at this height of the template
    seed: int
    lens: float  # how much of the light glasses take, 0..1; 0: none are worn
    rim: float  # half the width of their rims, dm; 0: no rims
    frame: np.ndarray  # RGB
    size: np.ndarray  # half sizes of a lens, dm


def sample_extras(rng: np.random.Generator) -> Extras:
    worn = rng.random() < 0.25
    dark = rng.random() < 0.3
    return Extras(
        rng.uniform(10, 240, 3) * rng.uniform(0.3, 1),
        float(rng.uniform(-2.9, -1.6)),
        int(rng.integers(1 << 31)),
        float(rng.uniform(0.5, 0.95) if dark else rng.uniform(0.02, 0.15)) if worn else 0.0,
        float(rng.uniform(0.008, 0.04)) if worn else 0.0,
        rng.uniform(0, 160, 3) * rng.uniform(0.1, 1),
        np.array([rng.uniform(0.2, 0.29), rng.uniform(0.13, 0.24)]),
    )


def look_at(
    yaw: float, pitch: float, roll: float, distance: float, aim: np.ndarray, focal_px: float, side_px: int
) -> Camera:
    """A camera at `distance` (dm) from `aim` (head frame): yaw 0 sees the face, positive from the person's left;
    positive pitch from above (radians). Its image is a square with `aim` in the middle."""
    outward = np.array([np.sin(yaw) * np.cos(pitch), -np.cos(yaw) * np.cos(pitch), np.sin(pitch)])
    forward = -outward
    right = np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    c, s = np.cos(roll), np.sin(roll)
    rotation = np.stack([c * right + s * down, -s * right + c * down, forward])
    return Camera.centred(side_px, side_px, focal_px, rotation, aim + distance * outward)


def sample_camera(points: np.ndarray, rng: np.random.Generator, yaw: float | None = None) -> Camera:
    """Mostly of faces from the front and sides, from 35 cm to 3 m; the image is a square around a head's points. yaw:
    from where the camera looks, radians; None: from anywhere."""
    u = rng.random()
    sampled = rng.normal(0, 0.45) if u < 0.55 else rng.uniform(-1.9, 1.9) if u < 0.88 else rng.uniform(-np.pi, np.pi)
    yaw = sampled if yaw is None else yaw
    pitch, roll = np.clip(rng.normal(0, 0.22), -0.8, 0.8), np.clip(rng.normal(0, 0.22), -0.9, 0.9)
    distance = float(np.exp(rng.uniform(np.log(3.5), np.log(30))))
    camera = look_at(yaw, pitch, roll, distance, np.zeros(3), 100.0, SIDE)
    pixels, _ = camera.projected(points)
    low, high = pixels.min(0), pixels.max(0)
    zoom = SIDE / (CROP_SIDES * (high - low).max() * rng.uniform(0.85, 1.15))
    # Crops are seldom in the middle of the photos that they are cut from: the principal point is wherever it is.
    middle = ((low + high) / 2 - camera.cx_px) * zoom + rng.normal(0, 0.04 * SIDE, 2)
    centre = (SIDE - 1) / 2 - middle
    intrinsics = np.array([[100.0 * zoom, 0, centre[0]], [0, 100.0 * zoom, centre[1]], [0, 0, 1]])
    return Camera.of_intrinsics(SIDE, SIDE, intrinsics, camera.rotation, camera.centre)
