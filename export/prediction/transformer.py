"""The transformer over codes: a context network sees the frames before, a masked slice network the codes of the frame
that were given already, and a chain of heads gives the slices of a cell one after another.

Departures from the paper: taps in time that never see anything are left out; the time from frame to frame takes the
place of the frame's number, which ends at 16; probabilities start from a table (`table.py`); the image that motion
alone predicts is seen as one more frame.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from export.prediction.attention import PLACES, AttentionLayer
from export.prediction.config import CODE_SIDE, TransformerShape

UNSEEN = -1  # code of a frame before the stream's first


class ContextNetwork(nn.Module):
    """Codes of the frames before and of the frame that motion predicts -> features of each cell of the next frame."""

    def __init__(self, shape: TransformerShape) -> None:
        super().__init__()
        self.shape = shape
        # A convolution in time of one-hots is a sum of rows; the row after the last stands for unseen codes and is 0.
        rows = shape.seen * shape.slices * shape.entries
        self.rows = nn.Embedding(rows + 1, shape.embedding, padding_idx=rows)
        nn.init.normal_(self.rows.weight, std=(shape.seen * shape.slices) ** -0.5)
        self.rows.weight.data[-1] = 0
        self.time_step = nn.Linear(1, shape.embedding)
        self.widen = nn.Linear(shape.embedding, shape.width)
        self.layers = nn.Sequential(*(AttentionLayer(shape, masked=False) for _ in range(shape.layers)))

    def forward(self, before: Tensor, times: Tensor) -> Tensor:
        """before int64 [B, seen, slices, 16, 16], oldest first, UNSEEN where there was none; times [B, 1] of
        `times_of` -> [B, 256, width]."""
        shape = self.shape
        codes = before.flatten(3).flatten(1, 2).transpose(1, 2)  # [B, 256, seen * slices]
        first = torch.arange(codes.shape[-1], device=codes.device) * shape.entries
        at = torch.where(codes == UNSEEN, self.rows.padding_idx, codes + first)
        summed = self.rows(at).sum(2) + self.time_step(times)[:, None]
        return self.layers(self.widen(summed))


def times_of(fps: Tensor) -> Tensor:
    """[B] -> [B, 1]: what the context network is told of the time from frame to frame."""
    return torch.log2(10 / fps)[:, None]


def sinusoids(width: int) -> Tensor:
    """Positions of 16 x 16 places: half of the channels by row, half by column; [256, width]."""
    rate = torch.exp(-math.log(1000) * torch.arange(width // 4) / (width // 4))
    parts = []
    for axis in (torch.arange(PLACES) // CODE_SIDE, torch.arange(PLACES) % CODE_SIDE):
        angle = axis[:, None] * rate
        parts += [angle.sin(), angle.cos()]
    return torch.cat(parts, 1)


class SliceNetwork(nn.Module):
    """Context and the codes of the frame at cells before -> features of each cell, which no later code reaches."""

    def __init__(self, shape: TransformerShape) -> None:
        super().__init__()
        self.slices, self.entries = shape.slices, shape.entries
        self.rows = nn.Embedding(shape.slices * shape.entries, shape.embedding)
        nn.init.normal_(self.rows.weight, std=shape.slices**-0.5)
        # Sees two rows above, three cells wide, and the left neighbour.
        self.above = nn.Conv2d(shape.embedding, shape.width, (2, 3))
        self.left = nn.Conv2d(shape.embedding, shape.width, 1, bias=False)
        self.from_context = nn.Linear(shape.width, shape.width)
        self.register_buffer("positions", sinusoids(shape.width), persistent=False)
        self.layers = nn.Sequential(*(AttentionLayer(shape, masked=True) for _ in range(shape.layers_of_slices)))

    def forward(self, context: Tensor, codes: Tensor) -> Tensor:
        """context [B, 256, width]; codes int64 [B, slices, 16, 16] -> [B, 256, width]."""
        first = torch.arange(self.slices, device=codes.device) * self.entries
        summed = self.rows(codes + first[:, None, None]).sum(1).permute(0, 3, 1, 2)
        above = self.above(F.pad(summed, (1, 1, 2, 0))[:, :, :-1])
        near = above + self.left(F.pad(summed, (1, 0))[..., :-1])
        return self.layers(near.flatten(2).transpose(1, 2) + self.positions + self.from_context(context))


class ChannelHeads(nn.Module):
    """Features of a cell, and the slices of it that are known -> logits of the next slice."""

    def __init__(self, shape: TransformerShape) -> None:
        super().__init__()
        self.norm = nn.LayerNorm(shape.width)
        self.hidden = nn.ModuleList(nn.Linear(shape.width, shape.width) for _ in range(shape.slices))
        self.earlier = nn.ModuleList(
            nn.ModuleList(nn.Embedding(shape.entries, shape.width) for _ in range(k)) for k in range(shape.slices)
        )
        self.out = nn.ModuleList(nn.Linear(shape.width, shape.entries) for _ in range(shape.slices))
        for table in self.earlier.modules():
            if isinstance(table, nn.Embedding):
                nn.init.normal_(table.weight, std=0.1)
        for layer in self.out:  # so that the probabilities begin as those of the table
            nn.init.zeros_(layer.weight)
            nn.init.zeros_(layer.bias)

    def slice_logits(self, features: Tensor, k: int, earlier: list[Tensor]) -> Tensor:
        """features [..., width] normalised by `norm`; codes [...] of slices 0 to k - 1 -> [..., K] of slice k."""
        hidden = self.hidden[k](features)
        for table, codes in zip(self.earlier[k], earlier, strict=True):
            hidden = hidden + table(codes)
        return self.out[k](F.relu(hidden))

    def forward(self, features: Tensor, codes: Tensor) -> Tensor:
        """features [B, 256, width]; codes int64 [B, slices, 256] -> [B, slices, 256, K]."""
        features, known = self.norm(features), list(codes.unbind(1))
        return torch.stack([self.slice_logits(features, k, known[:k]) for k in range(len(known))], 1)


class LatentTransformer(nn.Module):
    """table [slices, K + 1, K]: log-probabilities added to the logits, by the code that the cell had before (K: none).
    Zeros: no table."""

    def __init__(self, shape: TransformerShape) -> None:
        super().__init__()
        self.shape = shape
        self.context, self.slices, self.heads = ContextNetwork(shape), SliceNetwork(shape), ChannelHeads(shape)
        self.register_buffer("table", torch.zeros(shape.slices, shape.entries + 1, shape.entries))

    def prior_logits(self, before: Tensor, tables: Tensor | None = None, which: Tensor | None = None) -> Tensor:
        """before [B, seen, slices, 16, 16] -> [B, slices, 256, K] of the table: the network's own, or number which [B]
        of `tables` [n, slices, K + 1, K]."""
        last = before[:, self.shape.frames - 1].flatten(2)
        last = torch.where(last == UNSEEN, self.shape.entries, last)
        if tables is None:
            return torch.stack([self.table[k][last[:, k]] for k in range(self.shape.slices)], 1)
        return torch.stack([tables[which[:, None], k, last[:, k]] for k in range(self.shape.slices)], 1)

    def forward(
        self,
        before: Tensor,
        codes: Tensor,
        fps: Tensor,
        tables: Tensor | None = None,
        which: Tensor | None = None,
    ) -> Tensor:
        """Logits float32 [B, slices, 256, K] of each code of a frame given those before it in the frame.

        before int64 [B, seen, slices, 16, 16], oldest first; codes int64 [B, slices, 16, 16]: of the frame itself;
        fps [B]; tables, which: instead of the network's own table, as in `prior_logits`.
        """
        features = self.slices(self.context(before, times_of(fps)), codes)
        return self.heads(features, codes.flatten(2)).float() + self.prior_logits(before, tables, which)


def unreachable_parameters(shape: TransformerShape) -> int:
    """Number of the published network's parameters that never see any input: four of seven taps in time of the context,
    and 20 of 27 taps of the slice network's masked convolution. This network omits them; with them it has 49.9 M."""
    context = 4 * shape.slices * shape.entries * shape.embedding
    return context + 20 * shape.embedding * shape.width
