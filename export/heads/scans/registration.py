"""Brings a linear model of scanned heads into the vertices of `HeadShapes`.

    python -m export.heads.scans.registration ict_facekit_light.npz --out .data/heads/scans.npz

The source is ICT-FaceKit (MIT): a mean face, components of identity and expressions in one mesh. Its mean face is
registered to the template head once: the template is bent until it lies on that face, with the landmarks of both in the
same places. Each of the template's vertices then lies on one triangle of the source and moves as that does. Vertices
without such a triangle, inside the mouth and below the neck, follow their neighbours; eyeballs move as a whole.
"""

from __future__ import annotations

import argparse
from dataclasses import fields
from pathlib import Path

import igl
import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import splu, spsolve

from export.heads.photos.face_points import read_face_points
from export.heads.scans.scanned_heads import EYES, SKIN_VERTICES, ScannedHeads
from export.heads.shapes import HeadShapes, vertex_normals
from export.heads.surface import HeadMaker, barycentric
from export.heads.synthetic_heads import make_maker

# Vertices of the source and MediaPipe's points (`photos/face_points.json`) of the same places: chin, nose, eyes, mouth.
LANDMARKS = {
    966: 152, 978: 168, 4527: 197, 4942: 5, 4857: 4, 1140: 75, 2075: 97, 1147: 2, 4269: 326, 3360: 305, 1507: 33,
    1542: 160, 1537: 158, 1528: 133, 1518: 153, 1511: 144, 3742: 362, 3751: 385, 3756: 387, 3721: 263, 3725: 373,
    3732: 380, 5708: 61, 5695: 39, 2081: 37, 0: 0, 4275: 267, 6200: 269, 6213: 291, 6346: 405, 6461: 314, 5518: 17,
    5957: 84, 5841: 181, 5702: 78, 5711: 82, 5533: 13, 6216: 312, 6207: 308, 6470: 317, 5517: 14, 5966: 87,
}  # fmt: skip
# How much the bending is resisted, from stiff to soft, and from how far (dm) a vertex is drawn to the source.
STIFFNESS = (30, 30, 30, 10, 10, 10, 3, 3, 3, 1, 1, 1, 0.3, 0.3, 0.3, 0.1, 0.1, 0.1)
FAR_DM, NEAR_DM = 0.4, 0.2
ALONG = 0.05  # weight of distances along the surface; those across it have 1
MIN_COSINE = 0.5  # between the normals of two points that may be the same place


def _in_head_frame(points: np.ndarray) -> np.ndarray:
    """From the source's axes (centimetres, y up, z forward)."""
    points = points.astype(np.float64) / 10
    return np.stack([points[..., 0], -points[..., 2], points[..., 1]], -1)


