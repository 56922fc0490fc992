"""Our own atlas: every triangle of the body gets a part I of 24 and (U, V) at its corners.

The template body is cut, through its triangles, where two regions (by bone weights) meet and along planes through the
limbs' axes. Each piece is laid flat without folds (export.people.charts): limbs, torso and head on the unit square, of
hands and feet two sides next to each other. Directions follow the DensePose convention (which end of a limb is U = 0,
which side is V = 0); no published UV table is used. Left charts are mirrored right charts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from export import surface
from export.people import assets
from export.people.body import Body
from export.people.charts import (
    Mesh,
    border_loops,
    cut,
    flattened,
    flattened_loosely,
    on_square,
    pieces,
    without_chords,
)

VERSION = 1  # of the charts; what is kept on disk and depends on them carries it
REGIONS = ("torso", "head", "upper_arm", "lower_arm", "hand", "upper_leg", "lower_leg", "foot")
_PREFIXES = {
    "head": ("neck", "head"),
    "upper_arm": ("upperarm",),
    "lower_arm": ("lowerarm",),
    "hand": ("wrist", "finger", "metacarpal"),
    "upper_leg": ("upperleg",),
    "lower_leg": ("lowerleg",),
    "foot": ("foot", "toe"),
}
# region: (front part of the left limb, of the right; back part of the left, of the right;
#          does U grow towards the far end on the front, on the back)
_LIMBS = {
    "upper_arm": ((15, 16), (17, 18), True, True),
    "lower_arm": ((19, 20), (21, 22), False, True),
    "upper_leg": ((10, 9), (8, 7), False, True),
    "lower_leg": ((14, 13), (12, 11), True, False),
}
_AXES = {
    "upper_arm": ("upperarm01", "lowerarm01"),
    "lower_arm": ("lowerarm01", "wrist"),
    "hand": ("wrist", "finger3-3"),
    "upper_leg": ("upperleg01", "lowerleg01"),
    "lower_leg": ("lowerleg01", "foot"),
}
_FRONT = np.array([0.0, -1.0, 0.0])


def vertex_regions(body: Body) -> np.ndarray:
    """Weight of each region of `REGIONS` at each vertex: [V, 8], rows sum to 1."""
    weight = np.zeros((len(body.skin), len(REGIONS)))
    for k, name in enumerate(REGIONS):
        if k:
            columns = [b for b, bone in enumerate(body.bones) if bone.startswith(_PREFIXES[name])]
            weight[:, k] = body.skin[:, columns].sum(1)
    weight[:, 0] = 1 - weight[:, 1:].sum(1)
    return weight


def _around(points: np.ndarray, start: np.ndarray, end: np.ndarray, front: np.ndarray):
    """Position along the axis (0..1 between its ends), distances towards `front` and sideways, for a right limb."""
    axis = end - start
    length = np.linalg.norm(axis)
    axis = axis / length
    front = front - axis * (front @ axis)
    front /= np.linalg.norm(front)
    relative = points - start
    return relative @ axis / length, relative @ front, relative @ np.cross(axis, front)


def _half_turn(angle: np.ndarray) -> np.ndarray:
    """Angles of a back half, measured from the back: continuous across +-pi."""
    return np.mod(angle, 2 * np.pi) - np.pi


def _spread(x: np.ndarray) -> np.ndarray:
    """Scaled so that the smallest is 0 and the largest 1."""
    return (x - x.min()) / (x.max() - x.min())


class Atlas:
    """The template's surface, cut along the seams, and its charts.

    rest: float64 [V, 3] metres, the template body's vertices and those that the cuts made; faces: [F, 3] into them.
    part: uint8 [F]; uv: float32 [F, 3, 2] at the faces' corners. Built on the right half and mirrored, so that the
    mirror image of a label (`export.shards.mirror_iuv`) is exactly the label of the mirror image.
    """

    def __init__(self, body: Body) -> None:
        self._heads = {name: body.template.heads[k] for name, k in body.bone.items()}
        thumb = body.skin[:, [k for k, name in enumerate(body.bones) if name.startswith("finger1")]].sum(1)
        values = np.concatenate([vertex_regions(body), thumb[:, None]], 1)
        every = Mesh(body.template.vertices.astype(np.float64), body.faces["body"], values)
        mesh, _ = cut(every, every.vertices[:, 0], np.ones(len(every.faces), bool))
        mesh = mesh.only(mesh.vertices[mesh.faces][..., 0].mean(1) < 0)
        mesh, region = self._by_region(mesh)
        charts = []  # (mesh, part, uv of its vertices)
        for k, name in enumerate(REGIONS):
            own = mesh.only(region == k)
            make = {"torso": self._torso, "head": self._head, "hand": self._hand, "foot": self._foot}
            charts += make.get(name, self._limb)(own, name)
        self.charts = charts
        ends = np.cumsum([0] + [len(m.vertices) for m, _, _ in charts])
        rest = np.concatenate([m.vertices for m, _, _ in charts])
        faces = np.concatenate([m.faces + start for (m, _, _), start in zip(charts, ends, strict=False)])
        part = np.concatenate([np.full(len(m.faces), p, np.uint8) for m, p, _ in charts])
        uv = np.concatenate([at[m.faces] for m, _, at in charts])
        other = surface.MIRROR_PART[part]
        flip = np.stack([surface.MIRROR_FLIPS_U[part], surface.MIRROR_FLIPS_V[part]], -1)[:, None]
        self.rest = np.concatenate([rest, rest * [-1, 1, 1]])
        self.faces = np.concatenate([faces, faces[:, ::-1] + len(rest)])
        self.part = np.concatenate([part, other])
        self.uv = np.concatenate([uv, np.where(flip, 1 - uv, uv)[:, ::-1]]).astype(np.float32)

    @staticmethod
    def _by_region(mesh: Mesh) -> tuple[Mesh, np.ndarray]:
        """Cuts where two regions weigh the same; the region of each face."""
        for k in range(len(REGIONS)):
            weight = mesh.values[:, : len(REGIONS)]
            mesh, _ = cut(mesh, weight[:, k] - np.delete(weight, k, 1).max(1), np.ones(len(mesh.faces), bool))
        return mesh, mesh.values[mesh.faces][..., : len(REGIONS)].sum(1).argmax(1)

    def _bone(self, name: str) -> np.ndarray:
        return self._heads[f"{name}.R"]

    @staticmethod
    def _halves(mesh: Mesh, level: np.ndarray) -> tuple[Mesh, Mesh]:
        """The sides of a surface where `level` is above and below 0, each in one piece."""
        level = level - 1e-12
        mesh, _ = cut(Mesh(mesh.vertices, mesh.faces, np.concatenate([mesh.values, level[:, None]], 1)), level,
                      np.ones(len(mesh.faces), bool))  # fmt: skip
        above = mesh.values[mesh.faces][..., -1].sum(1) > 0
        # A crumb on the wrong side of the line belongs to what lies around it.
        for _ in range(3):
            for side in (True, False):
                rows = np.flatnonzero(above == side)
                above[rows[pieces(mesh.faces[rows]) > 0]] = not side
        return without_chords(mesh.only(above)), without_chords(mesh.only(~above))

    @staticmethod
    def _square(mesh: Mesh, rough_u: np.ndarray, rough_v: np.ndarray, weight: np.ndarray | None = None) -> np.ndarray:
        """(U, V) on the unit square; corners where the rough coordinates of the border come nearest to its."""
        border = border_loops(mesh.faces)[0]
        u, v = rough_u[border], rough_v[border]
        corners = np.array([(-u - v).argmax(), (u - v).argmax(), (u + v).argmax(), (v - u).argmax()])
        return flattened(mesh, border, on_square(mesh, border, corners, weight))

    def _limb(self, mesh: Mesh, name: str) -> list:
        start, end = (self._bone(bone) for bone in _AXES[name])
        (_, front_part), (_, back_part), front_outward, back_outward = _LIMBS[name]
        _, forward, _ = _around(mesh.vertices, start, end, _FRONT)
        charts = []
        for half, part, outward in zip(
            self._halves(mesh, forward), (front_part, back_part), (front_outward, back_outward), strict=True
        ):
            along, forward, side = _around(half.vertices, start, end, _FRONT)
            turn = np.arctan2(side, forward)
            turn = turn if part == front_part else _half_turn(turn)
            u = _spread(along if outward else -along)
            charts.append((half, part, self._square(half, u, 0.5 + turn / np.pi)))
        return charts

    def _torso(self, mesh: Mesh, name: str) -> list:
        # The middle between chest and back changes with height: follow it.
        y, z = mesh.vertices[:, 1], mesh.vertices[:, 2]
        bins = np.linspace(z.min(), z.max() + 1e-9, 13)
        of = np.digitize(z, bins) - 1
        middles = [(y[of == k].min() + y[of == k].max()) / 2 for k in range(12)]
        middle = np.interp(z, (bins[:-1] + bins[1:]) / 2, middles)
        charts = []
        for half, part in zip(self._halves(mesh, middle - y), (2, 1), strict=True):
            uv = self._square(half, _spread(-half.vertices[:, 2]), _spread(-half.vertices[:, 0]))
            charts.append((half, part, uv * [1, 0.5] + [0, 0.5]))  # the right half of the chart
        return charts

    def _head(self, mesh: Mesh, name: str) -> list:
        x, y, z = mesh.vertices.T
        height = _spread(z)
        # Neck and skull lean forward: follow their middle upwards.
        neck, head = self._heads["neck01"][1], self._heads["head"][1] - 0.02
        middle = np.interp(height, [0, 0.45], [neck, head])
        azimuth = np.arctan2(np.abs(x), middle - y) / np.pi  # 0 face, 1 back
        # The chart's upper corners lie a little before and behind the crown.
        rough = np.minimum(height, 0.93) - 0.5 * np.maximum(height - 0.93, 0)
        # The border runs through the mouth, which nobody sees: it takes no room.
        inner = (z > height_of(z, 0.25)) & (y > middle - 0.06) & (azimuth < 0.5) & (np.abs(x) < 1e-4)
        weight = np.where(inner, 0.02, 1.0)
        return [(mesh, 23, self._square(mesh, 1 - azimuth, rough, weight))]

    def _hand(self, mesh: Mesh, name: str) -> list:
        start, end = (self._bone(bone) for bone in _AXES[name])
        thumb = self._bone("finger2-1") - self._bone("finger5-1")
        along, across, _ = _around(mesh.vertices, start, end, thumb)
        axis = (end - start) / np.linalg.norm(end - start)
        radial = thumb - axis * (thumb @ axis)
        radial /= np.linalg.norm(radial)
        # The thumb's pad faces the fingers, not where the palm faces.
        turn = np.radians(55) * np.clip(mesh.values[:, -1:], 0, 1)
        facing = np.cos(turn) * np.cross(axis, radial) + np.sin(turn) * radial
        level = (smooth_normals(mesh, 4) * facing).sum(1)
        charts = []
        for half, sign in zip(self._halves(mesh, level), (1, -1), strict=True):
            a, c, _ = _around(half.vertices, start, end, thumb)
            # Palm and back lie side by side and meet at the thumb's edge, U = 0.5.
            u = 0.5 + sign * 0.5 * (across.max() - c) / np.ptp(across)
            plane = np.stack([u, (a - along.min()) / np.ptp(along)], 1)
            border = border_loops(half.faces)[0]
            charts.append((half, 3, flattened_loosely(half, border, plane[border])))
        return charts

    def _foot(self, mesh: Mesh, name: str) -> list:
        normal = smooth_normals(mesh, 6)
        forward, outward = -mesh.vertices[:, 1], -mesh.vertices[:, 0]
        charts = []
        for half, sole in zip(self._halves(mesh, -normal[:, 2] - 0.4), (True, False), strict=True):
            u = 1 - (-half.vertices[:, 1] - forward.min()) / np.ptp(forward)
            v = 0.5 * (-half.vertices[:, 0] - outward.min()) / np.ptp(outward)
            # Upper side and sole lie side by side and meet at the outer edge, V = 0.5.
            plane = np.stack([u, 1 - v if sole else v], 1)
            border = border_loops(half.faces)
            border = max(border, key=lambda loop: np.ptp(half.vertices[loop], axis=0)[:2].sum())
            charts.append((half, 6, flattened_loosely(half, border, plane[border])))
        return charts


def height_of(z: np.ndarray, share: float) -> float:
    return float(z.min() + share * np.ptp(z))


def smooth_normals(mesh: Mesh, rounds: int) -> np.ndarray:
    """Unit normals of the vertices, averaged over their neighbours `rounds` times: [V, 3]."""
    corner = mesh.vertices[mesh.faces]
    face = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    count = len(mesh.vertices)
    at = (mesh.faces.reshape(-1), np.repeat(np.arange(len(mesh.faces)), 3))
    normal = sp.csr_matrix((np.ones(len(at[0])), at), (count, len(mesh.faces))) @ face
    a, b = np.concatenate([mesh.faces[:, pair] for pair in ([0, 1], [1, 2], [2, 0])]).T
    link = sp.csr_matrix((np.ones(2 * len(a)), (np.concatenate([a, b]), np.concatenate([b, a]))), (count, count))
    for k in range(rounds + 1):
        normal = normal if k == 0 else normal + link @ normal
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    return normal


@dataclass(frozen=True)
class SurfaceTable:
    """Points of the template surface with their labels and geodesic distances between them.

    vertices: float32 [N, 3] metres; part: uint8 [N]; uv: float32 [N, 2]; geodesic: float16 [N, N] metres.
    """

    vertices: np.ndarray
    part: np.ndarray
    uv: np.ndarray
    geodesic: np.ndarray

    def nearest_by_point(self, points: np.ndarray) -> np.ndarray:
        """Index of the table point nearest to each of points [K, 3] (metres, template rest pose)."""
        return cKDTree(self.vertices).query(points)[1]

    def nearest_by_iuv(self, part: np.ndarray, uv: np.ndarray) -> np.ndarray:
        """Index of the table point of the same part nearest in (U, V); part [K] in 1..24, uv [K, 2]."""
        index = np.zeros(len(part), np.int64)
        for p in np.unique(part):
            own = np.flatnonzero(self.part == p)
            if not len(own):
                raise ValueError(f"part {p} is not a body part (1..24)")
            chosen = part == p
            index[chosen] = own[cKDTree(self.uv[own]).query(uv[chosen])[1]]
        return index


def load_surface_table(count: int = 4000) -> SurfaceTable:
    """The table, computed once (about a minute) and kept in the assets' cache."""
    path = assets.cache_dir() / f"surface-{VERSION}-{count}.npz"
    if not path.exists():
        body = Body()
        table = _build_surface_table(body, Atlas(body), count)
        assets.save_cache(path, vertices=table.vertices, part=table.part, uv=table.uv, geodesic=table.geodesic)
    with np.load(path) as data:
        return SurfaceTable(data["vertices"], data["part"], data["uv"], data["geodesic"])


