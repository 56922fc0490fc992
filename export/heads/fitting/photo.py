"""A photo of a head, and what the encoder of a bundle says of it (sdk/src/head/bundle/head_encoder and build).

Squares and maps are in continuous coordinates: pixel (x, y) covers [x, x + 1) x [y, y + 1).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from scipy.ndimage import map_coordinates

from export.bundle import read_manifest
from export.densepose.graphs import session

GREY = 127  # of the crop, beyond the photo
MIN_BILINEAR_SCALE = 0.8  # of a crop; where it is coarser, pixels are averaged first
MIN_HEAD_CELLS = 40  # less is no head, or one that tells nothing
STRAY_FRACTION = 0.01  # of the head's cells, on each side of its box
SAME_BOX = 0.15  # of its size, by which a box may move and is the same
LOG_FOCAL_SIGMA = 0.35  # of a camera that is not known; the median of its focal length is the photo's long side

Box = tuple[float, float, float, float]  # left, top, right, bottom, px


class NoHead(ValueError):
    """A photo shows no head that can be fitted; the sentence says what to do."""


@dataclass(frozen=True, eq=False)
class Look:
    """rgb: float32 [S, S, 3], 0..255, a crop of a photo; cells: float32 [G, G, 8], what the encoder says of it;
    to_photo: [2, 3], from the crop's pixels to the photo's."""

    rgb: np.ndarray
    cells: np.ndarray
    to_photo: np.ndarray

    @property
    def cell_px(self) -> float:
        """The distance of cells in the photo."""
        return self.rgb.shape[0] / self.cells.shape[0] * float(np.hypot(*self.to_photo[:, 0]))

    def in_photo(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """From cells of the crop, continuous, to pixels of the photo, continuous, [..., 2]."""
        scale = self.rgb.shape[0] / self.cells.shape[0]
        return np.stack([x * scale, y * scale], -1) @ self.to_photo[:, :2].T + self.to_photo[:, 2]

    def in_cells(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """From pixels of the photo to cells of the crop, both continuous, [..., 2]."""
        at = (np.stack([x, y], -1) - self.to_photo[:, 2]) @ np.linalg.inv(self.to_photo[:, :2]).T
        return at * (self.cells.shape[0] / self.rgb.shape[0])


@dataclass(frozen=True, eq=False)
class HeadPhoto(Look):
    """size: width and height; centre: the principal point, where the first pixel's centre is (0, 0). log_focal_sigma: 0
    where the focal length is known, else focal_px is the median. face: a second, closer look; None where no face is
    seen."""

    size: tuple[int, int]
    focal_px: float
    log_focal_sigma: float
    box_px: Box
    face: Look | None = None

    @property
    def centre(self) -> np.ndarray:
        return (np.array(self.size) - 1) / 2


@dataclass(frozen=True)
class FaceSpec:
    """Which points of the template are the face's, [3] and dm, and the side of the closer look by its box."""

    center: np.ndarray
    radius_dm: float
    crop_sides: float


