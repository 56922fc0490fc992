"""Photos of a folder, ready for COLMAP and the depth: upright JPEG files of at most LONG_SIDE_PX."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from maquette.frames import Frame, PixelFormat
from maquette.native import MaquetteError
from maquette.scene_making.exif import camera_of
from maquette.scene_making.motion import shrunk

LONG_SIDE_PX = 960
READABLE = (".jpg", ".jpeg", ".png", ".webp", ".bmp", ".tif", ".tiff")
_FOREIGN = {
    ".heic": "HEIC",
    ".heif": "HEIC",
    ".avif": "AVIF",
    ".dng": "RAW",
    ".cr2": "RAW",
    ".nef": "RAW",
    ".arw": "RAW",
}
_DARK, _BRIGHT = 10, 250  # mean grey levels, of 255
_PLAIN = 3.0  # standard deviation of grey levels
_MIN_SIDE_PX = 200


@dataclass(frozen=True)
class Photo:
    """file: name in the folder of prepared photos. origin: its name for the user, "IMG_3.jpg" or "12.30 s". camera:
    photos with the same text were taken with one camera and zoom. focal_px: 0 if unknown."""

    file: str
    origin: str
    width: int
    height: int
    camera: str
    focal_px: float = 0.0


@dataclass(frozen=True)
class LeftOut:
    """A photo or frame that is not used, and why."""

    name: str
    reason: str


@dataclass(frozen=True)
class Prepared:
    """ordered: photos follow each other, as the frames of a film. notes: sentences about the whole."""

    photos: list[Photo]
    left_out: list[LeftOut]
    found: int
    ordered: bool
    notes: list[str]

    def to_json(self) -> dict[str, Any]:
        return asdict(self)

    @staticmethod
    def of_json(known: dict[str, Any]) -> Prepared:
        photos = [Photo(**photo) for photo in known["photos"]]
        left_out = [LeftOut(**entry) for entry in known["left_out"]]
        return Prepared(photos, left_out, known["found"], known["ordered"], known["notes"])


def natural_order(name: str) -> list[Any]:
    """IMG_9 before IMG_10."""
    return [int(part) if part.isdigit() else part.lower() for part in re.split(r"(\d+)", name)]


def fault_of(grey: np.ndarray) -> str:
    """Why an image shows nothing that can be matched; "" if it does. grey: uint8 [H, W]."""
    mean, spread = float(grey.mean()), float(shrunk(grey).std())
    if mean < _DARK and spread < 3 * _PLAIN:
        return f"black: its mean is {mean:.0f} of 255"
    if mean > _BRIGHT:
        return f"overexposed: its mean is {mean:.0f} of 255"
    if spread < _PLAIN:
        return "one plain area, without anything to recognise"
    return ""


def scaled_size(width: int, height: int) -> tuple[int, int]:
    """At most LONG_SIDE_PX on the long side."""
    scale = min(1.0, LONG_SIDE_PX / max(width, height))
    return max(1, round(width * scale)), max(1, round(height * scale))


def photo_files(folder: Path) -> tuple[list[Path], list[LeftOut]]:
    """Files of the folder that can be photos, in natural order, and pictures of formats that are not read."""
    files = sorted((file for file in folder.iterdir() if file.is_file()), key=lambda file: natural_order(file.name))
    files = [file for file in files if not file.name.startswith(".")]
    foreign = [
        LeftOut(file.name, f"{_FOREIGN[file.suffix.lower()]} is not read: export it as JPEG")
        for file in files
        if file.suffix.lower() in _FOREIGN
    ]
    return [file for file in files if file.suffix.lower() in READABLE], foreign


def prepare_photos(
    folder: Path, target: Path, max_photos: int, progress: Callable[[float], None]
) -> Prepared:  # fmt: skip
    """Writes prepared photos to `target`. Raises MaquetteError where it cannot be written."""
    files, left_out = photo_files(folder)
    found = len(files) + len(left_out)
    notes = []
    if len(files) > max_photos:
        chosen = {round(k * (len(files) - 1) / (max_photos - 1)) for k in range(max_photos)}
        notes.append(f"{max_photos} of {len(files)} photos are used, evenly by their names; --photos N uses more.")
        files = [file for k, file in enumerate(files) if k in chosen]
    photos: list[Photo] = []
    known: dict[bytes, str] = {}
    for k, file in enumerate(files):
        progress(k / len(files))
        fault, grey, frame = _read(file)
        digest = hashlib.sha256(shrunk(grey).round().tobytes()).digest() if grey is not None else b""
        if not fault and digest in known:
            fault = f"the same picture as {known[digest]}"
        if fault or frame is None:
            left_out.append(LeftOut(file.name, fault))
            continue
        known[digest] = file.name
        height, width = frame.shape
        size = scaled_size(width, height)
        if size != (width, height):
            frame = frame.resized(*size)
        model, focal = camera_of(file)
        name = f"{len(photos):04d}.jpg"
        frame.save(target / name)
        camera = f"{size[0]}x{size[1]} {model} {focal:.3f}"
        photos.append(Photo(name, file.name, *size, camera, focal * max(size)))
    return Prepared(photos, left_out, found, False, notes)


def _read(file: Path) -> tuple[str, np.ndarray | None, Frame | None]:
    try:
        frame = Frame.open(file)
        height, width = frame.shape
        if min(height, width) < _MIN_SIDE_PX:
            return f"only {width} x {height} pixels", None, None
        grey = frame.pixels(PixelFormat.GREY8)
    except MaquetteError as error:
        return f"cannot be read: {error.text}", None, None
    except OSError as error:
        return f"cannot be read: {error.strerror}", None, None
    return fault_of(grey), grey, frame
