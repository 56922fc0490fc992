"""Cutting a triangle mesh along level lines, and laying a disc of it flat without folds.

Sources: Tutte, "How to draw a graph" (1963): with the border on a convex polygon and every inner vertex a weighted mean
(positive weights) of its neighbours, no triangle turns over. Floater, "Mean value coordinates" (2003), for weights that
keep angles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import spsolve

# A level line that passes this close to a vertex (share of the edge) goes through it, so that no slivers arise.
_SNAP = 0.03


@dataclass(frozen=True)
class Mesh:
    """vertices [V, 3]; faces [F, 3]; values [V, K], linear over each triangle and carried along when it is cut."""

    vertices: np.ndarray
    faces: np.ndarray
    values: np.ndarray

    def only(self, chosen: np.ndarray) -> Mesh:
        """The chosen faces (bool or indices) with the vertices they use."""
        used, faces = np.unique(self.faces[chosen], return_inverse=True)
        return Mesh(self.vertices[used], faces.reshape(-1, 3), self.values[used])


def cut(mesh: Mesh, level: np.ndarray, chosen: np.ndarray) -> tuple[Mesh, np.ndarray]:
    """Splits the chosen faces (bool [F]) where `level` [V] is 0, so that each of them lies on one side.

    Returns the mesh and, for each new face, the face it came from. Old vertices keep their numbers.
    """
    level = _snapped(mesh, level, chosen)
    sign = np.sign(level[mesh.faces])
    crossed = chosen & (sign.min(1) < 0) & (sign.max(1) > 0)
    faces, sign = mesh.faces[crossed], sign[crossed].astype(int)
    origin = np.flatnonzero(crossed)
    through = (sign == 0).any(1)  # one corner on the line: two pieces; else three

    def turned(rows: np.ndarray, first: np.ndarray) -> np.ndarray:
        return np.take_along_axis(rows, (first[:, None] + np.arange(3)) % 3, 1)

    two = turned(faces[through], (sign[through] == 0).argmax(1))
    alone = np.where(sign[~through].sum(1) > 0, -1, 1)[:, None]  # the sign that only one corner has
    three = turned(faces[~through], (sign[~through] == alone).argmax(1))
    edges = np.sort(np.concatenate([two[:, [1, 2]], three[:, [0, 1]], three[:, [0, 2]]]), 1)
    unique, number = np.unique(edges, axis=0, return_inverse=True)
    number = number.reshape(-1) + len(mesh.vertices)
    middle = number[: len(two)]
    ab, ac = number[len(two) : len(two) + len(three)], number[len(two) + len(three) :]
    a, b = unique.T
    share = (level[a] / (level[a] - level[b]))[:, None]
    pieces = [
        (two[:, 0], two[:, 1], middle, origin[through]), (two[:, 0], middle, two[:, 2], origin[through]),
        (three[:, 0], ab, ac, origin[~through]), (ab, three[:, 1], three[:, 2], origin[~through]),
        (ab, three[:, 2], ac, origin[~through]),
    ]  # fmt: skip
    out = Mesh(
        np.concatenate([mesh.vertices, mesh.vertices[a] * (1 - share) + mesh.vertices[b] * share]),
        np.concatenate([mesh.faces[~crossed], *(np.stack(p[:3], 1) for p in pieces)]),
        np.concatenate([mesh.values, mesh.values[a] * (1 - share) + mesh.values[b] * share]),
    )
    return out, np.concatenate([np.flatnonzero(~crossed), *(p[3] for p in pieces)])


def _snapped(mesh: Mesh, level: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    a, b = np.concatenate([mesh.faces[chosen][:, pair] for pair in ([0, 1], [1, 2], [2, 0])]).T
    a, b = np.concatenate([a, b]), np.concatenate([b, a])
    crossed = level[a] * level[b] < 0
    a, b = a[crossed], b[crossed]
    near = np.abs(level[a]) < _SNAP * np.abs(level[a] - level[b])
    out = level.copy()
    out[a[near]] = 0
    return out


def pieces(faces: np.ndarray) -> np.ndarray:
    """Number of the edge-connected piece each face belongs to, the largest piece being 0: [F]."""
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), 1)
    owner = np.tile(np.arange(len(faces)), 3)
    order = np.lexsort(edges.T)
    same = (edges[order][1:] == edges[order][:-1]).all(1)
    links = owner[order[:-1][same]], owner[order[1:][same]]
    graph = sp.csr_matrix((np.ones(len(links[0])), links), (len(faces), len(faces)))
    number = connected_components(graph, directed=False)[1]
    by_size = np.argsort(-np.bincount(number), kind="stable")
    return np.argsort(by_size)[number]


def border_loops(faces: np.ndarray) -> list[np.ndarray]:
    """Vertices along each border, in the direction of the faces, longest first. Raises ValueError where two borders
    meet in a vertex."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    keys = edges[:, 0] * (faces.max() + 1) + edges[:, 1]
    open_edges = edges[~np.isin(keys, edges[:, 1] * (faces.max() + 1) + edges[:, 0])]
    following = dict(open_edges.tolist())
    if len(following) != len(open_edges):
        raise ValueError("borders of a chart meet in a vertex")
    loops = []
    while following:
        start, at = following.popitem()
        loop = [start]
        while at != start:
            loop.append(at)
            at = following.pop(at)
        loops.append(np.array(loop))
    return sorted(loops, key=len, reverse=True)


