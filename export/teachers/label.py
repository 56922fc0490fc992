"""Labels of a photo by the teachers: boxes of all people and, where teachers agree, landmarks and mask."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from export.teachers.landmarks import Landmarks
from export.teachers.stored import Stored

_SAME_PERSON_IOU = 0.5  # of two masks
_AGREE_IOU = 0.4  # of the detector's box and the mask's
_AGREE_INSIDE = 0.7  # share of the mask that lies in the detector's box
_ALONE = 0.1  # share of a box that other boxes may cover
_MATTE_IOU = 0.6  # of the detector's box and the matte's
_SAME_MASK_IOU = 0.75  # of BlazePose's mask and the matte
_MIN_VISIBLE, _LANDMARKS_INSIDE = 0.6, 0.85  # share of the visible landmarks that lie on the mask

Detect = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
Find = Callable[[np.ndarray, np.ndarray], Landmarks | None]
Outline = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class PhotoLabels(Stored):
    """N people of one photo of H x W pixels, best score first.

    box: float32 [N, 4] x0, y0, x1, y1. score: float32 [N], of the detector. outlined: bool [N], there is a mask that
    agrees with the box. sure: bool [N], landmarks agree with box and mask too. mask: bool [N, H, W]. doubt: bool
    [N, H, W], pixels about which the two masks disagree. Zero unless sure: point: float32 [N, 33, 2] pixels, visible:
    float32 [N, 33], world: float32 [N, 33, 3] metres (`Landmarks`).
    """

    box: np.ndarray
    score: np.ndarray
    outlined: np.ndarray
    sure: np.ndarray
    point: np.ndarray
    visible: np.ndarray
    world: np.ndarray
    mask: np.ndarray
    doubt: np.ndarray


def label_photo(image: np.ndarray, detect: Detect, find: Find, outline: Outline) -> PhotoLabels:
    """image: uint8 [H, W, 3] BGR. The rest: as `PersonDetector.detect`, `LandmarkNetwork.find`, `MatteNetwork.find`.

    Of somebody alone in the box the matte is the mask: close by, BlazePose's mask often ends at the neck. In company
    the matte cannot tell who is who, and BlazePose's mask counts.
    """
    box, score = detect(image)
    shape = image.shape[:2]
    people: list[Landmarks | None] = []
    masks, doubts = np.zeros((len(box), *shape), bool), np.zeros((len(box), *shape), bool)
    outlined = np.zeros(len(box), bool)
    for k, this in enumerate(box):
        matte = outline(image, this) if _covered(this, np.delete(box, k, 0)) < _ALONE else np.zeros(shape, bool)
        if not agrees(matte, this, _MATTE_IOU):
            matte[:] = False
        poses = [pose for whole in whole_bodies(this, shape[0]) if (pose := find(image, whole)) is not None]
        wanted = matte if matte.any() else _filled(this, shape)
        found = max(poses, key=lambda pose: _iou(pose.mask > 0.5, wanted), default=None)
        pose = np.zeros(shape, bool) if found is None else found.mask > 0.5
        if not agrees(pose, this) or (matte.any() and _iou(pose, matte) < _SAME_MASK_IOU):
            found, pose = None, np.zeros(shape, bool)
        mask = matte if matte.any() else pose
        if not mask.any() or any(_iou(mask, other) > _SAME_PERSON_IOU for other in masks[outlined]):
            people.append(None)
            continue
        outlined[k], masks[k] = True, mask
        doubts[k] = (matte ^ pose) if matte.any() and pose.any() else False
        people.append(found if found is not None and _on_mask(found, mask) else None)

    def stacked(read: Callable[[Landmarks], np.ndarray], shape: tuple[int, ...]) -> np.ndarray:
        values = [np.zeros(shape) if person is None else read(person) for person in people]
        return np.array(values, np.float32).reshape(len(people), *shape)

    return PhotoLabels(
        box=box,
        score=score,
        outlined=outlined,
        sure=np.array([person is not None for person in people], bool),
        point=stacked(lambda p: p.point, (33, 2)),
        visible=stacked(lambda p: p.visible, (33,)),
        world=stacked(lambda p: p.world, (33, 3)),
        mask=masks,
        doubt=doubts,
    )


def whole_bodies(box: np.ndarray, height: int) -> list[np.ndarray]:
    """Where the whole person may be: the box and, if the image's lower border cuts it, longer ones.

    The landmark network takes what it is shown for a whole body; shown a head alone it finds the body in the face.
    """
    longer = [box]
    if box[3] > 0.97 * height:
        tall = box[3] - box[1]
        longer += [np.append(box[:3], box[3] + share * tall) for share in (0.7, 1.6, 3.0)]
    return longer


def agrees(mask: np.ndarray, box: np.ndarray, min_iou: float = _AGREE_IOU) -> bool:
    """Whether the mask is about the person in the box, not about a neighbour, and not a fragment of it."""
    y, x = np.nonzero(mask)
    if not len(x):
        return False
    low, high = np.array([x.min(), y.min()]), np.array([x.max(), y.max()]) + 1
    shared = np.clip(np.minimum(high, box[2:]) - np.maximum(low, box[:2]), 0, None).prod()
    union = (high - low).prod() + (box[2:] - box[:2]).prod() - shared
    inside = ((x >= box[0]) & (x < box[2]) & (y >= box[1]) & (y < box[3])).mean()
    return bool(shared / union >= min_iou and inside >= _AGREE_INSIDE)


def _covered(box: np.ndarray, others: np.ndarray) -> float:
    """The largest share of the box that one of the others [M, 4] covers."""
    sides = np.minimum(box[2:], others[:, 2:]) - np.maximum(box[:2], others[:, :2])
    return float((np.clip(sides, 0, None).prod(1) / (box[2:] - box[:2]).prod()).max(initial=0))


def _on_mask(found: Landmarks, mask: np.ndarray) -> bool:
    x, y = np.floor(found.point).astype(int).T
    inside = (x >= 0) & (x < mask.shape[1]) & (y >= 0) & (y < mask.shape[0])
    shown = inside & (found.visible >= _MIN_VISIBLE)
    return bool(shown.any() and mask[y[shown], x[shown]].mean() >= _LANDMARKS_INSIDE)


def _iou(first: np.ndarray, second: np.ndarray) -> float:
    return float((first & second).sum() / max((first | second).sum(), 1))


def _filled(box: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    x0, y0, x1, y1 = np.round(box).astype(int)
    out = np.zeros(shape, bool)
    out[max(y0, 0) : y1, max(x0, 0) : x1] = True
    return out


def draw(image: np.ndarray, labels: PhotoLabels) -> np.ndarray:
    """The photo with masks, landmarks and boxes: green where all teachers agree,
    yellow where landmarks lack, red where only the detector speaks."""
    out = image.copy()
    for k in range(len(labels.box)):
        out[labels.mask[k]] = (0.6 * out[labels.mask[k]] + 0.4 * np.array([255, 0, 255])).astype(np.uint8)
    thick = max(1, round(max(image.shape[:2]) / 400))
    for k, (x0, y0, x1, y1) in enumerate(labels.box.astype(int)):
        colour = (0, 220, 0) if labels.sure[k] else (0, 220, 255) if labels.outlined[k] else (0, 0, 255)
        cv2.rectangle(out, (x0, y0), (x1, y1), colour, thick)
        for (x, y), visible in zip(labels.point[k].astype(int), labels.visible[k], strict=True):
            if labels.sure[k] and visible > 0.5:
                cv2.circle(out, (int(x), int(y)), 2 * thick, (255, 255, 0), -1)
    return out
