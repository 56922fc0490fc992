"""What a camera sees of a head: colour under light, mask, depth, normals and template points of each pixel (Embree)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from export.camera import Camera
from export.heads.shapes import CUT_NORMAL, CUT_POINT
from export.heads.surface import Head, Place


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
    """rgb float32 [H, W, 3] 0..255 (0: no head), mask float32 [H, W] 0..1, depth float32 [H, W] dm (0: nothing),
    normal float32 [H, W, 3] and template float32 [H, W, 3] (dm) of each pixel's middle; camera: in decimetres."""

    rgb: np.ndarray
    mask: np.ndarray
    depth: np.ndarray
    normal: np.ndarray
    template: np.ndarray
    camera: Camera


class HeadViews:
    """A head ready to be seen by many cameras."""

    def __init__(self, head: Head) -> None:
        self.head = head
        self._scene = EmbreeScene(robust=True)
        TriangleMesh(self._scene, head.positions.astype(np.float32), head.faces.astype(np.int32))

    def _hits(self, origins: np.ndarray, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray, Place]:
        """Which rays [N] hit the head above the cut, how far along, and where."""
        found = self._scene.run(
            np.ascontiguousarray(origins, np.float32), np.ascontiguousarray(rays, np.float32), output=1
        )
        face, far = found["primID"], found["tfar"].astype(np.float64)
        hit = face >= 0
        below = ((origins + rays * np.where(hit, far, 0)[:, None]) - CUT_POINT) @ CUT_NORMAL > 0
        hit &= ~below
        u, v = found["u"], found["v"]
        weight = np.stack([1 - u - v, u, v], 1).astype(np.float64)
        return hit, far, Place(np.where(hit, face, 0), weight)

    def seen(self, camera: Camera, lamps: Lamps, samples: int = 2) -> Seen:
        """camera: in decimetres, the head's frame its world. `samples`: rays a pixel and axis for colour and mask."""
        height, width = camera.height_px, camera.width_px
        head = self.head

        def shoot(x: np.ndarray, y: np.ndarray):
            pixels = np.stack(np.meshgrid(x, y), -1).reshape(-1, 2)
            rays = camera.lifted(pixels, np.ones(len(pixels))) - camera.centre
            return rays, *self._hits(np.repeat(camera.centre[None], len(rays), 0), rays)

        offsets = (np.arange(samples) + 0.5) / samples - 0.5
        x = (np.arange(width)[:, None] + offsets).reshape(-1)
        y = (np.arange(height)[:, None] + offsets).reshape(-1)
        rays, hit, far, place = shoot(x, y)
        rgb = np.zeros((len(rays), 3))
        some = Place(place.face[hit], place.weight[hit])
        normal = head.normals_at(some)
        at = camera.centre + rays[hit] * far[hit, None]
        away = rays[hit] / np.linalg.norm(rays[hit], axis=1, keepdims=True)
        normal = np.where((normal * away).sum(1, keepdims=True) > 0, -normal, normal)
        lit = np.ones((len(at), len(lamps.directions)))
        for k, direction in enumerate(lamps.directions):
            facing = normal @ direction > 0
            start = at[facing] + 0.03 * normal[facing]
            shadow = self._scene.run(
                start.astype(np.float32), np.repeat(direction[None], len(start), 0).astype(np.float32)
            )
            lit[facing, k] = np.where(shadow >= 0, 0.25, 1.0)
        half = lamps.directions[0] - away
        half /= np.maximum(np.linalg.norm(half, axis=1, keepdims=True), 1e-9)
        shine = lamps.gloss * np.maximum((normal * half).sum(1), 0) ** 25 * lit[:, 0]
        rgb[hit] = head.colours_at(some) * lamps.on(normal, lit) + 255 * shine[:, None] * lamps.colours[0]

        def mean(values: np.ndarray) -> np.ndarray:
            shaped = values.reshape(height, samples, width, samples, -1)
            return shaped.mean((1, 3)).astype(np.float32)

        _, middle_hit, middle_far, middle = shoot(np.arange(width), np.arange(height))
        some = Place(middle.face[middle_hit], middle.weight[middle_hit])
        planes = np.zeros((height * width, 7), np.float32)
        planes[middle_hit, 0] = middle_far[middle_hit]
        planes[middle_hit, 1:4] = head.normals_at(some)
        planes[middle_hit, 4:] = head.template_at(some)
        planes = planes.reshape(height, width, 7)
        mask = mean(hit[:, None].astype(np.float64))[..., 0]
        return Seen(mean(np.clip(rgb, 0, 255)), mask, planes[..., 0], planes[..., 1:4], planes[..., 4:], camera)


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
