"""The training shard (docs/reference/formats.md): many labelled images in one .npz file.

Written by `export.people.dataset` (rendered people) and `export.teachers.shards` (photographs), read by training,
calibration and evaluation. A label is uint8 [H, W, 4] = (I, U * 255, V * 255, instance); labels of photographs may know
less than the part and use the values of I and the instance numbers below. Reading shards needs no renderer.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from tqdm import tqdm

from export.surface import (
    COARSE_COUNT,
    MIRROR_COARSE,
    MIRROR_FLIPS_U,
    MIRROR_FLIPS_V,
    MIRROR_PART,
    PART_COUNT,
    PART_TO_COARSE,
)

# Values of I beside 0..24, of photographs alone; U and V are 0:
REGION = 100  # REGION + k: a person, coarse class k (1..14), front and back not told apart
PART_ALONE = 150  # PART_ALONE + k: part k (1..24), U and V unknown
UNSURE = 254  # a person or not
PERSON = 255  # a person, somewhere on the body
# Which of the 25 classes (0 background) each value of I leaves possible: bool [256, 25].
POSSIBLE_PARTS = np.zeros((256, 25), bool)
POSSIBLE_PARTS[np.arange(25), np.arange(25)] = True
POSSIBLE_PARTS[REGION + 1 : REGION + 1 + COARSE_COUNT] = np.arange(1, COARSE_COUNT + 1)[:, None] == PART_TO_COARSE
POSSIBLE_PARTS[PART_ALONE + np.arange(1, PART_COUNT + 1), np.arange(1, PART_COUNT + 1)] = True
POSSIBLE_PARTS[PERSON, 1:] = True
POSSIBLE_PARTS[UNSURE] = True

# Instance numbers of photographs: from BOX_ALONE on people of whom only the box is known, from UNCERTAIN on regions in
# which there may be people or not ("ignore").
BOX_ALONE, UNCERTAIN = 128, 192

MIN_PIXELS, MIN_SIDE_PX = 64, 12  # smaller people are marked "ignore"
POINT_RANGE = np.array([[-1.0, -1.0, -0.1], [1.0, 1.0, 2.1]], np.float32)  # of stored surface points, metres

_MIRROR_VALUE = np.arange(256, dtype=np.uint8)
_MIRROR_VALUE[:25] = MIRROR_PART
_MIRROR_VALUE[REGION : REGION + COARSE_COUNT + 1] = REGION + MIRROR_COARSE
_MIRROR_VALUE[PART_ALONE : PART_ALONE + PART_COUNT + 1] = PART_ALONE + MIRROR_PART


class ShardError(ValueError):
    """A shard is missing, or is not what docs/reference/formats.md says."""


def mirror_iuv(iuv: np.ndarray) -> np.ndarray:
    """Labels of the mirrored image, before the pixels themselves are mirrored.

    iuv: uint8 [..., 3] holding I, U*255, V*255. Returns a new array of the same shape.
    """
    part = np.where(iuv[..., 0] <= PART_COUNT, iuv[..., 0], 0)
    out = np.empty_like(iuv)
    out[..., 0] = _MIRROR_VALUE[iuv[..., 0]]
    out[..., 1] = np.where(MIRROR_FLIPS_U[part], 255 - iuv[..., 1], iuv[..., 1])
    out[..., 2] = np.where(MIRROR_FLIPS_V[part], 255 - iuv[..., 2], iuv[..., 2])
    return out


def visible_boxes(label: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Boxes around each instance's visible pixels.

    label: uint8 [H, W, 4]. Returns box float32 [n, 4] (right, bottom exclusive), instance uint8 [n], ignore bool [n].
    """
    plane = np.ascontiguousarray(label[..., 3])
    count = np.bincount(plane.reshape(-1), minlength=256)
    instance = np.flatnonzero(count[1:]) + 1
    box, ignore = np.zeros((len(instance), 4), np.float32), np.zeros(len(instance), bool)
    for k, number in enumerate(instance):
        own = plane == number
        y, x = np.flatnonzero(own.any(1)), np.flatnonzero(own.any(0))
        box[k] = x[0], y[0], x[-1] + 1, y[-1] + 1
        small = count[number] < MIN_PIXELS or max(x[-1] - x[0], y[-1] - y[0]) + 1 < MIN_SIDE_PX
        ignore[k] = small or number >= UNCERTAIN
    return box, instance.astype(np.uint8), ignore


