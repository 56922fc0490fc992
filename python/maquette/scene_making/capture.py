"""The capture that a scene is built from: an upright world, held-out photos, and point clouds."""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from maquette.scene_making.photos import Photo
from maquette.scene_making.work_folder import write_atomically
from maquette.scenes import Capture

CLOUD = "cloud.ply"
_TO_OPENGL = np.diag([1.0, -1.0, -1.0])
_FEW, _SOME, _MANY = 6, 12, 24  # photos: below, 0, 1 and 2 are held out; from the last on, 3
_MAX_ERROR_PX = 2.0  # of sparse points that are used


def held_out_of(count: int) -> list[int]:
    """Numbers of the photos that only the comparison uses, evenly spread and never the first or last."""
    number = 0 if count < _FEW else 1 if count < _SOME else 2 if count < _MANY else 3
    return [round((k + 0.5) * count / number) for k in range(number)]


def write_capture(model: Any, photos: Sequence[Photo], source: Path, folder: Path) -> np.ndarray:
    """Writes photos, transforms.json and the sparse cloud of a pycolmap.Reconstruction to an empty folder. Returns the
    cloud, float32 [P, 3] in the capture's world. Raises OSError, MaquetteError."""
    images = sorted((image for image in model.images.values() if image.has_pose), key=lambda image: image.name)
    (folder / "images").mkdir()
    for image in images:
        shutil.copyfile(source / image.name, folder / "images" / image.name)
    turn, scale, middle = _upright(model, folder, [image.projection_center() for image in images])
    chosen = [k for k, point in model.points3D.items() if point.error <= _MAX_ERROR_PX] or list(model.points3D)
    xyz = np.array([model.points3D[k].xyz for k in chosen]).reshape(-1, 3)
    xyz = (scale * (xyz - middle) @ turn.T).astype(np.float32)
    rgb = np.array([model.points3D[k].color for k in chosen], np.uint8).reshape(-1, 3)
    held_out = [f"images/{images[k].name}" for k in held_out_of(len(images))]
    names = [f"images/{image.name}" for image in images]
    origins = {photo.file: photo.origin for photo in photos}
    frames = []
    for image in images:
        pose = image.cam_from_world()
        rotation = pose.rotation.matrix() @ turn.T
        centre = scale * turn @ (image.projection_center() - middle)
        frames.append(_entry(image, rotation, centre) | {"origin": origins.get(image.name, image.name)})
    table = {
        "ply_file_path": CLOUD,
        "up": [0, 0, 1],
        "frames": frames,
        "train_filenames": [name for name in names if name not in held_out],
        "test_filenames": held_out,
        "unit": "unknown: the mean distance of the cameras from their middle is 1",
    }
    write_cloud(folder / CLOUD, xyz, rgb)
    write_atomically(folder / "transforms.json", json.dumps(table, indent=1) + "\n")
    return xyz


def _upright(model: Any, folder: Path, centres: list[np.ndarray]) -> tuple[np.ndarray, float, np.ndarray]:
    """turn, scale, middle: p -> scale * turn @ (p - middle) has up at +z, the cameras around the origin, and their mean
    distance from it 1. The SDK estimates up from all cameras."""
    sparse = folder / "sparse"
    sparse.mkdir()
    model.write(sparse)
    with Capture(folder) as capture:
        up = capture.up
    shutil.rmtree(sparse)
    side = np.cross(up, np.eye(3)[np.abs(up).argmin()])
    side /= np.linalg.norm(side)
    places = np.stack(centres)
    middle = np.median(places, 0)
    size = float(np.linalg.norm(places - middle, axis=1).mean())
    return np.stack([side, np.cross(up, side), up]), 1 / max(size, 1e-9), middle


def _entry(image: Any, rotation: np.ndarray, centre: np.ndarray) -> dict[str, Any]:
    """A camera as nerfstudio writes it: OpenGL axes, pixels counted from the corner of the first."""
    camera = image.camera
    to_world = np.eye(4)
    to_world[:3, :3] = rotation.T @ _TO_OPENGL
    to_world[:3, 3] = centre
    lens = {"SIMPLE_RADIAL": ("k1",), "RADIAL": ("k1", "k2"), "OPENCV": ("k1", "k2", "p1", "p2")}
    extra = lens.get(camera.model_name, ())
    distortion = camera.params[len(camera.params) - len(extra) :]
    return {
        "file_path": f"images/{image.name}",
        "w": camera.width,
        "h": camera.height,
        "fl_x": camera.focal_length_x if len(camera.focal_length_idxs()) > 1 else camera.focal_length,
        "fl_y": camera.focal_length_y if len(camera.focal_length_idxs()) > 1 else camera.focal_length,
        "cx": camera.principal_point_x,
        "cy": camera.principal_point_y,
        "transform_matrix": to_world.tolist(),
        **{name: float(distortion[k]) for k, name in enumerate(extra)},
    }


def write_cloud(path: Path, xyz: np.ndarray, rgb: np.ndarray) -> None:
    """Writes a PLY file atomically. xyz: float32 [P, 3]; rgb: uint8 [P, 3]. Raises OSError."""
    points = np.empty(len(xyz), [("xyz", "<f4", 3), ("rgb", "u1", 3)])
    points["xyz"], points["rgb"] = xyz, rgb
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(xyz)}"]
    lines += [f"property float {axis}" for axis in "xyz"]
    lines += [f"property uchar {name}" for name in ("red", "green", "blue")] + ["end_header", ""]
    partial = path.with_name(f".{path.name}.partial")
    try:
        partial.write_bytes("\n".join(lines).encode() + points.tobytes())
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)
