"""Losses of the training: NPBG++ (arXiv 2203.13318), section 4."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn import functional as F

from export.scenes.config import COLOURS, LEVELS
from export.scenes.geometry.raster import filled
from export.scenes.perceptual import Perceptual


@dataclass(frozen=True)
class LossWeights:
    """quarter: L1 of images a quarter as wide. perceptual: see `Perceptual`. own: L1 of the target made from its own
    features; off, since three of them are the target's colours and little is left to learn. full: L1 of all pixels,
    which the paper does not have; PSNR is measured here too.

    The paper's 2500 for quarter goes with sums over VGG-19's features; ours are means.
    """

    quarter: float = 5.0
    perceptual: float = 0.5
    own: float = 0.0
    full: float = 1.0


def image_terms(
    picture: Tensor, target: Tensor, mask: Tensor, weights: LossWeights, perceptual: Perceptual | None
) -> dict[str, Tensor]:
    """Images RGB [N, 3, H, W], mask [N, 1, H, W] of the target's pixels that are there."""
    off = (picture - target) * mask
    share = mask.mean().clamp_min(1e-6)
    terms = {
        "quarter": weights.quarter * F.avg_pool2d(off, 4).abs().mean() / share,
        "full": weights.full * off.abs().mean() / share,
    }
    if perceptual is not None:
        terms["perceptual"] = weights.perceptual * perceptual(picture, target, mask)
    return terms


def own_rasters(features: Tensor) -> list[Tensor]:
    """An image's own features [N, 8, H, W] as if they were a dense cloud's: rasters [N, 9, H/2^k, W/2^k], with holes.

    A pixel of scale s stays with probability 1 - s / 2: holes are most frequent where points are sparse for pixels.
    """
    rasters = []
    for level in range(LEVELS):
        step = 2**level
        small = features[:, :, ::step, ::step]
        there = (torch.rand_like(small[:, :1]) < 1 - 0.5 / step).to(small)
        rasters.append(torch.cat([small, torch.ones_like(there)], 1) * there)
    return filled(rasters, features[:, :COLOURS].mean((0, 2, 3)))
