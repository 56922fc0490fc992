"""Reads a place's folder (docs/reference/formats.md): cameras, images and depth when asked for, the cloud."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from export.camera import Camera
from export.point_cloud import PointCloudError, read_ply

FORMAT = "maquette-place-1"
# Cameras of files look to -z with y up (OpenGL); ours look to z with y down (OpenCV).
AXES = np.diag([1.0, -1.0, -1.0, 1.0])
_MAX_BYTES, _MAX_FRAMES, _MAX_SIDE = 20_000_000, 10_000, 16_384


class PlaceError(ValueError):
    """A folder is not a place: what is wrong with which file."""


class Pictures(Sequence):
    """Read when asked for: `p[3]` is one image [H, W, ...], `p[2:5]` or `p[[7, 1]]` are several [n, H, W, ...]."""

    def __init__(self, files: list[Path], height: int, width: int, read) -> None:
        self.files, self.height, self.width, self._read = files, height, width, read

    def __len__(self) -> int:
        return len(self.files)

    def __getitem__(self, which):
        if isinstance(which, int | np.integer):
            return self._read(self.files[which], self.height, self.width)
        if isinstance(which, slice):
            which = range(len(self))[which]
        return np.stack([self[int(k)] for k in which])


@dataclass(frozen=True, eq=False)
class Place:
    """V views of H x W pixels of one place.

    images: uint8 [V, H, W, 3] RGB and depth: float32 [V, H, W] metres along the optical axis (0: nothing), both read
    when asked for. intrinsics: float64 [V, 3, 3] pixels, the centre of the top left one is (0, 0). world_to_camera:
    float64 [V, 3, 4], x right, y down, z forward, metres. xyz float32 [N, 3] and rgb uint8 [N, 3]: the cloud. source,
    held_out: numbers of the views to build from and of those to compare with. up: [3]. about: the file's own part
    `maquette` (kind, seed, assets with licences, cloud).
    """

    folder: Path
    images: Pictures
    depth: Pictures
    intrinsics: np.ndarray
    world_to_camera: np.ndarray
    xyz: np.ndarray
    rgb: np.ndarray
    source: np.ndarray
    held_out: np.ndarray
    up: np.ndarray
    about: dict

    def camera(self, view: int) -> Camera:
        rotation, shift = self.world_to_camera[view, :, :3], self.world_to_camera[view, :, 3]
        size = self.images.width, self.images.height
        return Camera.of_intrinsics(*size, self.intrinsics[view], rotation, -rotation.T @ shift)


def _image(file: Path, height: int, width: int) -> np.ndarray:
    image = cv2.imread(str(file), cv2.IMREAD_COLOR)
    if image is None:
        raise PlaceError(f"{file} is missing or no picture that can be read; render the place again.")
    if image.shape[:2] != (height, width):
        raise PlaceError(
            f"{file} is {image.shape[1]} x {image.shape[0]} pixels, transforms.json says {width} x {height}."
        )
    return np.ascontiguousarray(image[..., ::-1])


def _depth_reader(unit_m: float):
    def read(file: Path, height: int, width: int) -> np.ndarray:
        image = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
        if image is None or image.dtype != np.uint16 or image.ndim != 2:
            raise PlaceError(f"{file} is missing or no 16 bit depth picture; render the place again.")
        if image.shape != (height, width):
            raise PlaceError(f"{file} is {image.shape[1]} x {image.shape[0]} pixels, not {width} x {height}.")
        return image.astype(np.float32) * np.float32(unit_m)

    return read


def load_place(folder: Path | str) -> Place:
    """Reads a place; raises PlaceError with a sentence where a file is missing or not what it should be.

    Images and depth are opened only when asked for, and may raise then.
    """
    folder = Path(folder)
    file = folder / "transforms.json"
    if not file.is_file():
        raise PlaceError(f"{folder} has no transforms.json: it is no place, or was not rendered to the end.")
    if file.stat().st_size > _MAX_BYTES:
        raise PlaceError(f"{file} has {file.stat().st_size} bytes; {_MAX_BYTES} at most are read.")
    try:
        table = json.loads(file.read_text("utf-8"))
    except (ValueError, RecursionError) as error:
        raise PlaceError(f"{file} is no JSON: {error}.") from None
    about = table.get("maquette") if isinstance(table, dict) else None
    if not isinstance(about, dict) or about.get("format") != FORMAT:
        raise PlaceError(f"{file} is not of the format {FORMAT}; other folders are imported by the SDK.")
    frames = table.get("frames")
    if (
        not isinstance(frames, list)
        or not 0 < len(frames) <= _MAX_FRAMES
        or not all(isinstance(f, dict) for f in frames)
    ):
        raise PlaceError(f"{file} needs a list `frames` with 1 to {_MAX_FRAMES} cameras.")
    sizes = {(_side(file, frame, "w"), _side(file, frame, "h")) for frame in frames}
    if len(sizes) > 1:
        raise PlaceError(f"{file} has pictures of {len(sizes)} sizes; a place has one.")
    width, height = sizes.pop()
    cameras = [_camera(file, frame, k, width, height) for k, frame in enumerate(frames)]
    names = [_inside(file, frame, "file_path") for frame in frames]
    depths = [_inside(file, frame, "depth_file_path") for frame in frames]
    source, held_out = (_numbers(file, table, key, names) for key in ("train_filenames", "test_filenames"))
    if set(source) & set(held_out):
        raise PlaceError(f"{file} has views that are both in `train_filenames` and in `test_filenames`.")
    unit = _figures(file, about, "depth_unit_m", 1)[0]
    up = _figures(file, about, "up_axis", 3)
    if not 0 < unit < 1 or abs(np.linalg.norm(up) - 1) > 1e-6:
        raise PlaceError(
            f"{file}: `depth_unit_m` is {unit} and `up_axis` {up.tolist()}; a length and a unit vector belong there."
        )
    try:
        cloud = read_ply(folder / _inside(file, table, "ply_file_path"))
    except PointCloudError as error:
        raise PlaceError(f"The cloud of {folder} cannot be read: {error}") from None
    if cloud.dropped or not len(cloud.positions):
        raise PlaceError(
            f"The cloud of {folder} has {len(cloud.positions)} points, and {cloud.dropped} that are not finite."
        )
    return Place(
        folder,
        Pictures([folder / n for n in names], height, width, _image),
        Pictures([folder / n for n in depths], height, width, _depth_reader(unit)),
        np.stack([c.intrinsics for c in cameras]),
        np.stack([c.world_to_camera for c in cameras]),
        cloud.positions.astype(np.float32),
        np.rint(255 * cloud.colours).astype(np.uint8),
        np.array(source, np.int64),
        np.array(held_out, np.int64),
        up,
        about,
    )


def _figures(file: Path, entry: dict, key: str, count: int) -> np.ndarray:
    try:
        figures = np.array(entry[key], np.float64).reshape(-1)
    except (KeyError, TypeError, ValueError):
        raise PlaceError(f"{file} has no `{key}` with {count} figures.") from None
    if len(figures) != count or not np.isfinite(figures).all():
        raise PlaceError(f"{file}: `{key}` should be {count} finite figures.")
    return figures


def _side(file: Path, frame: dict, key: str) -> int:
    side = _figures(file, frame, key, 1)[0]
    if not 1 <= side <= _MAX_SIDE or side != int(side):
        raise PlaceError(f"{file}: a picture's `{key}` is {side}; 1 to {_MAX_SIDE} pixels are possible.")
    return int(side)


def _inside(file: Path, entry: dict, key: str) -> str:
    name = entry.get(key)
    if not isinstance(name, str) or not name:
        raise PlaceError(f"{file} has an entry without `{key}`.")
    if Path(name).is_absolute() or ".." in Path(name).parts or "\0" in name:
        raise PlaceError(f"{file}: `{key}` {name!r} leaves the folder.")
    return name


def _numbers(file: Path, table: dict, key: str, names: list[str]) -> list[int]:
    number = {name: k for k, name in enumerate(names)}
    wanted = table.get(key)
    if not isinstance(wanted, list) or not all(isinstance(n, str) and n in number for n in wanted):
        raise PlaceError(f"{file}: `{key}` should be a list of views' `file_path`.")
    return sorted({number[name] for name in wanted})


def _camera(file: Path, frame: dict, k: int, width: int, height: int) -> Camera:
    fx, fy, cx, cy = (_figures(file, frame, key, 1)[0] for key in ("fl_x", "fl_y", "cx", "cy"))
    if fx <= 0 or fy <= 0:
        raise PlaceError(f"{file}: camera {k} has focal lengths {fx} and {fy} pixels; both must be above 0.")
    to_world = _figures(file, frame, "transform_matrix", 16).reshape(4, 4) @ AXES
    rotation = to_world[:3, :3]
    turned = np.abs(rotation @ rotation.T - np.eye(3)).max() < 1e-4 and np.linalg.det(rotation) > 0
    if not turned or np.abs(to_world[3] - [0, 0, 0, 1]).max() > 1e-9:
        raise PlaceError(f"{file}: `transform_matrix` of camera {k} is no rotation with a shift.")
    # Files count pixels from the corner of the first one, cameras from its centre.
    return Camera(width, height, fx, fy, cx - 0.5, cy - 0.5, rotation.T, to_world[:3, 3])
