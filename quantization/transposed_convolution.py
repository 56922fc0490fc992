"""Writes transposed convolutions as plain ones, which ONNX Runtime has int8 kernels for."""

from __future__ import annotations

import numpy as np
import onnx
from onnx import helper, numpy_helper

# For output row 2y + phase a transposed convolution of kernel 4, stride 2, padding 1 reads these pairs of
# (kernel row, input row - y); the same holds for columns.
_TAPS = {0: ((1, 0), (3, -1)), 1: ((0, 1), (2, 0))}


def phase_weights(weight: np.ndarray) -> np.ndarray:
    """The weights of a transposed convolution (stride 2, padding 1) as those of a 3x3 convolution.

    weight: [in, out, 4, 4]. The result, [4 * out, in, 3, 3], holds the four output phases one
    after another, as DepthToSpace (DCR) reads them.
    """
    inputs, outputs = weight.shape[:2]
    phases = np.zeros((2, 2, outputs, inputs, 3, 3), weight.dtype)
    for row_phase, rows in _TAPS.items():
        for column_phase, columns in _TAPS.items():
            for kernel_row, row in rows:
                for kernel_column, column in columns:
                    taps = weight[:, :, kernel_row, kernel_column].T
                    phases[row_phase, column_phase, ..., row + 1, column + 1] = taps
    return phases.reshape(4 * outputs, inputs, 3, 3)


def rewrite(model: onnx.ModelProto) -> int:
    """Replaces transposed convolutions of kernel 4, stride 2, padding 1 by Conv and DepthToSpace, in place.

    The result is the same but for rounding. Returns how many were replaced; others are left alone.
    """
    graph = model.graph
    constants = {value.name: value for value in graph.initializer}
    nodes, count = [], 0
    for node in graph.node:
        if node.op_type != "ConvTranspose" or not _is_doubling(node):
            nodes.append(node)
            continue
        weight = numpy_helper.to_array(constants[node.input[1]])
        names = [node.input[0], f"{node.name}/phases.weight"]
        graph.initializer.append(numpy_helper.from_array(phase_weights(weight), names[1]))
        if len(node.input) > 2:
            bias = numpy_helper.to_array(constants[node.input[2]])
            names.append(f"{node.name}/phases.bias")
            graph.initializer.append(numpy_helper.from_array(np.tile(bias, 4), names[2]))
        phases, size = f"{node.name}/phases", {"kernel_shape": [3, 3], "pads": [1, 1, 1, 1]}
        nodes.append(helper.make_node("Conv", names, [phases], f"{node.name}/Conv", **size))
        nodes.append(helper.make_node("DepthToSpace", [phases], node.output, f"{node.name}/Spread", blocksize=2))
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
