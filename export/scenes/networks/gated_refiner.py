"""The refiner of NPBG++ (arXiv 2203.13318): a gated U-Net from point rasters at five scales to an image."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from export.scenes.config import LEVELS, RASTER


class GatedBlock(nn.Module):
    """ELU(conv3x3) * sigmoid(conv3x3), [N, inputs, H, W] -> [N, outputs, H, W].

    The border is reflected, and repeated where it is a single pixel, which has nothing to reflect.
    """

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.feature = nn.Conv2d(inputs, outputs, 3)
        self.gate = nn.Conv2d(inputs, outputs, 3)

    def forward(self, x: Tensor) -> Tensor:
        x = F.pad(x, (1, 1, 1, 1), mode="reflect" if min(x.shape[2:]) > 1 else "replicate")
        return F.elu(self.feature(x)) * torch.sigmoid(self.gate(x))


class GatedRefiner(nn.Module):
    """Rasters [N, 9, H/2^k, W/2^k] for k = 0..4, H and W multiples of 16 -> RGB [N, 3, H, W], not clamped.

    Where it differs from the authors' program: sizes are multiples of 16, so nothing is resized to even sizes.
    """

    START, WIDTHS = 16, (16, 32, 48, 64, 80)  # of the levels, after the raster has joined
    UP = (6, 12, 24, 48)  # to the levels 0..3

    def __init__(self) -> None:
        super().__init__()
        w = self.WIDTHS
        self.start = GatedBlock(RASTER, self.START)
        self.down = nn.ModuleList(GatedBlock(w[k - 1], w[k] - RASTER) for k in range(1, LEVELS))
        self.centre = GatedBlock(w[-1], w[-1])
        below = (*self.UP[1:], w[-1])
        self.up = nn.ModuleList(GatedBlock(below[k] + w[k], self.UP[k]) for k in range(LEVELS - 1))
        self.final = nn.Conv2d(self.UP[0], 3, 1)
        nn.init.constant_(self.final.bias, 0.5)

    def forward(self, rasters: list[Tensor]) -> Tensor:
        skips = [self.start(rasters[0])]
        for block, raster in zip(self.down, rasters[1:], strict=True):
            skips.append(torch.cat([block(F.avg_pool2d(skips[-1], 2)), raster], 1))
        x = self.centre(skips.pop())
        for block in reversed(self.up):
            skip = skips.pop()
            x = F.interpolate(x, scale_factor=2.0, mode="bilinear", align_corners=False)
            x = block(torch.cat([x, skip], 1))
        return self.final(x)
