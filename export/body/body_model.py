"""The body model of a bundle: what `sdk/src/body` reads, made from the MakeHuman body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from export.body.decimation import decimated
from export.body.pose_prior import POSES, PosePrior, drawn_rotations, pose_prior
from export.keypoints import NAMES
from export.people.body import Body
from export.surface_grid import SurfaceGrid
from export.teachers.body_model import JOINTS, PARENT, SHAPES, Pieces, Puppet

VERTICES = 2600
WEIGHTS = 4  # joints that move a point
NOWHERE = 65535  # a node of the surface that no chart reaches
_NEAR_TRIANGLES = 48  # of a node: candidates for the nearest


@dataclass(frozen=True, eq=False)
class BodyModel:
    """V vertices, then K = 33 keypoints: points that move with the body. Metres; x to the person's left, y to the
    back, z up; the pelvis' joint at the origin.

    joints: names; parents [19], -1 of the first; joint_rest [19, 3], joint_basis [S, 19, 3]; rest [V + K, 3], basis
    [S, V + K, 3] (a standard deviation each); weight_joints, weights [V + K, 4], sum 1; triangles [F, 3] of vertices;
    surface_triangle [24, n, n] (NOWHERE: none) and surface_fraction [24, n, n, 2], the fractions of the triangle's
    first and second vertex, at U = i / (n - 1), V = j / (n - 1); prior of the pose.
    """

    joints: tuple[str, ...]
    keypoints: tuple[str, ...]
    parents: np.ndarray
    joint_rest: np.ndarray
    joint_basis: np.ndarray
    rest: np.ndarray
    basis: np.ndarray
    weight_joints: np.ndarray
    weights: np.ndarray
    triangles: np.ndarray
    surface_triangle: np.ndarray
    surface_fraction: np.ndarray
    prior: PosePrior

    @property
    def vertex_count(self) -> int:
        return len(self.rest) - len(self.keypoints)


def heaviest(weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """weights [K, 19] to the joints [K, 4] with the largest of them, and these, scaled to sum 1."""
    order = np.argsort(-weights, axis=1, kind="stable")[:, :WEIGHTS]
    kept = np.take_along_axis(weights, order, 1)
    return order, kept / kept.sum(1, keepdims=True)


def nearest_on_triangles(points: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """points [K, 3], corners [F, 3, 3]. For each point the nearest triangle [K], the fractions of its three vertices
    [K, 3] and the distance [K] (Ericson, "Real-time collision detection", 5.1.5)."""
    tree = cKDTree(corners.mean(1))
    candidates = tree.query(points, k=np.arange(1, min(_NEAR_TRIANGLES, len(corners)) + 1))[1]
    a, b, c = (corners[candidates][:, :, k] for k in range(3))
    ab, ac, ap = b - a, c - a, points[:, None] - a
    dot = lambda u, v: (u * v).sum(-1)  # noqa: E731
    d1, d2, d3, d4, d5 = dot(ab, ab), dot(ab, ac), dot(ac, ac), dot(ap, ab), dot(ap, ac)
    scale = np.maximum(d1 * d3 - d2 * d2, 1e-18)
    v, w = (d3 * d4 - d2 * d5) / scale, (d1 * d5 - d2 * d4) / scale
    inside = (v >= 0) & (w >= 0) & (v + w <= 1)

    def on_edge(start, along):
        return np.clip(dot(points[:, None] - start, along) / np.maximum(dot(along, along), 1e-18), 0, 1)

    t_ab, t_ac, t_bc = on_edge(a, ab), on_edge(a, ac), on_edge(b, c - b)
    options = [(v, w), (t_ab, 0 * t_ab), (0 * t_ac, t_ac), (1 - t_bc, t_bc)]
    best = np.full(v.shape, np.inf)
    fraction = np.zeros((*v.shape, 3))
    for k, (x, y) in enumerate(options):
        at = a + x[..., None] * ab + y[..., None] * ac
        away = np.linalg.norm(points[:, None] - at, axis=-1)
        away = np.where(inside, away, np.inf) if k == 0 else away
        nearer = away < best
        best = np.where(nearer, away, best)
        fraction[nearer] = np.stack([1 - x - y, x, y], -1)[nearer]
    row, pick = np.arange(len(points)), best.argmin(1)
    return candidates[row, pick], fraction[row, pick], best[row, pick]


def _stacked(vertices: Pieces, keypoints: Pieces, field: str) -> np.ndarray:
    parts = [getattr(pieces, field).numpy().astype(np.float64) for pieces in (vertices, keypoints)]
    return np.concatenate(parts, 1 if field == "basis" else 0)


def make_body_model(grid: SurfaceGrid, body: Body | None = None, vertices: int = VERTICES) -> BodyModel:
    """The model whose surface has the labels of `grid`."""
    body = body or Body()
    puppet = Puppet(body, samples=1)
    kept, triangles = decimated(puppet.whole.rest.numpy(), body.faces["body"], vertices)
    whole = puppet.whole
    own = Pieces(whole.rest[kept], whole.basis[:, kept], whole.weights[kept], whole.normals[kept], whole.region[kept])
    weight_joints, weights = heaviest(_stacked(own, puppet.landmarks, "weights"))
    reached = ~np.isnan(grid.points).any(-1)
    nearest, fraction, _ = nearest_on_triangles(grid.points[reached], body.template.vertices[kept][triangles])
    surface_triangle = np.full(reached.shape, NOWHERE)
    surface_triangle[reached] = nearest
    surface_fraction = np.zeros((*reached.shape, 2))
    surface_fraction[reached] = fraction[:, :2]
    assert puppet.joint_basis.shape[0] == SHAPES
    return BodyModel(
        JOINTS, NAMES, np.array(PARENT),
        puppet.joint_rest.numpy().astype(np.float64), puppet.joint_basis.numpy().astype(np.float64),
        _stacked(own, puppet.landmarks, "rest"), _stacked(own, puppet.landmarks, "basis"),
        weight_joints, weights, triangles, surface_triangle, surface_fraction,
        pose_prior(drawn_rotations(body, POSES)),
    )  # fmt: skip
