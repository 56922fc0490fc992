"""Weights rounded together: what rounding one weight loses, those that are rounded after it make up for.

Rounded each by itself, the weights of a layer err independently. Its inputs are not independent (neighbouring pixels
are alike, and what follows a ReLU is never negative), so that errors of some weights can cancel those of others. With
H the mean of x x^T over the layer's inputs x, an output's expected squared error is e^T H e; weights are rounded one
after another, and the rest moves to where the error is least (Frantar et al., "GPTQ", ICLR 2023, after Hassibi and
Stork's "Optimal Brain Surgeon"). The integers change, scales do not.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnx
import torch
from onnx import helper, numpy_helper
from onnxruntime.quantization.quant_utils import TENSOR_NAME_QUANT_SUFFIX
from torch.nn import functional as F

from quantization.graphs import qdq
from quantization.graphs.activations import Activations
from quantization.samples import Sample

DAMPING = 0.01  # of H's mean diagonal: inputs that were never seen apart must not count for nothing
PIXELS = 512  # of a sample's input, at most: they are alike


def round_together(prepared: Path, quantized: Path, samples: list[Sample], limit: int) -> int:
    """Changes the int8 graph in place; returns how many layers. limit: the largest integer of a weight.

    Depthwise layers are left alone: their few weights have all 8 bits.
    """
    reference, model = onnx.load(prepared), onnx.load(quantized)
    held = {w.output: w for w in qdq.weights(model.graph, reference.graph)}
    layers = {n.name: n for n in qdq.heavy_nodes(reference.graph) if n.op_type == "Conv" and _groups(n) == 1}
    chosen = {n.name: held[n.input[1]] for n in qdq.heavy_nodes(model.graph) if n.name in layers and n.input[1] in held}
    sharing: dict[str, list[str]] = {}  # layers by the weight they read: kernels shared by levels are rounded once
    for name, weight in chosen.items():
        sharing.setdefault(weight.name, []).append(name)
    moments = input_moments(reference, [layers[name] for name in chosen], samples)
    stored = {value.name: value for value in model.graph.initializer}
    for name, nodes in sharing.items():
        weight = chosen[nodes[0]]
        moment = sum(moments[node] for node in nodes)
        flat = weight.expected.astype(np.float64).reshape(len(weight.expected), -1)
        integers = rounded(flat, moment, weight.scale.astype(np.float64), limit)
        key = name + TENSOR_NAME_QUANT_SUFFIX
        stored[key].CopyFrom(numpy_helper.from_array(integers.reshape(weight.stored.shape).astype(np.int8), key))
    onnx.save(model, quantized)
    return len(chosen)


def rounded(weights: np.ndarray, moment: np.ndarray, scale: np.ndarray, limit: int) -> np.ndarray:
    """Integers [out, in] of float weights [out, in]; scale: [out] or [1]; moment: [in, in], the mean of x x^T."""
    size = weights.shape[1]
    damped = moment + np.eye(size) * (DAMPING * np.trace(moment) / size + 1e-12)
    # The columns in falling order of what their inputs weigh: the last ones have nobody left to make up for them.
    order = np.argsort(-np.diag(damped), kind="stable")
    # Row k of the upper Cholesky factor of the inverse: how the columns after k make up for an error in column k.
    upper = np.linalg.cholesky(np.linalg.inv(damped[np.ix_(order, order)])).T
    left, steps = weights[:, order].copy(), np.broadcast_to(scale, len(weights))
    integers = np.empty_like(left)
    for k in range(size):
        integers[:, k] = np.clip(np.rint(left[:, k] / steps), -limit, limit)
        error = (left[:, k] - integers[:, k] * steps) / upper[k, k]
        left[:, k + 1 :] -= np.outer(error, upper[k, k + 1 :])
    return integers[:, np.argsort(order)]


def input_moments(
    reference: onnx.ModelProto, layers: list[onnx.NodeProto], samples: list[Sample]
) -> dict[str, np.ndarray]:
    """The sum of x x^T over the samples by layer; x: what one output pixel reads, [in * kernel rows * columns]."""
    run = Activations(reference, sorted({node.input[0] for node in layers}))
    kernels = qdq.constants(reference.graph)
    chance = np.random.default_rng(0)
    sums = dict.fromkeys((node.name for node in layers), 0.0)
    for sample in samples:
        seen = run(sample)
        for node in layers:
            columns = _columns(seen[node.input[0]], node, kernels[node.input[1]].shape[2:])
            if columns.shape[1] > PIXELS:
                columns = columns[:, chance.choice(columns.shape[1], PIXELS, replace=False)]
            columns = columns.astype(np.float64)
            sums[node.name] = sums[node.name] + columns @ columns.T / columns.shape[1]
    return sums


def _columns(values: np.ndarray, node: onnx.NodeProto, kernel: tuple[int, ...]) -> np.ndarray:
    """[in * kernel rows * columns, pixels] of an input [N, in, h, w]."""
    options = {a.name: helper.get_attribute_value(a) for a in node.attribute}
    top, left, bottom, right = options.get("pads", [0] * 4)
    padded = F.pad(torch.from_numpy(values), (left, right, top, bottom))
    dilation, stride = options.get("dilations", [1, 1]), options.get("strides", [1, 1])
    columns = F.unfold(padded, tuple(kernel), dilation=dilation, stride=stride)
    return columns.permute(1, 0, 2).flatten(1).numpy()


def _groups(node: onnx.NodeProto) -> int:
    return next((a.i for a in node.attribute if a.name == "group"), 1)
