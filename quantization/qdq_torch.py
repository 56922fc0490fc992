"""A quantised (QDQ) graph in torch, with gradients: what is rounded in the forward pass is not in the backward pass.

Runs the operators that the dense pose graphs consist of, as ONNX defines them, so that the integers which come out of
training belong to the very graph that they came from.
"""

from __future__ import annotations

import numpy as np
import onnx
import torch
from onnx import helper, numpy_helper
from onnxruntime.quantization.quant_utils import TENSOR_NAME_QUANT_SUFFIX
from torch import Tensor, nn
from torch.nn import functional as F

from quantization import qdq

# Weights of 7 bits lie between these, those of 8 between the others (onnxruntime.quantization, symmetric).
SEVEN_BITS, EIGHT_BITS = (-64, 64), (-127, 127)


class QdqGraph(nn.Module):
    """Weights and biases that the graph stores as integers are parameters, in float; scales and the rest are fixed.

    quantised: the int8 graph; reference: the float graph it was made from, whose weights are the first values
    (biases keep what correction made of them).
    """

    def __init__(self, quantised: onnx.ModelProto, reference: onnx.ModelProto) -> None:
        super().__init__()
        graph = quantised.graph
        self.inputs = [value.name for value in graph.input]
        self.outputs = [value.name for value in graph.output]
        self._nodes = [(node, {a.name: helper.get_attribute_value(a) for a in node.attribute}) for node in graph.node]
        self._fixed = {value.name: torch.from_numpy(numpy_helper.to_array(value).copy()) for value in graph.initializer}
        for node, attributes in self._nodes:
            if node.op_type == "Constant":
                self._fixed[node.output[0]] = torch.from_numpy(numpy_helper.to_array(attributes["value"]).copy())
        self._weights = qdq.weights(graph, reference.graph)
        self.values = nn.ParameterList(
            nn.Parameter(torch.from_numpy((w.dequantised() if self._is_bias(w) else w.expected).astype(np.float32)))
            for w in self._weights
        )

    @staticmethod
    def _is_bias(weight: qdq.Weight) -> bool:
        return weight.stored.dtype == np.int32

    @staticmethod
    def _limits(weight: qdq.Weight) -> tuple[int, int]:
        within = np.abs(weight.stored.astype(np.int64)).max() <= SEVEN_BITS[1]
        return SEVEN_BITS if within else EIGHT_BITS

    def _rounded(self, weight: qdq.Weight, value: Tensor) -> Tensor:
        """The float value through its integers. A bias has 32 bits, so that rounding it changes nothing."""
        if self._is_bias(weight):
            return value
        scale, zero = (torch.from_numpy(x.copy()) for x in (weight.scale, weight.zero_point.astype(np.int32)))
        low, high = self._limits(weight)
        if weight.scale.size == 1:
            return torch.fake_quantize_per_tensor_affine(value, scale[0], zero[0], low, high)
        return torch.fake_quantize_per_channel_affine(value, scale, zero, weight.axis, low, high)

    def forward(self, *given: Tensor) -> list[Tensor]:
        """Outputs in the graph's order."""
        known: dict[str, Tensor] = dict(self._fixed)
        known |= dict(zip(self.inputs, given, strict=True))
        known |= {w.output: self._rounded(w, value) for w, value in zip(self._weights, self.values, strict=True)}
        for node, attributes in self._nodes:
            if node.output[0] not in known:
                known[node.output[0]] = self._run(node, attributes, known)
        return [known[name] for name in self.outputs]

    def _run(self, node: onnx.NodeProto, attributes: dict, known: dict[str, Tensor]) -> Tensor:
        x, *rest = (known[name] if name else None for name in node.input)
        match node.op_type:
            case "QuantizeLinear":
                # Kept as the float values that the integers stand for.
                return torch.fake_quantize_per_tensor_affine(x, rest[0], rest[1].to(torch.int32), 0, 255)
            case "DequantizeLinear":
                factor = self._factor(node)
                return x if factor == 1 else x * factor
            case "Conv":
                top, left, bottom, right = attributes.get("pads", [0] * 4)
                if (top, left) != (bottom, right):
                    x, top, left = F.pad(x, (left, right, top, bottom)), 0, 0
                bias = rest[1] if len(rest) > 1 else None
                options = {"stride": attributes.get("strides", 1), "dilation": attributes.get("dilations", 1)}
                return F.conv2d(x, rest[0], bias, padding=(top, left), groups=attributes.get("group", 1), **options)
            case "Gemm":
                return F.linear(x, rest[0] if attributes.get("transB") else rest[0].T, rest[1])
            case "MatMul":
                return x @ rest[0]
            case "Add":
                return x + rest[0]
            case "Mul":
                return x * rest[0]
            case "Relu":
                return x.relu()
            case "Clip":
                return x.clamp(rest[0], rest[1])
            case "MaxPool":
                return F.max_pool2d(x, attributes["kernel_shape"], attributes["strides"])
            case "GlobalAveragePool":
                return x.mean((2, 3), keepdim=True)
            case "Concat":
                return torch.cat([x, *rest], attributes["axis"])
            case "Transpose":
                return x.permute(attributes["perm"])
            case "Flatten":
                return x.flatten(attributes["axis"])
            case "Shape":
                return torch.tensor(x.shape)
            case "Reshape":
                return x.reshape([x.shape[k] if size == 0 else size for k, size in enumerate(rest[0].tolist())])
        raise NotImplementedError(f"{node.name} is {node.op_type}, which quantization.qdq_torch does not know")

    def _factor(self, node: onnx.NodeProto) -> float:
        """What an activation is multiplied by where it is dequantised by another scale (quantization.simplify)."""
        if not hasattr(self, "_scales"):
            self._scales = {n.output[0]: n.input[1] for n, _ in self._nodes if n.op_type == "QuantizeLinear"}
        own = self._scales[node.input[0]]
        return 1.0 if own == node.input[1] else float(self._fixed[node.input[1]] / self._fixed[own])

    @torch.no_grad()
    def write(self, quantised: onnx.ModelProto) -> None:
        """Puts the trained values into the graph, as integers."""
        stored = {value.name: value for value in quantised.graph.initializer}
        for weight, value in zip(self._weights, self.values, strict=True):
            shape = [1] * weight.stored.ndim
            shape[weight.axis if weight.scale.size > 1 else 0] = -1
            integers = np.rint(value.double().numpy() / weight.scale.astype(np.float64).reshape(shape))
            integers += weight.zero_point.astype(np.float64).reshape(shape)
            if not self._is_bias(weight):
                integers = np.clip(integers, *self._limits(weight))
            name = weight.name + TENSOR_NAME_QUANT_SUFFIX
            stored[name].CopyFrom(numpy_helper.from_array(integers.astype(weight.stored.dtype), name))
