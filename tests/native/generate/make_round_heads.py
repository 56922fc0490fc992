"""Writes data/round_heads: a bundle of heads that are round and known exactly, for tests of all that is between a photo
and a mesh.

The prior: |S x| in a norm of 13 directions, nearly an ellipsoid, whose three shape codes stretch its axes by 7 %; two
colour codes. The encoder does not look for anything: whatever the crop shows, it sees the head of CODES, from the
front and turned by TURN_RAD, in its middle. Of a crop that is black, it sees none; of one that is more blue than red, a
mirrored one, which no camera explains. The template head is round as well, open below, with an eye and a tooth, both
octahedra; it opens its mouth and winks.

    python -m tests.native.generate.make_round_heads
"""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from export.bundle import OPSET, BundleInfo
from export.heads.bundle import CROP_SIDES, TEMPLATE, write_manifest
from export.heads.prior import FieldShape, Layer, Prior
from export.heads.prior_file import write_prior
from export.heads.template_file import Kind, Template, write_template

FOLDER = Path(__file__).parents[1] / "data" / "round_heads"
CODES = np.array([1.5, 0.5, -1.5])  # narrow and tall
TURN_RAD, DISTANCE_DM = 0.25, 10.0
RADII_DM = np.array([0.75, 0.95, 1.15])
STRETCH = 0.07
CROP_PX, CELL_PX = 192, 4
CELLS = CROP_PX // CELL_PX
SHAPE = FieldShape(
    octaves=0, width=26, geometry_layers=1, feature=3, surface_width=10, surface_layers=1, personal_geometry_layers=1
)
# One of each pair of opposite points of a cube's 26 (faces, edges, corners); the axes come first.
_HALF = [np.array(d) for d in product((-1, 0, 1), repeat=3) if d > (0, 0, 0)]
DIRECTIONS = np.array([d / np.linalg.norm(d) for d in sorted(_HALF, key=lambda d: (np.abs(d).sum(), -d @ (4, 2, 1)))])
SHARE = 2 / len(DIRECTIONS)  # so that the norm is the length, nearly
SLOPE = 0.8  # the field is a distance, nearly


def stretch(codes: np.ndarray) -> np.ndarray:
    """S [3]: a point x of the head lies on the template head at S x RADII_DM."""
    return (1 + STRETCH * codes) / RADII_DM


def norm(points: np.ndarray) -> np.ndarray:
    return SHARE * np.abs(points @ DIRECTIONS.T).sum(-1)


def prior() -> Prior:
    layers = [
        Layer(np.zeros((SHAPE.outputs(i), SHAPE.inputs(i)), np.float32), np.zeros(SHAPE.outputs(i), np.float32))
        for i in range(SHAPE.layers)
    ]
    first, geometry, surface, last = layers
    rows = np.concatenate([DIRECTIONS, -DIRECTIONS])  # squareplus(v) + squareplus(-v) is |v|, their difference is v
    first.weights[:] = rows / RADII_DM
    basis = np.stack([rows * np.eye(3)[k] * STRETCH / RADII_DM for k in range(3)])
    geometry.weights[0] = SLOPE * SHARE
    geometry.bias[0] = -SLOPE
    for axis in range(3):
        geometry.weights[1 + axis, [axis, axis + 13]] = np.array([1, -1]) * RADII_DM[axis]
        surface.weights[[2 * axis, 2 * axis + 1], 1 + axis] = 1, -1
        last.weights[3 + axis, [2 * axis, 2 * axis + 1]] = 1, -1
    # Units of the colour codes, far where squareplus is the identity.
    surface.bias[6:8] = 4
    last.weights[0, 6], last.weights[1, 7] = 1, 1
    last.bias[:3] = -4 + 0.9, -4 - 0.1, -0.6
    last.weights[0, [4, 5]] = 0.5, -0.5  # redder above
    colours = Layer(np.zeros((2, 10, SHAPE.inputs(2)), np.float32), np.zeros((2, 10), np.float32))
    colours.bias[0, 6], colours.bias[1, 7] = 0.5, 0.5

    count = 200
    z = 1 - (2 * np.arange(count) + 1) / count
    angle = 2.399963 * np.arange(count)
    directions = np.stack([np.sqrt(1 - z**2) * np.cos(angle), np.sqrt(1 - z**2) * np.sin(angle), z], 1)
    points = on_template(directions)
    landmarks = {
        "nose_tip": (0, -1, 0),
        "chin": (0, -0.6, -0.8),
        "crown": (0, 0, 1),
        "pupil_left": (0.35, -0.9, 0.25),
        "pupil_right": (-0.35, -0.9, 0.25),
    }
    return Prior(
        SHAPE,
        layers,
        [Layer(basis.astype(np.float32), np.zeros((3, 26), np.float32))],
        [colours],
        sharpness=40.0,
        cut_point=np.array([0, 0, -0.95], np.float32),
        cut_normal=np.array([0, 0, -1], np.float32),
        bounds_min=np.full(3, -2, np.float32),
        bounds_max=np.full(3, 2, np.float32),
        template_points=points.astype(np.float32),
        anchor_mean=points.astype(np.float32),
        anchor_linear=(-STRETCH * points[:, :, None] * np.eye(3)).astype(np.float32),
        anchor_sigma=np.full(count, 0.01, np.float32),
        landmarks={name: on_template(np.array(d)).astype(np.float32) for name, d in landmarks.items()},
    )