def _build_surface_table(body: Body, atlas: Atlas, count: int) -> SurfaceTable:
    """Vertices of the body, drawn by farthest-point order, each with the label of one of its faces."""
    used = np.unique(body.faces["body"])
    points, faces = body.template.vertices[used].astype(np.float64), np.searchsorted(used, body.faces["body"])
    graph = _surface_graph(points, faces)
    chosen, nearest = [0], np.linalg.norm(points - points[0], axis=1)
    for _ in range(count - 1):
        chosen.append(int(nearest.argmax()))
        nearest = np.minimum(nearest, np.linalg.norm(points - points[chosen[-1]], axis=1))
    chosen = np.array(chosen)
    # A vertex of the body is also one of the atlas (of the right half, and of its mirror image).
    corners = atlas.rest[atlas.faces].reshape(-1, 3)
    distance, corner = cKDTree(corners).query(points[chosen])
    kept = distance < 1e-3
    chosen, corner = chosen[kept], corner[kept]
    geodesic = np.zeros((len(chosen), len(chosen)), np.float16)
    for k in range(0, len(chosen), 250):
        geodesic[k : k + 250] = dijkstra(graph, indices=chosen[k : k + 250])[:, chosen]
    part, uv = np.repeat(atlas.part, 3)[corner], atlas.uv.reshape(-1, 2)[corner]
    return SurfaceTable(points[chosen].astype(np.float32), part, uv, geodesic)


def _surface_graph(points: np.ndarray, faces: np.ndarray) -> sp.csr_matrix:
    """Edges of the mesh and, across each edge, the straight line between the two opposite corners.

    The second kind shortens the zigzag of pure edge paths (about 10 % too long) to a few percent.
    """
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    opposite = np.concatenate([faces[:, 2], faces[:, 0], faces[:, 1]])
    key = np.sort(edges, 1)
    order = np.lexsort(key.T)
    same = (key[order][1:] == key[order][:-1]).all(1)
    across = np.stack([opposite[order[:-1][same]], opposite[order[1:][same]]], 1)
    pairs = np.unique(np.sort(np.concatenate([key, across]), 1), axis=0)
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    # The two triangles' unfolded diagonal is longer than the chord through the body; edges here are short
    # (under 3 cm), so the chord's error is far below the table's spacing.
    length = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
    return sp.csr_matrix(
        (np.tile(length, 2), (pairs.T.reshape(-1), pairs[:, ::-1].T.reshape(-1))), (len(points), len(points))
    )
