"""The parallel transformer as one ONNX graph: codes of the frames before -> what the decoder is given of the frame that
is expected.

`expected.onnx`: before float32 [1, seen * slices, 256], codes of the frames before, oldest first, and last those of
what motion predicts, -1 where there are none; times [1, 2] of `times_ahead` -> features [1, 16, 16, slices * entry's
width], the mean of the entries by their probabilities.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional as F

from export.densepose.graphs import session
from export.onnx_graphs import largest_difference, write_graph
from export.prediction.attention import PLACES
from export.prediction.config import CODE_SIDE
from export.prediction.parallel import ParallelTransformer, times_ahead
from export.prediction.transformer import UNSEEN

EXPECTED = "expected"
TOLERANCE = 1e-4  # largest |ONNX - torch|, relative to the largest number


class ExpectedGraph(nn.Module):
    """entries float32 [slices, K, width]: of the codebooks."""

    def __init__(self, net: ParallelTransformer, entries: Tensor) -> None:
        super().__init__()
        self.context, self.slices, self.heads = net.context, net.slices, net.heads
        self.slice_count = net.shape.slices
        self.register_buffer("first", torch.arange(net.shape.seen * net.shape.slices)[:, None] * net.shape.entries)
        # Nothing of the frame is known, so that what places see of each other before attention is always the same.
        masked = net.slices.masked.detach()[None, :, None, None].expand(1, -1, CODE_SIDE, CODE_SIDE)
        near = net.slices.near(masked).flatten(2).transpose(1, 2) + net.slices.positions
        self.register_buffer("near", near.detach())
        for k, own in enumerate(entries):
            self.register_buffer(f"entries_{k}", own.clone())

    def forward(self, before: Tensor, times: Tensor) -> Tensor:
        own = self.context
        at = torch.where(before < 0, own.rows.padding_idx, before + self.first).long()
        summed = own.rows(at).sum(1) + own.time_step(times)[:, None]
        context = own.layers(own.widen(summed))
        features = self.heads.norm(self.slices.layers(self.near + self.slices.from_context(context)))
        chances: list[Tensor] = []
        for k in range(self.slice_count):
            hidden = self.heads.hidden[k](features)
            for table, likely in zip(self.heads.earlier[k], chances, strict=True):
                hidden = hidden + likely @ table.weight
            chances.append(self.heads.out[k](F.relu(hidden)).softmax(-1))
        mean = torch.cat([likely @ self.get_buffer(f"entries_{k}") for k, likely in enumerate(chances)], -1)
        return mean.unflatten(1, (CODE_SIDE, CODE_SIDE))


@torch.no_grad()
def export_expected(net: ParallelTransformer, entries: Tensor, folder: Path) -> float:
    """Writes the graph; returns how far it is from torch. Raises ValueError where that is too far."""
    shape = net.eval().float().shape
    rng = np.random.default_rng(0)
    codes = rng.integers(shape.entries, size=(1, shape.seen, shape.slices, CODE_SIDE, CODE_SIDE))
    codes[:, 0] = UNSEEN
    before, times = torch.from_numpy(codes), times_ahead(torch.tensor([15.0]), torch.tensor([4.0]))
    chances = net.expected(before, times)
    expected = torch.cat([likely @ rows for likely, rows in zip(chances, entries, strict=True)], -1)
    given = before.view(1, -1, PLACES).float()
    path = folder / f"{EXPECTED}.onnx"
    write_graph(ExpectedGraph(net, entries), [given, times], path, ["before", "times"], ["features"])
    (made,) = session(path).run(None, {"before": given.numpy(), "times": times.numpy()})
    error = largest_difference(expected.view(made.shape).numpy(), made)
    if not error <= TOLERANCE:
        raise ValueError(f"{path} differs from torch by {error:.1e} of its largest value.")
    return error
