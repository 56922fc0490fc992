"""Builds a baseline from MediaPipe's face network (468 points with depth, Apache-2.0): a mesh of the face from one
photo.

Its points lie on the template head (`export.heads.photos.face_points`). This says which true points the mesh covers,
and gives its first alignment. The triangles are a Delaunay triangulation of the template's points, unrolled around the
head's axis; they close eyes and mouth.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.spatial import Delaunay
from scipy.spatial.transform import Rotation

from benchmarks.heads.distances import MM_PER_DM, Similarity, Triangles
from export.heads.photos.face_points import FacePoints, read_face_points
from export.teachers.faces import Face, FaceDetector, FaceNetwork, Square, faces_of

_AXIS_Y = 0.0  # dm, position of the axis for unrolling
_REACH_DM = 0.25  # dm to the nearest point; the throat is farther inside, hair farther outside


def _unrolled(template: np.ndarray) -> np.ndarray:
    """Maps template points [N, 3] (dm) to the angle from the front and the height: [N, 2], dm."""
    return np.stack([np.arctan2(template[:, 0], _AXIS_Y - template[:, 1]), template[:, 2]], 1)


@cache
def _template() -> tuple[FacePoints, Delaunay]:
    points = read_face_points()
    return points, Delaunay(_unrolled(points.template))


def is_inner_face(template: np.ndarray) -> np.ndarray:
    """Returns which of the template points [N, 3] (dm) the network's mesh covers, [N]."""
    points, plane = _template()
    flat = _unrolled(template)
    near = np.zeros(len(template), bool)
    inside = np.flatnonzero(plane.find_simplex(flat) >= 0)
    corners = points.template[plane.simplices[plane.find_simplex(flat[inside])]]
    near[inside] = np.linalg.norm(corners - template[inside][:, None], axis=2).min(1) < _REACH_DM
    return near & (template[:, 1] < _AXIS_Y)


def similarity(points: np.ndarray, onto: np.ndarray) -> Similarity:
    """Returns the similarity between corresponding points [N, 3], least squares (Umeyama 1991)."""
    a, b = points - points.mean(0), onto - onto.mean(0)
    rotation, _ = Rotation.align_vectors(b, a)
    matrix = rotation.as_matrix()
    scale = float((b * (a @ matrix.T)).sum() / (a**2).sum())
    return Similarity(scale, matrix, onto.mean(0) - scale * matrix @ points.mean(0))


def mesh_of(face: Face) -> Triangles:
    """Returns its points near their positions on the template head, mm."""
    points, plane = _template()
    seen = np.stack([face.point[:, 0], face.depth, -face.point[:, 1]], 1)
    placed = similarity(seen[points.used], points.template[points.used] * MM_PER_DM)(seen)
    return Triangles(placed, plane.simplices.astype(np.int64))


class FaceMeshes:
    """The two networks, loaded once; they need the extra `teachers`."""

    def __init__(self) -> None:
        self._networks = FaceDetector(), FaceNetwork()

    def mesh(self, rgb: np.ndarray, box: np.ndarray) -> Triangles | None:
        """Returns the mesh of the face in a head's box, mm, roughly in the template's frame; None if no face is
        found."""
        low, high = box[:2], box[2:]
        square = Square((low + high - 1) / 2, float((high - low).max()), 0.0)
        found = faces_of(*self._networks, np.ascontiguousarray(rgb[..., ::-1]), [square])
        own = [face for face in found if ((face.point.mean(0) > low) & (face.point.mean(0) < high)).all()]
        return mesh_of(own[0]) if own else None
