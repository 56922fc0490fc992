"""Codebooks, one a slice of the channels, learnt as exponential means of what they stand for (van den Oord et al.,
"Neural Discrete Representation Learning", appendix A.1)."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional as F

DECAY = 0.99
_EPSILON = 1e-5
_DEAD = 0.03  # of the mean count: an entry used less than that gets a new value
_REBORN = 0.06  # of the mean count: what an entry that was put elsewhere begins with, 70 steps from death
_REBIRTH_STEPS = 20


class Codebook(nn.Module):
    """entries [slices, K, width]. While training, entries follow the vectors that fall to them, and entries that no
    vector falls to are put where one of the batch is."""

    def __init__(self, slices: int, entries: int, width: int) -> None:
        super().__init__()
        self.register_buffer("entries", torch.randn(slices, entries, width))
        self.register_buffer("counts", torch.zeros(slices, entries))
        self.register_buffer("sums", torch.zeros(slices, entries, width))
        self.register_buffer("steps", torch.zeros((), dtype=torch.int64))

    def _vectors(self, x: Tensor) -> Tensor:
        """[B, slices * width, h, w] -> float32 [slices, B * h * w, width]."""
        slices, _, width = self.entries.shape
        return x.float().unflatten(1, (slices, width)).permute(1, 0, 3, 4, 2).flatten(1, 3)

    def _nearest(self, vectors: Tensor) -> Tensor:
        # |v|^2 is the same for all entries. In float32 whatever the network computes in: near ones differ by little.
        with torch.autocast(vectors.device.type, enabled=False):
            distance = self.entries.square().sum(-1)[:, None] - 2 * vectors @ self.entries.mT
        return distance.argmin(-1)

    @torch.no_grad()
    def nearest(self, x: Tensor) -> Tensor:
        """[B, slices * width, h, w] -> codes int64 [B, slices, h, w]; the lowest of equals."""
        batch, _, height, width = x.shape
        return self._nearest(self._vectors(x)).unflatten(1, (batch, height, width)).transpose(0, 1)

    def looked_up(self, codes: Tensor) -> Tensor:
        """Codes [B, slices, h, w] -> [B, slices * width, h, w]."""
        picked = [entries[codes[:, k]] for k, entries in enumerate(self.entries)]
        return torch.cat(picked, -1).permute(0, 3, 1, 2)

    def forward(self, x: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Quantized (gradients pass straight through), codes [B, slices, h, w], commitment (mean square)."""
        if self.training and not self.steps:
            self._start(x)
        codes = self.nearest(x)
        quantized = self.looked_up(codes)
        commitment = F.mse_loss(x.float(), quantized)
        if self.training:
            self._follow(x, codes)
        return x + (quantized - x).detach(), codes, commitment

    @torch.no_grad()
    def _start(self, x: Tensor) -> None:
        vectors = self._vectors(x)
        for k in range(len(self.entries)):
            self.entries[k] = vectors[k, torch.randint(vectors.shape[1], (self.entries.shape[1],))]
        self.counts.fill_(_REBORN * vectors.shape[1] / self.entries.shape[1])
        self.sums.copy_(self.entries * self.counts[..., None])

    @torch.no_grad()
    def _follow(self, x: Tensor, codes: Tensor) -> None:
        vectors = self._vectors(x)
        count = self.entries.shape[1]
        for k, own in enumerate(vectors):
            at = codes[:, k].flatten()
            self.counts[k].lerp_(torch.bincount(at, minlength=count).float(), 1 - DECAY)
            self.sums[k].lerp_(torch.zeros_like(self.sums[k]).index_add_(0, at, own), 1 - DECAY)
        self.steps += 1
        if self.steps % _REBIRTH_STEPS == 0:
            self._rebirth(vectors)
        total = self.counts.sum(1, keepdim=True)
        smoothed = (self.counts + _EPSILON) / (total + count * _EPSILON) * total
        self.entries.copy_(self.sums / smoothed[..., None])

    def _rebirth(self, vectors: Tensor) -> None:
        mean = vectors.shape[1] / self.entries.shape[1]
        for k in range(len(self.entries)):
            dead = (self.counts[k] < _DEAD * mean).nonzero()[:, 0]
            self.counts[k, dead] = _REBORN * mean
            chosen = vectors[k, torch.randint(vectors.shape[1], (len(dead),))]
            self.sums[k, dead] = chosen * _REBORN * mean


def used_fraction(codes: Tensor, entries: int) -> float:
    """Fraction of entries that occur, mean over slices. codes [B, slices, h, w]."""
    slices = codes.shape[1]
    return sum(len(codes[:, k].unique()) for k in range(slices)) / (slices * entries)
