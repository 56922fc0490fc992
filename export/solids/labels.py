"""Distance to the nearest sharp curve for each pixel of a view, exact to segments and arcs, in float64.

A curve counts where its faces meet at more than 18 degrees, where this camera sees it, and for pixels of a smooth
patch that it borders; faces joined over smooth edges are one patch. r is a pixel's footprint, depth / focal length. A
rounding of a radius under 1 r is a sharp curve along its middle, over 3 r it is a smooth surface; where it makes a
difference which of both one between them is, the pixel is marked `ignore`.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from export.camera import Camera
from export.solids.brep import ARC, LINE, Edge
from export.solids.records import BOUNDARY, CONCAVE, CONVEX, LIMIT_R
from export.solids.views import Seen, View

SHARP_RAD = np.radians(18.0)
SHARP_UNDER_R, SMOOTH_OVER_R = 1.0, 3.0  # radius of a rounding
_STEP_PX = 0.5  # between samples of a curve's visibility
_HALVINGS = 5  # of the steps at which a curve appears or vanishes
_AMBIGUOUS_R = 0.25
_MAX_STEPS = 96  # in one knot interval of a curve


@dataclass(eq=False)
class Labels:
    """distance: float64 [H, W] in r, 0..16, 16 where nothing is; kind: uint8 [H, W]; ignore: bool [H, W];
    patch: int32 [H, W], -1 where nothing is; pieces: of the curves."""

    distance: np.ndarray
    kind: np.ndarray
    ignore: np.ndarray
    patch: np.ndarray
    pieces: list[Piece]


@dataclass(eq=False)
class Piece:
    """A part of an edge that is sharp and seen throughout, camera coordinates. edge: index, roundings after the edges;
    t: from, to (0..1 of the edge); kind; sure: False where a rounding is neither sharp nor smooth."""

    edge: int
    start: float
    end: float
    kind: int
    sure: bool


class _Curves:
    """All edges of a view as flat arrays, evaluated at many places at once."""

    def __init__(self, edges: list[Edge], seen: Seen) -> None:
        rotation, centre = seen.camera.rotation, seen.camera.centre
        count = len(edges)
        self.kind = np.array([e.kind for e in edges], int)
        self.first = np.array([e.parameter[0] for e in edges])
        self.span = np.array([e.parameter[-1] - e.parameter[0] for e in edges])
        self.knot_edge = np.repeat(np.arange(count), [len(e.parameter) for e in edges])
        t = np.concatenate([(e.parameter - e.parameter[0]) / (e.parameter[-1] - e.parameter[0]) for e in edges])
        self.knot_t = t
        self._key = self.knot_edge * 2.0 + t
        self.point = (np.concatenate([e.point for e in edges]) - centre) @ rotation.T
        self.normal = np.concatenate([e.normal for e in edges]) @ rotation.T
        self._convex = np.concatenate([e.convex for e in edges]).astype(float)
        self.centre, self.x, self.y = np.zeros((3, count, 3))
        for k, e in enumerate(edges):
            if e.kind == ARC:
                self.centre[k] = rotation @ (e.centre - centre)
                self.x[k], self.y[k] = rotation @ e.x, rotation @ e.y

    def at(self, edge: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Points [n, 3], normals [n, 2, 3], convex bool [n] of edges [n] at 0..1."""
        right = np.clip(np.searchsorted(self._key, edge * 2.0 + t, "right"), 1, len(self._key) - 1)
        right = np.where(self.knot_edge[right] == edge, right, right - 1)
        left = right - 1
        w = (t - self.knot_t[left]) / np.maximum(self.knot_t[right] - self.knot_t[left], 1e-12)
        w = np.clip(w, 0, 1)[:, None]
        point = (1 - w) * self.point[left] + w * self.point[right]
        arc = self.kind[edge] == ARC
        if arc.any():
            a = (self.first[edge] + t * self.span[edge])[arc, None]
            own = edge[arc]
            point[arc] = self.centre[own] + self.x[own] * np.cos(a) + self.y[own] * np.sin(a)
        normal = (1 - w[..., None]) * self.normal[left] + w[..., None] * self.normal[right]
        normal /= np.maximum(np.linalg.norm(normal, axis=2, keepdims=True), 1e-12)
        convex = (1 - w[:, 0]) * self._convex[left] + w[:, 0] * self._convex[right] > 0.5
        return point, normal, convex


