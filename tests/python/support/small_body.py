"""A body of three joints, four vertices and one shape, for tests of files."""

from __future__ import annotations

import numpy as np

from export.body.body_model import NOWHERE, BodyModel
from export.body.pose_prior import PosePrior
from export.keypoints import COUNT, NAMES


def small_body() -> BodyModel:
    rest = np.array([[0, 0, 0.0], [0.5, 0, 0], [0, 0.25, 0], [0, 0, 1]])
    keypoints = np.stack([np.linspace(-0.5, 0.5, COUNT), np.zeros(COUNT), np.linspace(0, 1, COUNT)], 1)
    points = np.concatenate([rest, keypoints])
    weight_joints = np.zeros((len(points), 4), int)
    weight_joints[:, 1], weight_joints[:, 2], weight_joints[:, 3] = 1, 2, 2
    weights = np.tile([0.5, 0.25, 0.25, 0], (len(points), 1))
    triangle = np.full((24, 2, 2), NOWHERE)
    triangle[:12] = np.arange(48).reshape(12, 2, 2) % 4
    fraction = np.zeros((24, 2, 2, 2))
    fraction[:12, ..., 0], fraction[:12, ..., 1] = 0.4, 0.2
    precision = 4 * np.eye(6)
    precision[0, 3] = precision[3, 0] = -1
    mean = np.array([0, 0.1, 0.2, -0.1, 0, 0])
    return BodyModel(
        ("pelvis", "chest", "head"), NAMES, np.array([-1, 0, 1]),
        np.array([[0, 0, 0], [0, 0, 0.25], [0, 0, 0.5]]), np.full((1, 3, 3), 0.01) * np.arange(3)[:, None],
        points, points[None] / 8, weight_joints, weights, np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]),
        triangle, fraction, PosePrior(mean, precision, mean - 1, mean + 1.5),
    )  # fmt: skip
