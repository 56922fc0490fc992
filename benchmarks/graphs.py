"""Prepares the graphs of a bundle with their inputs for a photo, and counts their operations, for runtimes and
roofline."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import onnx
from onnx import helper, shape_inference

from export.densepose import targets as tg
from export.densepose.bundle import GRAPHS
from export.densepose.decode import detect
from export.densepose.graphs import Bundle

PHOTO = Path("tests/media/photo.jpg")
Feed = dict[str, np.ndarray]


def four_by_three(path: Path = PHOTO) -> np.ndarray:
    """Returns the middle of a photo in the shape of a camera frame, uint8 [480, 640, 3] RGB."""
    image = cv2.imread(str(path), cv2.IMREAD_COLOR)
    if image is None:
        raise ValueError(f"{path} cannot be read as a photograph.")
    height, width = image.shape[:2]
    rows = min(height, width * 3 // 4)
    top = (height - rows) // 2
    return cv2.resize(image[top : top + rows], (640, 480), interpolation=cv2.INTER_AREA)[..., ::-1].copy()


def feeds_of(bundle: Bundle, image: np.ndarray) -> dict[str, Feed]:
    """Returns the inputs of each graph for `image` (uint8 [H, W, 3] RGB), with the best person alone in the dense
    head."""
    network = bundle.network
    found = detect(bundle.graphs, image, network, bundle.decode)
    if not len(found.boxes):
        raise ValueError("the bundle finds no person in the image that the graphs are measured with")
    given = {
        "trunk": [found.tensor],
        "rpn_fine": found.features[:1],
        "rpn_coarse": found.features[1:],
        "box_head": [tg.pooled(found.features, [found.proposed], network, network.box_pool)],
        "dense_head": [tg.pooled(found.features, [found.boxes[:1]], network, network.dense_pool, level=0)],
    }
    feeds = {}
    for name in GRAPHS:
        inputs = [value["name"] for value in bundle.manifest["graphs"][name]["inputs"]]
        tensors = given[name] if name == "trunk" else [t.permute(0, 2, 3, 1) for t in given[name]]
        feeds[name] = {x: np.ascontiguousarray(t.numpy()) for x, t in zip(inputs, tensors, strict=True)}
    return feeds


@dataclass(frozen=True)
class Work:
    """The work of one node. macs: multiply-adds; bytes: inputs, weights and outputs, each moved once. integer: whether
    it computes on 8-bit numbers."""

    node: str
    macs: int
    bytes: int
    integer: bool


def work_of(path: Path, feed: Feed) -> list[Work]:
    """Returns the convolutions and matrix products of a graph at the sizes of `feed`."""
    model = onnx.load(path)
    for value in model.graph.input:
        for dimension, size in zip(value.type.tensor_type.shape.dim, feed[value.name].shape, strict=True):
            dimension.dim_value = size
    for value in model.graph.output:
        value.type.tensor_type.ClearField("shape")
    graph = shape_inference.infer_shapes(model, data_prop=True).graph
    shapes = {x.name: [d.dim_value for d in x.type.tensor_type.shape.dim] for x in [*graph.value_info, *graph.input]}
    shapes |= {x.name: [d.dim_value for d in x.type.tensor_type.shape.dim] for x in graph.output}
    shapes |= {x.name: list(x.dims) for x in graph.initializer}
    dequantized = {name for node in graph.node if node.op_type == "DequantizeLinear" for name in node.output}
    work = []
    for node in graph.node:
        if node.op_type not in ("Conv", "ConvTranspose", "Gemm", "MatMul"):
            continue
        source, weight, out = (shapes.get(name, []) for name in (node.input[0], node.input[1], node.output[0]))
        if not all([source, weight, out]) or 0 in [*source, *weight, *out]:
            raise ValueError(f"{path}: sizes at {node.name} are not known; export the bundle again")
        integer = node.input[1] in dequantized
        size = 1 if integer else 4
        moved = size * sum(int(np.prod(shape)) for shape in (source, weight, out))
        work.append(Work(node.name, multiply_adds(node, source, weight, out), moved, integer))
    return work


def multiply_adds(node: onnx.NodeProto, source: list[int], weight: list[int], out: list[int]) -> int:
    """Returns the multiply-adds of one node, from the shapes of its first input, weight and output."""
    if node.op_type == "Conv":
        return int(np.prod(out)) * int(np.prod(weight[1:]))
    if node.op_type == "ConvTranspose":
        return int(np.prod(source)) * int(np.prod(weight[1:]))
    transposed = {a.name: helper.get_attribute_value(a) for a in node.attribute}.get("transB", 0)
    return int(np.prod(out)) * weight[1 if transposed else -2]
