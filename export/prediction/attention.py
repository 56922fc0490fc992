"""Attention over all cells of a frame, with a learnt bias for each step along rows and along columns."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from export.prediction.config import CODE_SIDE, TransformerShape

PLACES = CODE_SIDE * CODE_SIDE


class AttentionLayer(nn.Module):
    """Pre-norm attention and pre-norm two-layer network. masked: a cell sees itself and those before, row by row."""

    def __init__(self, shape: TransformerShape, masked: bool) -> None:
        super().__init__()
        inner = shape.heads * shape.head_width
        self.heads, self.masked = shape.heads, masked
        self.norm = nn.LayerNorm(shape.width)
        self.query_key_value = nn.Linear(shape.width, 3 * inner, bias=False)
        self.project = nn.Linear(inner, shape.width)
        self.rows = nn.Parameter(torch.zeros(shape.heads, 2 * CODE_SIDE - 1))
        self.columns = nn.Parameter(torch.zeros(shape.heads, 2 * CODE_SIDE - 1))
        self.network = nn.Sequential(
            nn.LayerNorm(shape.width), nn.Linear(shape.width, shape.hidden), nn.ReLU(),
            nn.Linear(shape.hidden, shape.width),
        )  # fmt: skip

    def bias(self) -> Tensor:
        """[heads, 256, 256]: added to the score of a query (row) and a key (column); -infinity where it is not seen."""
        axis = torch.arange(CODE_SIDE, device=self.rows.device)
        # A product, since the gradient of an indexed read is slow. [16, 16, 31]: which step leads from one to another.
        steps = F.one_hot(axis[:, None] - axis + CODE_SIDE - 1, 2 * CODE_SIDE - 1).to(self.rows.dtype)
        rows, columns = (torch.einsum("qks,hs->hqk", steps, table) for table in (self.rows, self.columns))
        bias = (rows[:, :, None, :, None] + columns[:, None, :, None, :]).flatten(3).flatten(1, 2)
        if self.masked:
            hidden = torch.ones(PLACES, PLACES, dtype=torch.bool, device=bias.device).triu(1)
            bias = bias.masked_fill(hidden, float("-inf"))
        return bias

    def forward(self, x: Tensor) -> Tensor:
        """[B, 256, width] -> the same."""
        query, key, value = self.query_key_value(self.norm(x)).unflatten(-1, (3, self.heads, -1)).permute(2, 0, 3, 1, 4)
        seen = F.scaled_dot_product_attention(query, key, value, attn_mask=self.bias()[None].to(query.dtype))
        x = x + self.project(seen.transpose(1, 2).flatten(2))
        return x + self.network(x)
