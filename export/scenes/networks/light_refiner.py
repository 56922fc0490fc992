"""A refiner for two CPU cores: a U-Net that begins and ends at half resolution.

It is cheaper than the gated U-Net of NPBG++ (arXiv 2203.13318): the finest raster comes in as four pixels for one and
the image goes out so, hence nothing but copying is done at full resolution; convolution and ReLU are one int8
operation; borders are zeros, which convolutions bring along; maps from below pass a 1x1 convolution before they are
doubled; and pooling and doubling keep the values of int8 maps.

What the network computes is added to the colours of the finest raster (`export.scenes.geometry.raster.filled`):
training starts from an image, and what is rounded to 8 bits is the difference alone.
"""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from export.scenes.config import COLOURS, RASTER, RefinerConfig


def space_to_depth(x: Tensor) -> Tensor:
    """[N, C, H, W] -> [N, 4 C, H/2, W/2]: the pixels (0, 0), (0, 1), (1, 0), (1, 1) of each 2x2, all channels of the
    first before those of the next, so that a pixel is one piece of memory where channels are last."""
    n, c, h, w = x.shape
    return x.reshape(n, c, h // 2, 2, w // 2, 2).permute(0, 3, 5, 1, 2, 4).reshape(n, 4 * c, h // 2, w // 2)


def depth_to_space(x: Tensor) -> Tensor:
    """The inverse of `space_to_depth`."""
    n, c, h, w = x.shape
    return x.reshape(n, 2, 2, c // 4, h, w).permute(0, 3, 4, 1, 5, 2).reshape(n, c // 4, 2 * h, 2 * w)


def _block(inputs: int, outputs: int) -> nn.Sequential:
    return nn.Sequential(nn.Conv2d(inputs, outputs, 3, padding=1), nn.ReLU(inplace=True))


def _doubled(x: Tensor, like: Tensor) -> Tensor:
    """x as large as `like`, which has the same channels and is twice as large."""
    return F.interpolate(x, size=like.shape[2:], mode="nearest")


class LightRefiner(nn.Module):
    """Rasters [N, 9, H/2^k, W/2^k] for k < config.levels, H and W multiples of 16 -> RGB [N, 3, H, W], not clamped.

    double: makes a map twice as large, as large as a second one; exported graphs do it another way.
    """

    double: Callable[[Tensor, Tensor], Tensor] = staticmethod(_doubled)

    def __init__(self, config: RefinerConfig) -> None:
        super().__init__()
        self.config = config
        w = config.widths
        # Many channels meet first in a 1x1 convolution, which is a ninth of the work.
        entry = [nn.Conv2d(5 * RASTER, w[0], 1), nn.ReLU(inplace=True)]
        self.start = nn.Sequential(*entry, *_block(w[0], w[0]))
        self.down = nn.ModuleList(_block(w[k - 1] + RASTER, w[k]) for k in range(1, len(w)))
        self.centre = _block(w[-1], w[-1])
        self.lateral = nn.ModuleList(nn.Conv2d(w[k + 1], w[k], 1) for k in range(len(w) - 1))
        self.up = nn.ModuleList(_block(2 * w[k], w[k]) for k in range(len(w) - 1))
        self.final = nn.Conv2d(w[0], 12, 3, padding=1)
        nn.init.normal_(self.final.weight, std=0.01)
        nn.init.zeros_(self.final.bias)

    def forward(self, rasters: list[Tensor]) -> Tensor:
        return depth_to_space(self.of_rearranged([space_to_depth(rasters[0]), *rasters[1:]]))

    def of_rearranged(self, rasters: list[Tensor]) -> Tensor:
        """As `forward`, but the first raster comes and the image leaves rearranged."""
        skips = [self.start(torch.cat(rasters[:2], 1))]
        for block, raster in zip(self.down, rasters[2 : self.config.levels], strict=True):
            skips.append(block(torch.cat([F.max_pool2d(skips[-1], 2), raster], 1)))
        x = self.centre(skips.pop())
        for lateral, block in zip(reversed(self.lateral), reversed(self.up), strict=True):
            skip = skips.pop()
            x = block(torch.cat([self.double(lateral(x), skip), skip], 1))
        firsts = range(0, 4 * RASTER, RASTER)
        return torch.cat([rasters[0][:, first : first + COLOURS] for first in firsts], 1) + self.final(x)
