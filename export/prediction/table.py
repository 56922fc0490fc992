"""How likely each code is after the one that its place had in the frame before, counted: what the transformer starts
from and must beat."""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor

_PRIOR_COUNT = 4.0  # as if so many more had been seen of what is likely without counting: the same code, or any
_SAME = 0.5  # of that, for the same code


@dataclass(frozen=True, eq=False)
class CodeTable:
    """Natural logarithms of probabilities. frequency [slices, K]: of a code by itself; after [slices, K, K]: of a code
    (last axis) after another one at its place."""

    frequency: Tensor
    after: Tensor

    @staticmethod
    def counted(codes: Tensor, entries: int) -> CodeTable:
        """From codes int64 [N, T, slices, 16, 16] of training clips."""
        slices = codes.shape[2]
        frequency, after = [], []
        for k in range(slices):
            own = codes[:, :, k]
            counts = torch.bincount(own.flatten(), minlength=entries).float() + 0.5
            frequency.append((counts / counts.sum()).log())
            pairs = torch.bincount((own[:, :-1] * entries + own[:, 1:]).flatten(), minlength=entries**2)
            pairs = pairs.view(entries, entries).float()
            likely = _SAME * torch.eye(entries) + (1 - _SAME) * frequency[-1].exp()
            smoothed = pairs + _PRIOR_COUNT * likely
            after.append((smoothed / smoothed.sum(1, keepdim=True)).log())
        return CodeTable(torch.stack(frequency), torch.stack(after))

    def stacked(self) -> Tensor:
        """[slices, K + 1, K]: `after`, and as the last row what holds where no frame was seen before."""
        return torch.cat([self.after, self.frequency[:, None]], 1)


def bits_by_frequency(table: CodeTable, codes: Tensor) -> Tensor:
    """Of every frame but the first, a code: float32 [N, T - 1]."""
    of = [-table.frequency[k][codes[:, 1:, k]] for k in range(codes.shape[2])]
    return torch.stack(of).mean((0, 3, 4)) / math.log(2)


def bits_by_table(table: CodeTable, codes: Tensor) -> Tensor:
    """Of every frame but the first, a code: float32 [N, T - 1]."""
    of = [-table.after[k][codes[:, :-1, k], codes[:, 1:, k]] for k in range(codes.shape[2])]
    return torch.stack(of).mean((0, 3, 4)) / math.log(2)