class ShardWriter:
    """Collects images and writes them as one shard. boxes: whether it also stores the visible boxes."""

    def __init__(self, boxes: bool) -> None:
        self._files: dict[str, list[bytes]] = {"image": [], "label": [], "point": []}
        self._boxes: list[tuple[np.ndarray, ...]] | None = [] if boxes else None
        self._keypoints: list[tuple[np.ndarray, ...]] = []

    def add(
        self, image: np.ndarray, label: np.ndarray, jpeg_quality: int,
        point: np.ndarray | None = None, axis: np.ndarray | None = None, keypoint: np.ndarray | None = None,
    ) -> None:  # fmt: skip
        """image: uint8 [H, W, 3] BGR; label: uint8 [H, W, 4]; point: float [H, W, 3] of people's pixels, metres.

        axis: float [people, 2], the body axis of instance k in row k - 1 (`LabelledImage.axis`).
        keypoint: float [people, 33, 3], the same of `Record.keypoint`.
        """
        if keypoint is not None:
            known = np.flatnonzero(np.isfinite(keypoint).all((1, 2)))
            image_number = np.full(len(known), len(self._files["image"]), np.int32)
            self._keypoints.append((keypoint[known].astype(np.float32), image_number, (known + 1).astype(np.uint8)))
        self._files["image"].append(_encoded(".jpg", image, cv2.IMWRITE_JPEG_QUALITY, jpeg_quality))
        self._files["label"].append(_encoded(".png", label, cv2.IMWRITE_PNG_COMPRESSION, 3))
        if point is not None:
            low, high = POINT_RANGE
            scaled = np.where(label[..., 3:] > 0, np.clip((point - low) / (high - low), 0, 1) * 65535, 0)
            self._files["point"].append(_encoded(".png", scaled.astype(np.uint16), cv2.IMWRITE_PNG_COMPRESSION, 3))
        if self._boxes is not None:
            box, instance, ignore = visible_boxes(label)
            image_number = np.full(len(box), len(self._boxes), np.int32)
            own = np.full((len(box), 2), np.nan) if axis is None else axis[instance.astype(int) - 1]
            self._boxes.append((box, image_number, instance, ignore, own.astype(np.float32)))

    def write(self, path: Path, meta: dict[str, object]) -> None:
        """Writes the file atomically (temporary name, then rename)."""
        arrays = {}
        if self._boxes is not None:
            columns = map(np.concatenate, zip(*self._boxes, strict=True))
            arrays |= dict(zip(_BOX_COLUMNS, columns, strict=True))
        if self._keypoints:
            columns = map(np.concatenate, zip(*self._keypoints, strict=True))
            arrays |= dict(zip(_KEYPOINT_COLUMNS, columns, strict=True))
        arrays["meta"] = np.array(json.dumps(meta))
        for name, files in self._files.items():
            if files:
                arrays[name] = np.frombuffer(b"".join(files), np.uint8)
                arrays[f"{name}_end"] = np.cumsum([len(file) for file in files], dtype=np.int64)
        if "point" in arrays:
            arrays["point_range"] = POINT_RANGE
        temporary = path.with_suffix(".partial.npz")
        np.savez(temporary, **arrays)
        temporary.replace(path)


def _encoded(extension: str, image: np.ndarray, *options: int) -> bytes:
    ok, data = cv2.imencode(extension, image, list(options))
    if not ok:
        raise RuntimeError(f"encoding as {extension} failed")
    return data.tobytes()


def shard_paths(folder: Path) -> list[Path]:
    """The shards of a folder in order. Raises ShardError where there are none."""
    paths = sorted(folder.glob("shard-?????.npz"))
    if not paths:
        raise ShardError(
            f"{folder} has no shard-*.npz. Make some: python -m export.people.dataset --split {folder.name}"
        )
    return paths


@dataclass(frozen=True)
class Record:
    """One image with its label, both still encoded (40 kB, at 640 x 512 140 kB), so that a whole set stays in memory.

    By instance number - 1, None where nobody knows any: axis: float32 [people, 2] (`LabelledImage.axis`); keypoint:
    float32 [people, 33, 3] (`export.keypoints`), x and y in pixels and the probability that the image shows it; NaN for
    people of whom nobody knows them.
    """

    image: bytes
    label: bytes
    axis: np.ndarray | None = None
    keypoint: np.ndarray | None = None

    def decoded(self) -> tuple[np.ndarray, np.ndarray]:
        """BGR uint8 [H, W, 3] and label uint8 [H, W, 4]."""
        image = cv2.imdecode(np.frombuffer(self.image, np.uint8), cv2.IMREAD_COLOR)
        label = cv2.imdecode(np.frombuffer(self.label, np.uint8), cv2.IMREAD_UNCHANGED)
        if image is None or label is None or image.shape[:2] != label.shape[:2]:
            raise ShardError("a shard holds a damaged picture or label; render it again (export.people.dataset)")
        return image, label


def load_records(folder: Path, limit: int | None = None) -> list[Record]:
    """All images of a split, or the first `limit`. Raises ShardError."""
    records: list[Record] = []
    for path in tqdm(shard_paths(folder), desc=f"reading {folder.name}", unit="shard", leave=False):
        shard = _read(path, "image", "label", optional=(*_BOX_COLUMNS, *_KEYPOINT_COLUMNS))
        for k in range(len(shard["image_end"])):
            axis = _by_instance(shard, k, "box_axis", "box") if "box_axis" in shard else None
            keypoint = _by_instance(shard, k, "keypoint", "keypoint") if "keypoint" in shard else None
            image, label = (_file(shard, kind, k).tobytes() for kind in ("image", "label"))
            records.append(Record(image, label, axis, keypoint))
        if limit and len(records) >= limit:
            return records[:limit]
    return records


