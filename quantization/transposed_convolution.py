"""Writes transposed convolutions as plain ones, which ONNX Runtime has int8 kernels for."""

from __future__ import annotations

import numpy as np
import onnx
from onnx import helper, numpy_helper

# For output row 2y + phase a transposed convolution of kernel 4, stride 2, padding 1 reads these kernel rows, of input
# rows y - 1 and y (phase 0), or y and y + 1 (phase 1); the same holds for columns. So each of the four output phases is
# a convolution of kernel 2, padded on one side.
_TAPS = ((3, 1), (2, 0))
_PHASES = tuple((row, column) for row in (0, 1) for column in (0, 1))


def phase_weights(weight: np.ndarray, row_phase: int, column_phase: int) -> np.ndarray:
    """The weights [out, in, 2, 2] of one output phase of a transposed convolution of kernel 4, stride 2, padding 1.

    weight: [in, out, 4, 4].
    """
    taps = weight[:, :, _TAPS[row_phase]][..., _TAPS[column_phase]]
    return np.ascontiguousarray(taps.transpose(1, 0, 2, 3))


def rewrite(model: onnx.ModelProto) -> int:
    """Replaces transposed convolutions of kernel 4, stride 2, padding 1 by four convolutions, which DepthToSpace
    interleaves, in place.

    The result is the same but for rounding, and so is the number of multiply-adds. Returns how many were replaced;
    others are left alone.
    """
    graph = model.graph
    constants = {value.name: value for value in graph.initializer}
    nodes, count = [], 0
    for node in graph.node:
        if node.op_type != "ConvTranspose" or not _is_doubling(node):
            nodes.append(node)
            continue
        weight = numpy_helper.to_array(constants[node.input[1]])
        phases = []
        for row, column in _PHASES:
            name = f"{node.name}/phase{row}{column}"
            graph.initializer.append(numpy_helper.from_array(phase_weights(weight, row, column), f"{name}.weight"))
            given = [node.input[0], f"{name}.weight", *node.input[2:]]
            pads = [1 - row, 1 - column, row, column]  # top, left, bottom, right
            nodes.append(helper.make_node("Conv", given, [name], f"{name}/Conv", kernel_shape=[2, 2], pads=pads))
            phases.append(name)
        nodes.append(helper.make_node("Concat", phases, [f"{node.name}/phases"], f"{node.name}/Concat", axis=1))
        nodes.append(
            helper.make_node("DepthToSpace", [f"{node.name}/phases"], node.output, f"{node.name}/Spread", blocksize=2)
        )
        count += 1
    used = {name for node in nodes for name in node.input}
    kept = [value for value in graph.initializer if value.name in used]
    del graph.node[:], graph.initializer[:]
    graph.node.extend(nodes)
    graph.initializer.extend(kept)
    return count


def _is_doubling(node: onnx.NodeProto) -> bool:
    given = {a.name: helper.get_attribute_value(a) for a in node.attribute}
    wanted = {"kernel_shape": [4, 4], "strides": [2, 2], "pads": [1, 1, 1, 1]}
    plain = given.get("group", 1) == 1 and list(given.get("dilations", [1, 1])) == [1, 1]
    return plain and all(list(given.get(name, [])) == value for name, value in wanted.items())
