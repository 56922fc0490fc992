"""Cameras of a clip: static, panned and held in the hand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from export.camera import Camera

KINDS = ("static", "panned", "hand-held")
_LOOK = np.array([[1, 0, 0], [0, 0, -1], [0, 1.0, 0]])  # camera axes in the world before pitch and yaw
_WAVES = 4
_HZ = (0.2, 2.5)


def sway(rng: np.random.Generator, seconds: np.ndarray, size: float, axes: int) -> np.ndarray:
    """How a hand moves a camera: a sum of slow waves with that standard deviation, [T, axes]."""
    hertz = np.exp(rng.uniform(*np.log(_HZ), (axes, _WAVES)))
    phase = rng.uniform(0, 2 * np.pi, hertz.shape)
    strength = rng.normal(0, 1, hertz.shape) / np.sqrt(hertz)
    strength *= np.sqrt(2) * size / np.sqrt((strength**2).sum(1, keepdims=True) + 1e-12)
    return (strength * np.sin(2 * np.pi * hertz * seconds[:, None, None] + phase)).sum(2)


@dataclass(frozen=True, eq=False)
class CameraPath:
    """cameras: one a frame. yaw: float64 [T], radians, positive to the left."""

    kind: str
    cameras: list[Camera]
    yaw: np.ndarray
    half_view: float  # tangent of half the horizontal field of view
    widest: float  # tangent of the largest angle to one side that any frame shows


def draw_path(
    rng: np.random.Generator, kind: str, seconds: np.ndarray, width_px: int, height_px: int
) -> CameraPath:  # fmt: skip
    """A camera at about a person's height that looks towards +y, a little down."""
    u = rng.uniform
    half = np.radians(u(52, 66)) / 2
    focal = width_px / 2 / np.tan(half)
    eye = np.array([0, 0, u(1.2, 2.1)])
    pitch = np.radians(u(3, 9)) + np.arctan2(eye[2] - 1.3, 4.5)
    angles = np.zeros((len(seconds), 3))  # yaw, pitch, roll
    eyes = np.repeat(eye[None], len(seconds), 0)
    if kind == "panned":
        reach = np.radians(u(6, 12))
        angles[:, 0] = reach * np.sin(2 * np.pi * seconds / u(7, 12) + u(0, 2 * np.pi))
    if kind == "hand-held":
        angles += np.radians(sway(rng, seconds, 1.0, 3)) * [1.5, 1, 0.6]
        eyes = eyes + sway(rng, seconds, 0.025, 3)
    angles += [0, pitch, np.radians(rng.normal(0, 1.0))]
    cameras = []
    for (yaw, down, roll), at in zip(angles, eyes, strict=True):
        tilt = Rotation.from_euler("xz", [down, roll]).as_matrix()
        turn = Rotation.from_euler("z", -yaw).as_matrix()  # of the world, against the camera's
        cameras.append(Camera.centred(width_px, height_px, focal, tilt @ _LOOK @ turn, at))
    widest = np.tan(half + np.abs(angles[:, 0]).max())
    return CameraPath(kind, cameras, angles[:, 0], float(np.tan(half)), float(widest))
