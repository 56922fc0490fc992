"""Renders captures from new views without a network, as baselines: the nearest photo, and the points of the cloud.

Each takes a capture and a camera, and returns RGB float32 [H, W, 3] in 0..1. The background is one colour: the mean of
photo pixels that no point covers.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import torch
from torch import Tensor
from torch.nn import functional as F

from export.camera import Camera
from export.scenes.captures import Capture
from export.scenes.config import LEVELS, MULTIPLE
from export.scenes.fitting import View
from export.scenes.geometry.raster import NOTHING, pyramid, visible
from export.scenes.geometry.source_views import in_frame

SCORED_POINTS = 2000  # points that decide which photo is nearest
BACKGROUND_PHOTOS = 3
BACKGROUND_SIDE_PX = 160  # long side of photos for the mean colour
SEEN_FRACTION = 0.02  # fraction of uncovered photo pixels; below it, photos give no background colour


def moved_px(target: Camera, other: Camera, positions: np.ndarray) -> float:
    """Returns the distance of two cameras: the mean motion in pixels of the points [P, 3] in the target's frame.

    A point that the other does not have in its frame counts as moved by the diagonal.
    """
    diagonal = float(np.hypot(target.width_px, target.height_px))
    positions = positions[in_frame(positions, target)]
    if not len(positions):
        return diagonal
    other = other.resized(target.width_px, target.height_px)
    pixels = []
    for camera in (target, other):
        seen = (positions - camera.centre) @ camera.rotation.T
        with np.errstate(divide="ignore", invalid="ignore"):
            pixels.append(seen[:, :2] / seen[:, 2:] * (camera.fx_px, camera.fy_px) + (camera.cx_px, camera.cy_px))
        pixels[-1][~in_frame(positions, camera)] = np.inf
    moved = np.linalg.norm(pixels[1] - pixels[0], axis=1)
    return float(np.minimum(np.where(np.isfinite(moved), moved, diagonal), diagonal).mean())


def nearest_photo(capture: Capture, camera: Camera) -> np.ndarray:
    """Returns the source photo with the nearest camera (`moved_px`), at the camera's size. The photo of the camera
    itself is not used."""
    positions = capture.cloud.positions
    scored = positions[:: max(1, len(positions) // SCORED_POINTS)]
    best = min(capture.sources(), key=lambda k: moved_px(camera, capture.cameras[k], scored))
    image = capture.view(best).image
    if image.shape[:2] == (camera.height_px, camera.width_px):
        return image
    smaller = camera.width_px < image.shape[1]
    size = camera.width_px, camera.height_px
    return cv2.resize(image, size, interpolation=cv2.INTER_AREA if smaller else cv2.INTER_LINEAR)


@dataclass(frozen=True, eq=False)
class Cloud:
    """positions: float64 [P, 3]; colours: float32 [P, 3]; behind: float32 [3], the background colour."""

    positions: Tensor
    colours: Tensor
    behind: Tensor

    def points(self, camera: Camera) -> np.ndarray:
        """Draws one pixel a point; the nearest point is visible."""
        return self._painted(visible(self.positions, camera))

    def squares(self, camera: Camera, side_px: int = 3) -> np.ndarray:
        """Draws a square of `side_px` (odd) a point; the nearest point is visible. Points outside the frame are left
        out."""
        keys = visible(self.positions, camera)
        for axis in (0, 1):
            keys = _min_around(keys, side_px // 2, axis)
        return self._painted(keys)

    def pyramid(self, camera: Camera) -> np.ndarray:
        """Draws the five rasters of the refiner with the points' own colours: a pixel without a point at one level
        shows the next coarser level, interpolated bilinearly."""
        wide, high = (-(-side // MULTIPLE) * MULTIPLE for side in (camera.width_px, camera.height_px))
        shown = pyramid(visible(self.positions, camera.reframed(0, 0, wide, high)), LEVELS)
        picture = self.behind[:, None, None].expand(3, high // MULTIPLE, wide // MULTIPLE)
        for raster in reversed(shown.rasters(self.colours[shown.points])):
            size = raster.shape[1:]
            below = F.interpolate(picture[None], size=size, mode="bilinear", align_corners=False)[0]
            picture = torch.where(raster[3:] > 0, raster[:3], below)
        return np.ascontiguousarray(picture[:, : camera.height_px, : camera.width_px].permute(1, 2, 0).numpy())

    def _painted(self, keys: Tensor) -> np.ndarray:
        colours = torch.cat([self.colours, self.behind[None]])
        return colours[torch.where(keys == NOTHING, len(self.positions), keys & 0xFFFFFFFF)].numpy()


def _min_around(keys: Tensor, radius_px: int, axis: int) -> Tensor:
    found = keys.clone()
    for off in range(1, radius_px + 1):
        low, high = keys.narrow(axis, 0, keys.shape[axis] - off), keys.narrow(axis, off, keys.shape[axis] - off)
        for into, given in ((off, low), (0, high)):
            part = found.narrow(axis, into, given.shape[axis])
            torch.minimum(part, given, out=part)
    return found


def cloud_of(capture: Capture) -> Cloud:
    """Returns the points of the capture and the background colour: the mean of photo pixels without a point, or the
    mean of the points if they cover all photos."""
    positions, colours = torch.from_numpy(capture.cloud.positions), torch.from_numpy(capture.cloud.colours)
    sources, shown, count = capture.sources(), [], 0
    for at in np.linspace(0, len(sources) - 1, min(BACKGROUND_PHOTOS, len(sources))).round().astype(int):
        view: View = capture.view(sources[at], BACKGROUND_SIDE_PX)
        free = (visible(positions, view.camera) == NOTHING).numpy()
        shown.append(view.image[free])
        count += free.size
    free = np.concatenate(shown)
    behind = (free if len(free) > SEEN_FRACTION * count else capture.cloud.colours).mean(0, dtype=np.float64)
    return Cloud(positions, colours, torch.from_numpy(behind.astype(np.float32)))
