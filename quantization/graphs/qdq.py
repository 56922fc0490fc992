"""Weights and activations of a quantized (QDQ) graph with their scales, matched to the float graph."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import onnx
from onnx import numpy_helper
from onnxruntime.quantization.quant_utils import DEQUANT_OUTPUT_SUFFIX, QUANT_INPUT_SUFFIX, TENSOR_NAME_QUANT_SUFFIX

HEAVY = ("Conv", "ConvTranspose", "Gemm", "MatMul")


@dataclass(frozen=True)
class Weight:
    """A constant stored as integers. name: as in the float graph; output: what the int8 graph calls it where it is
    read. node: the first that reads it; slot: which of its inputs. stored: integers; scale: float32, one or one per
    channel along `axis`; zero_point: of the same shape. expected: the float constant."""

    name: str
    output: str
    node: str
    op_type: str
    slot: int
    stored: np.ndarray
    scale: np.ndarray
    zero_point: np.ndarray
    axis: int
    expected: np.ndarray

    def dequantized(self) -> np.ndarray:
        """float64, shaped like `stored`."""
        shape = [1] * self.stored.ndim
        if self.scale.size > 1:
            shape[self.axis] = -1
        scale, zero = self.scale.astype(np.float64).reshape(shape), self.zero_point.astype(np.float64).reshape(shape)
        return (self.stored.astype(np.float64) - zero) * scale

    def channels(self, values: np.ndarray) -> np.ndarray:
        """[channels, everything else] of an array shaped like `stored`; one row when there is one scale."""
        if self.scale.size == 1:
            return values.reshape(1, -1)
        return np.moveaxis(values, self.axis, 0).reshape(values.shape[self.axis], -1)


@dataclass(frozen=True)
class Pair:
    """An activation that is quantized and dequantized. name: as in the float graph; before, after: names in the
    int8 graph of the tensor that goes in and of the one that comes out; factor: what the latter is multiplied by."""

    name: str
    before: str
    after: str
    scale: float
    zero_point: int
    factor: float = 1.0

    def applied(self, values: np.ndarray) -> np.ndarray:
        """values, through this pair (unsigned 8 bit)."""
        steps = np.clip(np.rint(values / np.float32(self.scale)) + self.zero_point, 0, 255)
        return ((steps - self.zero_point) * np.float32(self.scale)).astype(np.float32)


def constants(graph: onnx.GraphProto) -> dict[str, np.ndarray]:
    return {value.name: numpy_helper.to_array(value) for value in graph.initializer}


def weights(quantized: onnx.GraphProto, reference: onnx.GraphProto) -> list[Weight]:
    """All constants that the int8 graph stores as integers.

    They are matched by the node that reads them, since the quantizer gives a bias that several nodes share
    one copy each, with names that the float graph does not know (so `create_weight_matching` of ONNX Runtime
    loses them). Raises ValueError for one that has no float counterpart.
    """
    known, expected = constants(quantized), constants(reference)
    readers: dict[str, tuple[onnx.NodeProto, int]] = {}
    for node in quantized.node:
        for slot, name in enumerate(node.input):
            readers.setdefault(name, (node, slot))
    nodes = {node.name: node for node in reference.node}
    found = []
    for node in quantized.node:
        if node.op_type != "DequantizeLinear" or node.input[0] not in known:
            continue
        reader, slot = readers[node.output[0]]
        name = nodes[reader.name].input[slot] if reader.name in nodes else ""
        if name not in expected:
            raise ValueError(f"{node.input[0]} has no counterpart in the float graph: was it made from other weights?")
        axis = next((a.i for a in node.attribute if a.name == "axis"), 1)
        scale = np.atleast_1d(known[node.input[1]])
        zero = np.atleast_1d(known[node.input[2]]) if len(node.input) > 2 else np.zeros_like(scale, np.int32)
        label = node.input[0].removesuffix(TENSOR_NAME_QUANT_SUFFIX)
        found.append(
            Weight(
                label,
                node.output[0], reader.name, reader.op_type, slot, known[node.input[0]], scale, zero, axis,
                expected[name].reshape(known[node.input[0]].shape),
            )
        )  # fmt: skip
    return found


def pairs(quantized: onnx.GraphProto) -> list[Pair]:
    """All activations with a quantize-dequantize pair, in the order of the graph.

    Where a map times a number is the same map with another scale (quantization.graphs.simplify), the product is
    a pair too.
    """
    known = constants(quantized)
    readers: dict[str, list[onnx.NodeProto]] = {}
    for node in quantized.node:
        if node.op_type == "DequantizeLinear":
            readers.setdefault(node.input[0], []).append(node)
    found = []
    for node in quantized.node:
        if node.op_type != "QuantizeLinear":
            continue
        scale, zero = float(known[node.input[1]]), int(known[node.input[2]])
        plain = [reader for reader in readers[node.output[0]] if reader.input[1] == node.input[1]]
        scaled = [reader for reader in readers[node.output[0]] if reader.input[1] != node.input[1]]
        first = (plain + scaled)[0]
        name = node.input[0].removesuffix(QUANT_INPUT_SUFFIX)
        found.append(Pair(name, node.input[0], first.output[0], scale, zero, float(known[first.input[1]]) / scale))
        for reader in scaled:
            product = reader.output[0].removesuffix(DEQUANT_OUTPUT_SUFFIX)
            found.append(Pair(product, node.input[0], reader.output[0], float(known[reader.input[1]]), zero))
    return found


def heavy_nodes(graph: onnx.GraphProto) -> Iterator[onnx.NodeProto]:
    """Convolutions and matrix products."""
    return (node for node in graph.node if node.op_type in HEAVY)
