"""What a camera sees of a head: colour under light, mask, depth, normals and template points of each pixel (Embree)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from export.camera import Camera
from export.heads.hair import slow_noise
from export.heads.shapes import vertex_normals
from export.heads.surface import Head, Place, cut_distance


@dataclass(frozen=True)
class Lamps:
    """Light in the head's frame: `ambient` RGB [3], `directions` [K, 3] towards the lights, their `colours` [K, 3]."""

    ambient: np.ndarray
    directions: np.ndarray
    colours: np.ndarray
    gloss: float = 0.1

    def on(self, normals: np.ndarray, lit: np.ndarray | None = None) -> np.ndarray:
        """RGB [N, 3] that reaches surfaces with these normals [N, 3]; `lit` [N, K] is 0 in the shadow of a lamp."""
        cosine = np.maximum(normals @ self.directions.T, 0)
        if lit is not None:
            cosine = cosine * lit
        # A little more from above than from below.
        return self.ambient * (1 + 0.25 * normals[:, 2:]) + cosine @ self.colours


def sample_lamps(rng: np.random.Generator) -> Lamps:
    """From flat light to a hard lamp at one side."""
    count = int(rng.integers(1, 3))
    directions = rng.normal(size=(count, 3)) + [0, -0.8, 0.6]
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    share = rng.uniform(0.25, 0.85)
    tint = np.exp(rng.normal(0, 0.035, (count + 1, 3)))
    power = rng.dirichlet(np.ones(count))[:, None]
    return Lamps(share * tint[0], directions, (1.25 - share) * power * tint[1:] * 1.3, float(rng.uniform(0, 0.3)))


@dataclass(frozen=True)
class Seen:
    """rgb float32 [H, W, 3] 0..255; present bool [H, W]: head or bust; mask bool [H, W]: head, above its cut; depth
    float32 [H, W] along the optical axis, dm; normal [H, W, 3] in the head's frame and template [H, W, 3], dm, float32
    (0 where nothing is present); camera: in decimetres."""

    rgb: np.ndarray
    present: np.ndarray
    mask: np.ndarray
    depth: np.ndarray
    normal: np.ndarray
    template: np.ndarray
    camera: Camera


@dataclass(frozen=True)
class Extras:
    """What a picture shows and the head does not have: clothes below it, glasses."""

    cloth: np.ndarray  # RGB
    collar: float  # dm: skin ends at this height of the template
    seed: int
    lens: float  # how much of the light glasses take, 0..1; 0: none are worn
    rim: float  # half the width of their rims, dm; 0: no rims
    frame: np.ndarray  # RGB
    size: np.ndarray  # half sizes of a lens, dm


def sample_extras(rng: np.random.Generator) -> Extras:
    worn = rng.random() < 0.25
    dark = rng.random() < 0.3
    return Extras(
        rng.uniform(10, 240, 3) * rng.uniform(0.3, 1),
        float(rng.uniform(-2.9, -1.6)),
        int(rng.integers(1 << 31)),
        float(rng.uniform(0.5, 0.95) if dark else rng.uniform(0.02, 0.15)) if worn else 0.0,
        float(rng.uniform(0.008, 0.04)) if worn else 0.0,
        rng.uniform(0, 160, 3) * rng.uniform(0.1, 1),
        np.array([rng.uniform(0.2, 0.29), rng.uniform(0.13, 0.24)]),
    )


class Scene:
    """Triangles that cameras see.

    positions, normals and template points [V, 3] (dm); faces [F, 3]; `colours(place)` gives RGB 0..255 without light of
    places on them, `is_head(points [N, 3])` whether points belong to the head or to what is below it.
    """

    def __init__(
        self,
        positions: np.ndarray,
        faces: np.ndarray,
        normals: np.ndarray,
        template: np.ndarray,
        colours: Callable[[Place], np.ndarray],
        is_head: Callable[[np.ndarray], np.ndarray],
    ) -> None:
        self.positions, self.faces, self.normals, self.template = positions, faces, normals, template
        self._colours, self._is_head = colours, is_head
        self._scene = EmbreeScene(robust=True)
        TriangleMesh(self._scene, positions.astype(np.float32), faces.astype(np.int32))

    def mix(self, values: np.ndarray, place: Place) -> np.ndarray:
        """Values of vertices at places."""
        return (values[self.faces[place.face]] * place.weight[..., None]).sum(1)

    def seen(self, camera: Camera, lamps: Lamps) -> Seen:
        """camera: in decimetres, the head's frame its world. One ray through the middle of each pixel."""
        height, width = camera.height_px, camera.width_px
        pixels = np.stack(np.meshgrid(np.arange(width), np.arange(height)), -1).reshape(-1, 2)
        rays = camera.lifted(pixels, np.ones(len(pixels))) - camera.centre
        origins = np.repeat(camera.centre[None].astype(np.float32), len(rays), 0)
        found = self._scene.run(origins, rays.astype(np.float32), output=1)
        hit = found["primID"] >= 0
        far, u, v = (found[name][hit].astype(np.float64) for name in ("tfar", "u", "v"))
        place = Place(found["primID"][hit], np.stack([1 - u - v, u, v], 1))
        at, away = camera.centre + rays[hit] * far[:, None], rays[hit]
        away = away / np.linalg.norm(away, axis=1, keepdims=True)
        normal = self.mix(self.normals, place)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
        shown = np.where((normal * away).sum(1, keepdims=True) > 0, -normal, normal)
        lit = np.ones((len(at), len(lamps.directions)))
        for k, direction in enumerate(lamps.directions):
            facing = shown @ direction > 0
            start = (at[facing] + 0.03 * shown[facing]).astype(np.float32)
            shadow = self._scene.run(start, np.repeat(direction[None].astype(np.float32), len(start), 0))
            lit[facing, k] = np.where(shadow >= 0, 0.25, 1.0)
        half = lamps.directions[0] - away
        half /= np.maximum(np.linalg.norm(half, axis=1, keepdims=True), 1e-9)
        shine = lamps.gloss * np.maximum((shown * half).sum(1), 0) ** 25 * lit[:, 0]
        planes = np.zeros((height * width, 11), np.float32)
        planes[hit, :3] = self._colours(place) * lamps.on(shown, lit) + 255 * shine[:, None] * lamps.colours[0]
        planes[hit, 3] = self._is_head(at)
        planes[hit, 4] = far
        planes[hit, 5:8] = normal
        planes[hit, 8:] = self.mix(self.template, place)
        p = planes.reshape(height, width, 11)
        present = hit.reshape(height, width)
        return Seen(np.clip(p[..., :3], 0, 255), present, p[..., 3] > 0, p[..., 4], p[..., 5:8], p[..., 8:], camera)


