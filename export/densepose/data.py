"""Augmented batches of shards' records (export.shards), drawn in a background thread."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

import cv2
import numpy as np
import torch

from export import keypoints
from export.densepose.person_crop import (
    PersonCrop,
    crop_around,
    cut,
    cut_label,
    outline,
    rotation,
    turn_upright,
    turned_box,
)
from export.densepose.targets import Truth
from export.shards import BOX_ALONE, Record, mirror_iuv, visible_boxes

MEAN = np.array([123.675, 116.28, 103.53], np.float32)  # RGB, 0..255
STD = np.array([58.395, 57.12, 57.375], np.float32)


def normalised(image: np.ndarray) -> np.ndarray:
    """BGR [H, W, 3] -> float32 [3, H, W], RGB, zero mean and unit variance."""
    return ((image[..., ::-1].astype(np.float32) - MEAN) / STD).transpose(2, 0, 1)


@dataclass(frozen=True)
class Cropping:
    """How crops of whole images are drawn: how often towards a person, whose long side then is `person_scale` crop
    sides (log-uniform).

    filled: min fraction of the crop's side that the image's long side fills, so that the crop shows more than margin.
    rolls: (fraction, smallest, largest angle in degrees). This fraction of the photographs, which nobody tilted, is
    turned by such an angle to either side.
    """

    towards_person: float = 0.8
    person_scale: tuple[float, float] = (0.3, 1.3)  # from far away to truncated by the crop
    filled: float = 0.0
    rolls: tuple[tuple[float, float, float], ...] = ()

    def draw(self, record: Record, size: int, rng: np.random.Generator) -> list[tuple[np.ndarray, Truth]]:
        """One crop and its people."""
        image, label, axis, keypoint = augmented(record, size, rng, self)
        return [(image, truth_of(label, axis, keypoint))]

    def draw_roll(self, rng: np.random.Generator) -> float:
        _, low, high = self.rolls[rng.choice(len(self.rolls), p=[fraction for fraction, _, _ in self.rolls])]
        return float(rng.uniform(low, high) * rng.choice([-1, 1]))


@dataclass(frozen=True)
class PersonCropping:
    """How person crops (`export.densepose.person_crop`) are drawn: `count` a record, of different people if there are.

    tilt_degrees: how far from upright, either way, they are turned; box_shake: how far each side of the box is off, in
    fractions of its size; coarse: how often a crop shows no more than `coarse_px` pixels a side (log-uniform). Of a
    record without anybody a square anywhere is drawn, as of a box that is a mistake.
    """

    count: int = 2
    tilt_degrees: float = 20.0
    box_shake: float = 0.2
    coarse: float = 0.35
    coarse_px: tuple[float, float] = (32, 160)

    def draw(self, record: Record, size: int, rng: np.random.Generator) -> list[tuple[np.ndarray, Truth]]:
        """Crops of `size` pixels; each has one person, whose box may reach out of the crop."""
        image, label = record.decoded()
        box, instance, ignore = visible_boxes(label)
        shown = np.flatnonzero(~ignore & (instance < BOX_ALONE))
        drawn = []
        for k in range(self.count):
            if not len(shown):
                drawn.append(self._of_nobody(image, label, size, rng))
                continue
            if k % len(shown) == 0:
                order = rng.permutation(shown)
            person = order[k % len(shown)]
            x0, y0, x1, y1 = box[person].astype(int)
            own = label[y0:y1, x0:x1, 3] == instance[person]
            known = None if record.axis is None else record.axis[instance[person] - 1]
            turn = self._turn(known, rng)
            crop = crop_around(self._shaken(turned_box(outline(own) + [x0, y0], turn), rng), turn, size)
            number = int(instance[person])
            drawn.append(self._crop(image, label, crop, number, rng, _rows_of([number], record.keypoint, _NO_KEYPOINT)))
        return drawn

    def _turn(self, axis: np.ndarray | None, rng: np.random.Generator) -> np.ndarray:
        tilt = rotation(rng.uniform(-self.tilt_degrees, self.tilt_degrees))
        # In photographs, most people of unknown axis stand upright. An axis seen from its end has no direction.
        if axis is None or not np.hypot(*axis) > MIN_AXIS:
            return tilt
        return tilt @ turn_upright(axis)

    def _shaken(self, box: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        size = np.tile(box[2:] - box[:2], 2)
        return box + size * rng.uniform(-self.box_shake, self.box_shake, 4)

    def _of_nobody(
        self, image: np.ndarray, label: np.ndarray, size: int, rng: np.random.Generator
    ) -> tuple[np.ndarray, Truth]:
        side = np.exp(rng.uniform(np.log(24), np.log(min(label.shape[:2]))))
        wide = side * np.array([1, 1]) * rng.uniform(0.4, 1, 2)
        corner = rng.uniform(0, np.array(label.shape[1::-1]) - wide)
        crop = crop_around(np.concatenate([corner, corner + wide]), rotation(0), size)
        return self._crop(image, label, crop, BOX_ALONE - 1, rng, _NO_KEYPOINT[None])

    def _crop(
        self, image: np.ndarray, label: np.ndarray, crop: PersonCrop, number: int, rng: np.random.Generator,
        keypoint: np.ndarray,
    ) -> tuple[np.ndarray, Truth]:  # fmt: skip
        """keypoint: [1, 33, 3] in the image."""
        image, label, box = cut(image, crop, _FILL), cut_label(label, crop), crop.box
        keypoint = keypoints.mapped(keypoint, crop.into)
        if rng.random() < self.coarse:
            side = round(np.exp(rng.uniform(*np.log(self.coarse_px))))
            small = cv2.resize(image, (side, side), interpolation=cv2.INTER_AREA)
            image = cv2.resize(small, image.shape[1::-1], interpolation=cv2.INTER_LINEAR)
        if rng.random() < 0.5:
            image, label = np.ascontiguousarray(image[:, ::-1]), label[:, ::-1].copy()
            label[..., :3] = mirror_iuv(label[..., :3])
            box = np.array([crop.side_px - box[2], box[1], crop.side_px - box[0], box[3]])
            keypoint = keypoints.mirrored(keypoint, crop.side_px)
        truth = Truth(
            torch.from_numpy(box[None].astype(np.float32)), torch.tensor([number], dtype=torch.uint8),
            torch.zeros(1, dtype=torch.bool), torch.from_numpy(label), torch.full((1, 2), torch.nan),
            torch.from_numpy(keypoint.astype(np.float32)),
        )  # fmt: skip
        return recoloured(image, rng), truth


ANY_CROPPING = Cropping()
CLOSE_CROPPING = Cropping(towards_person=0.95, person_scale=(0.6, 1.3))
# At 320 to 448 pixels people from about 32 to 450 pixels; more than half within 15 degrees of upright.
WIDE_CROPPING = Cropping(
    towards_person=0.85, person_scale=(0.085, 1.17), filled=0.9, rolls=((0.6, 0, 15), (0.3, 15, 60), (0.1, 60, 180))
)
# As photographs show people: seldom tiny, most of them upright.
USUAL_CROPPING = Cropping(
    towards_person=0.85, person_scale=(0.16, 1.3), filled=0.9, rolls=((0.76, 0, 12), (0.19, 12, 45), (0.05, 45, 180))
)
PERSON_CROPPING = PersonCropping()
SCALES = (0.06, 2.0)  # of the stored image
MIN_AXIS = 0.15  # length below which the body axis points at the camera (`export.shards.LabelledImage.axis`)
_FILL = tuple(float(v) for v in MEAN[::-1])
_NO_AXIS = np.full(2, np.nan, np.float32)
_NO_KEYPOINT = np.full((keypoints.COUNT, 3), np.nan, np.float32)


def augmented(
    record: Record, size: int, rng: np.random.Generator, cropping: Cropping = ANY_CROPPING
) -> tuple[np.ndarray, np.ndarray, np.ndarray | None, np.ndarray | None]:
    """A random square crop at a random scale, mirrored half of the time, with other colours: BGR, label, axes and
    keypoints by instance number - 1, where they are known.

    Where the crop is drawn towards a person, the scale is chosen by that person's size, so that people of all
    sizes in pixels are seen equally often.
    """
    image, label = record.decoded()
    axis, keypoint, box, instance = record.axis, record.keypoint, *visible_boxes(label)[:2]
    record_shape, focus = np.array(label.shape[:2]), 0
    if len(instance) and rng.random() < cropping.towards_person:
        chosen = rng.integers(len(instance))
        focus, extent = int(instance[chosen]), box[chosen]
        long_side = max(extent[2:] - extent[:2])
        scale = float(np.clip(size / long_side * np.exp(rng.uniform(*np.log(cropping.person_scale))), *SCALES))
    else:
        scale = size / 256 * np.exp(rng.uniform(*np.log((0.6, 1.3))))
    scale = max(scale, cropping.filled * size / max(image.shape[:2]))
    roll = cropping.draw_roll(rng) if cropping.rolls and axis is None else 0.0
    shape = (max(int(image.shape[1] * scale), 8), max(int(image.shape[0] * scale), 8))
    image = cv2.resize(image, shape, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR)
    label = cv2.resize(label, shape, interpolation=cv2.INTER_NEAREST)
    corner = _corner(label, size, focus, rng)
    middle, turn = np.array(corner) + size / 2, rotation(roll)
    into = np.concatenate([turn, (size / 2 - turn @ middle)[:, None]], 1)
    if keypoint is not None:
        stretch = np.array(shape) / record_shape[::-1]
        keypoint = keypoints.mapped(keypoint, into * np.array([*stretch, 1]))
    if roll:
        crop = PersonCrop(into, np.zeros(4), size)
        image, label = cut(image, crop, _FILL), cut_label(label, crop)
    else:
        image, label = _crop(image, corner, size, MEAN[::-1]), _crop(label, corner, size, np.zeros(4))
    if rng.random() < 0.5:
        image = image[:, ::-1]
        label = label[:, ::-1].copy()
        label[..., :3] = mirror_iuv(label[..., :3])
        axis = None if axis is None else axis * np.float32([-1, 1])
        keypoint = None if keypoint is None else keypoints.mirrored(keypoint, size)
    return recoloured(np.ascontiguousarray(image), rng), label, axis, keypoint


def _corner(label: np.ndarray, size: int, focus: int, rng: np.random.Generator) -> tuple[int, int]:
    """Upper left corner (x, y) of the crop, with the middle of person `focus` well inside it (0: anywhere)."""
    y, x = np.nonzero(label[..., 3] == focus) if focus else ((), ())
    corner = []
    for axis, length in enumerate((label.shape[1], label.shape[0])):
        low, high = min(0, length - size), max(0, length - size)
        if len(x):  # a person shrunk to nothing leaves no pixel
            middle = (x, y)[axis].mean()
            low, high = max(low, int(middle - 0.8 * size)), min(high, int(middle - 0.2 * size))
            low = min(low, high)
        corner.append(int(rng.integers(low, high + 1)))
    return corner[0], corner[1]


def _crop(array: np.ndarray, corner: tuple[int, int], size: int, fill: np.ndarray) -> np.ndarray:
    out = np.empty((size, size, array.shape[2]), np.uint8)
    out[:] = fill
    x, y = corner
    part = array[max(y, 0) : y + size, max(x, 0) : x + size]
    out[max(-y, 0) : max(-y, 0) + part.shape[0], max(-x, 0) : max(-x, 0) + part.shape[1]] = part
    return out


def recoloured(image: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """image: uint8 [H, W, 3]; the same with other contrast, brightness and colour balance, some grey or blurred."""
    colour = image.astype(np.float32)
    if rng.random() < 0.8:
        colour = (colour - 128) * rng.uniform(0.7, 1.3) + 128 + rng.normal(0, 15)
        colour *= 1 + rng.normal(0, 0.06, 3).astype(np.float32)
    if rng.random() < 0.08:
        colour[:] = colour.mean(-1, keepdims=True)
    if rng.random() < 0.15:
        colour = cv2.GaussianBlur(colour, (0, 0), rng.uniform(0.3, 1.2))
    return np.clip(colour, 0, 255).astype(np.uint8)


def truth_of(label: np.ndarray, axis: np.ndarray | None = None, keypoint: np.ndarray | None = None) -> Truth:
    """axis [people, 2] and keypoint [people, 33, 3]: by instance number - 1."""
    box, instance, ignore = visible_boxes(label)
    own = (_rows_of(instance, axis, _NO_AXIS), _rows_of(instance, keypoint, _NO_KEYPOINT))
    return Truth(*map(torch.from_numpy, (box, instance, ignore, label, *own)))


def _rows_of(instance: Sequence[int], values: np.ndarray | None, unknown: np.ndarray) -> np.ndarray:
    """Each instance's row of `values`, which has them by number - 1; `unknown` where there is none."""
    rows = [unknown if values is None or n > len(values) else values[n - 1] for n in map(int, instance)]
    return np.stack(rows).astype(np.float32) if rows else np.empty((0, *unknown.shape), np.float32)


