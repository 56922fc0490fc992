"""Labelled images out of training shards (docs/formats.md)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

POINTS_PER_PERSON = 196


class ShardError(RuntimeError):
    """A shard is missing, or is not what docs/formats.md says."""


@dataclass(frozen=True)
class LabelledImage:
    """One image with its truth.

    name: shard and position, the same in every run. image: uint8 [H, W, 3] RGB. label: uint8 [H, W, 4]
    holding I, U*255, V*255, instance. point: float32 [H, W, 3], surface point on the template body in
    metres, or None. box: float32 [n, 4] x0, y0, x1, y1. instance: uint8 [n], the box's number in label.
    ignore: bool [n].
    """

    name: str
    image: np.ndarray
    label: np.ndarray
    point: np.ndarray | None
    box: np.ndarray
    instance: np.ndarray
    ignore: np.ndarray


def shard_paths(folder: Path) -> list[Path]:
    paths = sorted(folder.glob("shard-*.npz"))
    if not paths:
        raise ShardError(
            f"{folder} has no shard-*.npz. Make some: python -m export.people.dataset --split {folder.name}"
        )
    return paths


def count_images(paths: list[Path]) -> int:
    total = 0
    for path in paths:
        with np.load(path) as shard:
            total += len(shard["image_end"])
    return total


def read_images(paths: list[Path], limit: int | None = None) -> Iterator[LabelledImage]:
    """The images of the shards in order, at most `limit` of them. Raises ShardError for other files."""
    given = 0
    for path in paths:
        shard = _read_shard(path)
        for k in range(len(shard["image_end"])):
            if given == limit:
                return
            yield _labelled_image(f"{path.stem}/{k:04d}", shard, k)
            given += 1


def read_image(folder: Path, name: str) -> LabelledImage:
    """The image that `read_images` calls `name`. Raises ShardError when the folder has no such image."""
    stem, _, number = name.partition("/")
    path = folder / f"{stem}.npz"
    shard = _read_shard(path) if path.exists() else {"image_end": ()}
    if not number.isdigit() or int(number) >= len(shard["image_end"]):
        raise ShardError(f"{folder} has no image {name}: were the figures made from another folder?")
    return _labelled_image(name, shard, int(number))


def _read_shard(path: Path) -> dict[str, np.ndarray]:
    with np.load(path) as file:
        missing = {"image", "image_end", "label", "label_end", "box", "box_image"} - set(file.files)
        if missing:
            raise ShardError(f"{path} lacks {', '.join(sorted(missing))}: it is not a shard of this project.")
        return {name: file[name] for name in file.files}


def _labelled_image(name: str, shard: dict[str, np.ndarray], k: int) -> LabelledImage:
    point = None
    if "point" in shard:
        low, high = shard["point_range"]
        point = (low + _decode(shard, "point", k, name) / np.float32(65535) * (high - low)).astype(np.float32)
    own = shard["box_image"] == k
    return LabelledImage(
        name=name,
        image=_decode(shard, "image", k, name)[..., ::-1].copy(),
        label=_decode(shard, "label", k, name),
        point=point,
        box=shard["box"][own],
        instance=shard["box_instance"][own],
        ignore=shard["box_ignore"][own],
    )


def _decode(shard: dict[str, np.ndarray], key: str, k: int, name: str) -> np.ndarray:
    ends = shard[key + "_end"]
    data = shard[key][ends[k - 1] if k else 0 : ends[k]]
    image = cv2.imdecode(data, cv2.IMREAD_UNCHANGED)
    if image is None:
        raise ShardError(f"{name}: its {key} cannot be decoded.")
    return image


def sample_pixels(image: LabelledImage, number: int, count: int = POINTS_PER_PERSON) -> np.ndarray:
    """Positions (y, x), int64 [K, 2], of up to `count` visible pixels of one person, always the same ones.

    They stand for the about 100 annotated points a person of DensePose-COCO; 196 is the most there are in it.
    """
    pixels = np.argwhere(image.label[..., 3] == number)
    if len(pixels) <= count:
        return pixels
    seed = [*image.name.encode(), number]
    return pixels[np.sort(np.random.default_rng(seed).choice(len(pixels), count, replace=False))]
