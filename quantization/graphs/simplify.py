"""Makes a quantized graph (QDQ) simpler where the result stays as good: fewer operations, fewer roundings."""

from __future__ import annotations

from collections import Counter

import numpy as np
import onnx
from onnx import helper, numpy_helper


def simplify(model: onnx.ModelProto) -> None:
    """All of this module, in place."""
    fold_scalar_products(model)
    share_scales(model)
    drop_zero_points_of_biases(model)
    drop_unused_constants(model)


class _Graph:
    """Who makes a tensor and who reads it."""

    def __init__(self, graph: onnx.GraphProto) -> None:
        self.constants = {value.name: value for value in graph.initializer}
        self.maker = {name: node for node in graph.node for name in node.output}
        self.readers: dict[str, list[onnx.NodeProto]] = {}
        for node in graph.node:
            for name in node.input:
                self.readers.setdefault(name, []).append(node)
        self.outputs = {value.name for value in graph.output}

    def made_by(self, name: str, kind: str) -> onnx.NodeProto | None:
        node = self.maker.get(name)
        return node if node is not None and node.op_type == kind else None

    def only_reader(self, name: str, kind: str) -> onnx.NodeProto | None:
        readers = self.readers.get(name, [])
        return readers[0] if len(readers) == 1 and readers[0].op_type == kind and name not in self.outputs else None

    def value(self, name: str) -> np.ndarray | None:
        """A constant as it was before quantization; None for what is computed."""
        for kind in ("DequantizeLinear", "QuantizeLinear"):
            node = self.made_by(name, kind)
            name = node.input[0] if node is not None else name
        if name in self.constants:
            value = self.constants[name]
        elif node := self.made_by(name, "Constant"):
            value = next((a.t for a in node.attribute if a.name == "value"), None)
        else:
            return None
        return None if value is None or value.data_type != onnx.TensorProto.FLOAT else numpy_helper.to_array(value)


def fold_scalar_products(model: onnx.ModelProto) -> int:
    """A quantized map times a positive number is the same map with another scale: no operation, no rounding.

    Written as DequantizeLinear with the product of both; the multiplication and the quantization of its result go.
    Returns how many multiplications went.
    """
    graph = model.graph
    view, gone, added = _Graph(graph), [], []
    for node in graph.node:
        if node.op_type != "Mul":
            continue
        for tensor, factor in (node.input, reversed(node.input)):
            source, number = view.made_by(tensor, "DequantizeLinear"), view.value(factor)
            if source is None or number is None or number.size != 1 or number.item() <= 0:
                continue
            quantize = view.only_reader(node.output[0], "QuantizeLinear")
            dequantize = quantize and view.only_reader(quantize.output[0], "DequantizeLinear")
            scale = view.constants.get(source.input[1])
            if dequantize is None or scale is None:
                continue
            product = (numpy_helper.to_array(scale) * np.float32(number.item())).astype(np.float32)
            name = f"{node.name}/scale"
            graph.initializer.append(numpy_helper.from_array(product, name))
            added.append((source, helper.make_node(
                "DequantizeLinear", [source.input[0], name, *source.input[2:]], dequantize.output, f"{node.name}/scaled"
            )))  # fmt: skip
            gone += [node, quantize, dequantize]
            break
    _replace(graph, gone, added)
    return len(added)


def share_scales(model: onnx.ModelProto) -> int:
    """Maps that are joined by Concat get the scale of the joined map before, so that joining them is only a copy.

    Returns how many maps got another scale.
    """
    view, count = _Graph(model.graph), 0
    for node in model.graph.node:
        joined = view.only_reader(node.output[0], "QuantizeLinear") if node.op_type == "Concat" else None
        if joined is None:
            continue
        for name in node.input:
            dequantize = view.made_by(name, "DequantizeLinear")
            quantize = dequantize and view.made_by(dequantize.input[0], "QuantizeLinear")
            if quantize is None or view.only_reader(quantize.output[0], "DequantizeLinear") is None:
                continue
            if view.only_reader(dequantize.output[0], "Concat") is None:
                continue
            quantize.input[1:] = joined.input[1:]
            dequantize.input[1:] = joined.input[1:]
            count += 1
    return count


def drop_zero_points_of_biases(model: onnx.ModelProto) -> int:
    """Drops zero points of 32-bit biases that are 0 in every channel: a missing one means the same. 4 bytes a channel.

    Returns how many went.
    """
    constants, count = {value.name: value for value in model.graph.initializer}, 0
    for node in model.graph.node:
        if node.op_type != "DequantizeLinear" or len(node.input) < 3:
            continue
        bias, zero_point = (constants.get(node.input[k]) for k in (0, 2))
        if bias is None or bias.data_type != onnx.TensorProto.INT32 or zero_point is None:
            continue
        if not numpy_helper.to_array(zero_point).any():
            del node.input[2]
            count += 1
    return count


def drop_unused_constants(model: onnx.ModelProto) -> int:
    """Returns how many initializers nobody reads went; and nodes that only made constants nobody reads."""
    graph, before = model.graph, len(model.graph.initializer)
    while True:
        used = Counter(name for node in graph.node for name in node.input)
        used.update(value.name for value in graph.output)
        idle = [node for node in graph.node if not any(used[name] for name in node.output)]
        if not idle:
            break
        _replace(graph, idle, [])
    kept = [value for value in graph.initializer if used[value.name]]
    del graph.initializer[:]
    graph.initializer.extend(kept)
    return before - len(kept)


def _replace(
    graph: onnx.GraphProto, gone: list[onnx.NodeProto], added: list[tuple[onnx.NodeProto, onnx.NodeProto]]
) -> None:
    """Takes nodes out, and puts each new node behind the one it is listed with."""
    after: dict[int, list[onnx.NodeProto]] = {}
    for place, node in added:
        after.setdefault(id(place), []).append(node)
    out = {id(node) for node in gone}
    nodes = []
    for node in graph.node:
        nodes += [] if id(node) in out else [node]
        nodes += after.get(id(node), [])
    nodes = [onnx.NodeProto.FromString(node.SerializeToString()) for node in nodes]
    del graph.node[:]
    graph.node.extend(nodes)
