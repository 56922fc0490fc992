"""Makes the folder of a capture: photos without distortion, cameras, a dense cloud, and COLMAP's own model."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import cv2
import numpy as np

from export.camera import Camera
from export.captures.dense import POINTS, dense_cloud
from export.captures.originals import Original
from export.captures.structure import pose, up_of_cameras, write_photos
from export.photos.packages import load_packages
from export.point_cloud import write_ply

HELD_OUT_EVERY = 8
DEPTH_STEPS = 60_000  # of a stored depth, for the farthest of a capture
_TO_OPENGL = np.diag([1.0, -1.0, -1.0])


def make(original: Original, folder: Path, max_points: int = POINTS) -> tuple[int, int, int]:
    """Writes the folder atomically; gives the numbers of photos, of those posed, and of points.

    Raises PackageError and CaptureError.
    """
    partial = folder.with_name(f".{folder.name}.partial")
    shutil.rmtree(partial, ignore_errors=True)
    counts = _write(original, partial, max_points)
    shutil.rmtree(folder, ignore_errors=True)
    partial.rename(folder)
    return counts


def _write(original: Original, partial: Path, max_points: int) -> tuple[int, int, int]:
    import pycolmap  # of the extra `captures`

    photos = original.photos()
    colmap = partial / "model"
    write_photos(photos, colmap, original.alone)
    model = pose(colmap, os.cpu_count() or 1)
    flat = partial / "flat"
    pycolmap.undistort_images(flat, colmap / "sparse" / "0", colmap / "images", jpeg_quality=95)
    straight = pycolmap.Reconstruction(flat / "sparse")
    views = sorted(straight.images.values(), key=lambda view: view.name)
    cameras = [_camera(view) for view in views]
    turn, scale, middle = _placed_upright(cameras)
    cameras = [_moved(camera, turn, scale, middle) for camera in cameras]
    sparse = np.array([scale * turn @ (point.xyz - middle) for point in straight.points3D.values()])
    images = [cv2.imread(str(flat / "images" / view.name)) for view in views]
    masks = [_flat_mask(colmap, model, view.name, camera) for view, camera in zip(views, cameras, strict=True)]
    held_out = [k for k in range(len(views)) if k % HELD_OUT_EVERY == HELD_OUT_EVERY // 2]
    sources = [k for k in range(len(views)) if k not in held_out]
    of_sources = [[part[k] for k in sources] for part in (cameras, images, masks)]
    depths, xyz, rgb = dense_cloud(*of_sources, sparse, max_points)
    names = [f"images/{view.name}" for view in views]
    depth_names, depth_unit = write_depths(partial, [names[k] for k in sources], depths)
    (flat / "images").rename(partial / "images")
    shutil.rmtree(flat)
    shutil.rmtree(colmap / "masks")
    package = load_packages()[original.package]
    table = {
        "camera_model": "PINHOLE",
        "ply_file_path": "cloud.ply",
        "up": [0, 0, 1],
        "depth_unit_scale_factor": depth_unit,
        "frames": [
            _entry(name, camera) | depth_names.get(name, {}) for name, camera in zip(names, cameras, strict=True)
        ],
        "train_filenames": [names[k] for k in sources],
        "test_filenames": [names[k] for k in held_out],
        "shows": original.shows,
        "package": f"{package.package} {package.version}",
        "licence": package.licence,
        "reprojection_error_px": float(model.compute_mean_reprojection_error()),
    }
    (partial / "transforms.json").write_text(json.dumps(table, indent=1) + "\n")
    write_ply(partial / "cloud.ply", xyz, rgb)
    in_model = ((xyz @ turn) / scale + middle).astype(np.float32)
    write_ply(partial / "model/fused.ply", in_model, rgb)
    return len(photos), len(views), len(xyz)


def write_depths(folder: Path, names: list[str], depths: list[np.ndarray]) -> tuple[dict[str, dict[str, str]], float]:
    """Writes the depth of photos as PNG of 16 bits, 0: unknown. Gives the entries of their frames by name of the photo,
    and what a stored 1 means in units of the capture."""
    unit = max([float(depth.max()) for depth in depths] + [1e-9]) / DEPTH_STEPS
    entries = {}
    (folder / "depth").mkdir()
    for name, depth in zip(names, depths, strict=True):
        path = f"depth/{Path(name).stem}.png"
        cv2.imwrite(str(folder / path), np.round(depth / unit).astype(np.uint16))
        entries[name] = {"depth_file_path": path}
    return entries, unit


def _camera(view) -> Camera:
    """The camera of an image of a pycolmap.Reconstruction, where pixel coordinates start at the corner of the first
    pixel."""
    fx, fy, cx, cy = view.camera.params
    pose = view.cam_from_world()
    rotation = pose.rotation.matrix()
    centre = -rotation.T @ pose.translation
    return Camera(view.camera.width, view.camera.height, fx, fy, cx - 0.5, cy - 0.5, rotation, centre)


def _placed_upright(cameras: list[Camera]) -> tuple[np.ndarray, float, np.ndarray]:
    """Rotation, scale and middle, so that p -> scale * rotation @ (p - middle) has up at +z, the cameras around the
    origin, and them a unit away from it on average."""
    up = up_of_cameras(np.stack([camera.rotation for camera in cameras]))
    side = np.cross(up, np.eye(3)[np.abs(up).argmin()])
    side /= np.linalg.norm(side)
    centres = np.stack([camera.centre for camera in cameras])
    middle = np.median(centres, 0)
    size = float(np.linalg.norm(centres - middle, axis=1).mean())
    return np.stack([side, np.cross(up, side), up]), 1 / max(size, 1e-9), middle


def _moved(camera: Camera, turn: np.ndarray, scale: float, middle: np.ndarray) -> Camera:
    return Camera(
        camera.width_px,
        camera.height_px,
        camera.fx_px,
        camera.fy_px,
        camera.cx_px,
        camera.cy_px,
        camera.rotation @ turn.T,
        scale * turn @ (camera.centre - middle),
    )


def _flat_mask(colmap: Path, model, name: str, camera: Camera) -> np.ndarray:
    """The mask of a photo without distortion, two pixels smaller: bool [H, W]."""
    mask = cv2.imread(str(colmap / "masks" / f"{name}.png"), cv2.IMREAD_GRAYSCALE)
    lens = next(image.camera for image in model.images.values() if image.name == name)
    focal, cx, cy, bend = lens.params  # SIMPLE_RADIAL
    old = np.array([[focal, 0, cx - 0.5], [0, focal, cy - 0.5], [0, 0, 1]])
    size = camera.width_px, camera.height_px
    to_old = cv2.initUndistortRectifyMap(old, np.array([bend, 0, 0, 0]), None, camera.intrinsics, size, cv2.CV_32FC1)
    return cv2.erode(cv2.remap(mask, *to_old, cv2.INTER_NEAREST), np.ones((5, 5))) > 0


def _entry(name: str, camera: Camera) -> dict:
    """As nerfstudio writes it: OpenGL axes, pixels counted from the first one's corner."""
    to_world = np.eye(4)
    to_world[:3, :3] = camera.rotation.T @ _TO_OPENGL
    to_world[:3, 3] = camera.centre
    return {
        "file_path": name,
        "w": camera.width_px,
        "h": camera.height_px,
        "fl_x": camera.fx_px,
        "fl_y": camera.fy_px,
        "cx": camera.cx_px + 0.5,
        "cy": camera.cy_px + 0.5,
        "transform_matrix": to_world.tolist(),
    }
