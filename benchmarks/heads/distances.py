"""How far a mesh lies from a true head.

One-sided, from true points to the nearest points of the mesh's triangles. The true points are first moved, rotated and
scaled to where they fit the mesh best, those of the face for the face's figure and all for the head's. All in mm.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import igl
import numpy as np
from scipy.spatial.transform import Rotation

ICP_STEPS, ICP_POINTS = 12, 1000
# Farther points weigh less: hair that is not there must not pull the face away.
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
        """Of each of the points [N, 3] the distance [N] to the mesh, and the outward normal [N, 3] there."""
        points = np.ascontiguousarray(points)
        square, face, _ = self._tree.squared_distance(self.points, self.faces, points)
        a, b, c = (self.points[self.faces[face, k]] for k in range(3))
        normal = np.cross(b - a, c - a)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        return np.sqrt(square), normal

    def offsets(self, points: np.ndarray) -> np.ndarray:
        """From the nearest points of the mesh to the points, [N, 3]."""
        points = np.ascontiguousarray(points)
        return points - self._tree.squared_distance(self.points, self.faces, points)[2]


@dataclass(frozen=True, eq=False)
class TruePoints:
    """points: float64 [N, 3] of the surface above the cut, mm; is_face: [N]; normals: [N, 3], None where not known."""

    points: np.ndarray
    is_face: np.ndarray
    normals: np.ndarray | None = None


@dataclass(frozen=True)
class Distances:
    """Means in mm after alignment; unaligned_mm: of the whole head as it is; scale: the mesh's size by the true one's;
    normals_deg: mean angle between normals, whole head; None where the true ones are not known."""

    face_mm: float
    head_mm: float
    unaligned_mm: float
    scale: float
    normals_deg: float | None


@dataclass(frozen=True, eq=False)
class Similarity:
    """x -> scale * rotation @ x + shift."""

    scale: float
    rotation: np.ndarray
    shift: np.ndarray

    def __call__(self, points: np.ndarray) -> np.ndarray:
        return self.scale * points @ self.rotation.T + self.shift


def aligned(mesh: Triangles, points: np.ndarray, steps: int = ICP_STEPS) -> Similarity:
    """What moves the points to where they fit the mesh best: point to plane, Huber's loss."""
    every = max(1, len(points) // ICP_POINTS)
    points = points[::every]
    middle = points.mean(0)
    found = Similarity(1.0, np.eye(3), np.zeros(3))
    for _ in range(steps):
        moved = found(points)
        offset = mesh.offsets(moved)
        distance = np.linalg.norm(offset, axis=1)
        # Where a point lies on the mesh, any direction does.
        slope = np.where(distance[:, None] > 1e-9, offset / np.maximum(distance, 1e-9)[:, None], 0)
        centre = found(middle[None])[0]
        arm = moved - centre
        j = np.concatenate([slope, np.cross(arm, slope), (arm * slope).sum(1, keepdims=True)], 1)
        weight = OUTLIER_MM / np.maximum(distance, OUTLIER_MM)
        scales = np.array([1, 1, 1, 100, 100, 100, 100])  # so that mm and radians count alike in the damping
        normal = j.T @ (j * weight[:, None]) + np.diag(1e-6 * len(points) * scales**2)
        step = -np.linalg.solve(normal, j.T @ (distance * weight))
        rotation = Rotation.from_rotvec(step[3:6]).as_matrix()
        scale = float(np.exp(np.clip(step[6], -0.1, 0.1)))
        shift = scale * rotation @ (found.shift - centre) + centre + step[:3]
        found = Similarity(scale * found.scale, rotation @ found.rotation, shift)
    return found


def measure(mesh: Triangles, true: TruePoints) -> Distances:
    whole, face = aligned(mesh, true.points), aligned(mesh, true.points[true.is_face])
    head_mm, normal = mesh.nearest(whole(true.points))
    face_mm, _ = mesh.nearest(face(true.points[true.is_face]))
    before_mm, _ = mesh.nearest(true.points)
    angle = None
    if true.normals is not None:
        cosine = np.clip((normal * (true.normals @ whole.rotation.T)).sum(1), -1, 1)
        angle = float(np.degrees(np.arccos(cosine)).mean())
    return Distances(float(face_mm.mean()), float(head_mm.mean()), float(before_mm.mean()), whole.scale, angle)
