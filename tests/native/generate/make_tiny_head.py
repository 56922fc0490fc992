"""Writes data/tiny_head: a bundle for heads with random numbers, and what Python makes of it.

`priors/<format>.maqp`: with bases in float32, float16 and int8; `priors/<format>.f32`, little-endian floats: each layer
of the head with codes SHAPE_CODES and COLOUR_CODES (weights, bias), sharpness, cut (point, normal), bounds (min, max),
anchors (template points, mean, linear, sigma), template points of the landmarks.

`bundle`: an encoder of one convolution, crops of 32 px and cells of 4 px, and the prior with int8 bases. `photo.bgr`:
32 x 32 pixels of noise, B, G, R bytes; `cells.f32`: what the encoder says of it [8][8][8].

`template.maqt`: a template head of five points.

`field/usual.maqp`: a field of the usual size. `field/<name>.f32`, of it and of two of those priors: POINTS points [3]
(dm), then what torch finds there in float64 for the head of the same codes: distance (dm), logits of red, green and
blue [3], template point [3] (dm).

    python -m tests.native.generate.make_tiny_head
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import onnx
import torch
from onnx import TensorProto, helper, numpy_helper

from export.bundle import OPSET, BundleInfo
from export.densepose.graphs import session
from export.heads.bundle import write_bundle
from export.heads.field import bases_of, geometry, surface
from export.heads.prior import FieldShape, Layer, Prior, combined
from export.heads.prior_file import FORMATS, read_prior, write_prior
from export.heads.template_file import write_template
from tests.python.support.small_prior import small_prior
from tests.python.support.small_template import small_template

FOLDER = Path(__file__).parents[1] / "data" / "tiny_head"
CROP_PX, CELL_PX = 32, 4
SHAPE_CODES, COLOUR_CODES = (0.5, -1.25, 2.0), (-0.75, 1.5)
POINTS = 70


def write_priors(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name in FORMATS:
        path = folder / f"{name}.maqp"
        write_prior(small_prior(), path, bases=name, constant="float32" if name == "float32" else "float16")
        prior = read_prior(path)
        layers = combined(prior, np.array(SHAPE_CODES), np.array(COLOUR_CODES))
        arrays = [array for layer in layers for array in (layer.weights, layer.bias)]
        arrays += [np.array([prior.sharpness]), prior.cut_point, prior.cut_normal, prior.bounds_min, prior.bounds_max]
        arrays += [prior.template_points, prior.anchor_mean, prior.anchor_linear, prior.anchor_sigma]
        arrays += list(prior.landmarks.values())
        np.concatenate([array.ravel() for array in arrays]).astype("<f4").tofile(path.with_suffix(".f32"))


def write_encoder(path: Path) -> None:
    """A convolution of each cell's pixels: 3 colours -> 8 channels."""
    rng = np.random.default_rng(3)
    side = CROP_PX // CELL_PX
    scales = np.array([1, 1, 1, 2, 4, 1, 1, 1])  # mattes of both signs
    weights = rng.normal(0, 0.3, (8, 3, CELL_PX, CELL_PX)) * scales[:, None, None, None] / 255
    weights -= weights.mean((1, 2, 3), keepdims=True)  # of even grey nothing is said but the bias
    bias = np.array([0.1, -1.0, 0.2, -2.5, 0.5, 0.0, 0.0, -1.0])
    nodes = [
        helper.make_node("Transpose", ["image"], ["planes"], perm=[0, 3, 1, 2]),
        helper.make_node("Conv", ["planes", "weights", "bias"], ["found"], strides=[CELL_PX, CELL_PX]),
        helper.make_node("Transpose", ["found"], ["cells"], perm=[0, 2, 3, 1]),
    ]
    constants = {"weights": weights.astype(np.float32), "bias": bias.astype(np.float32)}
    outputs = [helper.make_tensor_value_info("cells", TensorProto.FLOAT, [1, side, side, 8])]
    image = helper.make_tensor_value_info("image", TensorProto.FLOAT, [1, CROP_PX, CROP_PX, 3])
    initializers = [numpy_helper.from_array(values, name) for name, values in constants.items()]
    graph = helper.make_graph(nodes, "encoder", [image], outputs, initializers)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=8)
    onnx.checker.check_model(model, full_check=True)
    onnx.save(model, path)


def field_at(prior: Prior, points: np.ndarray) -> list[np.ndarray]:
    """Points [N, 3], float64 -> distance [N], logits [N, 3], template points [N, 3] of the head of those codes."""
    bases = bases_of(prior).double()
    with torch.no_grad():
        weights = bases.combine(*(torch.tensor(codes, dtype=torch.float64) for codes in (SHAPE_CODES, COLOUR_CODES)))
        at = torch.from_numpy(points)
        out = geometry(prior.shape, weights, at)
        return [tensor.numpy() for tensor in (out[:, 0], *surface(prior.shape, weights, at, out))]


def usual_prior() -> Prior:
    """Returns a field of the usual size with values like a head: wide layers of random numbers would grow them."""

    def scaled(layers: list[Layer], by: float) -> list[Layer]:
        return [Layer(by * layer.weights, by * layer.bias) for layer in layers]

    prior = small_prior(FieldShape(), len(SHAPE_CODES), len(COLOUR_CODES), seed=6)
    bases = {"shape_bases": scaled(prior.shape_bases, 0.05), "colour_bases": scaled(prior.colour_bases, 0.05)}
    return replace(prior, constant=scaled(prior.constant, 0.6), **bases)


def write_fields(folder: Path, priors: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    write_prior(usual_prior(), folder / "usual.maqp")
    for path in (folder / "usual.maqp", priors / "float32.maqp", priors / "int8.maqp"):
        prior = read_prior(path)
        points = np.random.default_rng(7).uniform(prior.bounds_min, prior.bounds_max, (POINTS, 3)).astype(np.float32)
        found = field_at(prior, points.astype(np.float64))
        numbers = np.concatenate([array.ravel() for array in (points, *found)])
        numbers.astype("<f4").tofile(folder / f"{path.stem}.f32")


def main() -> None:
    write_priors(FOLDER / "priors")
    write_template(small_template(), FOLDER / "template.maqt")
    bundle = FOLDER / "bundle"
    bundle.mkdir(exist_ok=True)
    write_encoder(bundle / "encoder.onnx")
    write_bundle(bundle, bundle / "encoder.onnx", small_prior(), BundleInfo("tiny-heads", "fp32"), face=None)
    photo = np.random.default_rng(9).integers(0, 256, (CROP_PX, CROP_PX, 3), np.uint8)  # B, G, R
    (cells,) = session(bundle / "encoder.onnx").run(None, {"image": photo[None, :, :, ::-1].astype(np.float32)})
    (FOLDER / "photo.bgr").write_bytes(photo.tobytes())
    cells.astype("<f4").tofile(FOLDER / "cells.f32")
    write_fields(FOLDER / "field", FOLDER / "priors")


if __name__ == "__main__":
    main()
