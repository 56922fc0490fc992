"""Writes data/tiny_bundle: a model bundle of the real interface whose answers are known without training.

The networks see colours. In a black image, one pixel cell of pure colour is one person:
red at a cell of P2 is a person of 32 px, green at a cell of P3 one of 64 px, blue at a cell of P4 one of 128 px,
each in the square anchor of that cell, shifted right by a tenth of its width (box delta 1 at weight 10).
The dense head answers the same for everybody: the upper quarter of the box is background; of the rest the left half is
part 3 and the right half part 7; U rises from -0.11 at the left to 1.11 at the right, V from 0 at the top to 1.

    python tests/native/make_tiny_bundle.py      needs onnx and numpy
"""

import hashlib
import json
from pathlib import Path

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

CHANNELS = 3
POOL, DENSE_POOL, OUTPUT = 7, 32, 64
COARSE, INDEX, SURFACE = 15, 25, 4


def tensor(name, value):
    return numpy_helper.from_array(np.asarray(value), name)


def graph(name, nodes, inputs, outputs, constants):
    def infos(specs):
        return [helper.make_tensor_value_info(n, TensorProto.FLOAT, shape) for n, shape in specs]

    model = helper.make_model(
        helper.make_graph(nodes, name, infos(inputs), infos(outputs), constants),
        opset_imports=[helper.make_opsetid("", 17)],
        ir_version=8,
        producer_name="maquette-tests",
    )
    onnx.checker.check_model(model)
    return model, inputs, outputs


def features(levels):
    return [(f"p{level}", [1, CHANNELS, f"h{level}", f"w{level}"]) for level in levels]


def trunk():
    """Features are mean colours."""
    nodes = []
    for level in range(2, 6):
        size = 2**level
        nodes.append(
            helper.make_node("AveragePool", ["image"], [f"p{level}"], kernel_shape=[size] * 2, strides=[size] * 2)
        )
    nodes.append(helper.make_node("MaxPool", ["p5"], ["p6"], kernel_shape=[1, 1], strides=[2, 2]))
    return graph("trunk", nodes, [("image", [1, 3, "height", "width"])], features(range(2, 7)), [])


def rpn(name, levels):
    """Objectness is 20 where the level's colour fills a cell and -20 where it is absent."""
    nodes, constants = [], []
    for level in levels:
        weight = np.zeros((3, CHANNELS, 1, 1), np.float32)
        if level <= 4:
            weight[1, level - 2] = 40  # anchor 1 is the square one; colours in the order R, G, B
        constants += [
            tensor(f"objectness{level}.weight", weight),
            tensor(f"objectness{level}.bias", np.full(3, -20, np.float32)),
            tensor(f"deltas{level}.weight", np.zeros((12, CHANNELS, 1, 1), np.float32)),
        ]
        nodes += [
            helper.make_node(
                "Conv", [f"p{level}", f"objectness{level}.weight", f"objectness{level}.bias"], [f"objectness{level}"]
            ),
            helper.make_node("Conv", [f"p{level}", f"deltas{level}.weight"], [f"deltas{level}"]),
        ]
    outputs = [(f"objectness{level}", [1, 3, f"h{level}", f"w{level}"]) for level in levels]
    outputs += [(f"deltas{level}", [1, 12, f"h{level}", f"w{level}"]) for level in levels]
    return graph(name, nodes, features(levels), outputs, constants)


def box_head():
    """A person where the middle of the RoI has colour: logit 24 * brightest - 3 against 0."""
    nodes = [
        helper.make_node("Slice", ["rois", "begin", "end", "axes"], ["middle"]),
        helper.make_node("ReduceMax", ["middle"], ["brightest"], axes=[2, 3], keepdims=0),
        helper.make_node("Gemm", ["brightest", "weight", "bias"], ["logits"]),
        helper.make_node("Gemm", ["brightest", "no_weight", "shift"], ["deltas"]),
    ]
    constants = [
        tensor("begin", np.array([2, 2], np.int64)),
        tensor("end", np.array([5, 5], np.int64)),
        tensor("axes", np.array([2, 3], np.int64)),
        tensor("weight", np.array([[24, 0]] * CHANNELS, np.float32)),
        tensor("bias", np.array([-3, 0], np.float32)),
        tensor("no_weight", np.zeros((CHANNELS, 4), np.float32)),
        tensor("shift", np.array([1, 0, 0, 0], np.float32)),
    ]
    return graph(
        "box_head",
        nodes,
        [("rois", ["people", CHANNELS, POOL, POOL])],
        [("logits", ["people", 2]), ("deltas", ["people", 4])],
        constants,
    )


