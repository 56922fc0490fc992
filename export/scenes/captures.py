"""Captured places on disk: a folder with transforms.json, photos and a point cloud.

transforms.json is the file of nerfstudio and Instant-NGP: `w`, `h`, `fl_x`, `fl_y`, `cx`, `cy` for all frames or for
each, and `frames`, each with `file_path` and `transform_matrix`, camera to world with x to the right, y up and z
backwards. A principal point counts from the corner of the first pixel, so ours is half a pixel less. The cloud is the
file named by `ply_file_path`, or cloud.ply. Frames in `test_filenames` are held out: images are made of the others.
Up is `up`, or `up_axis` in the table `maquette` of rendered places (export/places), or y.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from export.camera import Camera
from export.point_cloud import PointCloud, read_ply
from export.scenes.fitting import View

LARGEST_SIDE_PX = 16384
DISTORTION = ("k1", "k2", "k3", "k4", "p1", "p2")


class CaptureError(ValueError):
    """A folder is not a capture; the sentence says why."""


@dataclass(frozen=True, eq=False)
class Capture:
    """One place. photos: encoded, so that many fit into memory. up: of the world. held_out: indices of photos that
    images are never made of. names: of the photos, relative to the folder. seen: kept by training
    (export.scenes.samples)."""

    name: str
    cameras: list[Camera]
    photos: list[bytes]
    cloud: PointCloud
    up: tuple[float, float, float] = field(default=(0.0, 1.0, 0.0))
    held_out: frozenset[int] = frozenset()
    names: tuple[str, ...] = ()
    seen: dict[tuple[int, int], np.ndarray] = field(default_factory=dict)

    def sources(self) -> list[int]:
        """Indices of the photos that images are made of."""
        return [k for k in range(len(self.cameras)) if k not in self.held_out]

    def view(self, k: int, long_side_px: int | None = None) -> View:
        """Photo k, at most `long_side_px` wide or high. Raises CaptureError where it cannot be decoded."""
        camera = self.cameras[k]
        image = cv2.imdecode(np.frombuffer(self.photos[k], np.uint8), cv2.IMREAD_COLOR)
        if image is None or image.shape[:2] != (camera.height_px, camera.width_px):
            found = "cannot be decoded" if image is None else f"has {image.shape[1]} x {image.shape[0]} pixels"
            wanted = f"{camera.width_px} x {camera.height_px}"
            raise CaptureError(f"Photo {k} of {self.name} {found}; transforms.json says {wanted}.")
        share = min(1.0, (long_side_px or math.inf) / max(camera.width_px, camera.height_px))
        if share < 1:
            camera = camera.resized(max(1, round(camera.width_px * share)), max(1, round(camera.height_px * share)))
            image = cv2.resize(image, (camera.width_px, camera.height_px), interpolation=cv2.INTER_AREA)
        return View(np.ascontiguousarray(image[..., ::-1], np.float32) / 255, camera)


def read_capture(folder: Path) -> Capture:
    """Raises CaptureError, and PointCloudError for its cloud."""
    path = folder / "transforms.json"
    try:
        table = json.loads(path.read_text())
        frames = table["frames"]
        cloud_name = str(table.get("ply_file_path", "cloud.ply"))
        up = tuple(float(x) for x in table.get("up", table.get("maquette", {}).get("up_axis", (0, 1, 0))))
        tests = set(map(str, table.get("test_filenames", [])))
        held_out = frozenset(k for k, frame in enumerate(frames) if frame["file_path"] in tests)
        named = [(_camera(table | frame, path), folder / str(frame["file_path"])) for frame in frames]
    except (OSError, json.JSONDecodeError, UnicodeDecodeError) as error:
        raise CaptureError(f"{path} cannot be read as JSON: {error}.") from None
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        if isinstance(error, CaptureError):
            raise
        raise CaptureError(f"{path} lacks a field or has one of another kind: {error!r}.") from None
    if not named or len(up) != 3 or not all(map(math.isfinite, up)) or not any(up):
        raise CaptureError(f"{path} has {len(named)} frames and up {up}; it needs a frame and a direction.")
    root = folder.resolve()
    for file in [*(file for _, file in named), folder / cloud_name]:
        if not file.resolve().is_relative_to(root):
            raise CaptureError(f"{path} names {file}, which is outside of its folder.")
    try:
        photos = [file.read_bytes() for _, file in named]
    except OSError as error:
        raise CaptureError(f"A photo of {path} cannot be read: {error}.") from None
    cloud = read_ply(folder / cloud_name)
    names = tuple(str(frame["file_path"]) for frame in frames)
    return Capture(folder.name, [camera for camera, _ in named], photos, cloud, up, held_out, names=names)


def _camera(frame: dict[str, Any], path: Path) -> Camera:
    width, height = int(frame["w"]), int(frame["h"])
    fx, fy, cx, cy = (float(frame[name]) for name in ("fl_x", "fl_y", "cx", "cy"))
    matrix = np.array(frame["transform_matrix"], np.float64)
    if matrix.shape != (4, 4) or not np.isfinite([*matrix.ravel(), fx, fy, cx, cy]).all():
        raise CaptureError(f"{path}: a frame's transform_matrix and intrinsics must be 4 x 4 and finite numbers.")
    if not (0 < width <= LARGEST_SIDE_PX and 0 < height <= LARGEST_SIDE_PX and fx > 0 and fy > 0):
        raise CaptureError(f"{path}: a frame has {width} x {height} pixels and focal lengths {fx}, {fy}.")
    bent = [name for name in DISTORTION if float(frame.get(name, 0)) != 0]
    if bent:
        raise CaptureError(f"{path}: a frame has lens distortion ({', '.join(bent)}); undistort the photos first.")
    rotation = (matrix[:3, :3] * (1, -1, -1)).T
    if np.abs(rotation @ rotation.T - np.eye(3)).max() > 1e-3 or np.linalg.det(rotation) < 0:
        raise CaptureError(f"{path}: a frame's transform_matrix does not hold a rotation.")
    return Camera(width, height, fx, fy, cx - 0.5, cy - 0.5, rotation, matrix[:3, 3].copy())


def read_captures(folder: Path) -> list[Capture]:
    """All captures directly in a folder, by name, to learn from. Raises CaptureError where there is none, and where one
    has a single photo or no points; PointCloudError."""
    found = [read_capture(path.parent) for path in sorted(folder.glob("*/transforms.json"))]
    if not found:
        raise CaptureError(f"{folder} has no folders with a transforms.json in them.")
    for capture in found:
        photos, points = len(capture.sources()), len(capture.cloud.positions)
        if photos < 2 or not points:
            raise CaptureError(
                f"{folder / capture.name} has {photos} photos to learn from and {points} points; it needs 2 and 1."
            )
    return found
