"""Gives the learnt features the range of the colours, in networks that compute the same images.

Features are scaled in the extractor's last layer and back in those of the refiner that read rasters; what lies between,
a regression for each point, is linear in them. Eight bits hold all channels of a raster with one scale: beside features
of -5 .. 5 colours would have 25 steps. It also gives the SDK's `min_variation` one meaning for all features.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable

import torch
from torch import Tensor, nn

from export.scenes.config import COLOURS, FEATURES, RASTER
from export.scenes.networks.system import Networks

SHARE = 0.999  # of a feature's values are within -0.5 .. 0.5 afterwards
MAX_DIFFERENCE = 0.1  # of a feature's variance may differ between a bundle and its weights; 8 bits are about 0.001


@torch.no_grad()
def measured(networks: Networks, images: Iterable[Tensor]) -> Tensor:
    """Factors [5] of the learnt features, from photos [1, 3, H, W], sides multiples of 32. Raises ValueError without
    photos."""
    reaches = []
    for image in images:
        learnt = networks.extractor(image)[0, COLOURS:].flatten(1)
        reaches.append(learnt.abs().quantile(SHARE, dim=1) if learnt.shape[1] < 1 << 24 else learnt.abs().amax(1))
    if not reaches:
        raise ValueError("there is no photo to measure features on")
    return 0.5 / torch.stack(reaches).mean(0).clamp_min(1e-6)


@torch.no_grad()
def factors_between(networks: Networks, image: Tensor, features: Tensor) -> Tensor:
    """Factors [5] that a bundle's features [1, 8, H, W] of a photo [1, 3, H, W] are larger by than those of the weights
    that it was made of: a bundle need not say how it was scaled. Raises ValueError where they are of other weights."""
    own, theirs = (x[0, COLOURS:].flatten(1).double() for x in (networks.extractor(image), features))
    factors = (own * theirs).sum(1) / own.square().sum(1).clamp_min(1e-12)
    apart = (theirs - factors[:, None] * own).square().sum(1) / theirs.square().sum(1).clamp_min(1e-12)
    if not (factors > 0).all() or not float(apart.max()) <= MAX_DIFFERENCE:
        raise ValueError(
            f"the bundle's extractor is not made of these weights: {float(apart.max()):.0%} of a feature differ"
        )
    return factors.float()


@torch.no_grad()
def scaled(networks: Networks, factors: Tensor) -> Networks:
    """A copy whose learnt features are `factors` [5] times as large and whose images are the same."""
    result = copy.deepcopy(networks)
    result.extractor.final.weight *= factors[:, None, None, None]
    refiner = result.refiner
    back = torch.ones(RASTER)
    back[COLOURS:FEATURES] = 1 / factors
    _scale_inputs(refiner.start[0], back.repeat(5))  # four pixels of the finest raster, and the next one's
    for width, block in zip(refiner.config.widths, refiner.down, strict=False):
        _scale_inputs(block[0], torch.cat([torch.ones(width), back]))
    return result


def _scale_inputs(layer: nn.Conv2d, factors: Tensor) -> None:
    layer.weight *= factors[None, :, None, None]
