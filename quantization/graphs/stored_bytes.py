"""Weights that are read as float, but stored as bytes with a scale each: a third of the file, and no sum in bytes."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import onnx
from onnx import helper, numpy_helper


def store_as_bytes(model: onnx.ModelProto, axes: Iterable[tuple[str, int]]) -> None:
    """Replaces float initializers, each with the axis along which it has a scale a slice, in place."""
    graph = model.graph
    by_name = {tensor.name: tensor for tensor in graph.initializer}
    for name, axis in axes:
        values = numpy_helper.to_array(by_name[name])
        others = tuple(k for k in range(values.ndim) if k != axis)
        scale = np.maximum(np.abs(values).max(others) / 127, np.finfo(np.float32).tiny).astype(np.float32)
        steps = np.rint(values / np.expand_dims(scale, others)).clip(-127, 127).astype(np.int8)
        graph.initializer.remove(by_name[name])
        graph.initializer.extend(
            [
                numpy_helper.from_array(steps, f"{name}_bytes"),
                numpy_helper.from_array(scale, f"{name}_scale"),
                numpy_helper.from_array(np.zeros(len(scale), np.int8), f"{name}_zero"),
            ]
        )
        parts = [f"{name}_bytes", f"{name}_scale", f"{name}_zero"]
        graph.node.insert(0, helper.make_node("DequantizeLinear", parts, [name], name=f"{name}_read", axis=axis))
