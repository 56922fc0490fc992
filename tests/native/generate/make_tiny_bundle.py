"""Writes data/tiny_bundle: a model bundle of the real interface whose answers are known without training.

The networks see colours. In a black image, one pixel cell of pure colour is one person:
red at a cell of P2 is a person of 32 px, green at a cell of P3 one of 64 px, blue at a cell of P4 one of 128 px,
each in the square anchor of that cell, shifted right by a tenth of its width (box delta 1 at weight 10).
The dense head answers the same for everybody: the upper quarter of the box is background; of the rest the left half is
part 3 and the right half part 7; U rises from -0.11 at the left to 1.11 at the right, V from 0 at the top to 1.
Keypoint k is in row k and column 63 - k of the 64 x 64 cells; the last one is not shown.
The trunk's output `person`, which the manifest does not ask for (box_head.evidence_stride), is -180 times red, in cells
of 16 px: with it, reddish surroundings speak against a person.

    python -m tests.native.generate.make_tiny_bundle      from the root; needs onnx and numpy
"""

from pathlib import Path

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from export.bundle import OPSET, BundleInfo, write_manifest

CHANNELS = 3
POOL, DENSE_POOL, OUTPUT = 7, 32, 64
COARSE, INDEX, SURFACE, KEYPOINTS = 15, 25, 4, 33


def tensor(name, value):
    return numpy_helper.from_array(np.asarray(value), name)


def graph(name, nodes, inputs, outputs, constants):
    def infos(specs):
        return [helper.make_tensor_value_info(n, TensorProto.FLOAT, shape) for n, shape in specs]

    model = helper.make_model(
        helper.make_graph(nodes, name, infos(inputs), infos(outputs), constants),
        opset_imports=[helper.make_opsetid("", OPSET)],
        ir_version=8,
        producer_name="maquette-tests",
    )
    onnx.checker.check_model(model)
    return model, inputs, outputs


def maps(name, levels, channels):
    return [(f"{name}{level}", [1, f"h{level}", f"w{level}", channels]) for level in levels]


def trunk():
    """Features are mean colours."""
    nodes = []
    for level in range(2, 6):
        size = 2**level
        nodes.append(
            helper.make_node("AveragePool", ["image"], [f"mean{level}"], kernel_shape=[size] * 2, strides=[size] * 2)
        )
    nodes.append(helper.make_node("MaxPool", ["mean5"], ["mean6"], kernel_shape=[1, 1], strides=[2, 2]))
    nodes += [
        helper.make_node("Transpose", [f"mean{level}"], [f"p{level}"], perm=[0, 2, 3, 1]) for level in range(2, 7)
    ]
    nodes.append(helper.make_node("MatMul", ["p4", "evidence.weight"], ["person"]))
    constants = [tensor("evidence.weight", np.array([[-180], [0], [0]], np.float32))]
    outputs = [*maps("p", range(2, 7), CHANNELS), ("person", [1, "h4", "w4", 1])]
    return graph("trunk", nodes, [("image", [1, 3, "height", "width"])], outputs, constants)


def rpn(name, levels):
    """Objectness is 20 where the level's colour fills a cell and -20 where it is absent. Deltas are 0."""
    nodes, constants = [], []
    for level in levels:
        weight = np.zeros((CHANNELS, 15), np.float32)
        if level <= 4:
            weight[level - 2, 1] = 40  # anchor 1 is the square one; colours in the order R, G, B
        bias = np.array([-20] * 3 + [0] * 12, np.float32)
        constants += [tensor(f"weight{level}", weight), tensor(f"bias{level}", bias)]
        nodes += [
            helper.make_node("MatMul", [f"p{level}", f"weight{level}"], [f"product{level}"]),
            helper.make_node("Add", [f"product{level}", f"bias{level}"], [f"rpn{level}"]),
        ]
    return graph(name, nodes, maps("p", levels, CHANNELS), maps("rpn", levels, 15), constants)


def box_head():
    """A person where the middle of the RoI has colour: logit 24 * brightest - 3 against 0."""
    nodes = [
        helper.make_node("Slice", ["rois", "begin", "end", "axes"], ["middle"]),
        helper.make_node("ReduceMax", ["middle"], ["brightest"], axes=[1, 2], keepdims=0),
        helper.make_node("Gemm", ["brightest", "weight", "bias"], ["boxes"]),
    ]
    constants = [
        tensor("begin", np.array([2, 2], np.int64)),
        tensor("end", np.array([5, 5], np.int64)),
        tensor("axes", np.array([1, 2], np.int64)),
        tensor("weight", np.array([[24, 0, 0, 0, 0, 0]] * CHANNELS, np.float32)),
        tensor("bias", np.array([-3, 0, 1, 0, 0, 0], np.float32)),
    ]
    return graph("box_head", nodes, [("rois", ["people", POOL, POOL, CHANNELS])], [("boxes", ["people", 6])], constants)


