"""Crops of synthetic heads in front of photographs: calibration and validation data of the encoder's int8 graph."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch

from export.heads.encoder import CELL_PX, CELLS, CROP_PX
from export.heads.head_shards import (
    FACE_SIDES,
    LABEL_STEP,
    POINT_SCALE,
    HeadImages,
    head_paths,
    is_face,
    read_pictures,
)
from export.people.imaging import camera_faults

MAX_BILINEAR_ZOOM = 1.25
FACE_FRACTION = 0.5  # of the training crops
MIN_FACE_FRACTION, STRAY_FRACTION = 0.01, 0.01
VIEWS = 6  # of a held-out head


@dataclass(frozen=True)
class Crop:
    """image uint8 RGB [192, 192, 3]; template float32 [48, 48, 3] dm; matte float32 [48, 48]; normal
    [48, 48, 3]."""

    image: np.ndarray
    template: np.ndarray
    matte: np.ndarray
    normal: np.ndarray


class Backgrounds:
    """Photographs without people, small, in memory."""

    def __init__(self, folder: Path, limit: int = 200) -> None:
        paths = sorted(p for p in folder.rglob("*") if p.suffix in (".jpg", ".png"))[:limit]
        if not paths:
            raise FileNotFoundError(f"{folder} holds no photos: run `python -m export.photos backgrounds` first")
        self.images = []
        for path in paths:
            image = cv2.imread(str(path))
            scale = 480 / min(image.shape[:2])
            self.images.append(cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)[..., ::-1])

    def crop(self, rng: np.random.Generator, side: int) -> np.ndarray:
        """A random square of a random photo, RGB uint8 [side, side, 3]."""
        image = self.images[rng.integers(len(self.images))]
        size = int(rng.uniform(60, min(image.shape[:2])))
        y, x = rng.integers(image.shape[0] - size + 1), rng.integers(image.shape[1] - size + 1)
        out = cv2.resize(image[y : y + size, x : x + size], (side, side), interpolation=cv2.INTER_LINEAR)
        return out[:, ::-1] if rng.random() < 0.5 else out


@dataclass(frozen=True)
class Placing:
    """A crop's place in an image: linear [2, 2] and the whole map [2, 3] from pixels of the crop to pixels of the
    image, and whether it is mirrored."""

    linear: np.ndarray
    to_picture: np.ndarray
    mirrored: bool

    @property
    def zoom(self) -> float:
        """Pixels of the image by one of the crop."""
        return float(np.linalg.norm(self.linear[:, 0]))

    def cut(self, picture: np.ndarray, border: int = cv2.BORDER_CONSTANT, value: tuple = ()) -> np.ndarray:
        """float32 [192, 192, C] of an image [H, W, C]: bilinear, of pixels averaged before where it shrinks. border,
        value: what is beyond the image, as of cv2.warpAffine."""
        to_picture = self.to_picture
        if self.zoom > MAX_BILINEAR_ZOOM:
            height, width = picture.shape[:2]
            size = round(width / self.zoom), round(height / self.zoom)
            picture = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
            scale = np.array([size[0] / width, size[1] / height])
            to_picture = to_picture.copy()
            to_picture[:, 2] += 0.5
            to_picture *= scale[:, None]
            to_picture[:, 2] -= 0.5
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        size = (CROP_PX, CROP_PX)
        cut = cv2.warpAffine(picture, to_picture, size, flags=flags, borderMode=border, borderValue=value)
        return cut.astype(np.float32)


def placing(rng: np.random.Generator, augment: bool, side: int, face: np.ndarray | None = None) -> Placing:
    """A crop of a square image with sides of `side` pixels: of the whole head, or of the face, whose box (left, top,
    right, bottom) is given."""
    u = rng.uniform
    if face is None:
        size, middle = side * (u(0.72, 1.12) if augment else 0.92), np.full(2, (side - 1) / 2)
    else:
        size = FACE_SIDES * (face[2:] - face[:2]).max() * (u(0.85, 1.3) if augment else 1.0)
        middle = face.reshape(2, 2).mean(0)
    turn = np.radians(rng.normal(0, 12)) if augment else 0.0
    shift = rng.normal(0, 0.05 * size, 2) if augment else np.zeros(2)
    mirror = augment and u() < 0.5
    zoom = size / CROP_PX
    cos, sin = zoom * np.cos(turn), zoom * np.sin(turn)
    linear = np.array([[cos, -sin], [sin, cos]])
    if mirror:
        linear = linear @ np.diag([-1.0, 1.0])
    offset = middle + shift - linear @ np.full(2, (CROP_PX - 1) / 2)
    return Placing(linear, np.concatenate([linear, offset[:, None]], 1), mirror)


def face_box(template: np.ndarray, known: np.ndarray) -> np.ndarray | None:
    """Around the pixels of a map [H, W, 3] of template points (dm) that show the face, without strays: left, top,
    right, bottom (px); None where they are fewer than `MIN_FACE_FRACTION` of all. known: bool [H, W]."""
    y, x = np.nonzero(known & is_face(template))
    if len(x) < MIN_FACE_FRACTION * known.size:
        return None
    at = np.sort(np.stack([x, y], 1), 0)
    strays = int(STRAY_FRACTION * len(at))
    return np.concatenate([at[strays], at[-1 - strays] + 1]).astype(float)


def face_box_of(pictures: HeadImages, k: int) -> np.ndarray | None:
    """`face_box` of image k, in its pixels."""
    step = 2
    template = pictures.template[k][::step, ::step] / np.float32(POINT_SCALE)
    masks = pictures.masks[k][:: LABEL_STEP * step, :: LABEL_STEP * step]
    box = face_box(template, masks == 255)
    return None if box is None else box * (LABEL_STEP * step) - 0.5


def crop_of(
    pictures: HeadImages,
    k: int,
    backgrounds: Backgrounds,
    rng: np.random.Generator,
    augment: bool = True,
    of_face: bool = False,
) -> Crop:
    """A training crop of image k, of the whole head or, where it is seen, the face: other place, size and turn,
    mirrored half of the time, occluded now and then."""
    place = placing(rng, augment, pictures.rgb.shape[1], face_box_of(pictures, k) if of_face else None)
    masks = pictures.masks[k]
    planes = place.cut(np.dstack([pictures.rgb[k], (masks > 200) * np.uint8(255)]))
    alpha = place.cut((masks > 0) * np.uint8(255))[..., None] / 255
    matte = planes[..., 3] / 255
    image = planes[..., :3] + (1 - alpha) * backgrounds.crop(rng, CROP_PX)
    if augment and rng.random() < 0.3:
        image, part = occluded(image, backgrounds, rng)
        matte = matte * (1 - part)
    # Labels are picked at the middle of each cell, never mixed.
    j = CELL_PX * np.arange(CELLS) + (CELL_PX - 1) / 2
    x, y = np.meshgrid(j, j)
    source = np.stack([x, y], -1) @ place.linear.T + place.to_picture[:, 2]
    at = np.round(source / LABEL_STEP).astype(int)
    limit = pictures.template.shape[1] - 1
    inside = ((at >= 0) & (at <= limit)).all(-1)
    at = np.clip(at, 0, limit)
    template = pictures.template[k][at[..., 1], at[..., 0]].astype(np.float32) / POINT_SCALE
    normal = pictures.normal[k][at[..., 1], at[..., 0]].astype(np.float32) / 127
    known = (pictures.normal[k][at[..., 1], at[..., 0]] != 0).any(-1) & inside
    cells = matte.reshape(CELLS, CELL_PX, CELLS, CELL_PX).mean((1, 3)) * known
    normal[..., :2] = normal[..., :2] @ (place.linear / place.zoom)  # the crop's axes are turned against the image's
    if place.mirrored:
        template[..., 0] *= -1
    if augment:
        image = as_cameras_see(image, rng)
    return Crop(np.clip(image, 0, 255).astype(np.uint8), template, cells, normal)


def occluded(image: np.ndarray, backgrounds: Backgrounds, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Something before the head: an ellipse or a bar that shows another photo; and how much of each pixel it covers."""
    cover = np.zeros(image.shape[:2], np.uint8)
    middle = tuple(int(v) for v in rng.uniform(0.1, 0.9, 2) * CROP_PX)
    axes = tuple(int(v) for v in rng.uniform(0.05, 0.25, 2) * CROP_PX)
    if rng.random() < 0.6:
        cv2.ellipse(cover, middle, axes, rng.uniform(0, 180), 0, 360, 255, -1)
    else:
        end = tuple(int(v) for v in rng.uniform(-0.2, 1.2, 2) * CROP_PX)
        cv2.line(cover, middle, end, 255, int(rng.uniform(0.03, 0.15) * CROP_PX))
    part = cv2.GaussianBlur(cover, (0, 0), 0.8).astype(np.float32)[..., None] / 255
    texture = backgrounds.crop(rng, CROP_PX) if rng.random() < 0.6 else rng.uniform(0, 255, 3)
    return image * (1 - part) + part * texture, part[..., 0]


