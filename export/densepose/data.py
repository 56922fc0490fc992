"""Augmented batches of shards' records (export.shards), drawn in a background thread."""

from __future__ import annotations

from collections import deque
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

import cv2
import numpy as np
import torch

from export.densepose.targets import Truth
from export.shards import Record, mirror_iuv, visible_boxes

MEAN = np.array([123.675, 116.28, 103.53], np.float32)  # RGB, 0..255
STD = np.array([58.395, 57.12, 57.375], np.float32)


def normalised(image: np.ndarray) -> np.ndarray:
    """BGR [H, W, 3] -> float32 [3, H, W], RGB, zero mean and unit variance."""
    return ((image[..., ::-1].astype(np.float32) - MEAN) / STD).transpose(2, 0, 1)


@dataclass(frozen=True)
class Cropping:
    """How crops are drawn: how often towards a person, whose long side then is `person_scale` crop sides
    (log-uniform)."""

    towards_person: float = 0.8
    person_scale: tuple[float, float] = (0.3, 1.3)  # from far away to truncated by the crop


ANY_CROPPING = Cropping()
CLOSE_CROPPING = Cropping(towards_person=0.95, person_scale=(0.6, 1.3))
SCALES = (0.15, 2.0)  # of the stored picture


def augmented(
    record: Record, size: int, rng: np.random.Generator, cropping: Cropping = ANY_CROPPING
) -> tuple[np.ndarray, np.ndarray]:
    """A random square crop at a random scale, mirrored half of the time, with other colours.

    Where the crop is drawn towards a person, the scale is chosen by that person's size, so that people of all
    sizes in pixels are seen equally often.
    """
    image, label = record.decoded()
    people = np.unique(label[..., 3])[1:]
    focus = int(rng.choice(people)) if len(people) and rng.random() < cropping.towards_person else 0
    if focus:
        y, x = np.nonzero(label[..., 3] == focus)
        long_side = max(np.ptp(x), np.ptp(y)) + 1
        scale = np.clip(size / long_side * np.exp(rng.uniform(*np.log(cropping.person_scale))), *SCALES)
    else:
        scale = size / 256 * np.exp(rng.uniform(*np.log((0.6, 1.3))))
    shape = (max(int(image.shape[1] * scale), 8), max(int(image.shape[0] * scale), 8))
    image = cv2.resize(image, shape, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR)
    label = cv2.resize(label, shape, interpolation=cv2.INTER_NEAREST)
    corner = _corner(label, size, focus, rng)
    image, label = _crop(image, corner, size, MEAN[::-1]), _crop(label, corner, size, np.zeros(4))
    if rng.random() < 0.5:
        image = image[:, ::-1]
        label = label[:, ::-1].copy()
        label[..., :3] = mirror_iuv(label[..., :3])
    return _recoloured(np.ascontiguousarray(image), rng), label


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


def _recoloured(image: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    colour = image.astype(np.float32)
    if rng.random() < 0.8:
        colour = (colour - 128) * rng.uniform(0.7, 1.3) + 128 + rng.normal(0, 15)
        colour *= 1 + rng.normal(0, 0.06, 3).astype(np.float32)
    if rng.random() < 0.08:
        colour[:] = colour.mean(-1, keepdims=True)
    if rng.random() < 0.15:
        colour = cv2.GaussianBlur(colour, (0, 0), rng.uniform(0.3, 1.2))
    return np.clip(colour, 0, 255).astype(np.uint8)


def truth_of(label: np.ndarray) -> Truth:
    box, instance, ignore = visible_boxes(label)
    return Truth(torch.from_numpy(box), torch.from_numpy(instance), torch.from_numpy(ignore), torch.from_numpy(label))


class Batches:
    """Endless shuffled batches, `ahead` of them made ahead by a thread (OpenCV releases the interpreter's lock).

    Batch k depends on `seed` and k alone, so that a run resumed at step k sees what it would have seen. `photos`
    replace the fraction `photo_fraction` of the records; they are few, and so drawn with replacement.
    """

    def __init__(
        self, records: list[Record], batch: int, seed: int, first: int = 0,
        photos: list[Record] | None = None, photo_fraction: float = 0.0, ahead: int = 4,
    ) -> None:  # fmt: skip
        self.records, self.batch, self.seed, self.ahead = records, batch, seed, ahead
        self.photos, self.photo_fraction = photos or [], photo_fraction if photos else 0.0
        self._epoch, self._order = -1, np.empty(0, np.int64)
        cv2.setNumThreads(1)
        self._number, self._kind = first, None
        self._made: deque[Future] = deque()
        self._worker = ThreadPoolExecutor(1)

    def make(self, number: int, size: int, cropping: Cropping = ANY_CROPPING) -> tuple[torch.Tensor, list[Truth]]:
        """Batch `number` at an image side of `size` pixels."""
        rng = np.random.default_rng([self.seed, number])
        images, truths = [], []
        for k in range(number * self.batch, (number + 1) * self.batch):
            record = self.records[self._shuffled(k)]
            if rng.random() < self.photo_fraction:
                record = self.photos[rng.integers(len(self.photos))]
            image, label = augmented(record, size, rng, cropping)
            images.append(normalised(image))
            truths.append(truth_of(label))
        return torch.from_numpy(np.stack(images)), truths

    def next(self, size: int, cropping: Cropping = ANY_CROPPING) -> tuple[torch.Tensor, list[Truth]]:
        """Image [N, 3, size, size] and its people; those made ahead of another kind are discarded."""
        if not self.ahead:
            self._number += 1
            return self.make(self._number - 1, size, cropping)
        if self._kind != (size, cropping):
            self._drop()
            self._kind = (size, cropping)
        while len(self._made) <= self.ahead:
            self._made.append(self._worker.submit(self.make, self._number + len(self._made), size, cropping))
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
        if epoch != self._epoch:
            self._order = np.random.default_rng([self.seed, epoch, 1]).permutation(len(self.records))
            self._epoch = epoch
        return int(self._order[index])