class HeadViews:
    """A made head ready to be seen by many cameras, above its bust."""

    def __init__(self, head: Head, extras: Extras | None = None) -> None:
        self.head, self.extras = head, extras or sample_extras(np.random.default_rng(0))
        shapes = head.maker.shapes
        both = np.concatenate([shapes.faces, shapes.bust_faces])
        self.scene = Scene(
            np.concatenate([head.positions, head.vertices]),
            np.concatenate([head.faces, shapes.bust_faces + len(head.positions)]),
            np.concatenate([head.normals, vertex_normals(head.vertices, both)]),
            np.concatenate([head.template_points, shapes.template]),
            self._colours,
            lambda points: cut_distance(points) < 0,
        )

    def seen(self, camera: Camera, lamps: Lamps) -> Seen:
        """What `Scene.seen` gives."""
        return self.scene.seen(camera, lamps)

    def _colours(self, place: Place) -> np.ndarray:
        head, extras = self.head, self.extras
        out = np.zeros((len(place.face), 3))
        own = place.face < len(head.faces)
        out[own] = head.colours_at(Place(place.face[own], place.weight[own]))
        template = self.scene.mix(self.scene.template, place)
        bust = place.face[~own] - len(head.faces)
        if len(bust):
            uv = (head.maker.shapes.bust_uv[bust] * place.weight[~own][..., None]).sum(1)
            out[~own] = head.skin_colours(uv, template[~own], np.zeros(len(bust)))
        clothed = (template[:, 2] < extras.collar + 0.35 * np.abs(template[:, 0])) & (template[:, 2] < -1.5)
        rng = np.random.default_rng(extras.seed)
        folds = 1 + 0.12 * slow_noise(template[clothed], 0.7, rng) + 0.1 * slow_noise(template[clothed], 3.0, rng)
        out[clothed] = extras.cloth * folds[:, None]
        if extras.lens or extras.rim:
            x, z = np.abs(template[:, 0]), template[:, 2]
            front = template[:, 1] < -0.45
            box = np.abs(np.stack([x - 0.33, z - 0.01], 1)) - extras.size
            edge = np.linalg.norm(np.maximum(box + 0.1, 0), axis=1) + np.minimum((box + 0.1).max(1), 0) - 0.1
            lens, rim = front & (edge < 0), front & (np.abs(edge) < extras.rim)
            rim |= front & (x < 0.12) & (np.abs(z - 0.05) < extras.rim)
            rim |= (x > 0.5) & (template[:, 1] < 0.1) & (np.abs(z - 0.08) < extras.rim)
            out[lens] *= 1 - extras.lens
            out[rim] = extras.frame
        return np.clip(out, 0, 255)


def look_at(
    yaw: float, pitch: float, roll: float, distance: float, aim: np.ndarray, focal_px: float, side_px: int
) -> Camera:
    """A camera at `distance` (dm) from `aim` (head frame): yaw 0 sees the face, positive from the person's left;
    positive pitch from above (radians). Its picture is a square with `aim` in the middle."""
    outward = np.array([np.sin(yaw) * np.cos(pitch), -np.cos(yaw) * np.cos(pitch), np.sin(pitch)])
    forward = -outward
    right = np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    c, s = np.cos(roll), np.sin(roll)
    rotation = np.stack([c * right + s * down, -s * right + c * down, forward])
    return Camera.centred(side_px, side_px, focal_px, rotation, aim + distance * outward)
