"""Writes data/tiny_body: a body of three joints and four vertices, and what the fit of the teachers makes of poses.

`body.maqb`: the small body. `poses.f64`, little-endian doubles, of each of POSES poses of the shipped body
(`sdk/models/body`): the rotation vector of each of its 19 joints relative to its parent, the first to the body's axes;
10 shape coefficients; then where `export.teachers.body_model` places every STEP-th vertex and the 33 keypoints, in
body axes from the first joint, in float64.

    python -m tests.native.generate.make_tiny_body
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch

from export.body.body_file import FILE, read_body, write_body
from export.body.body_model import BodyModel
from export.teachers.body_model import Pieces, Puppet, chained, turns
from tests.python.support.small_body import small_body

FOLDER = Path(__file__).parents[1] / "data" / "tiny_body"
SHIPPED = Path(__file__).parents[3] / "sdk" / "models" / "body" / FILE
POSES, STEP = 6, 97


def puppet_of(model: BodyModel) -> tuple[Puppet, Pieces]:
    """The teachers' body with the numbers of `model`, in float64, and its points."""
    puppet = Puppet.__new__(Puppet)
    puppet.joint_rest, puppet.joint_basis = torch.tensor(model.joint_rest), torch.tensor(model.joint_basis)
    weights = np.zeros((len(model.rest), len(model.joints)))
    np.add.at(weights, (np.arange(len(weights))[:, None], model.weight_joints), model.weights)
    none = torch.zeros(len(model.rest), 3, dtype=torch.float64)
    region = torch.zeros(len(model.rest), 8, dtype=torch.float64)
    return puppet, Pieces(torch.tensor(model.rest), torch.tensor(model.basis), torch.tensor(weights), none, region)


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


if __name__ == "__main__":
    main()