def _by_instance(shard: dict[str, np.ndarray], k: int, column: str, kind: str) -> np.ndarray:
    """Rows of a column that belong to image k, by instance number - 1; NaN for others. kind: "box" or "keypoint"."""
    own = shard[f"{kind}_image"] == k
    number, values = shard[f"{kind}_instance"][own].astype(int), shard[column][own]
    out = np.full((number.max(initial=0), *values.shape[1:]), np.nan, np.float32)
    out[number - 1] = values
    return out


@dataclass(frozen=True)
class LabelledImage:
    """One image with its truth.

    name: shard and position, the same in every run. image: uint8 [H, W, 3] RGB. label: uint8 [H, W, 4]
    holding I, U*255, V*255, instance. point: float32 [H, W, 3], surface point on the template body in
    metres, or None. box: float32 [n, 4] x0, y0, x1, y1. instance: uint8 [n], the box's number in label.
    ignore: bool [n]. axis: float32 [n, 2], the direction in the image (x to the right, y down) from the middle of the
    hips to the top of the head; its length is 1 where the body lies in the image's plane and 0 where it is seen along
    the axis. NaN where nobody knows, None where nobody knows any.
    """

    name: str
    image: np.ndarray
    label: np.ndarray
    point: np.ndarray | None
    box: np.ndarray
    instance: np.ndarray
    ignore: np.ndarray
    axis: np.ndarray | None = None


def count_images(paths: list[Path]) -> int:
    total = 0
    for path in paths:
        with np.load(path) as shard:
            total += len(shard["image_end"])
    return total


def read_images(paths: list[Path], limit: int | None = None, first: int = 0) -> Iterator[LabelledImage]:
    """The images of the shards in order from number `first` on, at most `limit` of them. Raises ShardError for other
    files."""
    number = 0
    for path in paths:
        shard = _read(path, *_WITH_TRUTH)
        for k in range(len(shard["image_end"])):
            if limit is not None and number >= first + limit:
                return
            if number >= first:
                yield _labelled_image(f"{path.stem}/{k:04d}", shard, k)
            number += 1


def read_image(folder: Path, name: str) -> LabelledImage:
    """The image that `read_images` calls `name`. Raises ShardError when the folder has no such image."""
    stem, _, number = name.partition("/")
    path = folder / f"{stem}.npz"
    shard = _read(path, *_WITH_TRUTH) if path.exists() else {"image_end": ()}
    if not number.isdigit() or int(number) >= len(shard["image_end"]):
        raise ShardError(f"{folder} has no image {name}: were the figures made from another folder?")
    return _labelled_image(name, shard, int(number))


_ENCODED = ("image", "label", "point")
_BOX_COLUMNS = ("box", "box_image", "box_instance", "box_ignore", "box_axis")
_KEYPOINT_COLUMNS = ("keypoint", "keypoint_image", "keypoint_instance")
_WITH_TRUTH = ("image", "label", "point", "point_range", *_BOX_COLUMNS)
_OPTIONAL = {"point", "point_end", "point_range", "box_axis"}


def _read(path: Path, *keys: str, optional: tuple[str, ...] = ()) -> dict[str, np.ndarray]:
    """Arrays of a shard by name. Raises ShardError where one that every shard must have is missing."""
    wanted = {*keys, *(f"{key}_end" for key in keys if key in _ENCODED)}
    with np.load(path) as file:
        missing = wanted - set(file.files) - _OPTIONAL
        if missing:
            raise ShardError(f"{path} lacks {', '.join(sorted(missing))}: it is not a shard of this project.")
        return {name: file[name] for name in {*wanted, *optional} & set(file.files)}


def _file(shard: dict[str, np.ndarray], key: str, k: int) -> np.ndarray:
    """The k-th encoded file, uint8 [bytes]."""
    ends = shard[key + "_end"]
    return shard[key][ends[k - 1] if k else 0 : ends[k]]


def _labelled_image(name: str, shard: dict[str, np.ndarray], k: int) -> LabelledImage:
    point = None
    if "point" in shard:
        low, high = shard["point_range"]
        point = (low + _decoded(shard, "point", k, name) / np.float32(65535) * (high - low)).astype(np.float32)
    own = shard["box_image"] == k
    return LabelledImage(
        name=name,
        image=_decoded(shard, "image", k, name)[..., ::-1].copy(),
        label=_decoded(shard, "label", k, name),
        point=point,
        box=shard["box"][own],
        instance=shard["box_instance"][own],
        ignore=shard["box_ignore"][own],
        axis=shard["box_axis"][own] if "box_axis" in shard else None,
    )


def _decoded(shard: dict[str, np.ndarray], key: str, k: int, name: str) -> np.ndarray:
    image = cv2.imdecode(_file(shard, key, k), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise ShardError(f"{name}: its {key} cannot be decoded.")
    return image
