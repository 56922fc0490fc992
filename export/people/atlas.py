"""Our own atlas: every triangle of the body gets a part I of 24 and (U, V) at its corners.

Each chart is a cylinder or half cylinder around a bone of the template body, laid in the DensePose
convention's directions (which end of a limb is U = 0, which side is V = 0); no published UV table is used.
Parts are cut by bone weights and by a plane through the bone's axis. The mirror image of (I, U, V) is
exactly `export.surface.mirror_iuv` of it, because left charts are mirrored right charts.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from export.people import assets
from export.people.body import Body

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


def _around(points: np.ndarray, start: np.ndarray, end: np.ndarray, front: np.ndarray, left: bool):
    """Position along the axis (0..1 between its ends) and signed angle from `front`, mirrored for left limbs."""
    axis = end - start
    length = np.linalg.norm(axis)
    axis = axis / length
    front = front - axis * (front @ axis)
    front /= np.linalg.norm(front)
    # On the right limb positive angles lie where cross(axis, front) points; a mirror turns cross products over.
    side = np.cross(axis, front) * (-1 if left else 1)
    relative = points - start
    return relative @ axis / length, np.arctan2(relative @ side, relative @ front)


def _unit(x: np.ndarray, low: float, high: float) -> np.ndarray:
    return np.clip((x - low) / (high - low), 0, 1)


def _half_turn(angle: np.ndarray) -> np.ndarray:
    """Angles of a back half, measured from the back: continuous across +-pi."""
    return np.mod(angle, 2 * np.pi) - np.pi


class Atlas:
    """Labels of the body's triangles: `part` uint8 [F] and `uv` float32 [F, 3, 2] for `body.faces["body"]`."""

    def __init__(self, body: Body) -> None:
        self.faces = body.faces["body"]
        self.rest = body.template.vertices.astype(np.float64)
        self._heads = {name: body.template.heads[k] for name, k in body.bone.items()}
        corners = self.rest[self.faces]
        centre = corners.mean(1)
        region = vertex_regions(body)[self.faces].sum(1).argmax(1)
        left = centre[:, 0] > 0
        self.part = np.zeros(len(self.faces), np.uint8)
        self.uv = np.zeros((len(self.faces), 3, 2), np.float32)
        for k, name in enumerate(REGIONS):
            if name == "torso":
                self._torso(np.flatnonzero(region == k), corners, centre)
                continue
            for is_left in (True, False):
                chosen = np.flatnonzero((region == k) & (left == is_left))
                {"head": self._head, "hand": self._hand, "foot": self._foot}.get(name, self._limb)(
                    chosen, corners, centre, is_left, name
                )

    def _set(self, chosen: np.ndarray, part: int, u: np.ndarray, v: np.ndarray) -> None:
        self.part[chosen] = part
        self.uv[chosen] = np.stack([np.clip(u, 0, 1), np.clip(v, 0, 1)], -1).reshape(-1, 3, 2)

    def _bone(self, name: str, is_left: bool) -> np.ndarray:
        return self._heads[f"{name}.{'L' if is_left else 'R'}"]

    def _limb(self, chosen, corners, centre, is_left, name) -> None:
        start, end = (self._bone(bone, is_left) for bone in _AXES[name])
        front_parts, back_parts, front_outward, back_outward = _LIMBS[name]
        along, angle = _around(corners[chosen].reshape(-1, 3), start, end, _FRONT, is_left)
        low, high = np.percentile(along, [0.5, 99.5])
        along = _unit(along, low, high).reshape(-1, 3)
        angle = angle.reshape(-1, 3)
        _, middle = _around(centre[chosen], start, end, _FRONT, is_left)
        front = np.abs(middle) < np.pi / 2
        # V runs across; the convention mirrors it between left and right (export.surface.MIRROR_FLIPS_V).
        sign = -1 if is_left else 1
        for half, parts, outward, turn in (
            (front, front_parts, front_outward, angle),
            (~front, back_parts, back_outward, _half_turn(angle)),
        ):
            u = along[half] if outward else 1 - along[half]
            self._set(chosen[half], parts[0 if is_left else 1], u, 0.5 + sign * turn[half] / np.pi)

    def _torso(self, chosen, corners, centre) -> None:
        z = corners[chosen].reshape(-1, 3)[:, 2]
        low, high = np.percentile(z, [0.2, 99.8])
        # The middle between chest and back changes with height: follow it.
        bins = np.linspace(low, high, 13)
        middles = []
        for a, b in itertools.pairwise(bins):
            y = centre[chosen][(centre[chosen, 2] >= a) & (centre[chosen, 2] <= b), 1]
            middles.append((y.min() + y.max()) / 2)
        at = (bins[:-1] + bins[1:]) / 2
        depth = corners[chosen][..., 1] - np.interp(corners[chosen][..., 2], at, middles)
        front = centre[chosen, 1] < np.interp(centre[chosen, 2], at, middles)
        u = 1 - _unit(corners[chosen][..., 2], low, high)
        across = corners[chosen][..., 0]
        for half, part, facing in ((front, 2, -1), (~front, 1, 1)):
            turn = np.arctan2(across[half], facing * depth[half])
            self._set(chosen[half], part, u[half], 0.5 - turn / np.pi)

    def _head(self, chosen, corners, centre, is_left, name) -> None:
        points = corners[chosen]
        low, high = points[..., 2].min(), points[..., 2].max()
        # Neck and skull lean forward: follow their middle upwards.
        neck, head = self._heads["neck01"][1], self._heads["head"][1] - 0.02
        height = _unit(points[..., 2], low, high)
        middle = np.interp(height, [0, 0.45], [neck, head])
        azimuth = np.arctan2(np.abs(points[..., 0]), middle - points[..., 1]) / np.pi  # 0 face, 1 back
        self._set(chosen, 24 if is_left else 23, azimuth if is_left else 1 - azimuth, height)

    def _hand(self, chosen, corners, centre, is_left, name) -> None:
        start, end = (self._bone(bone, is_left) for bone in _AXES[name])
        # Angle 0 at the thumb's side puts the seam at the little finger.
        thumb = self._bone("finger2-1", is_left) - self._bone("finger5-1", is_left)
        along, angle = _around(corners[chosen].reshape(-1, 3), start, end, thumb, is_left)
        u = (angle / (2 * np.pi) + 0.5).reshape(-1, 3)
        u = _unwrapped(u)
        v = _unit(along, *np.percentile(along, [0.5, 99.5])).reshape(-1, 3)
        self._set(chosen, 4 if is_left else 3, u, v)

    def _foot(self, chosen, corners, centre, is_left, name) -> None:
        points = corners[chosen]
        ankle = self._bone("foot", is_left)
        forward = ankle[1] - points[..., 1]
        u = _unit(forward, *np.percentile(forward, [0.2, 99.8]))
        outward = (points[..., 0] - ankle[0]) * (1 if is_left else -1)
        height = points[..., 2] - points[..., 2].min()
        v = np.arctan2(outward, height - 0.03) / (2 * np.pi) + 0.5  # seam along the sole
        self._set(chosen, 5 if is_left else 6, u if is_left else 1 - u, _unwrapped(v))


