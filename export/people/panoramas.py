"""Places known all around (HDRI): what a camera sees of them, far out of focus, and the light they throw on people."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from export.camera import Camera
from export.people.render import Light

_CONE = np.cos(np.radians(20))  # half angle of what counts as one lamp
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)
# People are rendered in display values, not in radiance: hues and contrasts of light are softened as a camera does.
_SOFT = 0.6


class Panorama:
    """radiance: [H, W, 3] linear RGB; the first row is straight up, columns go once around."""

    def __init__(self, radiance: np.ndarray) -> None:
        self.radiance = np.asarray(radiance, np.float32)
        small = cv2.resize(self.radiance, (64, 32), interpolation=cv2.INTER_AREA)
        rows, columns = (np.arange(32) + 0.5) / 32 * np.pi, (np.arange(64) + 0.5) / 64 * 2 * np.pi
        polar, azimuth = np.meshgrid(rows, columns, indexing="ij")
        direction = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], -1)
        solid = np.sin(polar) * (np.pi / 32) * (2 * np.pi / 64)
        self.lamps = []
        rest = small.copy()
        for _ in range(2):
            bright = rest @ _LUMINANCE
            towards = direction.reshape(-1, 3)[bright.argmax()]
            cone = direction @ towards > _CONE
            ambient = np.median(rest[~cone].reshape(-1, 3), 0)
            over = np.clip(rest[cone] - ambient, 0, None) * solid[cone][:, None]
            middle = (over @ _LUMINANCE) @ direction[cone] + 1e-6 * towards
            self.lamps.append((middle / np.linalg.norm(middle), over.sum(0) / np.pi))
            rest[cone] = np.minimum(rest[cone], ambient)
        upper = direction[..., 2] > 0
        self.sky, self.ground = (
            (rest[half] * solid[half][:, None]).sum(0) / solid[half].sum() for half in (upper, ~upper)
        )

    def exposure(self, brightness: float) -> float:
        """Factor of radiance that gives a person in this light about this brightness."""
        falling = (self.sky + self.ground) / 2 + 0.5 * self.lamps[0][1]
        return brightness / max(float(falling @ _LUMINANCE), 1e-6)

    def seen(self, camera: Camera, yaw: float, exposure: float) -> np.ndarray:
        """The background behind the people: float32 [H, W, 3] BGR, 0..255. yaw: rotation of the environment,
        radians."""
        x = (np.arange(camera.width_px) + 0.5 - camera.width_px / 2) / camera.fx_px
        y = (np.arange(camera.height_px) + 0.5 - camera.height_px / 2) / camera.fx_px
        ray = np.stack([*np.meshgrid(x, y), np.ones((camera.height_px, camera.width_px))], -1)
        ray = ray @ camera.rotation
        ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
        height, width = self.radiance.shape[:2]
        column = ((np.arctan2(ray[..., 1], ray[..., 0]) - yaw) / (2 * np.pi) % 1) * width - 0.5
        row = np.arccos(np.clip(ray[..., 2], -1, 1)) / np.pi * height - 0.5
        # Lamps are a thousand times as bright as what is around them: cut off first, or enlarging makes rings.
        linear = cv2.remap(
            np.minimum(self.radiance * exposure, 1.5), column.astype(np.float32),
            np.clip(row, 0, height - 1).astype(np.float32), cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP,
        )  # fmt: skip
        linear = cv2.GaussianBlur(linear, (0, 0), 0.3 * camera.fx_px * 2 * np.pi / width)
        return 255 * np.clip(linear[..., ::-1], 0, 1) ** (1 / 2.2)

    def light(self, camera: Camera, yaw: float, exposure: float, rng: np.random.Generator) -> Light:
        """The same light on people: the upper and lower half as a mean each, the two brightest spots as lamps."""
        turn = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
        into = camera.rotation @ turn
        return Light(
            camera.rotation @ [0, 0, 1.0],
            softened(self.sky * exposure),
            softened(self.ground * exposure),
            np.stack([into @ towards for towards, _ in self.lamps]),
            np.stack([softened(colour * exposure) for _, colour in self.lamps]),
            shadow=rng.uniform(0.5, 1),
            softness=rng.uniform(0.004, 0.03),
            catcher=rng.uniform(0.1, 0.5),
            occlusion=rng.uniform(0.15, 0.6),
        )


def softened(colour: np.ndarray) -> np.ndarray:
    """Linear light [3] as it looks in display values: its brightness and its hue, both towards the middle."""
    brightness = max(float(colour @ _LUMINANCE), 1e-6)
    return np.clip(brightness**_SOFT * (colour / brightness) ** _SOFT, 0, 1.5)


def load_panoramas(folder: Path) -> list[Panorama]:
    files = sorted(folder.glob("*.npy"))
    if not files:
        raise FileNotFoundError(f"no panoramas in {folder}: run `python -m export.photos panoramas` first")
    return [Panorama(np.load(file)) for file in files]