class Labeller:
    """Labels of one solid from one place; frames of the same camera share the preparation."""

    def __init__(self, seen: Seen) -> None:
        self.seen = seen
        solid = seen.solid
        self._face_count = solid.face_count
        self._edges = [*solid.edges, *(r.middle for r in solid.roundings)]
        self._radius = np.concatenate([np.zeros(len(solid.edges)), [r.radius for r in solid.roundings]])
        self.curves = _Curves(self._edges, seen) if self._edges else None
        self._smooth = [e.face for e in solid.edges if np.mean(e.angle <= SHARP_RAD) >= 0.5]
        neighbours: dict[int, set[int]] = {r.face: {r.face} for r in solid.roundings}
        for a, b in self._smooth:
            for one, other in ((a, b), (b, a)):
                if one in neighbours:
                    neighbours[one].add(other)
        self._beside = [set(e.face) for e in solid.edges] + [neighbours[r.face] for r in solid.roundings]

    def _states(self, edge: np.ndarray, t: np.ndarray, frame: Camera) -> np.ndarray:
        """For each place on an edge 0 (not sharp or not seen) or the kind, + 4 where a rounding is undecided."""
        point, normal, convex = self.curves.at(edge, t)
        cosine = (normal[:, 0] * normal[:, 1]).sum(1)
        sine = np.linalg.norm(np.cross(normal[:, 0], normal[:, 1]), axis=1)
        z = point[:, 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            px = point[:, 0] / z * frame.fx_px + frame.cx_px
            py = point[:, 1] / z * frame.fy_px + frame.cy_px
            r = np.maximum(z, 1e-12) / frame.fx_px
            inside = (z > 0) & (px > -0.5) & (py > -0.5) & (px < frame.width_px - 0.5) & (py < frame.height_px - 0.5)
        ratio = self._radius[edge] / r
        facing = (normal * point[:, None]).sum(2) < 0
        sharp = (np.arctan2(sine, cosine) > SHARP_RAD) & (ratio < SMOOTH_OVER_R) & inside & facing.any(1)
        kind = np.where(facing.all(1), np.where(convex, CONVEX, CONCAVE), BOUNDARY)
        state = np.where(sharp, kind + 4 * (ratio >= SHARP_UNDER_R), 0)
        at = np.flatnonzero(sharp)
        outward = (normal[at] * facing[at][..., None]).sum(1)
        outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-12)
        lift = 0.05 * r[at] + 0.5 * self._radius[edge[at]]
        hidden = self.seen.hidden(point[at] + outward * lift[:, None], 0.1 * r[at])
        state[at[hidden]] = 0
        return state

    def _pieces(self, frame: Camera) -> list[Piece]:
        c = self.curves
        if c is None:
            return []
        # Steps of half a pixel in each knot interval, evenly in the image for straight lines.
        a = np.flatnonzero(c.knot_edge[:-1] == c.knot_edge[1:])
        edge, t0, t1 = c.knot_edge[a], c.knot_t[a], c.knot_t[a + 1]
        near = 1e-4
        p, q = c.point[a], c.point[a + 1]
        keep, s0, s1 = _clipped(p, q, frame, near, c.kind[edge] == LINE)
        edge, t0, t1, p, q, s0, s1 = (v[keep] for v in (edge, t0, t1, p, q, s0, s1))
        t0, t1 = t0 + (t1 - t0) * s0, t0 + (t1 - t0) * s1
        p, q = p + (q - p) * s0[:, None], p + (q - p) * s1[:, None]
        zp, zq = np.maximum(p[:, 2], near), np.maximum(q[:, 2], near)
        length = np.hypot(*((p[:, k] / zp - q[:, k] / zq) * frame.fx_px for k in range(2)))
        line = c.kind[edge] == LINE
        limit = np.where(line, 4 * (frame.width_px + frame.height_px), _MAX_STEPS)
        steps = np.clip(np.ceil(length / _STEP_PX), 1, limit).astype(int)
        owner = np.repeat(np.arange(len(edge)), steps + 1)
        first = np.cumsum(steps + 1) - steps - 1
        s = (np.arange(len(owner)) - first[owner]) / steps[owner]
        # A fraction of the way in the image is this fraction of the way in space.
        s = s * zp[owner] / np.maximum(s * zp[owner] + (1 - s) * zq[owner], 1e-12)
        t = t0[owner] + (t1 - t0)[owner] * s
        e = edge[owner]
        state = self._states(e, t, frame)
        return self._runs(e, t, state, frame)

    def _runs(self, e: np.ndarray, t: np.ndarray, state: np.ndarray, frame: Camera) -> list[Piece]:
        """Places of one state that follow one another become a piece; where it changes is found by halving."""
        if not len(e):
            return []
        change = np.flatnonzero((state[:-1] != state[1:]) & (e[:-1] == e[1:]))
        low, high, own = t[change].copy(), t[change + 1].copy(), e[change]
        for _ in range(_HALVINGS):
            if not len(change):
                break
            middle = (low + high) / 2
            same = self._states(own, middle, frame) == state[change]
            low, high = np.where(same, middle, low), np.where(same, high, middle)
        turn = dict(zip(change.tolist(), ((low + high) / 2).tolist(), strict=True))
        starts = np.flatnonzero(np.concatenate([[True], (state[1:] != state[:-1]) | (e[1:] != e[:-1])]))
        ends = np.concatenate([starts[1:], [len(e)]]) - 1
        found = []
        for i, j in zip(starts.tolist(), ends.tolist(), strict=True):
            # An edge of which only the end is seen is one that hides behind it: the corner belongs to the others.
            if state[i] and not (i == j and t[i] in (0.0, 1.0)):
                begin, end = turn.get(i - 1, float(t[i])), turn.get(j, float(t[j]))
                found.append(Piece(int(e[i]), begin, end, int(state[i] & 3), state[i] < 4))
        return found

    def pixels_of_curves(self, frame: Camera) -> np.ndarray:
        """Pixels [n, 2] along the curves seen, about evenly."""
        places = []
        for piece in self._pieces(frame):
            t = np.linspace(piece.start, piece.end, 9)
            point = self.curves.at(np.full(9, piece.edge), t)[0]
            places.append(point[:, :2] / point[:, 2:] * [frame.fx_px, frame.fy_px] + [frame.cx_px, frame.cy_px])
        return np.concatenate(places) if places else np.zeros((0, 2))

    def _patches(self, frame: Camera, limit_r: float) -> np.ndarray:
        """Patch number of each face, where roundings under so many r part the faces beside them: int [faces]."""
        parting = set()
        for rounding in self.seen.solid.roundings:
            middle = (rounding.middle.point - self.seen.camera.centre) @ self.seen.camera.rotation.T
            z = middle[:, 2][middle[:, 2] > 0]
            if len(z) and rounding.radius < limit_r * z.min() / frame.fx_px:
                parting.add(rounding.face)
        parent = list(range(self._face_count))

        def root(k: int) -> int:
            while parent[k] != k:
                parent[k] = parent[parent[k]]
                k = parent[k]
            return k

        for a, b in self._smooth:
            if a not in parting and b not in parting:
                parent[root(a)] = root(b)
        return np.array([root(k) for k in range(self._face_count)])

    def of(self, view: View) -> Labels:
        frame = view.camera
        pieces = self._pieces(frame)
        patches = self._patches(frame, SHARP_UNDER_R)
        first = self._field(view, [p for p in pieces if p.sure], patches)
        ignore = np.zeros(view.depth.shape, bool)
        other = self._patches(frame, SMOOTH_OVER_R)
        if any(not p.sure for p in pieces) or (other != patches).any():
            second = self._field(view, pieces, other)
            ignore = np.abs(first[0] - second[0]) > _AMBIGUOUS_R
        patch = np.where(view.face >= 0, patches[view.face], -1)
        return Labels(*first, ignore, patch, pieces)

    def field(self, view: View, pieces: list[Piece]) -> np.ndarray:
        """Distance [H, W] in r to the nearest of any pieces of this solid's edges, those of other views as well."""
        return self._field(view, pieces, self._patches(view.camera, SHARP_UNDER_R))[0]

    def _field(self, view: View, pieces: list[Piece], patches: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        frame = view.camera
        height, width = view.depth.shape
        point, r = view.point, view.footprint
        best = np.full((height, width), LIMIT_R)
        kind = np.zeros((height, width), np.uint8)
        # A point whose pixel is k px from that of a point of a curve is at least k r cos(angle off the axis) from it.
        slant = np.sqrt((view.ray[:: height - 1, :: width - 1] ** 2).sum(-1)).max() if min(height, width) > 1 else 2.0
        reach = int(np.ceil(LIMIT_R * slant)) + 2
        for piece in pieces:
            corner = self.outline(piece)
            pixel = corner[:, :2] / corner[:, 2:] * frame.fx_px + [frame.cx_px, frame.cy_px]
            x0, y0 = np.maximum(np.floor(pixel.min(0)).astype(int) - reach, 0)
            x1, y1 = np.minimum(np.ceil(pixel.max(0)).astype(int) + reach + 1, [width, height])
            if x0 >= x1 or y0 >= y1:
                continue
            allowed = np.zeros(self._face_count + 1, bool)  # the last one: nothing is there
            allowed[:-1] = np.isin(patches, [patches[f] for f in self._beside[piece.edge]])
            own = allowed[view.face[y0:y1, x0:x1]]
            if not own.any():
                continue
            y, x = np.nonzero(own)
            y, x = y + y0, x + x0
            at, near = point[y, x], self._nearest(piece, point[y, x])
            d = np.linalg.norm(at - near, axis=1) / r[y, x]
            better = d < best[y, x]
            y, x = y[better], x[better]
            best[y, x], kind[y, x] = d[better], piece.kind
        return best, kind

    def outline(self, piece: Piece) -> np.ndarray:
        """Points [k, 3] along the piece: its ends and the knots between them."""
        c = self.curves
        knots = c.knot_t[c.knot_edge == piece.edge]
        t = np.concatenate([[piece.start], knots[(knots > piece.start) & (knots < piece.end)], [piece.end]])
        return c.at(np.full(len(t), piece.edge), t)[0]

    def angle_and_rounding(self, piece: Piece) -> tuple[float, float]:
        """Radians between the normals of the surfaces at the piece's middle, and metres of its rounding's radius, 0 of
        an edge without one."""
        middle = np.array([(piece.start + piece.end) / 2])
        a, b = self.curves.at(np.array([piece.edge]), middle)[1][0]
        angle = np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)
        return float(angle), float(self._radius[piece.edge])

    def _nearest(self, piece: Piece, point: np.ndarray) -> np.ndarray:
        """The piece's nearest points [n, 3] to points [n, 3]."""
        c, e = self.curves, piece.edge
        if c.kind[e] == ARC:
            a0, a1 = (c.first[e] + s * c.span[e] for s in (piece.start, piece.end))
            return nearest_on_arc(point, c.centre[e], c.x[e], c.y[e], a0, a1)
        corner = self.outline(piece)
        if c.kind[e] == LINE:
            corner = corner[[0, -1]]
        return nearest_on_chords(point, corner)


