"""Every activation of a graph on real inputs."""

from __future__ import annotations

import numpy as np
import onnx
import onnxruntime
from onnx import helper

from quantization.samples import Sample


def float_session(model: onnx.ModelProto) -> onnxruntime.InferenceSession:
    """Runs a graph node by node, as it is written: nothing is fused, so that every tensor exists."""
    options = onnxruntime.SessionOptions()
    options.graph_optimization_level = onnxruntime.GraphOptimizationLevel.ORT_DISABLE_ALL
    options.intra_op_num_threads = 1
    options.log_severity_level = 3  # constants left over by the quantizer are no news
    return onnxruntime.InferenceSession(model.SerializeToString(), options, providers=["CPUExecutionProvider"])


class Activations:
    """Runs a graph and hands out the named tensors, one sample at a time.

    ONNX Runtime's `collect_activations` keeps those of all samples: gigabytes for a trunk.
    """

    def __init__(self, model: onnx.ModelProto, names: list[str]) -> None:
        copy = onnx.ModelProto.FromString(model.SerializeToString())
        given = {value.name for value in copy.graph.input}
        there = {value.name for value in copy.graph.output} | given
        for name in names:
            if name not in there:
                copy.graph.output.append(helper.make_tensor_value_info(name, onnx.TensorProto.FLOAT, None))
        self._names = [name for name in names if name not in given]
        self._given = [name for name in names if name in given]
        self._session = float_session(copy)

    def __call__(self, sample: Sample) -> dict[str, np.ndarray]:
        # Asked for nothing, a session gives all its outputs.
        found = self._session.run(self._names, sample) if self._names else []
        values = dict(zip(self._names, found, strict=True))
        return values | {name: sample[name] for name in self._given}


def tensor_names(model: onnx.ModelProto) -> list[str]:
    """The float tensors that nodes make or are given, constants aside, in the order of the graph."""
    shaped = {v.name: v.type.tensor_type.elem_type for v in (*model.graph.value_info, *model.graph.output)}
    shaped |= {value.name: value.type.tensor_type.elem_type for value in model.graph.input}
    constant = {name for node in model.graph.node if node.op_type == "Constant" for name in node.output}
    names = [value.name for value in model.graph.input]
    names += [name for node in model.graph.node for name in node.output]
    kept = [n for n in names if n not in constant and shaped.get(n) == onnx.TensorProto.FLOAT]
    return list(dict.fromkeys(kept))
