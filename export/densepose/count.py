"""Prints how many parameters and multiply-adds the network has.

    python -m export.densepose.count

Parameters: all that are trained, and in brackets without batch normalisation (as the paper counts).
Multiply-adds (MAC) of convolutions and matrix products: per pixel of the detector's input, per proposal,
per person.
"""

from __future__ import annotations

import argparse

import torch
from torch import Tensor, nn

from export.densepose.config import NetworkConfig
from export.densepose.network import MobileParsingRCNN

PAPER_MILLIONS = {64: 3.35, 88: 3.82, 112: 4.41}  # BiFPN variants of "Making DensePose Fast and Light"
PARTS = ("backbone", "neck", "rpn", "box_head", "dense_head")


def parameters(module: nn.Module, batch_norm: bool = True) -> int:
    """Number of trained values, with or without those of batch normalisation."""
    norms = [m for m in module.modules() if isinstance(m, nn.BatchNorm2d)]
    total = sum(p.numel() for p in module.parameters())
    return total if batch_norm else total - sum(p.numel() for m in norms for p in m.parameters())


def _macs(module: nn.Module, output: Tensor) -> int:
    if isinstance(module, nn.ConvTranspose2d):
        # Each output pixel of a stride-s transposed convolution meets kernel / s^2 taps.
        taps = module.kernel_size[0] * module.kernel_size[1] / (module.stride[0] * module.stride[1])
        return round(output.numel() * taps * module.in_channels / module.groups)
    if isinstance(module, nn.Conv2d):
        taps = module.kernel_size[0] * module.kernel_size[1]
        return output.numel() * taps * module.in_channels // module.groups
    return output.numel() * module.in_features


@torch.no_grad()
def macs(net: MobileParsingRCNN, height: int = 256, width: int = 320) -> dict[str, int]:
    """Multiply-adds by part: the first three for one image of the given size, the heads for one RoI."""
    net = net.eval()
    count = dict.fromkeys(PARTS, 0)
    owner = {id(m): part for part in PARTS for m in getattr(net, part).modules()}

    def add(module: nn.Module, _: tuple, output: Tensor) -> None:
        count[owner[id(module)]] += _macs(module, output)

    kinds = nn.Conv2d | nn.ConvTranspose2d | nn.Linear
    hooks = [m.register_forward_hook(add) for m in net.modules() if isinstance(m, kinds)]
    config = net.config
    net.detector(torch.zeros(1, 3, height, width))
    net.box_head(torch.zeros(1, config.width, config.box_pool, config.box_pool))
    net.dense_head(torch.zeros(1, config.width, config.dense_pool, config.dense_pool))
    for hook in hooks:
        hook.remove()
    return count


def main() -> None:
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    height, width = 256, 320
    for channels, paper in PAPER_MILLIONS.items():
        net = MobileParsingRCNN(NetworkConfig(width=channels))
        total, plain = parameters(net), parameters(net, batch_norm=False)
        print(
            f"\nwidth {channels}: {total / 1e6:.3f} M parameters ({plain / 1e6:.3f} M), "
            f"paper {paper} M, {total / paper / 1e4 - 100:+.1f} %"
        )
        work = macs(net, height, width)
        for part in PARTS:
            per_image = part in PARTS[:3]
            roi = "proposal" if part == "box_head" else "person"
            unit = "MAC per input pixel" if per_image else f"M MAC per {roi}"
            value = work[part] / (height * width) if per_image else work[part] / 1e6
            print(f"  {part:11} {parameters(getattr(net, part)) / 1e3:8.1f} k parameters {value:9.2f} {unit}")
        print(f"  detector at {width} x {height}: {sum(work[p] for p in PARTS[:3]) / 1e6:.0f} M MAC")


if __name__ == "__main__":
    main()