def fours(cells):
    """[h, w, C] (either side may be 1) with four neighbouring cells together, [1, h / 2, w / 2, 4 C]."""
    height, width, channels = cells.shape
    both = np.broadcast_to(cells, (max(height, 2), max(width, 2), channels))
    both = both.reshape(len(both) // 2, 2, both.shape[1] // 2, 2, channels)
    return np.ascontiguousarray(both.transpose(0, 2, 1, 3, 4).reshape(1, len(both), both.shape[2], 4 * channels))


def dense_head():
    ramp = np.linspace(-1, 1, OUTPUT, dtype=np.float32)
    # Coarse classes depend on the row, the index on the column: two small constants whose sum they are.
    rows = np.zeros((OUTPUT, 1, COARSE + INDEX), np.float32)
    rows[:, 0, 1:COARSE] = -100
    rows[:, 0, 1] = np.where(np.arange(OUTPUT) >= OUTPUT // 4, 10, -10)
    columns = np.zeros((1, OUTPUT, COARSE + INDEX), np.float32)
    columns[0, :, COARSE:] = -100
    columns[0, :, COARSE + 3] = -ramp
    columns[0, :, COARSE + 7] = ramp
    # A cell of `surface` is four of the output. U of its even and of its odd columns, V of its even and its odd rows.
    surface = np.zeros((1, DENSE_POOL, DENSE_POOL, SURFACE), np.float32)
    for parity in (0, 1):
        surface[0, ..., parity] = 0.61 * ramp[parity::2]
        surface[0, ..., 2 + parity] = 0.5 * ramp[parity::2, None]
    nodes = [helper.make_node("Add", ["rows", "columns"], ["labels.value"])]
    constants = [tensor("rows", fours(rows)), tensor("columns", fours(columns)), tensor("surface.value", surface)]
    channels = {"labels": 4 * (COARSE + INDEX), "surface": SURFACE}
    return same_for_everybody("dense_head", nodes, "rois", CHANNELS, constants, channels)


def keypoints():
    rows, columns = np.zeros((OUTPUT, 1, KEYPOINTS), np.float32), np.zeros((1, OUTPUT, KEYPOINTS), np.float32)
    for k in range(KEYPOINTS - 1):
        rows[k, 0, k] = columns[0, OUTPUT - 1 - k, k] = 20
    nodes = [helper.make_node("Add", ["rows", "columns"], ["keypoints.value"])]
    constants = [tensor("rows", fours(rows)), tensor("columns", fours(columns))]
    return same_for_everybody("keypoints", nodes, "surface", SURFACE, constants, {"keypoints": 4 * KEYPOINTS})


def same_for_everybody(name, nodes, given, given_channels, constants, channels):
    """A graph that gives each person of its input `given` the constants "OUTPUT.value". channels: of each output."""
    nodes = [helper.make_node("Shape", [given], ["people"], start=0, end=1), *nodes]
    outputs = []
    for output, count in channels.items():
        constants.append(tensor(f"{output}.rest", np.array([DENSE_POOL, DENSE_POOL, count], np.int64)))
        nodes += [
            helper.make_node("Concat", ["people", f"{output}.rest"], [f"{output}.shape"], axis=0),
            helper.make_node("Expand", [f"{output}.value", f"{output}.shape"], [output]),
        ]
        outputs.append((output, ["people", DENSE_POOL, DENSE_POOL, count]))
    inputs = [(given, ["people", DENSE_POOL, DENSE_POOL, given_channels])]
    return graph(name, nodes, inputs, outputs, constants)


def charts():
    """Weights [2, parts, 4, 4, SURFACE] and bias [2, parts] that take U and V from `surface` as they are, plus a half.

    Kernel row (or column) 1 makes the even output rows of a cell, kernel row 2 the odd ones.
    """
    weight = np.zeros((2, INDEX - 1, 4, 4, SURFACE), np.float32)
    for parity in (0, 1):
        weight[0, :, 1:3, 1 + parity, parity] = 1
        weight[1, :, 1 + parity, 1:3, 2 + parity] = 1
    bias = np.full((2, INDEX - 1), 0.5, np.float32)
    return np.concatenate([weight.ravel(), bias.ravel()]).astype("<f4").tobytes()


def main():
    folder = Path(__file__).parents[1] / "data" / "tiny_bundle"
    folder.mkdir(parents=True, exist_ok=True)
    graphs = {}
    for name, (model, inputs, outputs) in (
        ("trunk", trunk()),
        ("rpn_fine", rpn("rpn_fine", range(2, 3))),
        ("rpn_coarse", rpn("rpn_coarse", range(3, 7))),
        ("box_head", box_head()),
        ("dense_head", dense_head()),
        ("keypoints", keypoints()),
    ):
        (folder / f"{name}.onnx").write_bytes(model.SerializeToString())
        graphs[name] = {"inputs": dict(inputs), "outputs": dict(outputs)}
    (folder / "charts.f32").write_bytes(charts())
    task_keys = {
        "input": {"color": "RGB", "mean": [0, 0, 0], "std": [255, 255, 255], "multiple_of": 32, "long_side_px": 320},
        "rpn": {
            "strides": [4, 8, 16, 32, 64],
            "anchor_sizes_px": [32, 64, 128, 256, 512],
            "aspect_ratios": [0.5, 1, 2],
            "pre_nms_top_k": 1000,
            "post_nms_top_k": 100,
            "nms_iou": 0.7,
        },
        "box_head": {
            "pool_size": POOL,
            "strides": [4, 8, 16, 32],
            "canonical_level": 4,
            "canonical_size_px": 224,
            "delta_weights": [10, 10, 5, 5],
            "score_threshold": 0.5,
            "nms_iou": 0.5,
            "max_people": 20,
        },
        "dense_head": {
            "pool_size": DENSE_POOL,
            "stride": 4,
            "output_size": OUTPUT,
            "coarse_classes": COARSE,
            "index_classes": INDEX,
            "mask_threshold": 0.5,
            "min_visible_fraction": 0.3,
        },
        "keypoints": {"count": KEYPOINTS},
        "charts": {"file": "charts.f32"},
    }
    write_manifest(folder, "densepose", BundleInfo("tiny", "fp32", version="1"), graphs, ["charts.f32"], task_keys)


if __name__ == "__main__":
    main()
