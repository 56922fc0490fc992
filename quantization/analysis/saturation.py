"""Where 16-bit sums overflow: x86 with AVX2 or AVX-512 but without VNNI.

There `pmaddubsw` adds two products of an unsigned 8-bit activation and a signed 8-bit weight in 16 bits, and
clamps the sum to -32768..32767. Which two products meet is the kernel's business: ONNX Runtime's matrix product pairs
neighbours along the reduction, which for a convolution runs over kernel row, kernel column, input channel, in this
order. `count` assumes that order. `bound` does not: it takes the two largest weights of one sign of an output channel,
wherever they are, and the largest activation, 255, for both; no pair of any order can exceed it.

Depthwise convolutions are exempt: their kernel multiplies 16-bit numbers and adds in 32 bits
(onnxruntime/core/mlas/lib/intrinsics/avx2/qdwconv_avx2.cpp).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import onnx
from onnx import helper

from quantization.graphs import qdq
from quantization.graphs.activations import Activations
from quantization.samples import Sample

LARGEST, SMALLEST = 32767, -32768
ROWS = 96  # positions of the input looked at in each sample, evenly spread
BATCH = 96  # of these at a time, to bound memory


@dataclass(frozen=True)
class Layer:
    """One int8 layer. weights: int8-valued [out, reduction] in the kernel's order; pair: the activation it reads;
    attributes: of the convolution; kernel: its height and width, (1, 1) for a matrix product."""

    name: str
    op_type: str
    weights: np.ndarray
    scale: np.ndarray
    pair: qdq.Pair
    attributes: dict
    kernel: tuple[int, int]
    groups: int
    depthwise: bool


@dataclass(frozen=True)
class Saturation:
    """bound: largest |sum| of two products that any input and any order could give (safe up to 32767). pairs: sums
    looked at; clamped: how many of them overflow; worst_error: the largest error of an output that this causes, in
    units of the layer's output. exempt: the kernel has no 16-bit sums."""

    graph: str
    layer: str
    bits: int
    bound: int
    exempt: bool
    pairs: int = 0
    clamped: int = 0
    worst_error: float = 0.0

    @property
    def safe(self) -> bool:
        return self.exempt or self.bound <= LARGEST


def bound(weights: np.ndarray) -> int:
    """weights: integers [out, reduction]. 255 times the largest sum of two weights of one sign in a row."""
    largest = 0
    for sign in (1, -1):
        signed = np.sort(np.maximum(sign * weights.astype(np.int64), 0), 1)[:, -2:]
        largest = max(largest, int(signed.sum(1).max(initial=0)))
    return 255 * largest


def count(columns: np.ndarray, weights: np.ndarray) -> tuple[int, int, int]:
    """Pairs, how many overflow, and the largest error of a whole sum, for uint8 columns [n, reduction] and integer
    weights [out, reduction]. An odd reduction ends with a product alone, which cannot overflow."""
    even = columns.shape[1] // 2 * 2
    first, second = (weights[:, k:even:2].astype(np.int32) for k in (0, 1))
    pairs = clamped = worst = 0
    for start in range(0, len(columns), BATCH):
        part = columns[start : start + BATCH].astype(np.int32)
        for row in range(len(weights)):  # [n, pairs] at a time
            sums = part[:, 0:even:2] * first[row] + part[:, 1:even:2] * second[row]
            lost = sums - np.clip(sums, SMALLEST, LARGEST)
            pairs += sums.size
            if lost.any():
                clamped += int((lost != 0).sum())
                worst = max(worst, int(np.abs(lost.sum(1)).max()))
    return pairs, clamped, worst


def layers(reference: onnx.ModelProto, quantized: onnx.ModelProto) -> list[Layer]:
    """All convolutions and matrix products with int8 weights and a quantized input."""
    held = {w.output: w for w in qdq.weights(quantized.graph, reference.graph) if w.slot == 1}
    pairs = {pair.after: pair for pair in qdq.pairs(quantized.graph)}
    behind = {n.output[0]: n.input[0] for n in quantized.graph.node if n.op_type == "Flatten"}
    found = []
    for node in qdq.heavy_nodes(quantized.graph):
        given = node.input[0]
        while given in behind:  # passes integers on
            given = behind[given]
        if node.input[1] not in held or given not in pairs:
            continue
        weight, attributes = held[node.input[1]], {a.name: helper.get_attribute_value(a) for a in node.attribute}
        values = weight.stored.astype(np.int16)
        groups = attributes.get("group", 1)
        kernel = (1, 1)
        if node.op_type == "Conv":
            kernel = values.shape[2:]
            depthwise = groups > 1 and values.shape[1] == 1 and len(values) == groups
            values = values.transpose(0, 2, 3, 1)
        else:
            depthwise = False
            transposed = node.op_type == "Gemm" and attributes.get("transB", 0)
            values = values if transposed else values.T
        found.append(
            Layer(
                node.name, node.op_type, values.reshape(len(values), -1), weight.scale, pairs[given], attributes,
                tuple(kernel), groups, depthwise,
            )
        )  # fmt: skip
    return found


