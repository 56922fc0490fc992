"""What the teachers say about a photo: everybody's box and, where they agree with each other, landmarks and mask."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from export.teachers.landmarks import Landmarks

_SAME_PERSON_IOU = 0.5  # of two masks
_AGREE_IOU = 0.4  # of the detector's box and the mask's
_AGREE_INSIDE = 0.7  # share of the mask that lies in the detector's box

Detect = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
Find = Callable[[np.ndarray, np.ndarray], Landmarks | None]


@dataclass(frozen=True)
class PhotoLabels:
    """N people of one photo of H x W pixels, best score first.

    box: float32 [N, 4] x0, y0, x1, y1. score: float32 [N], of the detector. sure: bool [N], landmarks and mask agree
    with the box; the fields below are zero for the others. point: float32 [N, 33, 2] pixels. visible: float32 [N, 33].
    world: float32 [N, 33, 3] metres (`Landmarks`). mask: bool [N, H, W].
    """

    box: np.ndarray
    score: np.ndarray
    sure: np.ndarray
    point: np.ndarray
    visible: np.ndarray
    world: np.ndarray
    mask: np.ndarray

    def save(self, path: Path) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        partial = path.with_name(path.name + ".partial")
        with open(partial, "wb") as file:
            np.savez_compressed(file, **self.__dict__)
        partial.replace(path)

    @staticmethod
    def load(path: Path) -> PhotoLabels:
        with np.load(path) as data:
            return PhotoLabels(**data)


def label_photo(image: np.ndarray, detect: Detect, find: Find) -> PhotoLabels:
    """image: uint8 [H, W, 3] BGR. detect, find: as `PersonDetector.detect` and `LandmarkNetwork.find`."""
    box, score = detect(image)
    people: list[Landmarks | None] = []
    for this in box:
        found = find(image, this)
        if found is not None and (not agrees(found, this) or any(_same(found, other) for other in people)):
            found = None
        people.append(found)

    def stacked(read: Callable[[Landmarks], np.ndarray], shape: tuple[int, ...], kind: type) -> np.ndarray:
        values = [np.zeros(shape) if person is None else read(person) for person in people]
        return np.array(values, kind).reshape(len(people), *shape)

    return PhotoLabels(
        box=box,
        score=score,
        sure=np.array([person is not None for person in people], bool),
        point=stacked(lambda p: p.point, (33, 2), np.float32),
        visible=stacked(lambda p: p.visible, (33,), np.float32),
        world=stacked(lambda p: p.world, (33, 3), np.float32),
        mask=stacked(lambda p: p.mask > 0.5, image.shape[:2], bool),
    )


def agrees(found: Landmarks, box: np.ndarray) -> bool:
    """Whether the mask is about the person in the box, not about a neighbour, and not a fragment of it."""
    y, x = np.nonzero(found.mask > 0.5)
    if not len(x):
        return False
    low, high = np.array([x.min(), y.min()]), np.array([x.max(), y.max()]) + 1
    shared = np.clip(np.minimum(high, box[2:]) - np.maximum(low, box[:2]), 0, None).prod()
    union = (high - low).prod() + (box[2:] - box[:2]).prod() - shared
    inside = ((x >= box[0]) & (x < box[2]) & (y >= box[1]) & (y < box[3])).mean()
    return bool(shared / union >= _AGREE_IOU and inside >= _AGREE_INSIDE)


def _same(a: Landmarks, b: Landmarks | None) -> bool:
    if b is None:
        return False
    first, second = a.mask > 0.5, b.mask > 0.5
    return bool((first & second).sum() > _SAME_PERSON_IOU * max((first | second).sum(), 1))


def draw(image: np.ndarray, labels: PhotoLabels) -> np.ndarray:
    """The photo with masks, landmarks and boxes: green where the teachers agree, red where only the detector speaks."""
    out = image.copy()
    for k in range(len(labels.box)):
        out[labels.mask[k]] = (0.6 * out[labels.mask[k]] + 0.4 * np.array([255, 0, 255])).astype(np.uint8)
    thick = max(1, round(max(image.shape[:2]) / 400))
    for k, (x0, y0, x1, y1) in enumerate(labels.box.astype(int)):
        cv2.rectangle(out, (x0, y0), (x1, y1), (0, 220, 0) if labels.sure[k] else (0, 0, 255), thick)
        for (x, y), visible in zip(labels.point[k].astype(int), labels.visible[k], strict=True):
            if labels.sure[k] and visible > 0.5:
                cv2.circle(out, (int(x), int(y)), 2 * thick, (255, 255, 0), -1)
    return out
