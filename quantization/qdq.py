"""What a quantised (QDQ) graph holds: its weights and activations with their scales, matched to the float graph."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import onnx
from onnx import numpy_helper
from onnxruntime.quantization.quant_utils import QUANT_INPUT_SUFFIX, TENSOR_NAME_QUANT_SUFFIX

HEAVY = ("Conv", "ConvTranspose", "Gemm", "MatMul")


@dataclass(frozen=True)
class Weight:
    """A constant stored as integers. name: as in the float graph. node: that reads it; slot: which of its inputs.
    stored: integers; scale: float32, one or one per channel along `axis`; zero_point: likewise."""

    name: str
    node: str
    op_type: str
    slot: int
    stored: np.ndarray
    scale: np.ndarray
    zero_point: np.ndarray
    axis: int
    expected: np.ndarray

    def dequantised(self) -> np.ndarray:
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
    """An activation that is quantised and dequantised. name: as in the float graph; before, after: names in the
    int8 graph of the tensor that goes in and of the one that comes out."""

    name: str
    before: str
    after: str
    scale: float
    zero_point: int

    def applied(self, values: np.ndarray) -> np.ndarray:
        """values, through this pair (unsigned 8 bit)."""
        steps = np.clip(np.rint(values / np.float32(self.scale)) + self.zero_point, 0, 255)
        return ((steps - self.zero_point) * np.float32(self.scale)).astype(np.float32)


def constants(graph: onnx.GraphProto) -> dict[str, np.ndarray]:
    return {value.name: numpy_helper.to_array(value) for value in graph.initializer}


def weights(quantised: onnx.GraphProto, reference: onnx.GraphProto) -> list[Weight]:
    """All constants that the int8 graph stores as integers.

    They are matched by the node that reads them, since the quantiser gives a bias that several nodes share
    one copy each, with names that the float graph does not know (so `create_weight_matching` of ONNX Runtime
    loses them). Raises ValueError for one that has no float counterpart.
    """
    known, expected = constants(quantised), constants(reference)
    readers: dict[str, tuple[onnx.NodeProto, int]] = {}
    for node in quantised.node:
        for slot, name in enumerate(node.input):
            readers.setdefault(name, (node, slot))
    nodes = {node.name: node for node in reference.node}
    found = []
    for node in quantised.node:
        if node.op_type != "DequantizeLinear" or node.input[0] not in known:
            continue
        reader, slot = readers[node.output[0]]
        name = nodes[reader.name].input[slot] if reader.name in nodes else ""
        if name not in expected:
            raise ValueError(f"{node.input[0]} has no counterpart in the float graph: was it made from other weights?")
        axis = next((a.i for a in node.attribute if a.name == "axis"), 1)
        scale, zero = np.atleast_1d(known[node.input[1]]), np.atleast_1d(known[node.input[2]])
        label = node.input[0].removesuffix(TENSOR_NAME_QUANT_SUFFIX)
        found.append(
            Weight(
                label, reader.name, reader.op_type, slot, known[node.input[0]], scale, zero, axis,
                expected[name].reshape(known[node.input[0]].shape),
            )
        )  # fmt: skip
    return found


def pairs(quantised: onnx.GraphProto) -> list[Pair]:
    """All activations with a quantise-dequantise pair, in the order of the graph."""
    known = constants(quantised)
    after = {n.input[0]: n.output[0] for n in quantised.node if n.op_type == "DequantizeLinear"}
    found = []
    for node in quantised.node:
        if node.op_type != "QuantizeLinear":
            continue
        before, behind = node.input[0], after[node.output[0]]
        name = before.removesuffix(QUANT_INPUT_SUFFIX)
        scale, zero = float(known[node.input[1]]), int(known[node.input[2]])
        found.append(Pair(name, before, behind, scale, zero))
    return found


def heavy_nodes(graph: onnx.GraphProto) -> Iterator[onnx.NodeProto]:
    """Convolutions and matrix products."""
    return (node for node in graph.node if node.op_type in HEAVY)