def with_bits(layer: Layer, reference: onnx.ModelProto, bits: int) -> Layer:
    """The same layer with float weights rounded anew to `bits` bits, symmetric per output channel."""
    known = qdq.constants(reference.graph)
    node = next(n for n in reference.graph.node if n.name == layer.name)
    values = known[node.input[1]]
    if layer.op_type == "Conv":
        values = values.transpose(0, 2, 3, 1)
    elif not (layer.op_type == "Gemm" and layer.attributes.get("transB", 0)):
        values = values.T
    values = values.reshape(len(values), -1)
    largest = np.maximum(np.abs(values).max(1, keepdims=True), 1e-30)
    steps = 2 ** (bits - 1) - 1
    return replace(layer, weights=np.rint(values / largest * steps).astype(np.int16), scale=largest[:, 0] / steps)


def columns(layer: Layer, values: np.ndarray) -> list[np.ndarray]:
    """Inputs of the layer's products, as uint8 [positions, reduction] for each of its groups; at most `ROWS` positions.

    values: its float input, [N, C, h, w] or [N, features].
    """
    pair = layer.pair
    stored = np.clip(np.rint(values / np.float32(pair.scale)) + pair.zero_point, 0, 255).astype(np.uint8)
    if layer.op_type != "Conv":
        return [_thinned(stored.reshape(-1, layer.weights.shape[1]))]
    top, left, bottom, right = layer.attributes.get("pads", [0, 0, 0, 0])
    padding = [(0, 0), (0, 0), (top, bottom), (left, right)]
    stored = np.pad(stored, padding, constant_values=pair.zero_point)
    dilation, stride = (layer.attributes.get(name, [1, 1]) for name in ("dilations", "strides"))
    reach = [(k - 1) * d + 1 for k, d in zip(layer.kernel, dilation, strict=True)]
    windows = np.lib.stride_tricks.sliding_window_view(stored, reach, (2, 3))
    windows = windows[:, :, :: stride[0], :: stride[1], :: dilation[0], :: dilation[1]]
    windows = windows.transpose(0, 2, 3, 4, 5, 1)  # [N, y, x, kernel row, kernel column, channel]
    n, height, width = windows.shape[:3]
    at = np.linspace(0, n * height * width - 1, min(ROWS, n * height * width)).astype(int)
    chosen = windows[np.unravel_index(at, (n, height, width))]
    return [part.reshape(len(at), -1) for part in np.split(chosen, layer.groups, axis=-1)]


def _thinned(rows: np.ndarray) -> np.ndarray:
    return rows[np.linspace(0, len(rows) - 1, min(ROWS, len(rows))).astype(int)]


def saturation(
    graph: str, reference: onnx.ModelProto, quantized: onnx.ModelProto, samples: list[Sample], bits: int | None = None
) -> list[Saturation]:
    """Every int8 layer of a graph, with its own weights, or with float weights rounded to `bits` bits.

    Pairs are counted on the float graph's activations, for layers whose bound does not already exclude an overflow.
    """
    found = layers(reference, quantized)
    if bits is not None:
        found = [with_bits(layer, reference, bits) for layer in found]
    results = {}
    for layer in found:
        used = int(np.ceil(np.log2(max(np.abs(layer.weights).max(), 1)))) + 1
        results[layer.name] = Saturation(graph, layer.name, bits or used, bound(layer.weights), layer.depthwise)
    doubtful = [layer for layer in found if not results[layer.name].safe]
    run = Activations(reference, sorted({layer.pair.name for layer in doubtful})) if doubtful else None
    for sample in samples if run else []:
        values = run(sample)
        for layer in doubtful:
            weights = np.split(layer.weights, layer.groups)
            scales = np.split(np.broadcast_to(layer.scale, len(layer.weights)), layer.groups)
            for part, weight, scale in zip(columns(layer, values[layer.pair.name]), weights, scales, strict=True):
                pairs, clamped, worst = count(part, weight)
                last = results[layer.name]
                results[layer.name] = replace(
                    last,
                    pairs=last.pairs + pairs,
                    clamped=last.clamped + clamped,
                    worst_error=max(last.worst_error, float(worst * scale.max() * layer.pair.scale)),
                )
    return list(results.values())