def dense_head():
    ramp = np.linspace(-1, 1, OUTPUT, dtype=np.float32)
    coarse = np.full((1, COARSE, OUTPUT, 1), -100, np.float32)
    coarse[0, 0] = 0
    coarse[0, 1, :, 0] = np.where(np.arange(OUTPUT) >= OUTPUT // 4, 10, -10)
    index = np.full((1, INDEX, 1, OUTPUT), -100, np.float32)
    index[0, 3, 0] = -ramp
    index[0, 7, 0] = ramp
    # A cell of `surface` is four of the output. U of its even and of its odd columns, V of its even and its odd rows.
    surface = np.zeros((1, SURFACE, DENSE_POOL, DENSE_POOL), np.float32)
    for parity in (0, 1):
        surface[0, parity] = 0.61 * ramp[parity::2]
        surface[0, 2 + parity] = 0.5 * ramp[parity::2, None]
    sizes = {"coarse": [COARSE, OUTPUT, OUTPUT], "index": [INDEX, OUTPUT, OUTPUT]}
    sizes["surface"] = [SURFACE, DENSE_POOL, DENSE_POOL]
    nodes = [helper.make_node("Shape", ["rois"], ["people"], start=0, end=1)]
    constants = []
    for name, value in (("coarse", coarse), ("index", index), ("surface", surface)):
        constants += [tensor(f"{name}.rest", np.array(sizes[name], np.int64)), tensor(f"{name}.value", value)]
        nodes += [
            helper.make_node("Concat", ["people", f"{name}.rest"], [f"{name}.shape"], axis=0),
            helper.make_node("Expand", [f"{name}.value", f"{name}.shape"], [name]),
        ]
    return graph(
        "dense_head",
        nodes,
        [("rois", ["people", CHANNELS, DENSE_POOL, DENSE_POOL])],
        [(name, ["people", *size]) for name, size in sizes.items()],
        constants,
    )


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
    folder = Path(__file__).parent / "data" / "tiny_bundle"
    folder.mkdir(parents=True, exist_ok=True)
    files, graphs = {}, {}
    for name, (model, inputs, outputs) in (
        ("trunk", trunk()),
        ("rpn_fine", rpn("rpn_fine", range(2, 3))),
        ("rpn_coarse", rpn("rpn_coarse", range(3, 7))),
        ("box_head", box_head()),
        ("dense_head", dense_head()),
    ):
        content = model.SerializeToString()
        (folder / f"{name}.onnx").write_bytes(content)
        files[f"{name}.onnx"] = {"sha256": hashlib.sha256(content).hexdigest(), "bytes": len(content)}
        graphs[name] = {
            "file": f"{name}.onnx",
            "opset": 17,
            "inputs": [{"name": n, "type": "float32", "shape": s} for n, s in inputs],
            "outputs": [{"name": n, "type": "float32", "shape": s} for n, s in outputs],
        }
    (folder / "charts.f32").write_bytes(charts())
    files["charts.f32"] = {"sha256": hashlib.sha256(charts()).hexdigest(), "bytes": len(charts())}
    manifest = {
        "format": "maquette-bundle",
        "format_version": 2,
        "name": "tiny",
        "version": "1",
        "task": "densepose",
        "precision": "float32",
        "files": files,
        "graphs": graphs,
        "input": {"color": "RGB", "mean": [0, 0, 0], "std": [255, 255, 255], "multiple_of": 32, "long_side": 320},
        "rpn": {
            "strides": [4, 8, 16, 32, 64],
            "anchor_sizes": [32, 64, 128, 256, 512],
            "aspect_ratios": [0.5, 1, 2],
            "pre_nms_top_k": 1000,
            "post_nms_top_k": 100,
            "nms_iou": 0.7,
        },
        "box_head": {
            "pool": POOL,
            "strides": [4, 8, 16, 32],
            "canonical_level": 4,
            "canonical_size": 224,
            "delta_weights": [10, 10, 5, 5],
            "score_threshold": 0.5,
            "nms_iou": 0.5,
            "max_people": 20,
        },
        "dense_head": {
            "pool": DENSE_POOL,
            "stride": 4,
            "charts": "charts.f32",
            "output": OUTPUT,
            "coarse_classes": COARSE,
            "index_classes": INDEX,
            "mask_threshold": 0.5,
            "least_own_share": 0.3,
        },
        "licence": "Apache-2.0",
        "training_data": [],
        "measured": {},
    }
    (folder / "manifest.json").write_text(json.dumps(manifest, indent=1) + "\n")


if __name__ == "__main__":
    main()
