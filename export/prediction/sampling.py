"""Draws the codes of a next frame. Recomputes everything for each cell, so it is slow: for images in training."""

from __future__ import annotations

import torch
from torch import Tensor

from export.prediction.config import CODE_SIDE
from export.prediction.transformer import LatentTransformer, times_of


@torch.no_grad()
def drawn_codes(
    net: LatentTransformer, before: Tensor, fps: Tensor, temperature: float, generator: torch.Generator
) -> Tensor:
    """before int64 [B, seen, slices, 16, 16]; fps [B] -> codes int64 [B, slices, 16, 16]. temperature 0: the
    likeliest of each."""
    context, prior = net.context(before, times_of(fps)), net.prior_logits(before)
    codes = torch.zeros_like(before[:, 0])
    for place in range(CODE_SIDE * CODE_SIDE):
        features = net.heads.norm(net.slices(context, codes)[:, place])
        known: list[Tensor] = []
        for k in range(net.shape.slices):
            logits = net.heads.slice_logits(features, k, known).float() + prior[:, k, place]
            if temperature > 0:
                chances = (logits / temperature).softmax(-1)
                known.append(torch.multinomial(chances, 1, generator=generator)[:, 0])
            else:
                known.append(logits.argmax(-1))
            codes[:, k, place // CODE_SIDE, place % CODE_SIDE] = known[-1]
    return codes
