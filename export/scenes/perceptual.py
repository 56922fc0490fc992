"""Images compared by the features of a network that has seen photographs.

The paper takes VGG-19, whose weights cannot be had from a package with a clear licence (those of edge detectors that
contain VGG-16 were tuned on BSDS500, which is for research only). The person detector's MobileNetV2
(export.teachers.backbone; Apache-2.0, trained on COCO) is already used here, and is forty times as fast.
"""

from __future__ import annotations

from pathlib import Path

import torch
from torch import Tensor, nn

from export.densepose.data import MEAN, STD
from export.densepose.network import MobileNetV2


class Perceptual(nn.Module):
    """Distance of images RGB [N, 3, H, W] in 0..1: L1 of features at strides 2, 4, 8, 16, each relative to the mean
    size of the target's, and averaged. Sees 0 outside of `mask` [N, 1, H, W] in both."""

    _TAPS = (0, 2, 5, 12)  # blocks of the trunk

    def __init__(self, trunk: MobileNetV2) -> None:
        super().__init__()
        self.trunk = trunk.eval().requires_grad_(False)
        self.register_buffer("mean", torch.from_numpy(MEAN / 255)[:, None, None])
        self.register_buffer("std", torch.from_numpy(STD / 255)[:, None, None])

    def train(self, mode: bool = True) -> Perceptual:
        return super().train(False)

    def features(self, picture: Tensor) -> list[Tensor]:
        x, found = self.trunk.stem((picture - self.mean) / self.std), []
        for k, block in enumerate(self.trunk.blocks[: self._TAPS[-1] + 1]):
            x = block(x)
            if k in self._TAPS:
                found.append(x)
        return found

    def forward(self, picture: Tensor, target: Tensor, mask: Tensor) -> Tensor:
        with torch.no_grad():
            wanted = self.features(target * mask)
        pairs = zip(self.features(picture * mask), wanted, strict=True)
        return torch.stack([(a - b).abs().mean() / (b.abs().mean() + 1e-6) for a, b in pairs]).mean()


def load_perceptual(path: Path) -> Perceptual:
    """From the file that export.teachers.backbone writes."""
    trunk = MobileNetV2()
    trunk.load_state_dict(torch.load(path, map_location="cpu", weights_only=True))
    return Perceptual(trunk)
