"""Which real photographs are posed, where they come from, and what of them is the thing itself."""

from __future__ import annotations

import gzip
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from export.photos.packages import PackageError, PackageReader, fetch, load_packages

FRAMES_OF_BOX = 48
_BOX = "./usr/share/doc/opencv-doc/opencv4/html/box.mp4.gz"
_HOUSE = "mvtbdata/images/seq/im.{:03d}.png"


@dataclass(frozen=True, eq=False)
class Photo:
    """image: uint8 [H, W, 3], blue first. mask: uint8 [H, W], 255 where the thing is that points are wanted of."""

    image: np.ndarray
    mask: np.ndarray


@dataclass(frozen=True)
class Original:
    """package: its name in export/photos/packages.toml. alone: what is outside of the masks moves otherwise than the
    thing, and is made black."""

    name: str
    package: str
    shows: str
    alone: bool
    read: Callable[[PackageReader], list[Photo]]

    def photos(self) -> list[Photo]:
        """Fetches the package unless it is here. Raises PackageError."""
        with PackageReader(fetch(load_packages()[self.package])) as reader:
            return self.read(reader)


def write_plain(original: Original, folder: Path) -> int:
    """Writes the photos as PNG files, atomically, and gives their number. Raises PackageError and OSError."""
    partial = folder.with_name(f".{folder.name}.partial")
    shutil.rmtree(partial, ignore_errors=True)
    partial.mkdir(parents=True)
    photos = original.photos()
    for number, photo in enumerate(photos):
        file = partial / f"{number:03d}.png"
        if not cv2.imwrite(str(file), photo.image):
            raise OSError(f"{file} cannot be written; is the disk full?")
    shutil.rmtree(folder, ignore_errors=True)
    partial.rename(folder)
    return len(photos)


def _read_box(reader: PackageReader) -> list[Photo]:
    """The sharpest frame of each of as many equal pieces of the film."""
    frames = _film(gzip.decompress(reader.read(_BOX)))
    pieces = np.array_split(np.arange(len(frames)), FRAMES_OF_BOX)
    sharpest = [max(piece, key=lambda k: _sharpness(frames[k])) for piece in pieces]
    return [Photo(frames[k], box_mask(frames[k])) for k in sharpest]


def _film(data: bytes) -> list[np.ndarray]:
    with tempfile.NamedTemporaryFile(suffix=".mp4") as file:
        file.write(data)
        file.flush()
        film, frames = cv2.VideoCapture(file.name), []
        while (frame := film.read()[1]) is not None:
            frames.append(frame)
    if len(frames) < FRAMES_OF_BOX:
        raise PackageError(f"{_BOX} has {len(frames)} frames that can be read; {FRAMES_OF_BOX} are needed.")
    return frames


def _sharpness(frame: np.ndarray) -> float:
    grey = cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY)
    return float(cv2.Laplacian(grey, cv2.CV_32F)[box_mask(frame) > 0].var())


def box_mask(frame: np.ndarray) -> np.ndarray:
    """The hull of the largest yellow piece: a box is convex, and so is what is seen of it."""
    colours = cv2.cvtColor(frame, cv2.COLOR_BGR2HSV)
    yellow = cv2.inRange(colours, (12, 130, 100), (38, 255, 255))
    yellow = cv2.morphologyEx(yellow, cv2.MORPH_OPEN, np.ones((3, 3)))
    yellow = cv2.morphologyEx(yellow, cv2.MORPH_CLOSE, np.ones((9, 9)))
    _, pieces, figures, _ = cv2.connectedComponentsWithStats(yellow)
    mask = np.zeros(frame.shape[:2], np.uint8)
    if len(figures) > 1:
        largest = 1 + figures[1:, cv2.CC_STAT_AREA].argmax()
        hull = cv2.convexHull(np.argwhere(pieces == largest)[:, ::-1].astype(np.int32))
        cv2.fillConvexPoly(mask, hull, 255)
    return mask


def _read_house(reader: PackageReader) -> list[Photo]:
    photos = []
    for number in range(1, 10):
        name = _HOUSE.format(number)
        image = cv2.imdecode(np.frombuffer(reader.read(name), np.uint8), cv2.IMREAD_COLOR)
        if image is None:
            raise PackageError(f"{name} is no picture that can be read.")
        # All but the black cloth; its dark windows are closed.
        bright = (cv2.GaussianBlur(image[..., 0], (0, 0), 2) > 42).astype(np.uint8) * 255
        photos.append(Photo(image, cv2.morphologyEx(bright, cv2.MORPH_CLOSE, np.ones((25, 25)))))
    return photos


ORIGINALS = (
    Original("box", "opencv-doc", "a printed cardboard box, turned by hand before a camera", True, _read_box),
    Original("house", "mvtb-data", "a toy house with a cup and cars, grey, on a turntable", False, _read_house),
)