def _turned_onto(points: np.ndarray, targets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotation and shift that bring points [N, 3] nearest to targets, without scale: scans know sizes."""
    middle, there = points.mean(0), targets.mean(0)
    u, _, vt = np.linalg.svd((points - middle).T @ (targets - there))
    rotation = (u @ np.diag([1, 1, np.sign(np.linalg.det(u @ vt))]) @ vt).T
    return rotation, there - rotation @ middle


def _edges(faces: np.ndarray) -> np.ndarray:
    return np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)


def neighbour_differences(faces: np.ndarray, count: int) -> sparse.csr_matrix:
    """[count, count]: each vertex less the mean of its neighbours."""
    edges = np.unique(_edges(faces), axis=0)
    joined = sparse.coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), (count, count))
    joined = (joined + joined.T).tocsr()
    degree = np.maximum(np.asarray(joined.sum(1)).ravel(), 1)
    return (sparse.eye(count) - sparse.diags(1 / degree) @ joined).tocsr()


def places_on(points: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> tuple[sparse.csr_matrix, np.ndarray]:
    """The nearest places of a mesh to points [N, 3], as a matrix [N, vertices], and their distances [N]."""
    squared, face, at = igl.point_mesh_squared_distance(points, vertices, faces)
    weight = barycentric(at, vertices[faces[face]])
    rows = np.repeat(np.arange(len(points)), 3)
    shape = (len(points), len(vertices))
    matrix = sparse.coo_matrix((weight.ravel(), (rows, faces[face].ravel())), shape)
    return matrix.tocsr(), np.sqrt(np.maximum(squared, 0))


class _Registration:
    """Bends the template onto a surface [W, 3] with triangles, held by landmarks of both."""

    def __init__(self, maker: HeadMaker, surface: np.ndarray, faces: np.ndarray) -> None:
        shapes = maker.shapes
        self.template, self.surface, self.faces = shapes.template, surface, faces
        self.outer_faces, self.outer = maker.faces, np.unique(maker.faces)
        self.normals = vertex_normals(surface, faces)
        edges, times = np.unique(_edges(faces), axis=0, return_counts=True)
        self.is_border = np.isin(np.arange(len(surface)), edges[times == 1])
        differences = neighbour_differences(np.concatenate([shapes.faces, shapes.bust_faces]), len(self.template))
        self.differences = sparse.kron(differences, sparse.eye(3)).tocsr()
        marked = read_face_points().template[list(LANDMARKS.values())]
        places, _ = places_on(marked, self.template, maker.faces)
        self.off = surface[list(LANDMARKS)] - places @ self.template
        self.places = sparse.kron(places, sparse.eye(3)).tocsr()

    def matched(self, points: np.ndarray, far: float) -> tuple[np.ndarray, sparse.csr_matrix, np.ndarray]:
        """Which of the bent vertices lie on the surface, their places there, and the normals [., 3] of these."""
        normal = vertex_normals(points, self.outer_faces)[self.outer]
        places, away = places_on(points[self.outer], self.surface, self.faces)
        there = places @ self.normals
        there /= np.maximum(np.linalg.norm(there, axis=1, keepdims=True), 1e-9)
        same = ((there * normal).sum(1) > MIN_COSINE) & (away < far) & (places @ self.is_border < 0.3)
        return self.outer[same], places[same], there[same]

    def bent(self) -> np.ndarray:
        """The template's vertices [V, 3] on the surface."""
        moved = self._solved(STIFFNESS[0], np.zeros(0, int), np.zeros((0, 3)), np.zeros((0, 3)), 1.0)
        for number, stiffness in enumerate(STIFFNESS):
            is_early = number < len(STIFFNESS) // 2
            rows, places, normal = self.matched(moved, FAR_DM if number < len(STIFFNESS) // 3 else NEAR_DM)
            moved = self._solved(stiffness, rows, places @ self.surface, normal, 3.0 if is_early else 0.3)
        return moved

    def _solved(
        self, stiffness: float, rows: np.ndarray, targets: np.ndarray, normal: np.ndarray, marks: float
    ) -> np.ndarray:
        """Least squares of how the template bends; vertices `rows` go to targets [., 3] on a surface with normals."""
        size, count = 3 * len(self.template), len(rows)
        columns = 3 * rows[:, None] + np.arange(3)
        off = targets - self.template[rows]
        across = sparse.coo_matrix((normal.ravel(), (np.repeat(np.arange(count), 3), columns.ravel())), (count, size))
        along = sparse.coo_matrix((np.ones(3 * count), (np.arange(3 * count), columns.ravel())), (3 * count, size))
        parts = [
            (stiffness, self.differences, np.zeros(size)), (1.0, across, (off * normal).sum(1)),
            (ALONG, along, off.ravel()), (marks, self.places, self.off.ravel()),
            (1e-8, sparse.eye(size), np.zeros(size)),
        ]  # fmt: skip
        matrix = sparse.vstack([np.sqrt(weight) * part for weight, part, _ in parts]).tocsr()
        values = np.concatenate([np.sqrt(weight) * value for weight, _, value in parts])
        return self.template + spsolve((matrix.T @ matrix).tocsc(), matrix.T @ values).reshape(-1, 3)


def _followed(shapes: HeadShapes, known: np.ndarray, moves: np.ndarray) -> np.ndarray:
    """Moves [K, V, 3] of all vertices by those [K, N, 3] of the vertices `known`: as smooth as can be elsewhere."""
    count = len(shapes.template)
    differences = neighbour_differences(np.concatenate([shapes.faces, shapes.bust_faces]), count)
    energy = (differences.T @ differences + 1e-9 * sparse.eye(count)).tocsc()
    free = np.setdiff1d(np.arange(count), known)
    out = np.zeros((len(moves), count, 3))
    out[:, known] = moves
    inner, border = splu(energy[free][:, free]), energy[free][:, known]
    for row, move in zip(out, moves, strict=True):
        row[free] = -inner.solve(border @ move)
    return out


def register(source: Path, maker: HeadMaker) -> ScannedHeads:
    """source: arrays neutral, faces, identity_delta and _scale, expression_delta and _scale, expression_names."""
    with np.load(source) as stored:
        data = dict(stored)
    shapes, quads = maker.shapes, data["faces"]
    whole = _in_head_frame(data["neutral"])
    quads = quads[(quads < SKIN_VERTICES).all(1)]
    skin_faces = np.concatenate([quads[:, :3], quads[quads[:, 3] >= 0][:, [0, 2, 3]]]).astype(np.int64)
    marks = read_face_points().template[list(LANDMARKS.values())]
    rotation, shift = _turned_onto(whole[list(LANDMARKS)], marks)
    whole = whole @ rotation.T + shift

    def moves(name: str) -> np.ndarray:
        scaled = data[f"{name}_delta"].astype(np.float64) * data[f"{name}_scale"].astype(np.float64)[:, None, None]
        return _in_head_frame(scaled) @ rotation.T

    deltas = {name: moves(name) for name in ("identity", "expression")}
    skin = whole[:SKIN_VERTICES]
    registration = _Registration(maker, skin, skin_faces)
    neutral = registration.bent()
    rows, places, _ = registration.matched(neutral, NEAR_DM)
    carried = {}
    for name, delta in deltas.items():
        of_rows = np.stack([places @ move[:SKIN_VERTICES] for move in delta])
        carried[name] = _followed(shapes, rows, of_rows)
    eyes = np.unique(shapes.eye_faces)
    for side, (start, end) in zip((1, -1), EYES, strict=True):
        own = eyes[shapes.template[eyes, 0] * side > 0]
        ball, here = whole[start:end], shapes.template[own]
        middle = (ball.max(0) + ball.min(0)) / 2
        scale = np.ptp(ball, axis=0).mean() / np.ptp(here, axis=0).mean()
        neutral[own] = (here - (here.max(0) + here.min(0)) / 2) * scale + middle
        for name, delta in deltas.items():
            # The eyes turn in some expressions; the mean of a ball's moves does not.
            carried[name][:, own] = delta[:, None, start:end].mean(2)
    # The source's own surface, for truth: skin and eyeballs.
    kept = np.concatenate([np.arange(SKIN_VERTICES), np.arange(EYES[0][0], EYES[1][1])])
    number = np.full(len(whole), -1)
    number[kept] = np.arange(len(kept))
    quads = data["faces"][np.isin(data["faces"][:, :3], kept).all(1)]
    own_faces = np.concatenate([quads[:, :3], quads[quads[:, 3] >= 0][:, [0, 2, 3]]])
    all_faces = np.concatenate([maker.faces, shapes.eye_faces])
    to_template, _ = places_on(whole[kept], neutral, all_faces)
    single = np.float32
    return ScannedHeads(
        neutral.astype(single), carried["identity"].astype(single), carried["expression"].astype(single),
        data["expression_names"], whole[kept].astype(single), deltas["identity"][:, kept].astype(single),
        deltas["expression"][:, kept].astype(single), number[own_faces], (to_template @ shapes.template).astype(single),
    )  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("source", type=Path)
    parser.add_argument("--out", type=Path, default=Path(".data/heads/scans.npz"))
    arguments = parser.parse_args()
    heads = register(arguments.source, make_maker())
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    np.savez(arguments.out, **{f.name: getattr(heads, f.name) for f in fields(heads)})
    print(f"{arguments.out}: {len(heads.identity)} components, {len(heads.names)} expressions")


if __name__ == "__main__":
    main()
