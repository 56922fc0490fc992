"""Pictures of a place from a new side without any network, for comparison: the nearest photo, and its cloud's points.

All take a capture and a camera, and give RGB float32 [H, W, 3] in 0..1. What is behind the points is one colour: that
of the photos where no point is.
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

SCORED_POINTS = 2000  # of the cloud, enough to tell which photo is nearest
BACKGROUND_PHOTOS = 3
BACKGROUND_SIDE_PX = 160  # photos this small tell a mean colour
SEEN_FRACTION = 0.02  # of the photos' pixels: with fewer that no point covers, these tell nothing of the background


def moved_px(target: Camera, other: Camera, positions: np.ndarray) -> float:
    """How far apart two cameras are: by how many pixels of the target the points [P, 3] in its frame move, on average.

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
    """The source photo whose camera is nearest (`moved_px`), at the camera's size. Its own picture is not looked at."""
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
    """positions: float64 [P, 3]; colours: float32 [P, 3]; behind: float32 [3], where no point is."""

    positions: Tensor
    colours: Tensor
    behind: Tensor

    def points(self, camera: Camera) -> np.ndarray:
        """One pixel a point, the nearest wins."""
        return self._painted(visible(self.positions, camera))

    def squares(self, camera: Camera, side_px: int = 3) -> np.ndarray:
        """A square of `side_px` (odd) a point, the nearest wins. Points outside of the frame do not reach into it."""
        keys = visible(self.positions, camera)
        for axis in (0, 1):
            keys = _min_around(keys, side_px // 2, axis)
        return self._painted(keys)

    def pyramid(self, camera: Camera) -> np.ndarray:
        """The five rasters that the refiner gets, here of the points' own colours: where a finer one has no point, the
        next coarser shows, bilinearly."""
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
    """The capture's points, and the colour behind them: the mean of what a few source photos show where no point is;
    where points are all over them, the mean of the points."""
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
