"""The transformer that gives all codes of a frame at once, any time ahead: every code is either known or masked, each
place sees all others, and what is likeliest can be taken as known for a next pass (MaskGIT, arXiv 2202.04200).

Beside the causal network it is told how far ahead the frame is, and has no table. A pass with everything masked gives
the expected frame.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from export.prediction.attention import AttentionLayer
from export.prediction.config import TransformerShape
from export.prediction.transformer import ChannelHeads, ContextNetwork, sinusoids


def times_ahead(fps: Tensor, frames: Tensor) -> Tensor:
    """[B], [B] -> [B, 2]: time from frame to frame, and time to the frame that is wanted."""
    return torch.log2(torch.stack([10 / fps, 10 * frames / fps], 1))


class OpenSlices(nn.Module):
    """Context and the codes that are known -> features of each place."""

    def __init__(self, shape: TransformerShape) -> None:
        super().__init__()
        self.slices, self.entries = shape.slices, shape.entries
        self.rows = nn.Embedding(shape.slices * shape.entries, shape.embedding)
        nn.init.normal_(self.rows.weight, std=shape.slices**-0.5)
        self.masked = nn.Parameter(torch.randn(shape.embedding))
        self.near = nn.Conv2d(shape.embedding, shape.width, 3, padding=1)
        self.from_context = nn.Linear(shape.width, shape.width)
        self.register_buffer("positions", sinusoids(shape.width), persistent=False)
        self.layers = nn.Sequential(*(AttentionLayer(shape, masked=False) for _ in range(shape.layers)))

    def forward(self, context: Tensor, codes: Tensor, known: Tensor) -> Tensor:
        """context [B, 256, width]; codes int64 [B, slices, 16, 16], any where not known; known bool [B, 16, 16] ->
        [B, 256, width]."""
        first = torch.arange(self.slices, device=codes.device) * self.entries
        summed = self.rows(codes + first[:, None, None]).sum(1)
        summed = torch.where(known[..., None], summed, self.masked).permute(0, 3, 1, 2)
        near = self.near(summed).flatten(2).transpose(1, 2)
        return self.layers(near + self.positions + self.from_context(context))


class ParallelTransformer(nn.Module):
    def __init__(self, shape: TransformerShape) -> None:
        super().__init__()
        self.shape = shape
        self.context, self.slices, self.heads = ContextNetwork(shape, times=2), OpenSlices(shape), ChannelHeads(shape)

    def forward(self, before: Tensor, codes: Tensor, known: Tensor, times: Tensor) -> Tensor:
        """Logits float32 [B, slices, 256, K] of every code given those that are known, and slices before it at its
        place.

        before int64 [B, seen, slices, 16, 16], oldest first; codes int64 [B, slices, 16, 16] of the frame itself; known
        bool [B, 16, 16]; times [B, 2] of `times_ahead`.
        """
        features = self.slices(self.context(before, times), codes, known)
        return self.heads(features, codes.flatten(2)).float()

    def expected(self, before: Tensor, times: Tensor) -> list[Tensor]:
        """Probabilities of each slice's codes with nothing known, [slices] of [B, 256, K]. A slice is given the
        expected row of those before it, not each of them in turn."""
        none = torch.zeros(len(before), *before.shape[-2:], dtype=torch.bool, device=before.device)
        features = self.slices(self.context(before, times), torch.zeros_like(before[:, 0]), none)
        features, found = self.heads.norm(features), []
        for k in range(self.shape.slices):
            hidden = self.heads.hidden[k](features)
            for table, chances in zip(self.heads.earlier[k], found, strict=True):
                hidden = hidden + chances @ table.weight
            found.append(self.heads.out[k](F.relu(hidden)).float().softmax(-1))
        return found
