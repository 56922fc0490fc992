"""The pinhole camera of all renderers and captures, in the convention of OpenCV and of the SDK
(sdk/src/image/geometry/pinhole_camera.h): x to the right, y down, z forward; the centre of the top left pixel is
(0, 0)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation


@dataclass(frozen=True, eq=False)
class Camera:
    """rotation: float64 [3, 3], world to camera. centre: float64 [3], in the world."""

    width_px: int
    height_px: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    rotation: np.ndarray
    centre: np.ndarray

    @staticmethod
    def centred(width_px: int, height_px: int, focal_px: float, rotation: np.ndarray, centre: np.ndarray) -> Camera:
        """Square pixels, and the principal point in the middle of the image."""
        middle = (width_px - 1) / 2, (height_px - 1) / 2
        return Camera(width_px, height_px, focal_px, focal_px, *middle, rotation, centre)

    @staticmethod
    def of_intrinsics(
        width_px: int, height_px: int, intrinsics: np.ndarray, rotation: np.ndarray, centre: np.ndarray
    ) -> Camera:
        """intrinsics: [3, 3], as the property of that name."""
        fx, fy, cx, cy = intrinsics[[0, 1, 0, 1], [0, 1, 2, 2]]
        return Camera(width_px, height_px, fx, fy, cx, cy, rotation, centre)

    @property
    def intrinsics(self) -> np.ndarray:
        """[3, 3]: from the camera's coordinates to pixels times depth."""
        return np.array([[self.fx_px, 0, self.cx_px], [0, self.fy_px, self.cy_px], [0, 0, 1]])

    @property
    def world_to_camera(self) -> np.ndarray:
        """[3, 4]"""
        return np.concatenate([self.rotation, -(self.rotation @ self.centre)[:, None]], 1)

    def projected(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """World points [N, 3] -> pixels [N, 2] and depth along the optical axis [N], metres."""
        seen = (np.asarray(points, np.float64) - self.centre) @ self.rotation.T
        with np.errstate(divide="ignore", invalid="ignore"):
            pixel = (seen / seen[:, 2:]) @ self.intrinsics.T
        return pixel[:, :2], seen[:, 2]

    def lifted(self, pixels: np.ndarray, depth: np.ndarray) -> np.ndarray:
        """Pixels [N, 2] at depths [N] along the optical axis -> world points float64 [N, 3]."""
        rays = np.concatenate([pixels, np.ones((len(pixels), 1))], 1) @ np.linalg.inv(self.intrinsics).T
        return (rays * np.asarray(depth, np.float64)[:, None]) @ self.rotation + self.centre

    def resized(self, width_px: int, height_px: int) -> Camera:
        """A smaller or larger image of the same field of view."""
        scale_x, scale_y = width_px / self.width_px, height_px / self.height_px
        return replace(
            self,
            width_px=width_px,
            height_px=height_px,
            fx_px=self.fx_px * scale_x,
            fy_px=self.fy_px * scale_y,
            cx_px=(self.cx_px + 0.5) * scale_x - 0.5,
            cy_px=(self.cy_px + 0.5) * scale_y - 0.5,
        )

    def shrunk(self, factor: int, min_side_px: int = 1) -> Camera:
        """An image of the same field of view with a fraction of the width and height, rounded down."""
        return self.resized(max(self.width_px // factor, min_side_px), max(self.height_px // factor, min_side_px))

    def reframed(self, left_px: int, top_px: int, width_px: int, height_px: int) -> Camera:
        """The same camera with another frame, whose first pixel was (left, top): a crop, or more than there was."""
        return replace(
            self, width_px=width_px, height_px=height_px, cx_px=self.cx_px - left_px, cy_px=self.cy_px - top_px
        )

    def rolled(self, degrees: float) -> Camera:
        """The camera rolled about its axis, so that what it shows turns clockwise by a positive angle."""
        if not degrees:
            return self
        return replace(self, rotation=Rotation.from_euler("z", degrees, degrees=True).as_matrix() @ self.rotation)
