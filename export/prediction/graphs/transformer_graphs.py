"""The transformer as ONNX graphs for a runtime that keeps keys and values: what was computed for cells before is not
computed again. Look-ups, sums of embedded codes and the relative bias of the slice network are the runtime's
(`graph_runtime.py`).

`context.onnx`, once a frame: summed [1, 256, embedding], time_step [1, 1] (log2 of 10 / fps) -> context
[1, 256, width].

`slices.onnx`, for R cells of each of N samples of the frame that is made: context [N, R, width] of theirs; near
[N, R, 7 * embedding], the embedded codes of two rows above, three wide, and of the left neighbour; of each layer keys_l
and values_l [N, heads, C, head_width] of cells before, and bias_l [heads, R, C + R], added to the scores of those and
of the R cells themselves, -infinity where a cell is not seen -> features [N, R, width], and new_keys_l, new_values_l
[N, heads, R, head_width]. One cell at a time: R = 1, C = 256; a whole frame at once: R = 256, C = 0.

`head_k.onnx`: features [N, R, width], earlier [N, R, width] (sum of the tables of slices before) -> logits [N, R, K].
"""

from __future__ import annotations

from pathlib import Path

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from export.onnx_graphs import write_graph
from export.prediction.attention import PLACES, AttentionLayer
from export.prediction.transformer import LatentTransformer

NEIGHBOURS = ((-2, -1), (-2, 0), (-2, 1), (-1, -1), (-1, 0), (-1, 1), (0, -1))  # row, column of each part of `near`
CONTEXT, SLICES = "context", "slices"  # graphs


def head_name(k: int) -> str:
    """The graph that gives the logits of slice k."""
    return f"head_{k}"


class ContextGraph(nn.Module):
    """With what the slice network adds to its context: a matrix and positions."""

    def __init__(self, net: LatentTransformer) -> None:
        super().__init__()
        self.context, self.from_context = net.context, net.slices.from_context
        self.register_buffer("positions", net.slices.positions)

    def forward(self, summed: Tensor, time_step: Tensor) -> Tensor:
        own = self.context
        embedded = summed + own.time_step(time_step)[:, None]
        return self.from_context(own.layers(own.widen(embedded))) + self.positions


class CachedLayer(nn.Module):
    """`AttentionLayer` for some cells, with keys and values of others given."""

    def __init__(self, layer: AttentionLayer) -> None:
        super().__init__()
        self.layer, joint = layer, layer.query_key_value
        # The scale of scores lies in the queries: there are fewer of these.
        weight = joint.weight.detach().clone()
        inner = len(weight) // 3
        weight[:inner] *= (inner // layer.heads) ** -0.5
        self.query_key_value = nn.Linear(joint.in_features, joint.out_features, bias=False)
        self.query_key_value.weight.data = weight

    def forward(self, x: Tensor, keys: Tensor, values: Tensor, bias: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        layer = self.layer
        parts = self.query_key_value(layer.norm(x)).chunk(3, -1)
        query, key, value = (part.unflatten(-1, (layer.heads, -1)).transpose(1, 2) for part in parts)
        # Two products instead of one over all keys: the kept ones are read where they lie.
        scores = torch.cat([query @ keys.transpose(2, 3), query @ key.transpose(2, 3)], -1) + bias
        attention, kept = scores.softmax(-1), keys.shape[2]
        seen = attention[..., :kept] @ values + attention[..., kept:] @ value
        x = x + layer.project(seen.transpose(1, 2).flatten(2))
        return x + layer.network(x), key, value


class SliceGraph(nn.Module):
    def __init__(self, net: LatentTransformer) -> None:
        super().__init__()
        slices = net.slices
        above, left = slices.above, slices.left
        # Taps in the order of NEIGHBOURS.
        weight = torch.cat([above.weight.flatten(2), left.weight.flatten(2)], 2).permute(0, 2, 1).flatten(1)
        self.near = nn.Linear(weight.shape[1], weight.shape[0])
        self.near.weight.data, self.near.bias.data = weight.detach(), above.bias.detach()
        self.layers = nn.ModuleList(CachedLayer(layer) for layer in slices.layers)
        self.norm = net.heads.norm

    def forward(self, context: Tensor, near: Tensor, *caches: Tensor) -> tuple[Tensor, ...]:
        """caches: keys, values and bias of the first layer, of the second, ..."""
        x, new = self.near(near) + context, []
        for k, layer in enumerate(self.layers):
            x, key, value = layer(x, *caches[3 * k : 3 * k + 3])
            new += [key, value]
        return (self.norm(x), *new)


class HeadGraph(nn.Module):
    def __init__(self, net: LatentTransformer, k: int) -> None:
        super().__init__()
        self.hidden, self.out = net.heads.hidden[k], net.heads.out[k]

    def forward(self, features: Tensor, earlier: Tensor) -> Tensor:
        return self.out(F.relu(self.hidden(features) + earlier))


def slice_names(layers: int) -> tuple[list[str], list[str]]:
    """Names of inputs and outputs of `slices.onnx`."""
    caches = [f"{name}_{k}" for k in range(layers) for name in ("keys", "values", "bias")]
    new = [f"new_{name}_{k}" for k in range(layers) for name in ("keys", "values")]
    return ["context", "near", *caches], ["features", *new]


@torch.no_grad()
def write_transformer_graphs(net: LatentTransformer, folder: Path) -> None:
    """Writes all graphs of a transformer into a folder."""
    net, shape = net.eval().float(), net.shape
    folder.mkdir(parents=True, exist_ok=True)
    summed = torch.zeros(1, PLACES, shape.embedding)
    names = ["summed", "time_step"], ["context"]
    write_graph(ContextGraph(net), [summed, torch.zeros(1, 1)], folder / f"{CONTEXT}.onnx", *names)
    samples, rows, kept = 2, 3, 5  # any sizes that differ: those of the graph stay open
    kept_shape = (samples, shape.heads, kept, shape.head_width)
    caches = [
        torch.zeros(size)
        for _ in range(shape.layers_of_slices)
        for size in (kept_shape, kept_shape, (shape.heads, rows, kept + rows))
    ]
    near = torch.zeros(samples, rows, len(NEIGHBOURS) * shape.embedding)
    given = [torch.zeros(samples, rows, shape.width), near, *caches]
    inputs, outputs = slice_names(shape.layers_of_slices)
    axes: dict[str, dict[int, str]] = {name: {0: "samples", 1: "rows"} for name in ("context", "near", "features")}
    for k in range(shape.layers_of_slices):
        axes |= {f"{name}_{k}": {0: "samples", 2: "kept"} for name in ("keys", "values")}
        axes |= {f"new_{name}_{k}": {0: "samples", 2: "rows"} for name in ("keys", "values")}
        axes[f"bias_{k}"] = {1: "rows", 2: "kept_and_rows"}
    write_graph(SliceGraph(net), given, folder / f"{SLICES}.onnx", inputs, outputs, axes)
    for k in range(shape.slices):
        features = torch.zeros(samples, rows, shape.width)
        axes = {name: {0: "samples", 1: "rows"} for name in ("features", "earlier", "logits")}
        names = ["features", "earlier"], ["logits"]
        write_graph(HeadGraph(net, k), [features, features.clone()], folder / f"{head_name(k)}.onnx", *names, axes)
