"""The feature extractor of NPBG++ (arXiv 2203.13318): a U-Net from a photo to 8 features a pixel.

The first three are the photo's own red, green and blue, as they are: so a scene has colours without a network, the
refiner starts from an image instead of from nothing, and no bit of 8 is lost on what is known. Five are learnt.
The trunk is the MobileNetV2 that the dense pose network has too, since there are weights for it that may be shipped
(export.teachers.backbone); the paper's has a similar size.
"""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from export.densepose.data import MEAN, STD
from export.densepose.network import MobileNetV2
from export.scenes.config import COLOURS, FEATURES, ExtractorConfig

STRIDE = 32  # sides of the photo are multiples of it


def _doubled(x: Tensor, like: Tensor) -> Tensor:
    """x as large as `like`, which is twice as large."""
    return F.interpolate(x, size=like.shape[2:], mode="nearest")


class Extractor(nn.Module):
    """RGB [N, 3, H, W] in 0..1, H and W multiples of 32 -> features [N, 8, H, W].

    The trunk's statistics (BN) stand still, its weights are trained, as in the paper. double: as in the light refiner.
    """

    _TAPS = (0, 2, 5, 12, 15)  # blocks of the trunk: the last of strides 2, 4, 8, 16, 32
    _CHANNELS = (16, 24, 32, 96, 160)

    double: Callable[[Tensor, Tensor], Tensor] = staticmethod(_doubled)

    def __init__(self, config: ExtractorConfig) -> None:
        super().__init__()
        self.trunk = MobileNetV2()
        skips = (*reversed(self._CHANNELS[:-1]), 3)
        below = (self._CHANNELS[-1], *config.widths[:-1])
        # Where 1x1 convolutions narrow what is doubled, doubling and 3x3 convolutions are cheaper.
        self.lateral = nn.ModuleList(nn.Conv2d(b, w, 1, bias=False) for b, w in zip(below, config.widths, strict=True))
        self.blocks = nn.ModuleList(
            nn.Conv2d(w + s, w, 3, padding=1) for w, s in zip(config.widths, skips, strict=True)
        )
        self.final = nn.Conv2d(config.widths[-1], FEATURES - COLOURS, 1, bias=False)
        self.register_buffer("mean", torch.from_numpy(MEAN / 255)[:, None, None])
        self.register_buffer("std", torch.from_numpy(STD / 255)[:, None, None])

    def train(self, mode: bool = True) -> Extractor:
        super().train(mode)
        for module in self.trunk.modules():
            if isinstance(module, nn.BatchNorm2d):
                module.eval()
        return self

    def forward(self, image: Tensor) -> Tensor:
        x = self.trunk.stem((image - self.mean) / self.std)
        skips = [image]
        for k, block in enumerate(self.trunk.blocks):
            x = block(x)
            if k in self._TAPS:
                skips.append(x)
        x = skips.pop()
        for lateral, block in zip(self.lateral, self.blocks, strict=True):
            skip = skips.pop()
            x = F.relu(block(torch.cat([self.double(lateral(x), skip), skip], 1)))
        return torch.cat([image, self.final(x)], 1)