def _unwrapped(x: np.ndarray) -> np.ndarray:
    """Triangles across the seam of a full turn take all their corners from the side of their first two."""
    spread = x.max(1) - x.min(1) > 0.5
    high = np.median(x, 1) > 0.5
    x = np.where(spread[:, None] & high[:, None] & (x < 0.5), 1.0, x)
    return np.where(spread[:, None] & ~high[:, None] & (x > 0.5), 0.0, x)


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
    path = assets.cache_dir() / f"surface-{count}.npz"
    if not path.exists():
        table = _build_surface_table(Atlas(Body()), count)
        assets.save_cache(path, vertices=table.vertices, part=table.part, uv=table.uv, geodesic=table.geodesic)
    with np.load(path) as data:
        return SurfaceTable(data["vertices"], data["part"], data["uv"], data["geodesic"])


def _build_surface_table(atlas: Atlas, count: int) -> SurfaceTable:
    """Body vertices drawn by farthest-point order, each with the mean label of one of its triangles' parts."""
    used = np.unique(atlas.faces)
    local = np.full(len(atlas.rest), -1)
    local[used] = np.arange(len(used))
    faces, points = local[atlas.faces], atlas.rest[used]
    graph = _surface_graph(points, faces)
    # Eyes' sockets, mouth and the like hang inside: keep what is connected to the chest.
    start = int(np.argmin(np.abs(points - points[faces[atlas.part == 2]].mean((0, 1))).sum(1)))
    reachable = np.isfinite(dijkstra(graph, indices=start))
    chosen, nearest = [start], np.linalg.norm(points - points[start], axis=1)
    nearest[~reachable] = -1
    for _ in range(count - 1):
        chosen.append(int(nearest.argmax()))
        nearest = np.minimum(nearest, np.linalg.norm(points - points[chosen[-1]], axis=1))
    chosen = np.array(chosen)
    first_face = np.zeros(len(points), int)
    first_corner = np.zeros(len(points), int)
    for corner in range(3):
        first_face[faces[:, corner]] = np.arange(len(faces))
        first_corner[faces[:, corner]] = corner
    part = atlas.part[first_face[chosen]]
    uv = atlas.uv[first_face[chosen], first_corner[chosen]]
    geodesic = np.zeros((count, count), np.float16)
    for k in range(0, count, 250):
        geodesic[k : k + 250] = dijkstra(graph, indices=chosen[k : k + 250])[:, chosen]
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
