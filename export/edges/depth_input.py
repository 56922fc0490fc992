"""Input of the network from a depth frame: slopes of inverse depth and a mask of known pixels. Reference for the C++.

A plane's inverse depth is linear in pixels, so a crease is a step of the slope whichever way the plane leans. Depth
itself in 8 bits would have no edge left: 4 m in 256 steps are 16 mm.
"""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn import functional as F


def slopes(depth: Tensor, focal_px: Tensor) -> Tensor:
    """Depth [N, H, W] in metres, 0 where unknown, and focal lengths [N, 2] (x, y) -> [N, 3, H, W] within -1..1.

    Planes 0 and 1: g / (1 + |g|) of the surface's slope g = f z d(1/z) towards the next pixel in x and in y, metres of
    depth a metre sideways (nearer: positive), 0 where either pixel is unknown and at the last column or row. Plane 2:
    1 where depth is known.
    """
    known, planes = depth > 0, []
    for axis, focal in ((2, focal_px[:, 0]), (1, focal_px[:, 1])):
        n = depth.shape[axis] - 1
        here, there = depth.narrow(axis, 0, n), depth.narrow(axis, 1, n)
        both = (here > 0) & (there > 0)
        # By the difference of depths: that of close inverses would lose the digits of long focal lengths.
        g = focal[:, None, None] * (here - there) / torch.where(both, there, 1)
        g = torch.where(both, g / (1 + g.abs()), 0)
        planes.append(F.pad(g, (0, 1) if axis == 2 else (0, 0, 0, 1)))
    return torch.stack([*planes, known.to(depth.dtype)], 1)


def mirrored(planes: Tensor, multiple: int) -> Tensor:
    """Slopes [N, 3, H, W] -> sides that are multiples of `multiple`, with mirrors beyond the last column and row.

    Surfaces go on there, where unknown depth would look like their end. A slope along an axis stands between two
    pixels: its mirror is between the last two, which replaces the 0 of the last pixel, which has no neighbour.
    """
    for axis, along in ((3, 0), (2, 1)):
        n = planes.shape[axis]
        size = -(-n // multiple) * multiple
        if size == n:
            continue
        at = torch.arange(size, device=planes.device)
        pixel = torch.where(at < n, at, 2 * n - 1 - at).clamp_min(0)
        between = torch.where(at < n - 1, at, 2 * n - 3 - at).clamp_min(0)
        planes = torch.stack(
            [planes[:, k].index_select(axis - 1, between if k == along else pixel) for k in range(planes.shape[1])], 1
        )
    return planes


def folded(planes: Tensor, fold: int) -> Tensor:
    """[N, C, H, W] -> [N, C fold^2, H / fold, W / fold], as `torch.nn.functional.pixel_unshuffle` orders channels."""
    return F.pixel_unshuffle(planes, fold)
