"""Draws images of fitted and true heads from chosen cameras (Embree)."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from maquette import HeadMesh

from benchmarks.heads.fitted import DM_PER_M, z_up
from benchmarks.heads.other_heads import PEOPLE, load_head
from export.camera import Camera
from export.heads.sampling import Lamps, look_at, sample_camera, sample_extras, sample_lamps
from export.heads.surface import HeadMaker, Place
from export.heads.synthetic_heads import make_head
from export.heads.views import HeadViews, Scene, Seen

# Vertex colours contain the photo's light; more light would saturate them at 255.
_DIM = 0.75
FLAT = Lamps(np.full(3, _DIM), np.array([[0.0, -1, 0]]), np.zeros((1, 3)), gloss=0.0)
STUDIO = Lamps(np.full(3, 0.55), np.array([[-0.4, -0.75, 0.53]]), np.full((1, 3), 0.65), gloss=0.05)
GREY = 90  # grey level behind heads
TURN_DEG = 45.0  # degrees of new views to both sides of the photo's camera
FRAME_DM = 3.4  # side in dm that a new view shows


@dataclass(frozen=True, eq=False)
class DrawnMesh:
    """A mesh of the library, for cameras in dm."""

    scene: Scene

    @staticmethod
    def of(mesh: HeadMesh, with_texture: bool = True) -> DrawnMesh:
        """Returns the mesh with its texture, if it has one and with_texture is true, or with its vertex colours."""
        faces = mesh.triangles.astype(np.int64)
        textured = with_texture and mesh.texture_jpeg is not None
        of_vertices = (mesh.texture_coordinates if textured else mesh.colours).astype(np.float64)
        texture = cv2.imdecode(np.frombuffer(mesh.texture_jpeg, np.uint8), cv2.IMREAD_COLOR_RGB) if textured else None

        def mixed(place: Place) -> np.ndarray:
            return (of_vertices[faces[place.face]] * place.weight[..., None]).sum(1)

        def sampled(place: Place) -> np.ndarray:
            pixel = (mixed(place) * texture.shape[0] - 0.5).astype(np.float32)
            found = cv2.remap(texture, pixel[:, None, 0].copy(), pixel[:, None, 1].copy(), cv2.INTER_LINEAR,
                              borderMode=cv2.BORDER_REPLICATE)  # fmt: skip
            return found[:, 0].astype(np.float64)

        positions = z_up(mesh.positions_m) * DM_PER_M
        return DrawnMesh.coloured(positions, faces, z_up(mesh.normals), sampled if textured else mixed)

    @staticmethod
    def coloured(
        positions: np.ndarray, faces: np.ndarray, normals: np.ndarray, colours: Callable[[Place], np.ndarray]
    ) -> DrawnMesh:
        """positions, normals: [V, 3] in dm; faces: int64 [F, 3]; colours: function that returns RGB 0..255 of surface
        points."""

        def everywhere(points: np.ndarray) -> np.ndarray:
            return np.ones(len(points), bool)

        return DrawnMesh(Scene(positions, faces, normals, np.zeros_like(positions), colours, everywhere))

    def colours(self, camera: Camera, behind: np.ndarray | None = None) -> np.ndarray:
        """Draws without light, uint8 RGB [H, W, 3]; behind: a background image of that size."""
        rgb, present = self._lit(camera)
        return _before(rgb, present, behind)

    def shown(self, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
        """Returns the colours before conversion to grey levels, and the pixels that show the mesh, bool [H, W]."""
        rgb, present = self._lit(camera)
        return _before(rgb, present, None), present

    def _lit(self, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
        seen = self.scene.seen(camera, FLAT)
        up = np.where((seen.normal * _towards(camera, seen)).sum(-1) > 0, -1, 1) * seen.normal[..., 2]
        return seen.rgb / (_DIM * (1 + 0.25 * up[..., None])), seen.present

    def normals(self, camera: Camera) -> np.ndarray:
        """Draws normals in the camera's axes as colours: red to the right, green up, blue towards the camera."""
        seen = self.scene.seen(camera, FLAT)
        axes = seen.normal @ camera.rotation.T * [1, -1, -1]
        return _before(127.5 * (axes + 1), seen.present, None)


def _towards(camera: Camera, seen: Seen) -> np.ndarray:
    """Returns the surface direction away from the camera at each pixel, [H, W, 3]; its length is arbitrary."""
    height, width = seen.depth.shape
    pixels = np.stack(np.meshgrid(np.arange(width), np.arange(height)), -1).reshape(-1, 2)
    return (camera.lifted(pixels, np.ones(len(pixels))) - camera.centre).reshape(height, width, 3)


def _before(rgb: np.ndarray, present: np.ndarray, behind: np.ndarray | None) -> np.ndarray:
    behind = np.full(rgb.shape, GREY, np.uint8) if behind is None else behind
    return np.where(present[..., None], np.clip(rgb, 0, 255), behind).round().astype(np.uint8)


def beside(camera: Camera, turn_deg: float, side_px: int) -> Camera:
    """Returns a camera rotated around the head: to the person's left for a positive angle."""
    away = -camera.rotation[2]
    yaw = np.arctan2(away[0], -away[1]) + np.radians(turn_deg)
    distance = 10.0
    return look_at(yaw, 0.05, 0.0, distance, np.array([0, 0, -0.1]), side_px * distance / FRAME_DM, side_px)


def framed(camera: Camera, box: np.ndarray, sides: float, side_px: int) -> tuple[Camera, np.ndarray]:
    """Returns a square of `sides` times the box, in `side_px` pixels: its camera, and the affine map [2, 3] from its
    pixels to pixels of the camera's image."""
    left, top, right, bottom = box
    side = sides * max(right - left, bottom - top)
    zoom = side / side_px
    corner = np.array([(left + right - side) / 2, (top + bottom - side) / 2])
    to_picture = np.concatenate([zoom * np.eye(2), (corner + 0.5 * zoom - 0.5)[:, None]], 1)
    middle = (np.array([camera.cx_px, camera.cy_px]) - to_picture[:, 2]) / zoom
    return (
        replace(
            camera, width_px=side_px, height_px=side_px, fx_px=camera.fx_px / zoom, fy_px=camera.fy_px / zoom,
            cx_px=middle[0], cy_px=middle[1],
        ),
        to_picture,
    )  # fmt: skip


def made_head(maker: HeadMaker, name: str, number: int, split: str = "test") -> tuple[HeadViews, Lamps]:
    """Returns the head of a file of `export.heads.view_shards`, and the light of its image `number`."""
    head = make_head(maker, split, int(name.rpartition("-")[2]))
    rng = np.random.default_rng([zlib.crc32(b"views"), int(name.rpartition("-")[2])])
    views = HeadViews(head, sample_extras(rng))
    points = head.positions[np.unique(head.faces)]
    points = points[points[:, 2] > -1.6]
    for _ in range(number + 1):
        sample_camera(points, rng)
        lamps = sample_lamps(rng)
    return views, lamps


def other_head(folder: Path, name: str) -> Scene:
    """Returns a head of another source, which `benchmarks.heads.other_heads` has fetched into `folder`."""
    return load_head(folder / "people", name, PEOPLE[name]).scene


def seen_before_grey(seen: Seen) -> np.ndarray:
    """Returns a renderer of uint8 RGB images."""
    return _before(seen.rgb, seen.present, None)