def on_template(directions: np.ndarray) -> np.ndarray:
    """Where rays from the middle leave the template head."""
    return directions / norm(directions / RADII_DM)[..., None]


def cells(mirrored: bool) -> np.ndarray:
    """Returns the encoder's output, [CELLS, CELLS, 8]."""
    turn = np.array([[np.cos(TURN_RAD), -np.sin(TURN_RAD), 0], [np.sin(TURN_RAD), np.cos(TURN_RAD), 0], [0, 0, 1]])
    rotation = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]) @ turn  # to the camera
    focal_px = CROP_PX * DISTANCE_DM / (CROP_SIDES * 2 * RADII_DM[2])
    i, j = np.mgrid[:CELLS, :CELLS]
    middle = (CROP_PX - 1) / 2
    rays = np.stack([(CELL_PX * n + (CELL_PX - 1) / 2 - middle) / focal_px for n in (j, i)] + [np.ones(i.shape)], -1)
    ray, origin = rays @ rotation, -np.array([0, 0, DISTANCE_DM]) @ rotation
    scale = stretch(CODES)
    depths = np.linspace(DISTANCE_DM - 2, DISTANCE_DM + 2, 4001)
    values = np.stack([norm((origin + depth * ray) * scale) - 1 for depth in depths])
    hit = (values < 0).any(0)
    point = origin + depths[(values < 0).argmax(0)][..., None] * ray
    gradient = np.sign((point * scale) @ DIRECTIONS.T) @ DIRECTIONS * scale
    normal = gradient / np.linalg.norm(gradient, axis=-1, keepdims=True) @ rotation.T
    template = point * scale * RADII_DM * ([-1, 1, 1] if mirrored else [1, 1, 1])
    known = [template, np.full((*hit.shape, 1), np.log(0.02)), np.full((*hit.shape, 1), 6.0), normal]
    found = np.concatenate(known, -1)
    found[~hit] = 0
    found[~hit, 3:5] = np.log(0.3), -6
    return found.astype(np.float32)


