"""Converts the graphs of a dense pose bundle to TensorFlow Lite files, which LiteRT runs with the kernels of XNNPACK.

Sizes are fixed. Maps are channels last, so that transposes vanish. 8-bit activations become signed: values and zero
points decrease by 128. Weights, scales and the order of the layers stay.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import flatbuffers
import numpy as np
import onnx
from ai_edge_litert import schema_py_generated as tfl
from onnx import helper, numpy_helper, shape_inference

Feed = dict[str, np.ndarray]
IMAGE = "image"  # the only input with channels first in ONNX
VERSIONS = {
    "RESHAPE": 1,
    "CONV_2D": 3,
    "DEPTHWISE_CONV_2D": 3,
    "FULLY_CONNECTED": 5,
}  # versions of operators; others have version 2
TYPES = {"float32": tfl.TensorType.FLOAT32, "int8": tfl.TensorType.INT8, "int32": tfl.TensorType.INT32}


def to_channels_last(shape: list[int]) -> list[int]:
    return [shape[0], *shape[2:], shape[1]] if len(shape) == 4 else list(shape)


@dataclass
class Writer:
    """Builds a model with one subgraph from tensors and operators."""

    graph: tfl.SubGraphT = field(default_factory=tfl.SubGraphT)
    buffers: list = field(default_factory=lambda: [tfl.BufferT()])  # the format requires an empty first buffer
    codes: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.graph.tensors, self.graph.operators = [], []

    def tensor(self, name: str, shape: list[int], kind: str, scale: tuple | None = None, data: np.ndarray | None = None,
               axis: int = 0) -> int:  # fmt: skip
        """Adds a tensor and returns its index. scale: (scales [K], zero points [K]) along `axis`. data: values of a
        constant."""
        tensor = tfl.TensorT()
        tensor.name, tensor.shape, tensor.type = name, [int(size) for size in shape], TYPES[kind]
        tensor.buffer = 0
        if data is not None:
            buffer = tfl.BufferT()
            buffer.data = np.frombuffer(np.ascontiguousarray(data).tobytes(), np.uint8)
            tensor.buffer = len(self.buffers)
            self.buffers.append(buffer)
        if scale is not None:
            tensor.quantization = tfl.QuantizationParametersT()
            tensor.quantization.scale = [float(x) for x in np.atleast_1d(scale[0])]
            tensor.quantization.zeroPoint = [int(x) for x in np.broadcast_to(scale[1], np.atleast_1d(scale[0]).shape)]
            tensor.quantization.quantizedDimension = axis
        self.graph.tensors.append(tensor)
        return len(self.graph.tensors) - 1

    def operator(self, name: str, inputs: list[int], output: int, options: object = None) -> None:
        if name not in self.codes:
            self.codes.append(name)
        operator = tfl.OperatorT()
        operator.opcodeIndex, operator.inputs, operator.outputs = self.codes.index(name), inputs, [output]
        if options is not None:
            operator.builtinOptions = options
            operator.builtinOptionsType = getattr(tfl.BuiltinOptions, type(options).__name__.removesuffix("T"))
        self.graph.operators.append(operator)

    def shape_of(self, index: int) -> list[int]:
        return self.graph.tensors[index].shape

    def scale_of(self, index: int) -> tuple | None:
        quantization = self.graph.tensors[index].quantization
        return (quantization.scale, quantization.zeroPoint) if quantization is not None else None

    def bytes(self) -> bytes:
        model = tfl.ModelT()
        model.version, model.subgraphs, model.buffers, model.operatorCodes = 3, [self.graph], self.buffers, []
        for name in self.codes:
            code = tfl.OperatorCodeT()
            code.builtinCode = code.deprecatedBuiltinCode = getattr(tfl.BuiltinOperator, name)
            code.version = VERSIONS.get(name, 2)
            model.operatorCodes.append(code)
        builder = flatbuffers.Builder(1 << 20)
        builder.Finish(model.Pack(builder), b"TFL3")
        return bytes(builder.Output())


class Converter:
    """Converts one ONNX graph at the sizes of `feed`."""

    def __init__(self, path: Path, feed: Feed) -> None:
        model = onnx.load(path)
        for value in model.graph.input:
            for dimension, size in zip(value.type.tensor_type.shape.dim, feed[value.name].shape, strict=True):
                dimension.dim_value = size
        for value in model.graph.output:
            value.type.tensor_type.ClearField("shape")
        self.graph = shape_inference.infer_shapes(model, data_prop=True).graph
        values = [*self.graph.value_info, *self.graph.input, *self.graph.output]
        self.shapes = {x.name: [d.dim_value for d in x.type.tensor_type.shape.dim] for x in values}
        self.constants = {x.name: numpy_helper.to_array(x) for x in self.graph.initializer}
        self.producers = {name: node for node in self.graph.node for name in node.output}
        self.consumers: dict[str, list] = {}
        for node in self.graph.node:
            for name in node.input:
                self.consumers.setdefault(name, []).append(node)
        self.writer = Writer()
        self.tensors: dict[str, int] = {}  # tensor index by the value's name in ONNX
        self.last: set[str] = set()  # values that have channels last in ONNX too
        self.aliases: dict[str, str] = {}

    def constant(self, name: str) -> np.ndarray | None:
        """Returns the value of a constant; quantized constants are dequantized."""
        if name in self.constants:
            return self.constants[name]
        node = self.producers.get(name)
        if node is None or node.op_type not in ("Constant", "QuantizeLinear", "DequantizeLinear"):
            return None
        if node.op_type == "Constant":
            return numpy_helper.to_array(node.attribute[0].t)
        x, scale, *zeros = (self.constant(x) for x in node.input)
        if x is None:
            return None
        zero = zeros[0] if zeros else np.zeros(scale.shape, x.dtype if node.op_type == "DequantizeLinear" else np.uint8)
        if node.op_type == "DequantizeLinear":
            along = [1] * x.ndim
            if scale.ndim:
                along[attributes_of(node).get("axis", 1)] = -1
            return (x.astype(np.float32) - zero.astype(np.float32).reshape(along)) * scale.reshape(along)
        limits = np.iinfo(zero.dtype)
        return np.clip(np.rint(x / scale) + zero, limits.min, limits.max).astype(zero.dtype)

    def scale(self, node: onnx.NodeProto) -> tuple:
        """Returns scale and zero point of a node that quantizes activations; the zero point is for signed numbers."""
        scale, zero = self.constant(node.input[1]), self.constant(node.input[2])
        return scale, int(zero) - (128 if zero.dtype == np.uint8 else 0)

    def convert(self) -> bytes:
        """Converts one node. Raises ValueError for an unknown operator."""
        for value in self.graph.input:
            shape = self.shapes[value.name]
            if value.name != IMAGE:
                self.last.add(value.name)
            shape = shape if value.name in self.last else to_channels_last(shape)
            self.tensors[value.name] = self.writer.tensor(value.name, shape, "float32")
        self.writer.graph.inputs = [self.tensors[value.name] for value in self.graph.input]
        for node in self.graph.node:
            if self.constant(node.output[0]) is None and node.output[0] not in self.tensors:
                self.node(node)
        self.writer.graph.outputs = [self.as_float(self.tensors[value.name]) for value in self.graph.output]
        return self.writer.bytes()

    def node(self, node: onnx.NodeProto) -> None:
        kind, source = node.op_type, node.input[0]
        if source in self.last and kind not in ("Transpose", "Shape"):
            self.last.add(node.output[0])
        if kind == "Shape":
            return
        if kind == "QuantizeLinear":
            self.quantize(node)
        elif kind == "DequantizeLinear":
            self.dequantize(node)
        elif kind == "Transpose":
            if list(attributes_of(node)["perm"]) == [0, 2, 3, 1]:
                self.last.add(node.output[0])
            elif source not in self.last:
                raise ValueError(f"{node.name}: an unknown transpose")
            self.tensors[node.output[0]] = self.tensors[source]
        elif kind in MAKERS:
            MAKERS[kind](self, node)
        else:
            raise ValueError(f"{node.name}: {kind} is not known")

    def quantize(self, node: onnx.NodeProto) -> None:
        source = self.tensors[node.input[0]]
        scale = self.scale(node)
        found = self.writer.scale_of(source)
        if found is not None and np.isclose(found[0][0], scale[0], rtol=1e-6, atol=0) and list(found[1]) == [scale[1]]:
            self.tensors[node.output[0]] = source
            return
        out = self.writer.tensor(node.output[0], self.writer.shape_of(source), "int8", scale)
        self.writer.operator("QUANTIZE", [source], out, tfl.QuantizeOptionsT())
        self.tensors[node.output[0]] = out

    def dequantize(self, node: onnx.NodeProto) -> None:
        """Keeps 8-bit numbers and dequantizes for operators that need floats. If the scale differs from that of the
        numbers, a product is added: the bundle multiplies by constants in this way."""
        source, (scale, zero) = self.tensors[node.input[0]], self.scale(node)
        found = self.writer.scale_of(source)
        if np.isclose(found[0][0], scale, rtol=1e-6, atol=0) and found[1][0] == zero:
            self.tensors[node.output[0]] = source
            return
        if found[1][0] != zero:
            raise ValueError(f"{node.name}: another zero point than that of its numbers")
        factor = self.writer.tensor(
            f"{node.output[0]}_factor", [1], "int8", (scale / found[0][0], 0), np.array([1], np.int8)
        )
        out = self.writer.tensor(node.output[0], self.writer.shape_of(source), "int8", (scale, zero))
        self.writer.operator("MUL", [source, factor], out, tfl.MulOptionsT())
        self.tensors[node.output[0]] = out

    def end_of(self, node: onnx.NodeProto) -> tuple[onnx.NodeProto, int]:
        """Returns the node whose output ends this operator, and its activation: a ReLU or a clip to 6 is fused."""
        none, relu = tfl.ActivationFunctionType.NONE, tfl.ActivationFunctionType.RELU
        following = self.consumers.get(node.output[0], [])
        if len(following) != 1 or following[0].op_type not in ("Clip", "Relu"):
            return node, none
        if following[0].op_type == "Relu":
            return following[0], relu
        if [float(self.constant(x)) for x in following[0].input[1:]] != [0.0, 6.0]:
            raise ValueError(f"{following[0].name}: a clip that is not to 0 and 6")
        return following[0], tfl.ActivationFunctionType.RELU6

    def inputs_and_output(self, node: onnx.NodeProto, names: list[str], end: onnx.NodeProto,
                          shape: list[int] | None = None) -> tuple[list[int], int]:  # fmt: skip
        """Returns the tensors of the inputs, as 8-bit numbers if the result is quantized at once, otherwise as floats;
        and the output."""
        name = end.output[0]
        following = self.consumers.get(name, [])
        tensors = [self.tensors[x] for x in names]
        quantized = [self.writer.scale_of(x) is not None for x in tensors]
        if shape is None:
            shape = (
                self.shapes[name]
                if name in self.last or node.output[0] in self.last
                else to_channels_last(self.shapes[name])
            )
        if all(quantized) and len(following) == 1 and following[0].op_type == "QuantizeLinear":
            output = following[0].output[0]
            index = self.writer.tensor(output, shape, "int8", self.scale(following[0]))
            self.tensors[output] = index
        else:
            tensors = [self.as_float(x) for x in tensors]
            index = self.writer.tensor(name, shape, "float32")
        self.tensors[name] = index
        if node.output[0] in self.last:
            self.last.update([name, *(x.output[0] for x in following if x.op_type == "QuantizeLinear")])
        return tensors, index

    def as_float(self, index: int) -> int:
        if self.writer.scale_of(index) is None:
            return index
        name = f"{self.writer.graph.tensors[index].name}_float"
        out = self.writer.tensor(name, self.writer.shape_of(index), "float32")
        self.writer.operator("DEQUANTIZE", [index], out, tfl.DequantizeOptionsT())
        return out

    def weights(self, name: str, bias: str | None, source: int, order: list[int], axis: int) -> list[int]:
        """Returns tensors of a layer's weight, with axes in `order`, and of its bias; integers if `source` has
        integers."""
        weight = self.constant(name)
        count = weight.transpose(order).shape[axis]
        values = np.zeros(count, np.float32) if bias is None else self.constant(bias)
        found = self.writer.scale_of(source)
        if found is None:
            weight = weight.transpose(order).astype(np.float32)
            return [self.writer.tensor(name, weight.shape, "float32", data=weight),
                    self.writer.tensor(f"{name}_bias", [count], "float32", data=values.astype(np.float32))]  # fmt: skip
        node = self.producers[name]
        weight, scale = self.constant(node.input[0]).transpose(order), np.atleast_1d(self.constant(node.input[1]))
        scale = np.broadcast_to(scale, (count,))
        sums = found[0][0] * scale.astype(np.float64)
        rounded = np.rint(values / sums).astype(np.int32)
        return [self.writer.tensor(name, weight.shape, "int8", (scale, 0), weight, axis),
                self.writer.tensor(f"{name}_bias", [count], "int32", (sums, 0), rounded)]  # fmt: skip

    def padded(self, node: onnx.NodeProto, source: int, attributes: dict) -> tuple[int, int]:
        """Returns the source, padded if the format has no such padding, and the padding for the layer."""
        pads, strides = list(attributes.get("pads", [0] * 4)), list(attributes.get("strides", [1, 1]))
        kernel, dilations = attributes["kernel_shape"], attributes.get("dilations", [1, 1])
        if not any(pads):
            return source, tfl.Padding.VALID
        totals = [d * (k - 1) for k, d in zip(kernel, dilations, strict=True)]
        if strides == [1, 1] and pads == [
            totals[0] // 2,
            totals[1] // 2,
            totals[0] - totals[0] // 2,
            totals[1] - totals[1] // 2,
        ]:
            return source, tfl.Padding.SAME
        amounts = np.array([[0, 0], [pads[0], pads[2]], [pads[1], pads[3]], [0, 0]], np.int32)
        shape = (np.array(self.writer.shape_of(source)) + amounts.sum(1)).tolist()
        scale = self.writer.scale_of(source)
        out = self.writer.tensor(f"{node.output[0]}_padded", shape, "float32" if scale is None else "int8", scale)
        pad = self.writer.tensor(f"{node.output[0]}_pads", [4, 2], "int32", data=amounts)
        self.writer.operator("PAD", [source, pad], out, tfl.PadOptionsT())
        return out, tfl.Padding.VALID

    def conv(self, node: onnx.NodeProto) -> None:
        attributes = attributes_of(node)
        end, activation = self.end_of(node)
        (source,), out = self.inputs_and_output(node, [node.input[0]], end)
        depthwise = attributes.get("group", 1) > 1
        if depthwise and attributes["group"] != self.writer.shape_of(source)[3]:
            raise ValueError(f"{node.name}: groups of more than one channel")
        options = tfl.DepthwiseConv2DOptionsT() if depthwise else tfl.Conv2DOptionsT()
        source, options.padding = self.padded(node, source, attributes)
        options.strideH, options.strideW = attributes.get("strides", [1, 1])
        options.dilationHFactor, options.dilationWFactor = attributes.get("dilations", [1, 1])
        options.fusedActivationFunction = activation
        if depthwise:
            options.depthMultiplier = 1
        bias = node.input[2] if len(node.input) > 2 else None
        order, axis = ([1, 2, 3, 0], 3) if depthwise else ([0, 2, 3, 1], 0)
        weights = self.weights(node.input[1], bias, source, order, axis)
        self.writer.operator("DEPTHWISE_CONV_2D" if depthwise else "CONV_2D", [source, *weights], out, options)

    def dense(self, node: onnx.NodeProto) -> None:
        """Converts Gemm, or MatMul with the Add of its bias."""
        gemm, end, bias = node.op_type == "Gemm", node, None
        if gemm:
            bias = node.input[2]
        else:
            (following,) = self.consumers[node.output[0]]
            if following.op_type == "Add":
                end = following
                (bias,) = (x for x in following.input if x != node.output[0])
        shape = self.shapes[end.output[0]]
        (source,), out = self.inputs_and_output(node, [node.input[0]], end, shape)
        order = [0, 1] if gemm and attributes_of(node).get("transB") else [1, 0]
        options = tfl.FullyConnectedOptionsT()
        options.keepNumDims = len(shape) > 2
        self.writer.operator(
            "FULLY_CONNECTED", [source, *self.weights(node.input[1], bias, source, order, 0)], out, options
        )

    def arithmetic(self, node: onnx.NodeProto) -> None:
        kind = node.op_type
        end, activation = self.end_of(node)
        for name in node.input:
            if name not in self.tensors:
                value = self.constant(name).astype(np.float32)
                quantizer = self.producers.get(name)
                if quantizer is not None and quantizer.op_type == "DequantizeLinear":
                    scale, zero = self.scale(quantizer)
                    number = np.rint(value / scale + zero).astype(np.int8)
                    self.tensors[name] = self.writer.tensor(name, value.shape, "int8", (scale, zero), number)
                else:
                    self.tensors[name] = self.writer.tensor(name, value.shape, "float32", data=value)
        inputs, out = self.inputs_and_output(node, list(node.input), end)
        options = tfl.AddOptionsT() if kind == "Add" else tfl.MulOptionsT()
        options.fusedActivationFunction = activation
        self.writer.operator(kind.upper(), inputs, out, options)

    def same_scale(self, inputs: list[int], out: int) -> list[int]:
        """Returns the inputs with the scale of the output, which nodes that only move numbers need."""
        scale = self.writer.scale_of(out)
        found = []
        for index in inputs:
            if scale is not None and self.writer.scale_of(index) != scale:
                name = f"{self.writer.graph.tensors[index].name}_scaled_for_{out}"
                again = self.writer.tensor(name, self.writer.shape_of(index), "int8", scale)
                self.writer.operator("QUANTIZE", [index], again, tfl.QuantizeOptionsT())
                index = again
            found.append(index)
        return found

    def concat(self, node: onnx.NodeProto) -> None:
        inputs, out = self.inputs_and_output(node, list(node.input), node)
        options = tfl.ConcatenationOptionsT()
        axis = attributes_of(node)["axis"]
        options.axis = axis if node.output[0] in self.last else [0, 3, 1, 2][axis]
        self.writer.operator("CONCATENATION", self.same_scale(inputs, out), out, options)

    def reshape(self, node: onnx.NodeProto) -> None:
        if node.input[0] not in self.last:
            raise ValueError(f"{node.name}: a reshape of maps whose channels come first")
        shape = self.shapes[node.output[0]]
        inputs, out = self.inputs_and_output(node, [node.input[0]], node, shape)
        options = tfl.ReshapeOptionsT()
        options.newShape = shape
        target = self.writer.tensor(f"{node.output[0]}_shape", [len(shape)], "int32", data=np.array(shape, np.int32))
        self.writer.operator("RESHAPE", [*self.same_scale(inputs, out), target], out, options)

    def max_pool(self, node: onnx.NodeProto) -> None:
        attributes = attributes_of(node)
        inputs, out = self.inputs_and_output(node, [node.input[0]], node)
        options = tfl.Pool2DOptionsT()
        options.padding = tfl.Padding.VALID
        options.strideH, options.strideW = attributes["strides"]
        options.filterHeight, options.filterWidth = attributes["kernel_shape"]
        self.writer.operator("MAX_POOL_2D", self.same_scale(inputs, out), out, options)

    def mean(self, node: onnx.NodeProto) -> None:
        inputs, out = self.inputs_and_output(node, [node.input[0]], node)
        options = tfl.ReducerOptionsT()
        options.keepDims = True
        axes = self.writer.tensor(f"{node.output[0]}_axes", [2], "int32", data=np.array([1, 2], np.int32))
        self.writer.operator("MEAN", [*inputs, axes], out, options)


MAKERS = {"Conv": Converter.conv, "Gemm": Converter.dense, "MatMul": Converter.dense, "Add": Converter.arithmetic,
          "Mul": Converter.arithmetic, "Concat": Converter.concat, "Reshape": Converter.reshape,
          "Flatten": Converter.reshape, "MaxPool": Converter.max_pool, "GlobalAveragePool": Converter.mean}  # fmt: skip


def attributes_of(node: onnx.NodeProto) -> dict:
    return {attribute.name: helper.get_attribute_value(attribute) for attribute in node.attribute}


def channels_last(feed: Feed) -> list[np.ndarray]:
    """Returns the inputs in the layout of `from_onnx`: the image [1, 3, H, W] of the ONNX graph as [1, H, W, 3]."""
    return [np.ascontiguousarray(x.transpose(0, 2, 3, 1)) if name == IMAGE else x for name, x in feed.items()]


def from_onnx(path: Path, feed: Feed) -> bytes:
    """Returns a TensorFlow Lite file with the function of the ONNX graph, for inputs with the shapes of `feed`.

    Maps of inputs and outputs are [N, H, W, C]. Raises ValueError for what the converter does not know.
    """
    return Converter(path, feed).convert()
