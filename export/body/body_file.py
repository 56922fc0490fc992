"""Body files (.maqb) in numpy: written and read. The layout is that of sdk/src/body/model/body_file.h, version 1
(docs/reference/formats.md)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from export.body.body_model import NOWHERE, WEIGHTS, BodyModel
from export.body.pose_prior import PosePrior
from export.checked_file import START, checked_head, signed, write_whole
from export.keypoints import NAMES
from export.surface import PART_COUNT

MAGIC, VERSION = b"MAQBOD\r\n", 1
FILE = "body.maqb"
POINT_STEP_M = 5e-5
_FRACTIONS = 255  # skin weights and fractions of a triangle's vertices are steps of 1 / 255
_LARGEST = 32767
HEAD = np.dtype(
    [
        *START,
        ("joints", "<u4"),
        ("shapes", "<u4"),
        ("vertices", "<u4"),
        ("keypoints", "<u4"),
        ("triangles", "<u4"),
        ("surface_nodes", "<u4"),
        ("point_step_m", "<f4"),
        ("reserved", "<u4"),
    ]
)


class BodyFileError(ValueError):
    """A file is no body, or is damaged; or a body does not fit into a file."""


def _steps(values: np.ndarray, step: np.ndarray | float) -> bytes:
    steps = np.rint(np.asarray(values, np.float64) / step)
    if not (np.abs(steps) <= _LARGEST).all():
        raise BodyFileError(f"The body reaches {np.abs(values).max():g} m, too far for steps of {np.max(step):g} m.")
    return steps.astype("<i2").tobytes()


def whole_fractions(fractions: np.ndarray) -> np.ndarray:
    """Shares [K, W] that sum to 1, as whole numbers that sum to 255: the largest remainders are rounded up."""
    exact = fractions * _FRACTIONS
    low = np.floor(exact).astype(int)
    rank = np.argsort(np.argsort(low - exact, axis=1, kind="stable"), axis=1)
    return (low + (rank < _FRACTIONS - low.sum(1, keepdims=True))).astype("u1")


def body_bytes(model: BodyModel) -> bytes:
    """The bytes of a file. Raises BodyFileError for a body that does not fit."""
    head = np.zeros((), HEAD)
    head["joints"], head["shapes"], head["vertices"] = len(model.joints), len(model.basis), model.vertex_count
    head["keypoints"], head["triangles"] = len(model.keypoints), len(model.triangles)
    head["surface_nodes"], head["point_step_m"] = model.surface_triangle.shape[1], POINT_STEP_M
    reach = np.maximum(np.abs(model.basis).max((1, 2)), np.abs(model.joint_basis).max((1, 2)))
    basis_step = (reach / _LARGEST).astype("<f4").astype(np.float64) * (1 + 1e-6)
    basis_step = basis_step.astype("<f4")
    each = basis_step.astype(np.float64)[:, None, None]
    triple = np.concatenate([model.surface_fraction, 1 - model.surface_fraction.sum(-1, keepdims=True)], -1)
    fractions = whole_fractions(triple.reshape(-1, 3))[:, :2]
    fractions[model.surface_triangle.ravel() == NOWHERE] = 0
    parts = [basis_step.tobytes()]
    for name, parent in zip(model.joints, model.parents, strict=True):
        parts += [bytes([len(name.encode())]), name.encode(), np.int8(parent).tobytes()]
    parts += [_steps(model.joint_rest, POINT_STEP_M), _steps(model.joint_basis, each)]
    parts += [_steps(model.rest, POINT_STEP_M), _steps(model.basis, each)]
    parts += [model.weight_joints.astype("u1").tobytes(), whole_fractions(model.weights).tobytes()]
    parts += [model.triangles.astype("<u2").tobytes()]
    parts += [model.surface_triangle.astype("<u2").tobytes(), fractions.tobytes()]
    prior = model.prior
    parts += [np.asarray(a, "<f4").tobytes() for a in (prior.mean, prior.low, prior.high, prior.precision)]
    return signed(head, MAGIC, VERSION, b"".join(parts))


def write_body(model: BodyModel, path: Path) -> None:
    """The file appears atomically. Raises BodyFileError, OSError."""
    write_whole(body_bytes(model), path)


class _Reader:
    def __init__(self, data: bytes, at: int, name: str) -> None:
        self.data, self.at, self.name = data, at, name

    def take(self, form: str, *shape: int) -> np.ndarray:
        size = np.dtype(form).itemsize * int(np.prod(shape))
        if self.at + size > len(self.data):
            raise BodyFileError(f"{self.name} ends before what its head claims.")
        self.at += size
        return np.frombuffer(self.data[self.at - size : self.at], form).reshape(shape)


def body_from_bytes(data: bytes, name: str = "The body in memory") -> BodyModel:
    """name: begins the sentence of errors. Raises BodyFileError for bytes that are damaged or no body."""
    head = checked_head(data, HEAD, MAGIC, VERSION, name, "a body (.maqb)", BodyFileError)
    joints, shapes, vertices, keypoints, triangles, nodes = (
        int(head[key]) for key in ("joints", "shapes", "vertices", "keypoints", "triangles", "surface_nodes")
    )
    read, step = _Reader(data, HEAD.itemsize, name), float(head["point_step_m"])
    each = read.take("<f4", shapes).astype(np.float64)[:, None, None]
    names, parents = [], []
    for _ in range(joints):
        names.append(read.take("u1", int(read.take("u1", 1)[0])).tobytes().decode(errors="replace"))
        parents.append(int(read.take("i1", 1)[0]))
    joint_rest, joint_basis = read.take("<i2", joints, 3) * step, read.take("<i2", shapes, joints, 3) * each
    points = vertices + keypoints
    rest, basis = read.take("<i2", points, 3) * step, read.take("<i2", shapes, points, 3) * each
    weight_joints, weights = read.take("u1", points, WEIGHTS).astype(int), read.take("u1", points, WEIGHTS) / _FRACTIONS
    faces = read.take("<u2", triangles, 3).astype(int)
    surface = read.take("<u2", PART_COUNT, nodes, nodes).astype(int)
    fraction = read.take("u1", PART_COUNT, nodes, nodes, 2) / _FRACTIONS
    angles = 3 * (joints - 1)
    mean, low, high = (read.take("<f4", angles).astype(np.float64) for _ in range(3))
    prior = PosePrior(mean, read.take("<f4", angles, angles).astype(np.float64), low, high)
    if read.at != len(data):
        raise BodyFileError(f"{name} has {len(data) - read.at} bytes that belong to nothing.")
    return BodyModel(tuple(names), NAMES[:keypoints], np.array(parents), joint_rest, joint_basis, rest, basis,
                     weight_joints, weights, faces, surface, fraction, prior)  # fmt: skip


def read_body(path: Path) -> BodyModel:
    """Raises BodyFileError for a file that is damaged or no body, OSError for one that cannot be read."""
    return body_from_bytes(path.read_bytes(), str(path))