class Encoder:
    """The encoder of a bundle for heads."""

    def __init__(self, folder: Path) -> None:
        """Raises FileNotFoundError and ValueError for what is no bundle for heads."""
        manifest = read_manifest(folder)
        if manifest.get("task") != "heads":
            raise ValueError(f"{folder} is a bundle for {manifest.get('task')}; name one for heads.")
        self.crop_px, self.crop_sides = (manifest["encoder"][key] for key in ("crop_px", "crop_sides"))
        face = manifest["encoder"].get("face")
        self.face = FaceSpec(np.array(face["center_dm"]), face["radius_dm"], face["crop_sides"]) if face else None
        self.graph = session(folder / manifest["graphs"]["encoder"]["file"])

    def run(self, bgr: np.ndarray, to_photo: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The crop and its cells, as in Look."""
        rgb = crop(bgr, to_photo, self.crop_px)
        return rgb, self.graph.run(["cells"], {"image": rgb[None]})[0][0]


def square(box: Box, roll_rad: float, sides: float, crop_px: int) -> np.ndarray:
    """From a crop of the square around a box, `sides` times its longer side, to the photo, [2, 3]."""
    scale = sides * max(box[2] - box[0], box[3] - box[1]) / crop_px
    c, s = scale * math.cos(roll_rad), scale * math.sin(roll_rad)
    linear = np.array([[c, -s], [s, c]])
    middle = np.array([(box[0] + box[2]) / 2, (box[1] + box[3]) / 2])
    return np.concatenate([linear, (middle - linear @ np.full(2, crop_px / 2))[:, None]], 1)


def crop(bgr: np.ndarray, to_photo: np.ndarray, side: int) -> np.ndarray:
    """RGB float32 [side, side, 3]: bilinear, of pixels averaged before where the crop is coarser than the photo."""
    height, width = bgr.shape[:2]
    corners = np.array([[0, 0], [side, 0], [0, side], [side, side]]) @ to_photo[:, :2].T + to_photo[:, 2]
    # The pixels that the crop reads; the first ones are even, as where two of them share their colour.
    x0, y0 = (np.clip(np.floor(corners.min(0)) - 2, 0, (width, height)).astype(int)) // 2 * 2
    x1, y1 = np.clip(np.ceil(corners.max(0)) + 2, 0, (width, height)).astype(int)
    if x1 <= x0 or y1 <= y0:
        return np.full((side, side, 3), GREY, np.float32)
    window = bgr[y0:y1, x0:x1, ::-1].astype(np.float32)
    scale = 1 / np.hypot(*to_photo[:, 0])
    if scale < MIN_BILINEAR_SCALE:
        size = [max(1, int(n * scale + 0.5)) for n in (x1 - x0, y1 - y0)]
        window = cv2.resize(window, size, interpolation=cv2.INTER_AREA)
    pixel = np.arange(side) + 0.5
    at = np.stack(np.meshgrid(pixel, pixel), -1) @ to_photo[:, :2].T + to_photo[:, 2]
    at = (at - (x0, y0)) * (np.array(window.shape[1::-1]) / (x1 - x0, y1 - y0)) - 0.5
    rows = (at[..., 1], at[..., 0])
    planes = [map_coordinates(window[..., c], rows, order=1, mode="grid-constant", cval=GREY) for c in range(3)]
    return np.clip(np.stack(planes, -1), 0, 255).astype(np.float32)


def usable(cells: np.ndarray) -> np.ndarray:
    """Which cells have numbers that can be believed."""
    return np.isfinite(cells).all(-1) & (np.abs(cells[..., :3]) <= 16).all(-1)


def shows_face(cells: np.ndarray, face: FaceSpec) -> np.ndarray:
    return np.linalg.norm(cells[..., :3] - face.center, axis=-1) < face.radius_dm


def shows_head(cells: np.ndarray) -> np.ndarray:
    return usable(cells) & (cells[..., 4] > 0)


def look_at(
    encoder: Encoder, bgr: np.ndarray, box: Box | None = None, roll_rad: float = 0.0, focal_px: float = 0.0
) -> HeadPhoto:
    """box: of the head with its hair; None: it is looked for in the middle, then in the whole photo (the SDK goes on
    with parts of it). focal_px: 0 where it is not known. Raises NoHead."""
    height, width = bgr.shape[:2]

    def look(to_photo: np.ndarray) -> HeadPhoto:
        rgb, cells = encoder.run(bgr, to_photo)
        known = focal_px > 0
        photo = HeadPhoto(
            rgb, cells.copy(), to_photo, (width, height), focal_px if known else float(max(width, height)),
            0.0 if known else LOG_FOCAL_SIGMA, box or (0, 0, 0, 0),
        )  # fmt: skip
        grid = np.arange(cells.shape[0]) + 0.5
        at = photo.in_photo(*np.meshgrid(grid, grid))
        photo.cells[~((at >= 0) & (at < (width, height))).all(-1)] = np.nan
        return photo

    def with_face(photo: HeadPhoto) -> HeadPhoto:
        of_face = encoder.face and _box_around(photo, shows_head(photo.cells) & shows_face(photo.cells, encoder.face))
        if not of_face:
            return photo
        closer = look(square(of_face, roll_rad, encoder.face.crop_sides, encoder.crop_px))
        return replace(photo, face=Look(closer.rgb, closer.cells, closer.to_photo))

    looks = 1 if box else 2
    if box is None:
        for side in (min(width, height), max(width, height)):
            middle = ((width - side) / 2, (height - side) / 2, (width + side) / 2, (height + side) / 2)
            box = _box_of(look(square(middle, roll_rad, 1.0, encoder.crop_px)))
            if box:
                break
        else:
            raise NoHead(f"No head is seen in the photo of {width} x {height} pixels. Give its box with --box.")
    for left in range(looks, 0, -1):
        photo = look(square(box, roll_rad, encoder.crop_sides, encoder.crop_px))
        around = _box_of(photo)
        if around is None:
            raise NoHead(f"No head is seen in the box {box} of the photo. Give the box of the head with its hair.")
        if left == 1 or _is_same(around, box):
            break
        box = around
    return with_face(photo)


def _box_of(photo: HeadPhoto) -> Box | None:
    """Around the cells that show a head, without strays; None where there are too few."""
    return _box_around(photo, shows_head(photo.cells))


def _box_around(photo: HeadPhoto, chosen: np.ndarray) -> Box | None:
    rows, columns = np.nonzero(chosen)
    if len(rows) < MIN_HEAD_CELLS:
        return None
    at = np.sort(photo.in_photo(columns + 0.5, rows + 0.5), axis=0)
    strays = int(STRAY_FRACTION * len(at))
    half = photo.cell_px / 2
    return tuple(map(float, (*(at[strays] - half), *(at[len(at) - 1 - strays] + half))))


def _is_same(a: Box, b: Box) -> bool:
    limit = SAME_BOX * max(b[2] - b[0], b[3] - b[1])
    return all(abs(one - other) <= limit for one, other in zip(a, b, strict=True))
