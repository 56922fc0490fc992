"""Writes data/tiny_body: a body of three joints and four vertices, and what the fit of the teachers makes of poses.

`body.maqb`: the small body. `poses.f64`, little-endian doubles, of each of POSES poses of the shipped body
(`sdk/models/body`): the rotation vector of each of its 19 joints relative to its parent, the first to the body's axes;
10 shape coefficients; then where `export.teachers.body_model` places every STEP-th vertex and the 33 keypoints, in
body axes from the first joint, in float64.

`sizes.f64`, of each of SHAPES shapes of the shipped body: 10 coefficients, then height, chest, waist, hip and inseam.

    python -m tests.native.generate.make_tiny_body
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from scipy.spatial import ConvexHull

from export.body.body_file import FILE, read_body, write_body
from export.body.body_model import BodyModel
from export.teachers.body_model import Pieces, Puppet, chained, turns
from tests.python.support.small_body import small_body

FOLDER = Path(__file__).parents[1] / "data" / "tiny_body"
SHIPPED = Path(__file__).parents[3] / "sdk" / "models" / "body" / FILE
POSES, STEP, SHAPES = 6, 97, 8
LEVELS = (0.65, 0.35, -0.05)  # chest, waist, hip: between the hip joints and the neck


def puppet_of(model: BodyModel) -> tuple[Puppet, Pieces]:
    """The teachers' body with the numbers of `model`, in float64, and its points."""
    puppet = Puppet.__new__(Puppet)
    puppet.joint_rest, puppet.joint_basis = torch.tensor(model.joint_rest), torch.tensor(model.joint_basis)
    weights = np.zeros((len(model.rest), len(model.joints)))
    np.add.at(weights, (np.arange(len(weights))[:, None], model.weight_joints), model.weights)
    none = torch.zeros(len(model.rest), 3, dtype=torch.float64)
    region = torch.zeros(len(model.rest), 8, dtype=torch.float64)
    return puppet, Pieces(torch.tensor(model.rest), torch.tensor(model.basis), torch.tensor(weights), none, region)


def sizes_m(model: BodyModel, shape: np.ndarray) -> list[float]:
    """Sizes as sdk/src/body/sizes/body_sizes.h defines them."""
    count = model.vertex_count
    rest, points = model.rest[:count], (model.rest + np.tensordot(shape, model.basis, 1))[:count]
    joints = model.joint_rest + np.tensordot(shape, model.joint_basis, 1)
    weights = np.zeros((count, len(model.joints)))
    np.add.at(weights, (np.arange(count)[:, None], model.weight_joints[:count]), model.weights[:count])
    arms = [k for k, name in enumerate(model.joints) if name.startswith(("upper_arm", "lower_arm", "hand"))]
    torso = model.triangles[(weights[:, arms].sum(1)[model.triangles] < 0.5).all(1)]
    hips = np.mean([joints[model.joints.index(f"upper_leg.{side}"), 2] for side in "LR"])
    neck = joints[model.joints.index("neck"), 2]
    girths = []
    for level in LEVELS:
        z = hips + level * (neck - hips)
        edges = points[torso[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)]
        cut = edges[(edges[:, 0, 2] < z) != (edges[:, 1, 2] < z)]
        t = (z - cut[:, 0, 2]) / (cut[:, 1, 2] - cut[:, 0, 2])
        girths.append(ConvexHull(cut[:, 0, :2] + t[:, None] * (cut[:, 1, :2] - cut[:, 0, :2])).area)
    top, sole = rest[:, 2].argmax(), rest[:, 2].argmin()
    middle = np.flatnonzero((np.abs(rest[:, 0]) <= 0.012) & (weights[:, 0] >= 0.5))
    crotch = middle[rest[middle, 2].argmin()]
    return [points[top, 2] - points[sole, 2], *girths, points[crotch, 2] - points[sole, 2]]


def main() -> None:
    FOLDER.mkdir(parents=True, exist_ok=True)
    write_body(small_body(), FOLDER / "body.maqb")
    model = read_body(SHIPPED)
    puppet, points = puppet_of(model)
    rng = np.random.default_rng(5)
    shown = np.r_[0 : model.vertex_count : STEP, model.vertex_count : len(model.rest)]
    rows = []
    for number in range(POSES):
        rotation = rng.normal(0, 0.2 + 0.2 * number, (len(model.joints), 3))
        shape = rng.normal(0, 1, len(model.basis))
        bones = puppet.bones(chained(turns(torch.tensor(rotation))), torch.tensor(shape))
        placed, _ = Puppet.place(points, bones, torch.tensor(shape), torch.zeros(8, dtype=torch.float64))
        rows.append(np.concatenate([rotation.ravel(), shape, placed.numpy()[shown].ravel()]))
    (FOLDER / "poses.f64").write_bytes(np.array(rows).astype("<f8").tobytes())
    shapes = np.clip(rng.normal(0, 1.2, (SHAPES, len(model.basis))), -3, 3)
    sizes = [[*shape, *sizes_m(model, shape)] for shape in shapes]
    (FOLDER / "sizes.f64").write_bytes(np.array(sizes).astype("<f8").tobytes())


if __name__ == "__main__":
    main()
