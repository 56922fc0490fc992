"""How likely each code is after the one that its cell had in the frame before, counted: what the transformer starts
from and must beat."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import torch
from torch import Tensor

_PRIOR_COUNT = 4.0  # as if so many more had been seen of what is likely without counting: the same code, or any
_SAME = 0.5  # of that, for the same code


STAYS_AT_FIRST = 0.7  # how likely it is that a code stays as it is, before a stream has shown it
_RETURNS = 0.02  # of that weight, to each of the two, so that either may come back


@dataclass(frozen=True, eq=False)
class CodeTable:
    """Natural logarithms of probabilities. frequency [slices, K]: of a code by itself; after [slices, K, K]: of a code
    (last axis) after another one at its cell."""

    frequency: Tensor
    after: Tensor

    @staticmethod
    def counted(codes: Tensor, entries: int) -> CodeTable:
        """From codes [N, T, slices, 16, 16] of training clips; on their device."""
        slices = codes.shape[2]
        frequency, after = [], []
        for k in range(slices):
            own = codes[:, :, k].long()
            counts = torch.bincount(own.flatten(), minlength=entries).float() + 0.5
            frequency.append((counts / counts.sum()).log())
            pairs = torch.bincount((own[:, :-1] * entries + own[:, 1:]).flatten(), minlength=entries**2)
            pairs = pairs.view(entries, entries).float()
            likely = _SAME * torch.eye(entries, device=codes.device) + (1 - _SAME) * frequency[-1].exp()
            smoothed = pairs + _PRIOR_COUNT * likely
            after.append((smoothed / smoothed.sum(1, keepdim=True)).log())
        return CodeTable(torch.stack(frequency), torch.stack(after))

    @staticmethod
    def of_stacked(stacked: Tensor) -> CodeTable:
        """The inverse of `stacked`. Raises ValueError where a row is not of probabilities."""
        if not torch.allclose(stacked.double().logsumexp(-1).exp(), torch.ones(()).double(), atol=1e-3):
            raise ValueError("The table's rows are not probabilities: the transformer was trained without it.")
        return CodeTable(stacked[:, -1], stacked[:, :-1])

    def stacked(self) -> Tensor:
        """[slices, K + 1, K]: `after`, and as the last row what holds where no frame was seen before."""
        return torch.cat([self.after, self.frequency[:, None]], 1)


def bits_by_frequency(table: CodeTable, codes: Tensor) -> Tensor:
    """Mean bits a code of every frame but the first: float32 [N, T - 1]."""
    of = [-table.frequency[k][codes[:, 1:, k].long()] for k in range(codes.shape[2])]
    return torch.stack(of).mean((0, 3, 4)) / math.log(2)


def bits_by_table(table: CodeTable, codes: Tensor) -> Tensor:
    """Mean bits a code of every frame but the first: float32 [N, T - 1]."""
    of = [-table.after[k][codes[:, :-1, k].long(), codes[:, 1:, k].long()] for k in range(codes.shape[2])]
    return torch.stack(of).mean((0, 3, 4)) / math.log(2)


def bits_of_stream(
    frequency_bits: np.ndarray, after_bits: np.ndarray, codes: np.ndarray, predicted_bits: np.ndarray | None = None
) -> np.ndarray:
    """The SDK's bits of one stream: each code either stays or follows the table, or predicted_bits [T - 1, slices, 16,
    16] where these are given. Each cell learns which of the two from the frames so far: the posterior of two experts
    (Herbster and Warmuth, "Tracking the best expert", 1998). A cut is a frame with at least as many bits as its codes
    have by frequency alone; after it, cells have learnt nothing.

    frequency_bits float32 [slices, K], after_bits [slices, K, K], codes [T, slices, 16, 16] -> float64 [T - 1, slices,
    16, 16].
    """
    slices = np.arange(codes.shape[1])[:, None, None]
    at_first = np.full(codes.shape[1:], STAYS_AT_FIRST)
    stays, found = at_first, []
    for number, (before, now) in enumerate(pairwise(codes)):
        own = np.where(now == before, stays, 0)
        moves = after_bits[slices, before, now] if predicted_bits is None else predicted_bits[number]
        likely = own + (1 - stays) * np.exp2(-moves.astype(np.float64))
        found.append(-np.log2(likely))
        is_cut = found[-1].sum() >= frequency_bits[slices, now].sum()
        stays = at_first if is_cut else _RETURNS + (1 - 2 * _RETURNS) * own / likely
    return np.stack(found)
