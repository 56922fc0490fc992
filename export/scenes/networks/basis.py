"""The functions of the viewing direction that descriptors combine (NPBG++, arXiv 2203.13318, section 3.3)."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn

from export.scenes.config import BASIS

FREQUENCIES = (math.pi / 2, math.pi, 2 * math.pi)
SLOPE = 0.01  # of the leaky ReLU


def directions(points: Tensor, centre: Tensor) -> Tensor:
    """Unit vectors [P, 3] from a camera's centre [3] to points [P, 3], in the points' type; 0 for a point in it."""
    away = points - centre
    return away / (away.norm(dim=-1, keepdim=True) + 1e-7)


def encoded(direction: Tensor) -> Tensor:
    """Unit vectors [P, 3] -> [P, 18]: sin x, sin y, sin z, cos x, cos y, cos z of pi/2 times it, then of pi times and
    2 pi times."""
    parts = [f(frequency * direction) for frequency in FREQUENCIES for f in (torch.sin, torch.cos)]
    return torch.cat(parts, -1)


class Basis(nn.Sequential):
    """Unit vectors [P, 3] -> values of the basis [P, 6]. Shared by all points of all scenes; 678 parameters."""

    def __init__(self) -> None:
        inputs = 6 * len(FREQUENCIES)
        super().__init__(
            nn.Linear(inputs, 16), nn.LeakyReLU(SLOPE), nn.Linear(16, 16), nn.LeakyReLU(SLOPE), nn.Linear(16, BASIS)
        )

    def forward(self, direction: Tensor) -> Tensor:
        return super().forward(encoded(direction))