def write_encoder(path: Path) -> None:
    plain, mirrored = cells(mirrored=False), cells(mirrored=True)
    matte = np.zeros(8, np.float32)
    matte[4] = 1

    def constant(name: str, values) -> onnx.TensorProto:
        return numpy_helper.from_array(np.asarray(values, np.float32), name)

    nodes = [
        helper.make_node("ReduceMean", ["image"], ["colour"], axes=[1, 2], keepdims=1),
        # How blue it is: 0 to 1.
        helper.make_node("Mul", ["colour", "red_to_blue"], ["weighed"]),
        helper.make_node("ReduceSum", ["weighed", "last_axis"], ["blueness"], keepdims=1),
        helper.make_node("Clip", ["blueness", "zero", "one"], ["mirrored"]),
        helper.make_node("Mul", ["mirrored", "difference"], ["change"]),
        # How dark: from 0 down.
        helper.make_node("ReduceSum", ["colour", "last_axis"], ["sum"], keepdims=1),
        helper.make_node("Sub", ["sum", "black"], ["light"]),
        helper.make_node("Min", ["light", "zero"], ["darkness"]),
        helper.make_node("Mul", ["darkness", "matte"], ["unseen"]),
        helper.make_node("Add", ["plain", "change"], ["seen"]),
        helper.make_node("Add", ["seen", "unseen"], ["cells"]),
    ]
    constants = [
        constant("red_to_blue", [-0.1, 0, 0.1]),
        constant("difference", (mirrored - plain)[None]),
        constant("plain", plain[None]),
        constant("matte", matte),
        constant("black", 200),
        constant("zero", 0),
        constant("one", 1),
        numpy_helper.from_array(np.array([3], np.int64), "last_axis"),
    ]
    inputs = [helper.make_tensor_value_info("image", TensorProto.FLOAT, [1, CROP_PX, CROP_PX, 3])]
    outputs = [
        helper.make_tensor_value_info("cells", TensorProto.FLOAT, [1, CELLS, CELLS, 8]),
    ]
    graph = helper.make_graph(nodes, "encoder", inputs, outputs, constants)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=8)
    onnx.checker.check_model(model, full_check=True)
    onnx.save(model, path)


def template() -> Template:
    """Rings around the z axis from the crown down to the cut, and two octahedra inside."""
    rings, around = 14, 24
    polar = np.linspace(0.1, 2.35, rings)[:, None]
    azimuth = np.linspace(0, 2 * np.pi, around, endpoint=False) + np.pi / 2  # the seam is at the back
    directions = np.stack(np.broadcast_arrays(np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth),
                                              np.cos(polar)), -1).reshape(-1, 3)  # fmt: skip
    directions = np.concatenate([directions, [[0, 0, 1]]])
    points, kinds = [on_template(directions)], [np.full(len(directions), Kind.SURFACE)]
    vertex_points, uv = [], []
    for ring in range(rings):
        for step in range(around + 1):  # the seam's vertices are there twice
            vertex_points.append(ring * around + step % around)
            uv.append((step / around, (ring + 1) / (rings + 1)))
    crown = len(vertex_points)
    vertex_points.append(rings * around)
    uv.append((0.5, 0))
    triangles = []
    for step in range(around):
        triangles.append((crown, step, step + 1))
        for ring in range(rings - 1):
            a, b = ring * (around + 1) + step, (ring + 1) * (around + 1) + step
            triangles += [(a, b, b + 1), (a, b + 1, a + 1)]
    octahedron = np.concatenate([np.eye(3), -np.eye(3)])
    faces = [(0, 1, 2), (1, 3, 2), (3, 4, 2), (4, 0, 2), (1, 0, 5), (3, 1, 5), (4, 3, 5), (0, 4, 5)]
    eye = on_template(np.array([0.35, -0.9, 0.25])) * 0.9
    for middle, radius, kind in ((eye, 0.1, Kind.EYE), (np.array([0, -0.6, -0.4]), 0.05, Kind.TEETH)):
        first, start = sum(map(len, points)), len(vertex_points)
        points.append(middle + radius * octahedron)
        kinds.append(np.full(6, kind))
        vertex_points += range(first, first + 6)
        uv += [(0.1 * k, 1) for k in range(6)]
        triangles += [tuple(start + corner for corner in face) for face in faces]
    points = np.concatenate(points)
    jaw = np.flatnonzero((points[:, 1] < -0.2) & (points[:, 2] < -0.35))
    lid = np.flatnonzero(np.linalg.norm(points - eye, axis=1) < 0.3)
    actions = {
        "jawOpen": (jaw, np.tile([0, 0.02, -0.15], (len(jaw), 1))),
        "eyeBlinkLeft": (lid, np.tile([0, 0, -0.05], (len(lid), 1))),
    }
    return Template(points, np.concatenate(kinds).astype(np.uint8), np.array(vertex_points), np.array(uv),
                    np.array(triangles), actions)  # fmt: skip


def write_bundle(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    write_template(template(), folder / TEMPLATE)
    write_encoder(folder / "encoder.onnx")
    write_prior(prior(), folder / "prior.maqp", bases="float16", constant="float16")
    write_manifest(folder, BundleInfo("round-heads", "fp32"), face=None)


if __name__ == "__main__":
    write_bundle(FOLDER / "bundle")
