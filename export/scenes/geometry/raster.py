"""Which point each pixel shows, and rasters of their descriptors: NPBG++ (arXiv 2203.13318), section 3.4.

One pixel a point; the nearest is visible, of equal depths the lowest index, by the same arithmetic as the SDK's
`ZBuffer` (sdk/src/scene/visibility/z_buffer.h). A key is the depth's bits, then the index: the smallest is visible.

Coarser levels are the smallest keys of 2x2 pixels of the next finer one. That is what a camera of half the size would
find, and exactly: a point at (x, y) is in pixel floor(x + 1/2), and half the size moves it to (x + 1/2) / 2 - 1/2, so
to pixel floor((x + 1/2) / 2) = floor(floor(x + 1/2) / 2). It holds where all sides can be halved, hence sides are
multiples of 16 here: the frame is wider than the image by up to 15 pixels, with the points that are there, and
cropped afterwards. The paper truncates sizes instead and draws the points five times. A point that is dropped as
occluded (`without_occluded`) is never the visible one of a coarser pixel that has another point of its block.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from export.camera import Camera
from export.scenes.config import COLOURS

NOTHING = torch.iinfo(torch.int64).max
OCCLUSION_BLOCK_PX = 4
_INDEX = (1 << 32) - 1


def projected(points: Tensor, camera: Camera) -> tuple[Tensor, Tensor, Tensor]:
    """Columns, rows and depths, float32 [P] each; columns and rows mean nothing where the depth is not positive.

    points: float64 [P, 3]. The camera's centre is subtracted in double: scenes may lie far from the world's origin.
    """
    x, y, z = (points - torch.from_numpy(camera.centre).to(points)).float().unbind(1)
    scale = np.array([[camera.fx_px], [camera.fy_px], [1]])
    (a, b, c), (d, e, f), (g, h, i) = (camera.rotation * scale).astype(np.float32).tolist()
    forward = g * x + h * y + i * z
    safe = torch.where(forward > 0, forward, 1.0)
    cx, cy = (float(np.float32(value)) for value in (camera.cx_px, camera.cy_px))
    return (a * x + b * y + c * z) / safe + cx, (d * x + e * y + f * z) / safe + cy, forward


def visible(points: Tensor, camera: Camera, near: float = 0.0) -> Tensor:
    """Keys, int64 [H, W], NOTHING where there is no point. points: float64 [P, 3], fewer than 2^32."""
    columns, rows, depths = projected(points, camera)
    w, h = camera.width_px, camera.height_px
    ahead = (depths >= max(near, torch.finfo(torch.float32).tiny)) & (depths <= torch.finfo(torch.float32).max)
    inside = (columns >= -0.5) & (columns < w - 0.5) & (rows >= -0.5) & (rows < h - 0.5)
    (index,) = torch.where(ahead & inside)
    # The sum is rounded, on the last edge up to the pixel behind it.
    at = (rows[index] + 0.5).long().clamp_max(h - 1) * w + (columns[index] + 0.5).long().clamp_max(w - 1)
    keys = torch.full((h * w,), NOTHING, dtype=torch.int64, device=points.device)
    key = depths[index].view(torch.int32).long() << 32 | index
    return keys.scatter_reduce(0, at, key, "amin").view(h, w)


def without_occluded(keys: Tensor, tolerance: float) -> Tensor:
    """Keys [H, W] without the points that bleed through holes of what is before them: those of a block of
    OCCLUSION_BLOCK_PX x OCCLUSION_BLOCK_PX pixels, counted from the first one, that are farther than its nearest by
    more than `tolerance` of that depth. Infinite: all stay."""
    h, w = keys.shape
    rows, columns = -(-h // OCCLUSION_BLOCK_PX), -(-w // OCCLUSION_BLOCK_PX)
    whole = torch.full(
        (rows * OCCLUSION_BLOCK_PX, columns * OCCLUSION_BLOCK_PX), NOTHING, dtype=keys.dtype, device=keys.device
    )
    whole[:h, :w] = keys
    blocks = whole.view(rows, OCCLUSION_BLOCK_PX, columns, OCCLUSION_BLOCK_PX)
    nearest = depths_of(blocks.amin((1, 3)))
    limit = (
        (nearest * (1 + tolerance)).repeat_interleave(OCCLUSION_BLOCK_PX, 0).repeat_interleave(OCCLUSION_BLOCK_PX, 1)
    )
    return torch.where(depths_of(keys) > limit[:h, :w], NOTHING, keys)


def halved(keys: Tensor) -> Tensor:
    """Keys [H, W] of the next coarser level, [H/2, W/2]. Raises ValueError where a side is odd."""
    h, w = keys.shape
    if h % 2 or w % 2:
        raise ValueError(f"a raster of {w} x {h} pixels cannot be halved; its sides must be multiples of 16")
    return keys.view(h // 2, 2, w // 2, 2).amin((1, 3))


def depths_of(keys: Tensor) -> Tensor:
    """float32, infinite where there is no point."""
    depths = (keys >> 32).int().view(torch.float32)
    return torch.where(keys == NOTHING, torch.inf, depths)


@dataclass(frozen=True)
class Pyramid:
    """points: indices int64 [V] of all that are visible in a pixel. slots: for each level, finest first, where in
    `points` the pixel's point is, int64 [H/2^k, W/2^k]; V where there is none."""

    points: Tensor
    slots: list[Tensor]

    def rasters(self, descriptors: Tensor) -> list[Tensor]:
        """Descriptors [V, C] of `points` -> [C + 1, H/2^k, W/2^k] for each level, the last channel 1 where there is a
        point. All is 0 elsewhere."""
        rows = torch.cat([descriptors, descriptors.new_ones(len(descriptors), 1)], 1)
        rows = torch.cat([rows, rows.new_zeros(1, rows.shape[1])])
        return [rows[slot].permute(2, 0, 1) for slot in self.slots]


def pyramid(keys: Tensor, levels: int) -> Pyramid:
    """The pyramid of `visible` keys [H, W], whose sides are multiples of 2^(levels - 1)."""
    # A point has one pixel, so no index comes twice; and what is visible in a coarser pixel is visible in a finer one.
    points = torch.sort(keys[keys != NOTHING] & _INDEX).values
    slots = []
    for level in range(levels):
        keys = halved(keys) if level else keys
        found = torch.searchsorted(points, keys & _INDEX)
        slots.append(torch.where(keys == NOTHING, len(points), found))
    return Pyramid(points, slots)


def filled(rasters: list[Tensor], background: Tensor) -> list[Tensor]:
    """Rasters [..., 9, H/2^k, W/2^k], finest first, as a refiner wants them: where a pixel has no point its colours are
    those of the next coarser raster, in the coarsest `background` [3], so that the finest holds an image. Occupancy
    and learnt features stay 0 there."""
    below, found = background[:, None, None].to(rasters[-1]), []
    for raster in reversed(rasters):
        below = raster[..., :COLOURS, :, :] + (1 - raster[..., -1:, :, :]) * below
        found.append(torch.cat([below, raster[..., COLOURS:, :, :]], -3))
        below = below.repeat_interleave(2, -2).repeat_interleave(2, -1)
    return found[::-1]