class Batches:
    """Endless shuffled batches, `ahead` of them made ahead by `workers` threads (OpenCV releases the interpreter lock).

    Batch k depends on `seed` and k alone, so that a run resumed at step k sees what it would have seen. `photos`
    replace the fraction `photo_fraction` of the records; they are few, and so drawn with replacement.
    """

    def __init__(
        self, records: list[Record], batch: int, seed: int, first: int = 0,
        photos: list[Record] | None = None, photo_fraction: float = 0.0, ahead: int = 4, workers: int = 1,
    ) -> None:  # fmt: skip
        self.records, self.batch, self.seed, self.ahead = records, batch, seed, ahead
        self.photos, self.photo_fraction = photos or [], photo_fraction if photos else 0.0
        self._orders: dict[int, np.ndarray] = {}
        cv2.setNumThreads(1)
        self._number, self._kind = first, None
        self._made: deque[Future] = deque()
        self._worker = ThreadPoolExecutor(workers)

    def make(
        self, number: int, sizes: tuple[int, ...], cropping: Cropping | PersonCropping = ANY_CROPPING
    ) -> tuple[torch.Tensor, list[Truth]]:
        """Batch `number` at an image side of one of `sizes`, pixels."""
        rng = np.random.default_rng([self.seed, number])
        size = int(rng.choice(sizes)) if len(sizes) > 1 else sizes[0]
        images, truths = [], []
        records = -(-self.batch // getattr(cropping, "count", 1))
        for k in range(number * records, (number + 1) * records):
            record = self.records[self._shuffled(k)]
            if rng.random() < self.photo_fraction:
                record = self.photos[rng.integers(len(self.photos))]
            for image, truth in cropping.draw(record, size, rng):
                images.append(normalised(image))
                truths.append(truth)
        return torch.from_numpy(np.stack(images[: self.batch])), truths[: self.batch]

    def next(
        self, sizes: tuple[int, ...], cropping: Cropping | PersonCropping = ANY_CROPPING
    ) -> tuple[torch.Tensor, list[Truth]]:
        """Image [N, 3, size, size] and its people; those made ahead of another kind are discarded."""
        if not self.ahead:
            self._number += 1
            return self.make(self._number - 1, sizes, cropping)
        if self._kind != (sizes, cropping):
            self._drop()
            self._kind = (sizes, cropping)
        while len(self._made) <= self.ahead:
            self._made.append(self._worker.submit(self.make, self._number + len(self._made), sizes, cropping))
        self._number += 1
        return self._made.popleft().result()

    def close(self) -> None:
        """Ends the thread; a process that leaves while it runs may crash."""
        self._drop()
        self._worker.shutdown()

    def _drop(self) -> None:
        for batch in self._made:
            batch.cancel()
        self._made.clear()

    def _shuffled(self, k: int) -> int:
        """The k-th record drawn: every record once before any comes again."""
        epoch, index = divmod(k, len(self.records))
        if epoch not in self._orders:  # at the end of an epoch several threads may be in two of them
            self._orders[epoch] = np.random.default_rng([self.seed, epoch, 1]).permutation(len(self.records))
            self._orders.pop(epoch - 2, None)
        return int(self._orders[epoch][index])