def without_chords(mesh: Mesh) -> Mesh:
    """The same surface with a new vertex in the middle of each inner edge that joins two border vertices.

    On a straight side such an edge would leave a triangle without area.
    """
    while True:
        faces = mesh.faces
        border = np.zeros(len(mesh.vertices), bool)
        border[np.concatenate(border_loops(faces))] = True
        edges = np.sort(np.stack([faces, np.roll(faces, -1, 1)], -1), -1)  # [F, 3, 2], edge k from corner k to k + 1
        unique, number, used = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True, return_counts=True)
        chord = border[unique].all(1) & (used == 2)
        if not chord.any():
            return mesh
        hit = chord[number.reshape(-1, 3)]
        # One edge a face at a time: of the rest the next round takes care.
        number = np.where(hit, number.reshape(-1, 3), len(unique))
        taken, busy = [], np.zeros(len(faces), bool)
        for edge in np.unique(number[hit]):
            owners = np.flatnonzero((number == edge).any(1))
            if not busy[owners].any():
                busy[owners] = True
                taken.append((edge, owners))
        fresh, kept = [], ~busy
        middles = []
        for edge, owners in taken:
            new = len(mesh.vertices) + len(middles)
            middles.append(unique[edge])
            for owner in owners:
                k = int((number[owner] == edge).argmax())
                a, b, c = np.roll(faces[owner], -k)
                fresh += [[a, new, c], [new, b, c]]
        a, b = np.array(middles).T
        mesh = Mesh(
            np.concatenate([mesh.vertices, (mesh.vertices[a] + mesh.vertices[b]) / 2]),
            np.concatenate([faces[kept], fresh]),
            np.concatenate([mesh.values, (mesh.values[a] + mesh.values[b]) / 2]),
        )


