"""Tensor by tensor: how much error an int8 graph makes here, and how much has gathered.

All metrics are signal to noise ratios in dB against the prepared float graph. An activation has two: `here`, the float
tensor against its own quantize-dequantize (what this pair alone does), and `gathered`, the float tensor against the
same tensor of the int8 graph. A node's `jump` is the worst gathered figure of its inputs less that of its output: how
much this node spoils.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import onnx
from tqdm import tqdm

from quantization.analysis.errors import sqnr_db
from quantization.graphs import qdq
from quantization.graphs.activations import Activations, tensor_names
from quantization.samples import Sample


@dataclass(frozen=True)
class TensorError:
    """One tensor of one graph; metrics in dB, None where they do not apply.

    kind: "weight", "bias" or "activation". here: this tensor's own rounding. worst_channel: the lowest `here` of its
    channels (weights). gathered: with all that came before. jump: dB lost from the worst input of `node`, which
    makes or reads the tensor, to this. scale: the largest one; bits: of the integers in use.
    """

    graph: str
    name: str
    kind: str
    node: str
    op_type: str
    here: float | None
    worst_channel: float | None = None
    gathered: float | None = None
    jump: float | None = None
    scale: float | None = None
    bits: int | None = None


class Noise:
    """Power of a signal and of what is wrong with it."""

    def __init__(self) -> None:
        self.signal = self.noise = 0.0

    def add(self, expected: np.ndarray, actual: np.ndarray) -> None:
        expected = expected.astype(np.float64).ravel()
        gap = expected - actual.ravel()
        self.signal += float(expected @ expected)
        self.noise += float(gap @ gap)

    @property
    def db(self) -> float:
        return sqnr_db(self.signal, self.noise)


def weight_errors(graph: str, reference: onnx.ModelProto, quantized: onnx.ModelProto) -> list[TensorError]:
    """Weights and biases against the float ones. Channels that are all zero have no error and are passed over."""
    found = []
    for weight in qdq.weights(quantized.graph, reference.graph):
        whole, channels = Noise(), []
        expected, actual = (weight.channels(x) for x in (weight.expected, weight.dequantized()))
        for first, second in zip(expected, actual, strict=True):
            whole.add(first, second)
            if first.any():
                channels.append(
                    sqnr_db(float(np.square(first, dtype=np.float64).sum()), float(np.square(first - second).sum()))
                )
        kind = "bias" if weight.slot == 2 else "weight"
        bits = int(np.ceil(np.log2(max(np.abs(weight.stored.astype(np.int64)).max(), 1)))) + 1
        found.append(
            TensorError(
                graph, weight.name, kind, weight.node, weight.op_type, whole.db,
                worst_channel=min(channels, default=None), scale=float(weight.scale.max()), bits=bits,
            )
        )  # fmt: skip
    return found


def pair_errors(
    graph: str, reference: onnx.ModelProto, quantized: onnx.ModelProto, samples: Iterable[Sample]
) -> list[TensorError]:
    """`here` of every activation with a pair: runs the float graph alone, and so is quick."""
    pairs = qdq.pairs(quantized.graph)
    run = Activations(reference, [pair.name for pair in pairs])
    noise = {pair.name: Noise() for pair in pairs}
    for sample in samples:
        values = run(sample)
        for pair in pairs:
            noise[pair.name].add(values[pair.name], pair.applied(values[pair.name]))
    makers = _makers(quantized.graph)
    return [
        TensorError(
            graph, pair.name, "activation", *makers.get(pair.before, ("", "input")), noise[pair.name].db,
            scale=pair.scale, bits=8,
        )
        for pair in pairs
    ]  # fmt: skip


def activation_errors(
    graph: str, reference: onnx.ModelProto, quantized: onnx.ModelProto, samples: list[Sample]
) -> list[TensorError]:
    """Every activation that both graphs have, with all its metrics."""
    pairs = {pair.name: pair for pair in qdq.pairs(quantized.graph)}
    there = set(tensor_names(quantized))
    names = [n for n in tensor_names(reference) if n in pairs or n in there]
    names += [n for n in pairs if n not in names]  # numbers that activations are multiplied by
    # The tensor that a node of the int8 graph reads under this name: the output of its QDQ pair, if any.
    seen = {name: pairs[name].after if name in pairs else name for name in names}
    expect, run = Activations(reference, names), Activations(quantized, list(seen.values()))
    here, gathered = ({name: Noise() for name in names} for _ in range(2))
    for sample in tqdm(samples, desc=f"comparing {graph}", unit="sample", leave=False, disable=None):
        expected, actual = expect(sample), run(sample)
        for name in names:
            factor = pairs[name].factor if name in pairs else 1.0
            gathered[name].add(expected[name], actual[seen[name]] / factor)
            if name in pairs:
                here[name].add(expected[name], pairs[name].applied(expected[name]))
    makers = _makers(quantized.graph)
    original = {behind: name for name, behind in seen.items()}
    nodes = {node.name: node for node in quantized.graph.node}
    found = []
    for name in names:
        pair = pairs.get(name)
        node, op_type = makers.get(pair.before if pair else name, ("", "input"))
        given = [original[x] for x in nodes[node].input if x in original] if node else []
        worst = min((gathered[x].db for x in given), default=None)
        jump = None if worst is None or not np.isfinite(worst) else worst - gathered[name].db
        found.append(
            TensorError(
                graph, name, "activation", node, op_type, here[name].db if pair else None,
                gathered=gathered[name].db, jump=jump, scale=pair.scale if pair else None, bits=8 if pair else None,
            )
        )  # fmt: skip
    return found


def _makers(graph: onnx.GraphProto) -> dict[str, tuple[str, str]]:
    """Name and type of the node that makes each tensor."""
    return {name: (node.name, node.op_type) for node in graph.node for name in node.output}


def worst_first(errors: list[TensorError]) -> list[TensorError]:
    """By the lowest of each tensor's metrics. A bias counts as a whole: channels that are nearly zero do no harm."""

    def key(error: TensorError) -> float:
        metrics = [error.here, error.gathered, None if error.kind == "bias" else error.worst_channel]
        return min(figure for figure in metrics if figure is not None)

    return sorted(errors, key=key)
