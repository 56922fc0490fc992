"""Triangles to pixels in torch: which triangle each pixel of several images sees, by a depth buffer.

All images of a batch go through the same few tensor operations, on whatever device their tensors are.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

_MAX_CANDIDATES = 40_000_000  # at once; a candidate takes some 60 bytes


@dataclass(frozen=True)
class Hits:
    """The pixels that see something: `pixel` int64 [N], index in [B, S, S]; face int64 [N]; weight float32 [N, 3],
    barycentric coordinates on the triangle; nearness float32 [N], as of the vertices."""

    pixel: Tensor
    face: Tensor
    weight: Tensor
    nearness: Tensor


def rasterized(corners: Tensor, nearness: Tensor, picture: Tensor, side: int, perspective: bool) -> Hits:
    """Rasterizes triangles into B square images of `side` pixels.

    corners float32 [F, 3, 2]: pixels of each triangle's corners. nearness [F, 3] > 0: larger is nearer, affine over the
    image: 1 / depth in perspective, else any constant less the depth. image int64 [F]. Triangles with a corner
    whose nearness is not positive are left out.
    """
    low = corners.amin(1).ceil().clamp(min=0)
    high = corners.amax(1).floor().clamp(max=side - 1)
    size = (high - low + 1).clamp(min=0)
    a, b, c = corners.unbind(1)
    area = _cross(b - a, c - a)
    good = (nearness.amin(1) > 0) & (area.abs() > 1e-9) & torch.isfinite(corners).flatten(1).all(1)
    count = (torch.nan_to_num(size).prod(1) * good).long()
    pictures = int(picture.max()) + 1 if len(picture) else 0
    buffer = torch.full((pictures * side * side,), -1, dtype=torch.int64, device=corners.device)
    kept = count.nonzero()[:, 0]
    ends = count[kept].cumsum(0)
    start = 0
    while start < len(kept):
        before = int(ends[start - 1]) if start else 0
        stop = max(start + 1, int(torch.searchsorted(ends, before + _MAX_CANDIDATES, right=True)))
        _fill(buffer, kept[start:stop], corners, nearness, area, low, size, count, picture, side)
        start = stop
    pixel = (buffer >= 0).nonzero()[:, 0]
    face = buffer[pixel] & 0xFFFFFFFF
    at = torch.stack([pixel % side, pixel // side % side], 1).float()
    weight = _barycentric(at, corners[face], area[face])
    near = (weight * nearness[face]).sum(1)
    if perspective:
        weight = weight * nearness[face] / near[:, None]
    return Hits(pixel, face, weight, near)


def _cross(a: Tensor, b: Tensor) -> Tensor:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _barycentric(at: Tensor, corners: Tensor, area: Tensor) -> Tensor:
    a, b, c = (corners[:, k] - at for k in range(3))
    return torch.stack([_cross(b, c), _cross(c, a), _cross(a, b)], 1) / area[:, None]


def _fill(
    buffer: Tensor, kept: Tensor, corners: Tensor, nearness: Tensor, area: Tensor, low: Tensor, size: Tensor,
    count: Tensor, picture: Tensor, side: int,
) -> None:  # fmt: skip
    """Each pixel of each triangle's box is a candidate; the nearest that lies inside stays in the buffer."""
    counts = count[kept]
    face = torch.repeat_interleave(kept, counts)
    first = torch.repeat_interleave(counts.cumsum(0) - counts, counts)
    offset = torch.arange(len(face), device=face.device) - first
    width = size[face, 0].long()
    x, y = low[face, 0].long() + offset % width, low[face, 1].long() + offset // width
    weight = _barycentric(torch.stack([x, y], 1).float(), corners[face], area[face])
    inside = (weight.amin(1) >= 0).nonzero()[:, 0]
    face, weight = face[inside], weight[inside]
    near = (weight * nearness[face]).sum(1).contiguous()
    # Positive floats are ordered as their bits are.
    key = (near.view(torch.int32).long() << 32) | face
    at = (picture[face] * side + y[inside]) * side + x[inside]
    buffer.scatter_reduce_(0, at, key, "amax")
