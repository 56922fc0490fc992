"""Products whose inputs become bytes by fixed scales, in place of scales found for each input as it comes: those are of
a whole tensor, so that the rows of one sample would depend on those of the others."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
import onnx
from onnx import helper, numpy_helper

Ranges = dict[str, tuple[float, float]]  # the smallest and the largest number of a tensor


def scaled_inputs(model: onnx.ModelProto) -> list[str]:
    """Tensors whose scale is found as they come."""
    return [node.input[0] for node in model.graph.node if node.op_type == "DynamicQuantizeLinear"]


def show(model: onnx.ModelProto, tensors: Iterable[str]) -> None:
    """Makes them outputs, in place, after those that there are; not the graph's own inputs and outputs."""
    there = {value.name for value in (*model.graph.input, *model.graph.output)}
    shown = [name for name in dict.fromkeys(tensors) if name not in there]
    model.graph.output.extend(helper.make_tensor_value_info(name, onnx.TensorProto.FLOAT, None) for name in shown)


def fix_scales(model: onnx.ModelProto, ranges: Mapping[str, tuple[float, float]]) -> None:
    """In place: of each tensor of scaled_inputs() the range; what lies beyond is cut off. A product, its scales and its
    bias become one operator of ONNX Runtime, as that makes of the graph before: separate ones take half as long again.
    Raises ValueError where a product is not as quantize_dynamic makes it."""
    graph = model.graph
    constants = {tensor.name: numpy_helper.to_array(tensor) for tensor in graph.initializer}
    makers = {output: node for node in graph.node for output in node.output}
    users: dict[str, list[onnx.NodeProto]] = {}
    for node in graph.node:
        for name in node.input:
            users.setdefault(name, []).append(node)

    def only_user(name: str, kind: str) -> onnx.NodeProto:
        found = users.get(name, [])
        if [node.op_type for node in found] != [kind]:
            raise ValueError(f"{name} is used by {[node.op_type for node in found]}, not by one {kind}")
        return found[0]

    gone: set[str] = set()  # first outputs of nodes that become part of others
    made: dict[str, onnx.NodeProto] = {}  # by the first output of the node that they take the place of
    for node in graph.node:
        if node.op_type != "DynamicQuantizeLinear":
            continue
        quantized, scale, zero = node.output
        low, high = min(ranges[node.input[0]][0], 0.0), max(ranges[node.input[0]][1], 0.0)
        step = np.float32(max((high - low) / 255, np.finfo(np.float32).tiny))
        graph.initializer.append(numpy_helper.from_array(step, scale))
        graph.initializer.append(numpy_helper.from_array(np.uint8(np.clip(np.rint(-low / step), 0, 255)), zero))
        made[quantized] = helper.make_node("QuantizeLinear", [node.input[0], scale, zero], [quantized], name=node.name)
        product = only_user(quantized, "MatMulInteger")
        cast = only_user(product.output[0], "Cast")
        scaled = only_user(cast.output[0], "Mul")
        scales = makers[next(name for name in scaled.input if name != cast.output[0])]
        given = [product.input[0], product.input[1], scales.input[0], scales.input[1], *product.input[2:]]
        last = scaled
        after = users.get(scaled.output[0], [])
        if [one.op_type for one in after] == ["Add"] and any(name in constants for name in after[0].input):
            last = after[0]
            given.append(next(name for name in last.input if name in constants))
        gone |= {part.output[0] for part in (product, cast, scaled, scales, last)}
        made[last.output[0]] = helper.make_node(
            "MatMulIntegerToFloat", given, [last.output[0]], name=product.name, domain="com.microsoft"
        )
    nodes = [made.get(n.output[0], n) for n in graph.node if n.output[0] in made or n.output[0] not in gone]
    del graph.node[:]
    graph.node.extend(nodes)
    model.opset_import.append(helper.make_opsetid("com.microsoft", 1))
    onnx.checker.check_model(model)
