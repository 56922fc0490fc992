"""Biases take up the mean error of rounded weights.

Rounded weights W' shift a layer's outputs on average by (W' - W) * E[x]; subtracted from the bias, the mean is right
again (Nagel et al., "Data-free quantization through weight equalization and bias correction", ICCV 2019, section 4.2;
here E[x] is measured on calibration data). It pays for depthwise layers, where few weights make one output.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnx
from onnx import helper, numpy_helper
from onnxruntime.quantization.quant_utils import TENSOR_NAME_QUANT_SUFFIX

from quantization.graphs import qdq
from quantization.graphs.activations import float_session
from quantization.samples import Sample


def correct_biases(prepared: Path, quantized: Path, samples: list[Sample]) -> int:
    """Changes the int8 graph in place; returns how many biases. Convolutions without a bias stay as they are.

    Means are taken over everything but channels; the zeros of padding are left out of account.
    """
    reference, model = onnx.load(prepared), onnx.load(quantized)
    held = {w.output: w for w in qdq.weights(model.graph, reference.graph)}
    layers = {n.name: n for n in qdq.heavy_nodes(model.graph) if n.op_type == "Conv" and len(n.input) == 3}
    layers = {name: n for name, n in layers.items() if n.input[1] in held and n.input[2] in held}
    inputs = {n.name: n.input[0] for n in qdq.heavy_nodes(reference.graph) if n.name in layers}
    means = _channel_means(reference, sorted(set(inputs.values())), samples)
    stored = {value.name: value for value in model.graph.initializer}
    for node, layer in layers.items():
        kernel, bias = held[layer.input[1]], held[layer.input[2]]
        groups = next((a.i for a in layer.attribute if a.name == "group"), 1)
        taps = (kernel.dequantized() - kernel.expected).sum((2, 3))  # [out, in of the group]
        mean = means[inputs[node]].reshape(groups, -1).repeat(len(taps) // groups, 0)
        shift = (taps * mean).sum(1)
        values = np.rint((bias.expected - shift) / bias.scale.astype(np.float64)).astype(np.int32)
        name = bias.name + TENSOR_NAME_QUANT_SUFFIX
        stored[name].CopyFrom(numpy_helper.from_array(values, name))
    onnx.save(model, quantized)
    return len(layers)


def _channel_means(model: onnx.ModelProto, names: list[str], samples: list[Sample]) -> dict[str, np.ndarray]:
    """Mean [channels] of tensors [N, channels, h, w] over the samples."""
    model = onnx.ModelProto.FromString(model.SerializeToString())
    for name in names:
        node = helper.make_node("ReduceMean", [name], [f"{name}/mean"], axes=[0, 2, 3], keepdims=0)
        model.graph.node.append(node)
        model.graph.output.append(helper.make_tensor_value_info(f"{name}/mean", onnx.TensorProto.FLOAT, None))
    session = float_session(model)
    sums = dict.fromkeys(names, 0.0)
    for sample in samples:
        for name, value in zip(names, session.run([f"{name}/mean" for name in names], sample), strict=True):
            sums[name] = sums[name] + value.astype(np.float64)
    return {name: value / len(samples) for name, value in sums.items()}