def nearest_on_arc(point: np.ndarray, centre, x, y, a0: float, a1: float) -> np.ndarray:
    """Nearest points [n, 3] of centre + x cos a + y sin a, a0 <= a <= a1; x and y are orthogonal and of one length."""
    rel = point - centre
    angle = np.arctan2(rel @ y, rel @ x)
    turned = (angle - a0) % (2 * np.pi)
    # Beyond the end, the nearer end: the arc's gap is split in its middle.
    span = a1 - a0
    beyond = turned > span
    turned = np.where(beyond, np.where(turned > (span + 2 * np.pi) / 2, 0, span), turned)
    a = (a0 + turned)[:, None]
    return centre + x * np.cos(a) + y * np.sin(a)


def nearest_on_chords(point: np.ndarray, corner: np.ndarray) -> np.ndarray:
    """Nearest points [n, 3] of the segments between corners [k, 3]."""
    best, out = np.full(len(point), np.inf), np.empty_like(point)
    for a, b in pairwise(corner):
        along = b - a
        s = np.clip((point - a) @ along / max(along @ along, 1e-300), 0, 1)
        near = a + s[:, None] * along
        d = ((point - near) ** 2).sum(1)
        better = d < best
        best[better], out[better] = d[better], near[better]
    return out


def _clipped(
    p: np.ndarray, q: np.ndarray, frame: Camera, near: float, line: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Which intervals p..q [n, 3] can be in the frame, and for lines the fractions between which they are."""
    n = len(p)
    s0, s1 = np.zeros(n), np.ones(n)
    keep = np.ones(n, bool)
    left, right = (-0.5 - frame.cx_px) / frame.fx_px, (frame.width_px - 0.5 - frame.cx_px) / frame.fx_px
    top, bottom = (-0.5 - frame.cy_px) / frame.fy_px, (frame.height_px - 0.5 - frame.cy_px) / frame.fy_px
    for plane, least in (
        ((0, 0, 1), near), ((1, 0, -left), 0), ((-1, 0, right), 0), ((0, 1, -top), 0), ((0, -1, bottom), 0)
    ):  # fmt: skip
        dp, dq = p @ np.array(plane, float) - least, q @ np.array(plane, float) - least
        keep &= (dp > 0) | (dq > 0) | ~line
        cross = dp / np.where(dp == dq, 1, dp - dq)
        s0 = np.where(line & (dp < 0) & (dq > 0), np.maximum(s0, cross), s0)
        s1 = np.where(line & (dp > 0) & (dq < 0), np.minimum(s1, cross), s1)
    return keep & (s0 < s1), s0, s1