def flattened(mesh: Mesh, border: np.ndarray, border_uv: np.ndarray) -> np.ndarray:
    """(U, V) of every vertex of a disc, [V, 2], without folds, given those of its outer border (a convex polygon).

    Further borders (holes) are closed by a fan while solving.
    """
    faces, vertices = mesh.faces, mesh.vertices
    outer = set(border.tolist())
    for loop in border_loops(faces):
        if loop[0] not in outer:
            fan = np.stack([np.roll(loop, -1), loop, np.full(len(loop), len(vertices))], 1)
            faces, vertices = np.concatenate([faces, fan]), np.concatenate([vertices, [vertices[loop].mean(0)]])
    count = len(vertices)
    corner = vertices[faces]
    rows, columns, weights = [], [], []
    for k in range(3):
        i = faces[:, k]
        p, q = corner[:, (k + 1) % 3] - corner[:, k], corner[:, (k + 2) % 3] - corner[:, k]
        length_p, length_q = np.linalg.norm(p, axis=1), np.linalg.norm(q, axis=1)
        cosine = np.clip((p * q).sum(1) / np.maximum(length_p * length_q, 1e-18), -1, 1)
        tangent = np.sqrt((1 - cosine) / np.maximum(1 + cosine, 1e-6))  # of half the angle at i
        rows += [i, i]
        columns += [faces[:, (k + 1) % 3], faces[:, (k + 2) % 3]]
        weights += [tangent / np.maximum(length_p, 1e-9) + 1e-6, tangent / np.maximum(length_q, 1e-9) + 1e-6]
    weight = sp.csr_matrix((np.concatenate(weights), (np.concatenate(rows), np.concatenate(columns))), (count, count))
    weight = sp.diags(1 / np.asarray(weight.sum(1)).ravel()) @ weight
    free = np.setdiff1d(np.arange(count), border)
    system = (sp.identity(count, format="csr") - weight)[free]
    uv = np.zeros((count, 2))
    uv[border] = border_uv
    uv[free] = spsolve(system[:, free].tocsc(), -(system[:, border] @ border_uv))
    return uv[: len(mesh.vertices)]


def signed_areas(faces: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """Twice the area of each face in (U, V): [F], negative where it runs clockwise."""
    a, b = uv[faces[:, 1]] - uv[faces[:, 0]], uv[faces[:, 2]] - uv[faces[:, 0]]
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def flattened_loosely(mesh: Mesh, border: np.ndarray, border_uv: np.ndarray, rounds: int = 200) -> np.ndarray:
    """As `flattened`, for any border: where it is too hollow and faces turn over, it is smoothed until none does.

    Raises ValueError when that does not help.
    """
    border_uv = border_uv.copy()
    for _ in range(rounds):
        uv = flattened(mesh, border, border_uv)
        area = signed_areas(mesh.faces, uv)
        folded = area * np.sign(np.median(area)) <= 0
        if not folded.any():
            return uv
        near = np.isin(border, mesh.faces[folded])
        if not near.any():
            # A fold away from the border: all of it is too hollow.
            near[:] = True
        near |= np.roll(near, 1) | np.roll(near, -1)
        mean = (np.roll(border_uv, 1, 0) + np.roll(border_uv, -1, 0)) / 2
        border_uv[near] = 0.5 * (border_uv + mean)[near]
    raise ValueError(f"{int(folded.sum())} faces of a chart stay folded")


def on_square(mesh: Mesh, border: np.ndarray, corners: np.ndarray, weight: np.ndarray | None = None) -> np.ndarray:
    """(U, V) of the border's vertices on the unit square, by arc length between four of them.

    corners: places in `border` of the vertices at (0, 0), (1, 0), (1, 1), (0, 1). weight [V]: of lengths there.
    """
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
    count = len(border)
    steps = (corners[1] - corners[0]) % count
    if steps > (corners[3] - corners[0]) % count:  # the border runs the other way round
        border, corners = border[::-1], count - 1 - corners
        return on_square(mesh, border, corners, weight)[::-1]
    uv = np.zeros((count, 2))
    for k in range(4):
        span = (corners[(k + 1) % 4] - corners[k]) % count
        places = (corners[k] + np.arange(span + 1)) % count
        points = mesh.vertices[border[places]]
        length = np.linalg.norm(np.diff(points, axis=0), axis=1)
        if weight is not None:
            length = length * np.minimum(weight[border[places]][1:], weight[border[places]][:-1])
        along = np.concatenate([[0], np.cumsum(length)])
        share = (along / along[-1])[:, None]
        uv[places] = square[k] * (1 - share) + square[(k + 1) % 4] * share
    return uv
