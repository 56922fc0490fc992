"""One head as a closed surface: skin, eyes and hair joined, what is inside left out; its distances and colours."""

from __future__ import annotations

from dataclasses import dataclass

import igl
import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from export.heads.hair import Barber, Shell, Style, slow_noise
from export.heads.sampling import sample_tones
from export.heads.shapes import (
    CUT_NORMAL,
    CUT_POINT,
    HeadShapes,
    Identity,
    boundary_loops,
    vertex_normals,
)

SKIN, EYE, HAIR = 0, 1, 2


@dataclass(frozen=True)
class Place:
    """Points of a surface: the triangle of each [N] and its barycentric coordinates [N, 3]."""

    face: np.ndarray
    weight: np.ndarray


class HeadMaker:
    """Makes heads from seeds. `skin`: the skin texture, RGB uint8 [H, W, 3]."""

    def __init__(self, shapes: HeadShapes, skin: np.ndarray) -> None:
        self.shapes, self.skin = shapes, skin.astype(np.float32)
        self.barber = Barber(shapes)
        outer = self._seen_from_outside()
        self.faces, self.uv = shapes.faces[outer], shapes.uv[outer]
        caps = []
        self.cap_vertices: list[np.ndarray] = []  # the loop of which each further vertex is the mean
        for loop in boundary_loops(self.faces):
            middle = len(shapes.template) + len(self.cap_vertices)
            following = np.roll(loop, -1)
            caps.append(np.stack([following, loop, np.full(len(loop), middle)], 1))
            self.cap_vertices.append(loop)
        self.caps = np.concatenate(caps)

    def _seen_from_outside(self) -> np.ndarray:
        """Mask of the template's skin faces, without the inside of mouth and eye sockets."""
        s = self.shapes
        scene = EmbreeScene(robust=True)
        faces = np.concatenate([s.faces, s.eye_faces])
        TriangleMesh(scene, s.template.astype(np.float32), faces.astype(np.int32))
        corner = s.template[s.faces]
        normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        start = corner.mean(1) + 1e-3 * normal
        rng = np.random.default_rng(0)
        free = np.zeros(len(start))
        for direction in rng.normal(size=(96, 3)):
            direction /= np.linalg.norm(direction)
            facing = normal @ direction > 0.2
            rays = np.repeat(direction[None], facing.sum(), 0).astype(np.float32)
            hit = scene.run(start[facing].astype(np.float32), rays)
            free[facing] += hit < 0
        seen = free >= 4
        # Nostrils and the folds of ears stay: only what hangs together away from the rest of the skin goes.
        deep = self._deep(corner.mean(1))
        return seen | ~deep

    def _deep(self, centre: np.ndarray) -> np.ndarray:
        """Triangles in the places where the mesh goes inside: behind the lips and around the eyeballs."""
        s = self.shapes
        eyes = s.template[np.unique(s.eye_faces)]
        deep = (np.abs(centre[:, 0]) < 0.4) & (np.abs(centre[:, 2] + 0.62) < 0.4) & (centre[:, 1] < 0.1)
        for side in (1, -1):
            eye = eyes[eyes[:, 0] * side > 0]
            middle = (eye.max(0) + eye.min(0)) / 2
            deep |= np.linalg.norm(centre - middle, axis=1) < 1.25 * (np.ptp(eye[:, 0]) / 2)
        return deep

    def make(self, identity: Identity, rng: np.random.Generator, style: Style | None = None) -> Head:
        """The head of an identity; hair, skin and light are drawn from `rng`."""
        vertices = self.shapes.vertices(identity)
        style = style or self.barber.sample(rng, identity.phenotype.gender, identity.phenotype.age)
        return Head(self, vertices, style, self.barber.shells(vertices, style, rng), rng)


