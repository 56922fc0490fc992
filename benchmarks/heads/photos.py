"""Makes photos of heads with known shape from stored images (`export.heads.view_shards`, `other_heads`).

Heads are in front of photographs without people, framed like camera photos, so that the principal point is the middle
of the photo.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np

from benchmarks.heads.distances import MM_PER_DM, Triangles, TruePoints
from benchmarks.heads.face_mesh import is_inner_face
from benchmarks.heads.visible import seen_from, seen_from_outside
from export.camera import Camera
from export.heads.head_shards import HeadImages, is_face, read_pictures
from export.heads.sampling import sample_extras
from export.heads.surface import Head, HeadMaker, cut_distance
from export.heads.synthetic_heads import make_head

HEAD = 255  # threshold of masks
MAX_YAW_DEG, MAX_PITCH_DEG = 45.0, 35.0
FRONT_YAW_DEG, SIDE_YAW_DEG = 20.0, (35.0, 110.0)
# Focal length by the photo's long side, of phones (wide to telephoto) and portrait lenses.
FOCAL_OF_LONG_SIDE = (0.7, 1.6)
NARROW_BY_LONG = 0.75
MARGIN = 1.1  # ratio of the photo's size to the part that must show the head
DARK_SKIN, LIGHT_SKIN = 110, 180  # grey values between skin tones
NOISE = 1.5  # standard deviation, of 0..255


@dataclass(frozen=True, eq=False)
class Photo:
    """rgb: uint8 [H, W, 3]; box: of the head with its hair, left, top, right, bottom; camera: the true one, in dm of
    the head's frame."""

    rgb: np.ndarray
    box: np.ndarray
    camera: Camera


@dataclass(frozen=True, eq=False)
class TrueHead:
    """Images of a head, and points of its surface."""

    name: str
    pictures: HeadImages
    true: TruePoints
    traits: Mapping[str, str] = field(default_factory=dict)  # known traits: hair, skin, glasses

    def front(self) -> int | None:
        """Returns the first image from less than 45 degrees to the side; None if there is none."""
        shown = [k for k in range(len(self.pictures.rgb)) if _is_whole(self.pictures, k)]
        return next((k for k in shown if _is_from(self.pictures, k, -MAX_YAW_DEG, MAX_YAW_DEG)), None)

    def front_and_sides(self) -> tuple[int, int, int] | None:
        """Returns the first images from the front, the left and the right; None if one is missing."""
        near, far = SIDE_YAW_DEG
        spans = ((-FRONT_YAW_DEG, FRONT_YAW_DEG), (near, far), (-far, -near))
        shown = [k for k in range(len(self.pictures.rgb)) if _is_whole(self.pictures, k)]
        found = [next((k for k in shown if _is_from(self.pictures, k, *span)), None) for span in spans]
        return None if None in found else tuple(found)

    def all_around(self, count: int) -> tuple[int, ...] | None:
        """Returns the first `count` images from anywhere; None if there are fewer."""
        shown = [k for k in range(len(self.pictures.rgb)) if _is_whole(self.pictures, k)]
        return tuple(shown[:count]) if len(shown) >= count else None

    def seen_by(self, cameras: Sequence[Camera]) -> np.ndarray | None:
        """Returns which of the true points, [N], these cameras see; None if the whole surface is unknown."""
        true = self.true
        if true.mesh is None or true.normals is None:
            return None
        centres = np.array([camera.centre for camera in cameras])
        return seen_from(true.mesh.points / MM_PER_DM, true.mesh.faces, true.points / MM_PER_DM, true.normals, centres)


class PhotoBackgrounds:
    """Photographs without people, cropped to any size."""

    def __init__(self, folder: Path) -> None:
        self.paths = sorted(p for p in folder.rglob("*") if p.suffix in (".jpg", ".png"))
        if not self.paths:
            raise FileNotFoundError(f"{folder} holds no photos: run `python -m export.photos backgrounds` first")

    def cut(self, rng: np.random.Generator, width: int, height: int) -> np.ndarray:
        """Returns a random part of a random photo, RGB uint8 [height, width, 3]."""
        image = cv2.imread(str(self.paths[rng.integers(len(self.paths))]))[..., ::-1]
        scale = max(width / image.shape[1], height / image.shape[0]) * rng.uniform(1, 1.4)
        image = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA if scale < 1 else 1)
        x = int(rng.integers(max(image.shape[1] - width, 0) + 1))
        y = int(rng.integers(max(image.shape[0] - height, 0) + 1))
        return cv2.resize(image[y : y + height, x : x + width], (width, height))


def yaw_pitch_deg(rotation: np.ndarray) -> tuple[float, float]:
    """Returns the direction from which a camera sees the head: 0, 0 is the front, positive is the person's left and
    above."""
    away = -rotation[2]
    return float(np.degrees(np.arctan2(away[0], -away[1]))), float(np.degrees(np.arcsin(np.clip(away[2], -1, 1))))


def _is_from(pictures: HeadImages, k: int, low: float, high: float) -> bool:
    yaw, pitch = yaw_pitch_deg(pictures.rotation[k])
    return low <= yaw <= high and abs(pitch) < MAX_PITCH_DEG


