"""Renders a head by ray casting (Embree): colour under light, mask, depth, normals and template points of each
pixel."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from export.camera import Camera
from export.heads.hair import slow_noise
from export.heads.sampling import Extras, Lamps, sample_extras
from export.heads.shapes import vertex_normals
from export.heads.surface import Head, Place, cut_distance


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
        """The result of `Scene.seen`."""
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
