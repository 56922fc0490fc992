"""The networks of dense pose, and others with their trunk and neck, written more simply: what is exported."""

from __future__ import annotations

import copy
from typing import TypeVar

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from export.densepose.network import Aspp, Fusion
from export.onnx_graphs import doubled, fold_batch_norm

Network = TypeVar("Network", bound=nn.Module)


class FixedFusion(nn.Module):
    """`Fusion` with its normalised weights as plain numbers."""

    def __init__(self, fusion: Fusion) -> None:
        super().__init__()
        weight = F.relu(fusion.weight.detach().double())
        self.weight = (weight / (weight.sum() + 1e-4)).tolist()

    def forward(self, *maps: Tensor) -> Tensor:
        return sum(weight * x for weight, x in zip(self.weight, maps, strict=True))


class SplitAspp(nn.Module):
    """`Aspp`, its batch normalisation folded, whose mixture takes the maps and the context apart, then adds."""

    def __init__(self, aspp: Aspp) -> None:
        super().__init__()
        self.branches, self.context = aspp.branches, aspp.context
        width, mix = aspp.context.out_channels, aspp.mix[0]
        maps, weight = width * len(aspp.branches), mix.weight.detach()
        self.mix_maps = nn.Conv2d(maps, width, 1)
        self.mix_context = nn.Conv2d(width, width, 1, bias=False)
        self.mix_maps.weight.data.copy_(weight[:, :maps])
        self.mix_maps.bias.data.copy_(mix.bias.detach())
        self.mix_context.weight.data.copy_(weight[:, maps:])

    def forward(self, x: Tensor) -> Tensor:
        maps = torch.cat([branch(x) for branch in self.branches], 1)
        context = F.relu(self.context(F.adaptive_avg_pool2d(x, 1)))
        return F.relu(self.mix_maps(maps) + self.mix_context(context))


def simplified(net: Network) -> Network:
    """A copy in evaluation mode that computes the same with fewer operations. `net.neck` is a BiFPN.

    Batch normalisation is folded into the convolutions, the fusion weights are constants, and the image-wide ASPP
    branch is added after its part of the 1x1 mixture instead of being spread over the map first.
    """
    net = copy.deepcopy(net).cpu().float().eval().requires_grad_(False)
    fold_batch_norm(net)
    for module in list(net.modules()):
        for name, child in module.named_children():
            if isinstance(child, Fusion):
                setattr(module, name, FixedFusion(child))
            elif isinstance(child, Aspp):
                setattr(module, name, SplitAspp(child))
    net.neck.up = doubled
    if getattr(net, "evidence", None) is not None:
        net.evidence.up = doubled
    return net.eval().requires_grad_(False)