def _is_whole(pictures: HeadImages, k: int) -> bool:
    """Returns whether the image shows the head without truncation at its border, except at the neck."""
    mask = pictures.masks[k] == HEAD
    return bool(mask.any() and not mask[0].any() and not mask[:, 0].any() and not mask[:, -1].any())


def camera_of(pictures: HeadImages, k: int) -> Camera:
    focal, cx, cy = pictures.intrinsics[k]
    rotation, shift = pictures.rotation[k], pictures.shift[k]
    side = pictures.rgb.shape[1]
    return Camera(side, side, focal, focal, cx, cy, rotation, -rotation.T @ shift)


def photo_of(pictures: HeadImages, k: int, backgrounds: PhotoBackgrounds, rng: np.random.Generator) -> Photo:
    """Returns image k as a camera takes it. The bust continues beyond the border of the stored image."""
    camera, mask = camera_of(pictures, k), pictures.masks[k] == HEAD
    y, x = np.nonzero(mask)
    box = np.array([x.min(), y.min(), x.max() + 1, y.max() + 1], np.float64)
    # Half of the photo reaches from the principal point over the head's box.
    reach = MARGIN * np.abs(box.reshape(2, 2) - 0.5 - [camera.cx_px, camera.cy_px]).max(0)
    long = camera.fx_px / np.exp(rng.uniform(*np.log(FOCAL_OF_LONG_SIDE)))
    width = 2 * int(np.ceil(max(NARROW_BY_LONG * long / 2, reach[0])))
    height = 2 * int(np.ceil(max(long / 2, reach[1])))
    # The image moves by less than half a pixel, so that it is not resampled; the camera includes this shift.
    left = round(camera.cx_px - (width - 1) / 2)
    top = round(camera.cy_px - (height - 1) / 2)
    side = pictures.rgb.shape[1]
    columns, from_y = np.arange(left, left + width).clip(0, side - 1), np.arange(top, top + height)
    rows = from_y.clip(0, side - 1)
    alpha = (pictures.masks[k] > 0)[rows[:, None], columns] & (from_y >= 0)[:, None]
    rgb = np.where(
        alpha[..., None], pictures.rgb[k][rows[:, None], columns], backgrounds.cut(rng, width, height)
    ).astype(np.float64)
    rgb += rng.normal(0, NOISE, rgb.shape)
    return Photo(
        np.clip(rgb, 0, 255).round().astype(np.uint8),
        box - [left, top, left, top],
        camera.reframed(left, top, width, height),
    )


def generator(name: str, k: int) -> np.random.Generator:
    """Returns the random generator of a photo; it depends on the head's name and the image's number alone."""
    return np.random.default_rng([zlib.crc32(f"heads-report/{name}".encode()), k])


def read_made_heads(
    data: Path, count: int | None = None, maker: HeadMaker | None = None, split: str = "test"
) -> list[TrueHead]:
    """Reads synthetic heads: images in data/views, points in data/points. With the generator they are made again: then
    points that cannot be seen from outside are left out, and surface and traits are known."""
    heads = []
    for path in sorted((data / "views" / split).glob("head-*[0-9].npz"))[:count]:
        with np.load(data / "points" / split / path.name) as stored:
            points, normals, template = (stored[name] for name in ("surface", "normal", "template"))
        own, mesh, traits = cut_distance(points) < 0, None, {}
        if maker:
            number = int(path.stem.rpartition("-")[2])
            head = make_head(maker, split, number)
            own &= seen_from_outside(head.positions, head.faces, points, normals)
            mesh = Triangles(head.positions.astype(np.float64) * MM_PER_DM, head.faces.astype(np.int64))
            traits = traits_of(head, number)
        true = TruePoints(
            points[own].astype(np.float64) * MM_PER_DM, is_face(template[own]), normals[own].astype(np.float64),
            is_inner_face(template[own]), mesh,
        )  # fmt: skip
        heads.append(TrueHead(path.stem, read_pictures(path), true, traits))
    if not heads:
        raise FileNotFoundError(
            f"{data / 'views' / split} holds no images: run `python -m export.heads.view_shards {split}` and "
            f"`python -m export.heads.points {split}` first"
        )
    return heads


def traits_of(head: Head, number: int) -> dict[str, str]:
    """Returns the traits by which reports group synthetic heads; number: of its file, which decides its glasses."""
    light = float(head.tone @ [0.299, 0.587, 0.114])
    extras = sample_extras(np.random.default_rng([zlib.crc32(b"views"), number]))
    return {
        "hair": head.style.name,
        "skin": "dark" if light < DARK_SKIN else "light" if light > LIGHT_SKIN else "medium",
        "glasses": "dark glasses" if extras.lens > 0.4 else "glasses" if extras.lens else "no glasses",
        "beard": "beard" if head.style.beard.max() > 0 else "no beard",
    }


def read_other_heads(data: Path, count: int | None = None) -> list[TrueHead]:
    """Reads heads of another source in data/other (`benchmarks.heads.other_heads`); none if they were not fetched."""
    heads = []
    for path in sorted((data / "other").glob("*.npz"))[:count]:
        with np.load(path) as stored:
            true = TruePoints(stored["surface"].astype(np.float64) * MM_PER_DM, stored["face"])
        heads.append(TrueHead(path.stem, read_pictures(path), true))
    return heads
