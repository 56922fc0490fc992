"""Losses of the edge network: error of the distance, its predicted error, and the kind of edge.

The paper's histogram loss (arXiv 2011.15081, section 4.3 of its code's description) stands beside L1, L2 and a mixture
of both on one distance a pixel; docs/research/edges.md has the comparison.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn import functional as F

from export.edges.config import EPS_R, KINDS, SHARP_R

LOSSES = ("mixed", "l1", "l2", "histogram")
DECODINGS = ("expectation", "median", "mode")
NEAR_R = SHARP_R[-1]  # of an edge: pixels that say where it is
LOG_SPREAD = (-7.0, 1.0)  # of the spread in EPS_R: 0.015 to 43 r


@dataclass(frozen=True)
class LossWeights:
    """near: pixels within NEAR_R of an edge count so many times more. spread, kind: against the distance's own term."""

    near: float = 8.0
    spread: float = 0.02
    kind: float = 0.05


@dataclass(frozen=True)
class FieldTarget:
    """distance [N, H, W] in r, 0 to EPS_R; kind [N, H, W], int64: 0 none in reach, 1 crease, 2 boundary; counts
    [N, H, W], bool: depth and label are known."""

    distance: Tensor
    kind: Tensor
    counts: Tensor


def bin_centres(bins: int, like: Tensor) -> Tensor:
    """[bins], in r."""
    return (torch.arange(bins, device=like.device, dtype=torch.float32) + 0.5) * (EPS_R / bins)


def histogram_target(distance: Tensor, bins: int) -> Tensor:
    """Mass of a normal distribution of one bin's width around each distance, inside 0..EPS_R: [N, bins, H, W]."""
    width = EPS_R / bins
    rims = torch.arange(bins + 1, device=distance.device, dtype=torch.float32) * width
    below = torch.special.ndtr((rims[:, None, None] - distance[:, None]) / width)
    mass = below[:, 1:] - below[:, :-1]
    return mass / mass.sum(1, keepdim=True)


def decoded(planes: Tensor, bins: int, decoding: str = "expectation") -> tuple[Tensor, Tensor]:
    """Planes of the network [N, P, H, W] -> distance and its spread (mean absolute error it expects), in r."""
    if not bins:
        return (planes[:, 0] * EPS_R).clamp(0, EPS_R), planes[:, 1].clamp(*LOG_SPREAD).exp() * EPS_R
    share = planes[:, :bins].softmax(1)
    centres = bin_centres(bins, planes)[:, None, None]
    mean = (share * centres).sum(1)
    spread = (share * (centres - mean[:, None]).abs()).sum(1)
    if decoding == "mode":
        mean = centres.flatten()[share.argmax(1)]
    elif decoding == "median":
        below = share.cumsum(1)
        at = (below < 0.5).sum(1, keepdim=True).clamp_max(bins - 1)
        inside = share.gather(1, at)
        before = below.gather(1, at) - inside
        mean = (at + (0.5 - before) / inside.clamp_min(1e-9)).squeeze(1) * (EPS_R / bins)
    return mean, spread


def field_terms(planes: Tensor, target: FieldTarget, bins: int, loss: str, weights: LossWeights) -> dict[str, Tensor]:
    """The loss's terms over pixels that count. planes: [N, P, H, W], float32."""
    counts = target.counts.float()
    near = target.distance < NEAR_R
    weight = counts * (1 + weights.near * near)
    total = weight.sum().clamp_min(1)
    if bins:
        pixel = F.cross_entropy(planes[:, :bins], histogram_target(target.distance, bins), reduction="none")
        terms = {"distance": (pixel * weight).sum() / total}
    else:
        error = planes[:, 0] - target.distance / EPS_R
        # Beyond EPS_R nothing is known: what is above 1 is right there.
        error = torch.where(target.distance >= EPS_R, error.clamp_max(0), error)
        pixel = error.abs() if loss == "l1" else 8 * error**2
        if loss == "mixed":
            # Beside an edge the median is sharp and the mean is not; farther away the mean makes the smaller RMSE.
            pixel = torch.where(near, error.abs(), pixel)
        spread = planes[:, 1].clamp(*LOG_SPREAD)
        own = error.detach().abs() * torch.exp(-spread) + spread
        terms = {"distance": (pixel * weight).sum() / total}
        terms["spread"] = weights.spread * (own * counts).sum() / counts.sum().clamp_min(1)
    known = (target.kind > 0) & target.counts
    wanted = torch.stack([target.kind == k + 1 for k in range(KINDS)], 1).float()
    kind = F.binary_cross_entropy_with_logits(planes[:, -KINDS:], wanted, reduction="none").mean(1)
    terms["kind"] = weights.kind * (kind * known).sum() / known.sum().clamp_min(1)
    return terms
