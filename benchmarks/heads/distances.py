"""Measures the distance of a mesh from a true head, in mm.

Distances go from true points to the nearest points of the mesh's triangles. The true points are first moved, rotated
and scaled to fit the mesh best: with the points of the face for the face's metric, and with all points for the head's
metric and for other parts. `back_mm` goes from the mesh to the true surface.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import igl
import numpy as np
from scipy.spatial.transform import Rotation

from export.heads.surface import cut_distance

MM_PER_DM = 100
BACK_POINTS = 4000
CUT_MARGIN_DM = 0.05  # so near the clip plane a mesh ends or closes
ICP_STEPS, ICP_POINTS = 12, 1000
# Farther points have less weight, so that missing hair does not move the face.
OUTLIER_MM = 3.0


@dataclass(frozen=True, eq=False)
class Triangles:
    """points: float64 [V, 3], mm; faces: int64 [F, 3]."""

    points: np.ndarray
    faces: np.ndarray

    @cached_property
    def _tree(self) -> igl.AABB:
        tree = igl.AABB()
        tree.init(self.points, self.faces)
        return tree

    def nearest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns for each of the points [N, 3] the distance [N] to the mesh, and the outward normal [N, 3] there."""
        points = np.ascontiguousarray(points)
        square, face, _ = self._tree.squared_distance(self.points, self.faces, points)
        a, b, c = (self.points[self.faces[face, k]] for k in range(3))
        normal = np.cross(b - a, c - a)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        return np.sqrt(square), normal

    def offsets(self, points: np.ndarray) -> np.ndarray:
        """Returns vectors from the nearest points of the mesh to the points, [N, 3]."""
        points = np.ascontiguousarray(points)
        return points - self._tree.squared_distance(self.points, self.faces, points)[2]


@dataclass(frozen=True, eq=False)
class TruePoints:
    """points: float64 [N, 3] of the surface above the clip plane, mm; is_face: [N]. None if unknown: normals [N, 3];
    is_inner_face [N], points that a face network covers (`face_mesh.py`); mesh, the whole surface."""

    points: np.ndarray
    is_face: np.ndarray
    normals: np.ndarray | None = None
    is_inner_face: np.ndarray | None = None
    mesh: Triangles | None = None


@dataclass(frozen=True)
class Distances:
    """Means in mm after alignment. unaligned_mm: whole head without alignment; scale: size of the mesh relative to the
    true one. None if unknown: normals_deg: mean angle between normals, whole head; inner_face_mm: aligned by the inner
    face alone; seen_mm, unseen_mm: points that the photos show or do not show; back_mm: from the mesh to the true
    surface."""

    face_mm: float
    head_mm: float
    unaligned_mm: float
    scale: float
    normals_deg: float | None
    inner_face_mm: float | None = None
    seen_mm: float | None = None
    unseen_mm: float | None = None
    back_mm: float | None = None


@dataclass(frozen=True, eq=False)
class Similarity:
    """Maps x to scale * rotation @ x + shift."""

    scale: float
    rotation: np.ndarray
    shift: np.ndarray

    def __call__(self, points: np.ndarray) -> np.ndarray:
        return self.scale * points @ self.rotation.T + self.shift

    def inverse(self) -> Similarity:
        return Similarity(1 / self.scale, self.rotation.T, -self.rotation.T @ self.shift / self.scale)


def aligned(mesh: Triangles, points: np.ndarray, steps: int = ICP_STEPS) -> Similarity:
    """Returns the similarity that fits the points to the mesh: point to plane, Huber loss."""
    every = max(1, len(points) // ICP_POINTS)
    points = points[::every]
    middle = points.mean(0)
    found = Similarity(1.0, np.eye(3), np.zeros(3))
    for _ in range(steps):
        moved = found(points)
        offset = mesh.offsets(moved)
        distance = np.linalg.norm(offset, axis=1)
        # For a point on the mesh, any direction is valid.
        slope = np.where(distance[:, None] > 1e-9, offset / np.maximum(distance, 1e-9)[:, None], 0)
        centre = found(middle[None])[0]
        arm = moved - centre
        j = np.concatenate([slope, np.cross(arm, slope), (arm * slope).sum(1, keepdims=True)], 1)
        weight = OUTLIER_MM / np.maximum(distance, OUTLIER_MM)
        scales = np.array([1, 1, 1, 100, 100, 100, 100])  # scales radians, so that mm and radians are damped equally
        normal = j.T @ (j * weight[:, None]) + np.diag(1e-6 * len(points) * scales**2)
        step = -np.linalg.solve(normal, j.T @ (distance * weight))
        rotation = Rotation.from_rotvec(step[3:6]).as_matrix()
        scale = float(np.exp(np.clip(step[6], -0.1, 0.1)))
        shift = scale * rotation @ (found.shift - centre) + centre + step[:3]
        found = Similarity(scale * found.scale, rotation @ found.rotation, shift)
    return found


def measure(mesh: Triangles, true: TruePoints, seen: np.ndarray | None = None) -> Distances:
    """seen: [N], true points that the photos show."""
    whole, face = aligned(mesh, true.points), aligned(mesh, true.points[true.is_face])
    head_mm, normal = mesh.nearest(whole(true.points))
    face_mm, _ = mesh.nearest(face(true.points[true.is_face]))
    before_mm, _ = mesh.nearest(true.points)
    angle = None
    if true.normals is not None:
        cosine = np.clip((normal * (true.normals @ whole.rotation.T)).sum(1), -1, 1)
        angle = float(np.degrees(np.arccos(cosine)).mean())
    parts = (None, None) if seen is None else (_mean(head_mm[seen]), _mean(head_mm[~seen]))
    return Distances(
        float(face_mm.mean()), float(head_mm.mean()), float(before_mm.mean()), whole.scale, angle,
        inner_face_mm(mesh, true), *parts, None if true.mesh is None else back_mm(mesh, true.mesh, whole.inverse()),
    )  # fmt: skip


def inner_face_mm(mesh: Triangles, true: TruePoints) -> float | None:
    """Returns the distance of the inner face alone, aligned by it; None if it is unknown."""
    if true.is_inner_face is None:
        return None
    points = true.points[true.is_inner_face]
    return float(mesh.nearest(aligned(mesh, points)(points))[0].mean())


def back_mm(mesh: Triangles, true: Triangles, to_true: Similarity) -> float | None:
    """Returns the distance from evenly spread points of the mesh above the clip plane to the true surface."""
    a, b, c = (mesh.points[mesh.faces[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    rng = np.random.default_rng(0)
    face = rng.choice(len(area), BACK_POINTS, p=area / area.sum())
    u, v = np.sqrt(rng.random((BACK_POINTS, 1))), rng.random((BACK_POINTS, 1))
    points = to_true((1 - u) * a[face] + u * (1 - v) * b[face] + u * v * c[face])
    points = points[cut_distance(points / MM_PER_DM) < -CUT_MARGIN_DM]
    return _mean(np.linalg.norm(true.offsets(points), axis=1)) if len(points) else None


def _mean(values: np.ndarray) -> float | None:
    return float(values.mean()) if len(values) else None