class Head:
    """A made head. positions [V, 3] dm; faces [F, 3]; kind [F]; template_points [V, 3]: the template's point below.

    vertices: those of HeadShapes, float64 [., 3].
    """

    def __init__(
        self, maker: HeadMaker, vertices: np.ndarray, style: Style, shells: list[Shell], rng: np.random.Generator
    ) -> None:
        self.maker, self.vertices, self.style, self.shells = maker, vertices, style, shells
        template = maker.shapes.template

        def with_caps(points: np.ndarray) -> np.ndarray:
            return np.concatenate([points, [points[loop].mean(0) for loop in maker.cap_vertices]])

        base, below = with_caps(vertices), with_caps(template)
        eyes = maker.shapes.eye_faces
        half = len(eyes) // 2
        closed_skin = np.concatenate([maker.faces, maker.caps])
        parts = [(base, closed_skin, SKIN, below), (base, eyes[:half], EYE, below), (base, eyes[half:], EYE, below)]
        parts += [(s.vertices, s.faces, HAIR, template[s.below]) for s in shells]
        positions, faces, kinds, points, uv, whole = [], [], [], [], [], []
        start = 0
        for number, (p, f, kind, t) in enumerate(parts):
            positions.append(p)
            points.append(t)
            whole.append(f + start)
            inside = np.zeros(len(f), bool)
            centre = p[f].mean(1)
            for other, (q, g, *_) in enumerate(parts):
                if other != number:
                    inside |= igl.fast_winding_number(np.ascontiguousarray(q), np.ascontiguousarray(g), centre) > 0.5
            texture = np.zeros((len(f), 3, 2))
            if kind == SKIN:
                texture[: len(maker.uv)] = maker.uv
            faces.append(f[~inside] + start)
            kinds.append(np.full((~inside).sum(), kind))
            uv.append(texture[~inside])
            start += len(p)
        self.positions = np.ascontiguousarray(np.concatenate(positions))
        self.template_points = np.concatenate(points)
        self.faces = np.ascontiguousarray(np.concatenate(faces))
        self.kind, self.uv = np.concatenate(kinds), np.concatenate(uv)
        self._whole = np.ascontiguousarray(np.concatenate(whole))
        self._parts = [(np.ascontiguousarray(p), np.ascontiguousarray(f)) for p, f, *_ in parts]
        self.normals = vertex_normals(self.positions, self.faces)
        self._paint(rng)

    def _paint(self, rng: np.random.Generator) -> None:
        self.tone, self.iris = sample_tones(rng)
        self.seed = int(rng.integers(1 << 31))
        extra = len(self.positions) - len(self.style.shade)
        self._shade = np.concatenate([self.style.shade, np.zeros(extra)])[:, None]

    def visible_vertices(self) -> np.ndarray:
        """The head's vertices [V, 3]; those under hair are replaced by the point of the hair above them."""
        out, height = self.vertices.copy(), np.zeros(len(self.vertices))
        for shell in self.shells:
            outer = shell.outer
            away = np.linalg.norm(shell.vertices[outer] - self.vertices[shell.below[outer]], axis=1)
            higher = away > height[shell.below[outer]]
            at = shell.below[outer][higher]
            out[at], height[at] = shell.vertices[outer][higher], away[higher]
        return out

    def nearest(self, points: np.ndarray) -> tuple[Place, np.ndarray]:
        """The places nearest to points [N, 3], and how far they are, dm [N]."""
        squared, face, at = igl.point_mesh_squared_distance(points, self.positions, self.faces)
        corner = self.positions[self.faces[face]]
        return Place(face, barycentric(at, corner)), np.sqrt(np.maximum(squared, 0))

    def is_inside(self, points: np.ndarray) -> np.ndarray:
        """Which of [N, 3] lie inside of any part (generalized winding number)."""
        inside = np.zeros(len(points), bool)
        for p, f in self._parts:
            inside |= igl.fast_winding_number(p, f, points) > 0.5
        return inside

    def distances(self, points: np.ndarray) -> tuple[np.ndarray, Place]:
        """Signed distances (dm, negative inside) to skin, eyes and hair, without the cut; and the nearest places."""
        place, distance = self.nearest(points)
        return np.where(self.is_inside(points), -distance, distance), place

    def _mix(self, values: np.ndarray, place: Place) -> np.ndarray:
        return (values[self.faces[place.face]] * place.weight[..., None]).sum(1)

    def points_at(self, place: Place) -> np.ndarray:
        return self._mix(self.positions, place)

    def template_at(self, place: Place) -> np.ndarray:
        return self._mix(self.template_points, place)

    def normals_at(self, place: Place) -> np.ndarray:
        n = self._mix(self.normals, place)
        return n / np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-9)

    def colours_at(self, place: Place) -> np.ndarray:
        """RGB [N, 3], 0..255, without light."""
        template, point = self.template_at(place), self.points_at(place)
        out = np.zeros((len(template), 3))
        kind = self.kind[place.face]
        skin, eye, hair = kind == SKIN, kind == EYE, kind == HAIR
        uv = (self.uv[place.face[skin]] * place.weight[skin][..., None]).sum(1)
        shade = self._mix(self._shade, Place(place.face[skin], place.weight[skin]))[:, 0]
        out[skin] = self.skin_colours(uv, template[skin], shade)
        out[eye] = self._eye_colours(template[eye])
        rng = np.random.default_rng(self.seed + 1)
        strands = 1 + 0.14 * slow_noise(point[hair] * [1, 1, 0.12], 7.0, rng) + 0.1 * slow_noise(point[hair], 0.8, rng)
        out[hair] = self.style.colour * np.clip(strands, 0.4, 1.7)[:, None]
        return np.clip(out, 0, 255)

    def skin_colours(self, uv: np.ndarray, template: np.ndarray, shade: np.ndarray) -> np.ndarray:
        """RGB [N, 3] of skin at places of texture [N, 2] and template [N, 3]; `shade` [N]: how much hair it has."""
        image = self.maker.skin
        height, width = image.shape[:2]
        x = np.clip(uv[:, 0] * width - 0.5, 0, width - 1.001)
        y = np.clip((1 - uv[:, 1]) * height - 0.5, 0, height - 1.001)
        x0, y0 = x.astype(int), y.astype(int)
        fx, fy = (x - x0)[:, None], (y - y0)[:, None]
        texture = (image[y0, x0] * (1 - fx) + image[y0, x0 + 1] * fx) * (1 - fy) + (
            image[y0 + 1, x0] * (1 - fx) + image[y0 + 1, x0 + 1] * fx
        ) * fy
        rng = np.random.default_rng(self.seed)
        # The texture's contrast is kept and its colour replaced by the tone.
        out = self.tone * (texture / [185.0, 145.0, 123.0]) ** 1.15
        out *= 1 + 0.05 * slow_noise(template, 0.7, rng)[:, None] + 0.03 * slow_noise(template, 4.0, rng)[:, None]
        blush = np.exp(-(((np.abs(template[:, 0]) - 0.45) / 0.25) ** 2 + ((template[:, 2] + 0.35) / 0.25) ** 2))
        out *= 1 + blush[:, None] * np.array([0.06, -0.04, -0.04]) * rng.uniform(0, 2)
        x, z = np.abs(template[:, 0]), template[:, 2]
        arc = np.interp(x, [0.08, 0.2, 0.4, 0.58], [0.19, 0.235, 0.27, 0.17])
        brow = np.exp(-(((z - arc) / 0.045) ** 4)) * np.clip((x - 0.1) / 0.08, 0, 1) * np.clip((0.58 - x) / 0.12, 0, 1)
        brow = np.where(template[:, 1] < -0.5, brow * self.style.brows, 0)[:, None]
        cover = np.maximum(brow, shade[:, None])
        return out * (1 - cover) + cover * self.style.colour * np.where(shade[:, None] > brow, 1.0, 0.6)

    def _eye_colours(self, template: np.ndarray) -> np.ndarray:
        eyes = self.maker.shapes.template[np.unique(self.maker.shapes.eye_faces)]
        right = eyes[eyes[:, 0] < 0]
        middle = (right.max(0) + right.min(0)) / 2
        offset = template - middle * np.where(template[:, :1] < 0, 1, [[-1, 1, 1]])
        offset /= np.maximum(np.linalg.norm(offset, axis=1, keepdims=True), 1e-9)
        angle = np.arccos(np.clip(-offset[:, 1], -1, 1))
        out = np.full((len(template), 3), 225.0)
        out[angle < 0.5] = self.iris
        out[angle < 0.2] = 12
        return out

    def samples(self, count: int, rng: np.random.Generator) -> Place:
        """Places evenly spread over what of the surface lies above the cut."""
        corner = self.positions[self.faces]
        area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
        area[(corner.mean(1) - CUT_POINT) @ CUT_NORMAL > 0.1] = 0
        face = rng.choice(len(area), count, p=area / area.sum())
        a, b = np.sqrt(rng.random(count)), rng.random(count)
        return Place(face, np.stack([1 - a, a * (1 - b), a * b], 1))


def barycentric(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Barycentric coordinates [N, 3] of points [N, 3] in the planes of triangles [N, 3, 3]."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = points - corners[:, 0]
    aa, ab, bb, pa, pb = (a * a).sum(1), (a * b).sum(1), (b * b).sum(1), (p * a).sum(1), (p * b).sum(1)
    det = np.maximum(aa * bb - ab * ab, 1e-18)
    v, w = (bb * pa - ab * pb) / det, (aa * pb - ab * pa) / det
    out = np.clip(np.stack([1 - v - w, v, w], 1), 0, 1)
    return out / out.sum(1, keepdims=True)


def cut_distance(points: np.ndarray) -> np.ndarray:
    """Signed distance (dm) to the plane at which heads end: positive below it. [N]"""
    return (points - CUT_POINT) @ CUT_NORMAL
