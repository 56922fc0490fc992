"""The edge networks in torch: the light U-Net that ships, and the published one as a reference."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from export.edges.config import FOLD, INPUT_PLANES, NetworkConfig


def _convolution(inputs: int, outputs: int, stride: int = 1) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, 3, stride, 1, bias=False), nn.BatchNorm2d(outputs), nn.ReLU(inplace=True)
    )


def _doubled(x: Tensor, like: Tensor) -> Tensor:
    """x as large as `like`, which is twice as large."""
    return F.interpolate(x, size=like.shape[2:], mode="nearest")


class Residual(nn.Module):
    """relu(x + f(x)) of planes that are not negative. It begins as the identity, so that a trained network without the
    block computes the same with it."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.first = _convolution(channels, channels)
        self.second = nn.Sequential(nn.Conv2d(channels, channels, 3, 1, 1, bias=False), nn.BatchNorm2d(channels))
        nn.init.zeros_(self.second[1].weight)

    def forward(self, x: Tensor) -> Tensor:
        return F.relu(x + self.second(self.first(x)))


class EdgeNetwork(nn.Module):
    """Folded slopes [N, 12, H / 2, W / 2] -> planes [N, P, H, W]; H and W multiples of `config.multiple`.

    Plain 3 x 3 convolutions, ReLU, skips by addition, residual blocks where `config.blocks` has some, the finest layers
    at half resolution, the best layout for int8 kernels (docs/research/scenes.md). Planes without a histogram:
    distance / EPS_R (0 to 1 where it is right, not cut off), logarithm of its spread, logits of crease and boundary.
    With one: logits of the bins, then those two. double: replaced where a graph is made.
    """

    double: Callable[[Tensor, Tensor], Tensor] = staticmethod(_doubled)

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        widths = config.widths
        self.stem = nn.Sequential(_convolution(INPUT_PLANES * FOLD**2, widths[0]), _convolution(widths[0], widths[0]))
        self.down = nn.ModuleList(nn.Sequential(_convolution(a, b, 2), _convolution(b, b)) for a, b in pairwise(widths))
        self.deep = nn.ModuleList(
            nn.Sequential(*(Residual(width) for _ in range(count)))
            for width, count in zip(widths[1:], config.blocks or (0,) * (len(widths) - 1), strict=True)
        )
        self.up = nn.ModuleList(nn.ModuleList([_convolution(b, a), _convolution(a, a)]) for a, b in pairwise(widths))
        self.head = nn.Conv2d(widths[0], config.planes * FOLD**2, 3, 1, 1)

    def features(self, x: Tensor) -> Tensor:
        """Planes as they leave the graph: [N, P 4, H / 2, W / 2], 2 x 2 pixels as channels."""
        skips = [self.stem(x)]
        for block, deep in zip(self.down, self.deep, strict=True):
            skips.append(deep(block(skips[-1])))
        x = skips.pop()
        for (narrow, join), skip in zip(reversed(self.up), reversed(skips), strict=True):
            x = join(self.double(narrow(x), skip) + skip)
        return self.head(x)

    def forward(self, x: Tensor) -> Tensor:
        return F.pixel_shuffle(self.features(x), FOLD)


class PublishedNetwork(nn.Module):
    """DEF-Image (arXiv 2011.15081): depth [N, 1, H, W], sides multiples of 16 -> bins' logits [N, 244, H, W].

    ResNet-152 from random weights with a first stride of 1 and shortcuts by average pooling, and a U-Net's decoder:
    78.63 M parameters. It needs a GPU; here it is a check of the description and a size to compare with.
    """

    def __init__(self, bins: int = 244) -> None:
        super().__init__()
        from torchvision.models.resnet import Bottleneck, ResNet

        trunk = ResNet(Bottleneck, [3, 8, 36, 3])
        trunk.conv1 = nn.Conv2d(1, 64, 7, 1, 3, bias=False)
        for stage in (trunk.layer2, trunk.layer3, trunk.layer4):
            convolution, norm = stage[0].downsample
            wide = nn.Conv2d(convolution.in_channels, convolution.out_channels, 1, bias=False)
            stage[0].downsample = nn.Sequential(nn.AvgPool2d(2), wide, norm)
        self.stem = nn.Sequential(trunk.conv1, trunk.bn1, trunk.relu)
        self.stages = nn.ModuleList(
            [nn.Sequential(trunk.maxpool, trunk.layer1), trunk.layer2, trunk.layer3, trunk.layer4]
        )
        sides = ((2048 + 1024, 512), (512 + 512, 256), (256 + 256, 128), (128 + 64, 64))
        self.decoder = nn.ModuleList(self._block(a, b) for a, b in sides)
        self.head = nn.Conv2d(64, bins, 3, 1, 1)

    @staticmethod
    def _block(inputs: int, outputs: int) -> nn.Sequential:
        layers: list[nn.Module] = []
        for a in (inputs, outputs):
            layers += [nn.Conv2d(a, outputs, 3, 1, 1, bias=False), nn.BatchNorm2d(outputs), nn.LeakyReLU(0.01)]
        return nn.Sequential(*layers)

    def forward(self, x: Tensor) -> Tensor:
        skips = [self.stem(x)]
        for stage in self.stages:
            skips.append(stage(skips[-1]))
        x = skips.pop()
        for block, skip in zip(self.decoder, reversed(skips), strict=True):
            # The published decoder doubles in front of each block; its last skip is at full resolution.
            x = F.interpolate(x, size=skip.shape[2:], mode="nearest")
            x = block(torch.cat([x, skip], 1))
        return self.head(x)