def as_cameras_see(image: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Colours, low resolution and what else cameras do; RGB in and out."""
    image = image * np.exp(rng.normal(0, 0.1, 3)).astype(np.float32)
    if rng.random() < 0.4:
        small = int(np.exp(rng.uniform(np.log(40), np.log(CROP_PX))))
        image = cv2.resize(image, (small, small), interpolation=cv2.INTER_AREA)
        image = cv2.resize(image, (CROP_PX, CROP_PX), interpolation=cv2.INTER_LINEAR)
    return camera_faults(rng, np.clip(image, 0, 255)[..., ::-1])[..., ::-1]


def read_heads(folder: Path, split: str, limit: int | None = None) -> list[HeadImages]:
    paths = head_paths(folder, split)[:limit]
    if not paths:
        raise FileNotFoundError(f"{folder / split} holds no pictures: run `python -m export.heads.view_shards {split}`")
    return [read_pictures(path) for path in paths]


def held_out_crops(folder: Path, backgrounds: Backgrounds) -> list[Crop]:
    """The same crops of validation heads each time, VIEWS a head, with and without camera artefacts."""
    rng = np.random.default_rng(1)
    heads = read_heads(folder, "val")
    return [crop_of(p, k, backgrounds, rng, augment=k % 2 == 1) for p in heads for k in range(VIEWS)]


def held_out_face_crops(folder: Path, backgrounds: Backgrounds) -> list[Crop]:
    """The same crops of the faces of validation heads each time, without augmentation."""
    rng = np.random.default_rng(1)
    return [
        crop_of(p, k, backgrounds, rng, augment=False, of_face=True)
        for p in read_heads(folder, "val")
        for k in range(VIEWS)
        if face_box_of(p, k) is not None
    ]


def batched(crops: list[Crop]) -> tuple[torch.Tensor, ...]:
    columns = zip(*((c.image.astype(np.float32), c.template, c.matte, c.normal) for c in crops), strict=True)
    return tuple(torch.from_numpy(np.stack(column)) for column in columns)
