"""Person by person: who was found, how well they were painted, and who was found where nobody is.

What is said about one person here is summed up by `breakdown.py`, and the worst of it is shown by `failures.py`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from export.evaluation.average_precision import ImageMatches, box_iou, match
from export.evaluation.backends import Prediction
from export.shards import LabelledImage
from export.surface import COARSE_COUNT, LIMB_SIDE, PART_TO_COARSE

MATCH_IOU = 0.5
LONG_SIDE_PX = 320  # of the rendered images; photographs are measured as if they were as large


@dataclass(frozen=True)
class PersonRecord:
    """One person who was asked for, and what was painted there.

    image: its name. box: x0, y0, x1, y1 in pixels of the image. height_px: the box's, with the image resized to a long
    side of 320. cut: whether the box touches the frame. crowding: largest IoU of the box with another person's.
    groups_seen: fraction of the 14 body groups (coarse parts) with a visible pixel, NaN where that is not known.
    found: whether a shown detection has box IoU >= .5 and is matched to this person. mask_iou: of that detection's
    pixels, 0 when missed; NaN when the mask is not known. asked, right: visible pixels (in photographs: landmarks), and
    those painted with the right part. limb, same_side: pixels or landmarks of limbs where a limb is painted, and those
    where it is of the right side.
    """

    image: str
    box: tuple[float, float, float, float]
    height_px: float
    cut: bool
    crowding: float
    groups_seen: float
    found: bool
    mask_iou: float
    asked: int
    right: int
    limb: int
    same_side: int


@dataclass(frozen=True)
class FalseAlarm:
    """A shown detection of nobody. box: x0, y0, x1, y1 in pixels of the image `image`."""

    image: str
    box: tuple[float, float, float, float]
    score: float


@dataclass(frozen=True)
class Comparison:
    """Detections of one image against its people.

    matches: all detections, for AP. shown: those from the threshold on. number: int64 [G], for each person asked for
    the number in `shown.inds` of the detection matched to it, or 0. false: bool [S], shown detections of nobody.
    """

    matches: ImageMatches
    shown: Prediction
    number: np.ndarray
    false: np.ndarray

    def false_alarms(self, image: str) -> list[FalseAlarm]:
        return [
            FalseAlarm(image, plain_box(self.shown.box[d]), float(self.shown.score[d]))
            for d in np.flatnonzero(self.false)
        ]


def compare(found: Prediction, box: np.ndarray, asked: np.ndarray, threshold: float) -> Comparison:
    """box: [n, 4] of everybody in the image; asked: bool [n], the others count neither way."""
    overlap = box_iou(found.box, box)
    matches = ImageMatches(found.score, overlap[:, asked], overlap[:, ~asked].max(1, initial=0.0))
    shown = found.above(threshold)
    count = len(shown.score)
    kept = ImageMatches(matches.score[:count], matches.similarity[:count], matches.ignorable[:count])
    person, dropped = match(kept, MATCH_IOU, MATCH_IOU)
    number = np.zeros(int(asked.sum()), np.int64)
    hits = np.flatnonzero(person >= 0)
    number[person[hits]] = hits + 1
    return Comparison(matches, shown, number, (person < 0) & ~dropped)


def plain_box(box: np.ndarray) -> tuple[float, float, float, float]:
    return tuple(round(float(v), 1) for v in box)


def touches_frame(box: np.ndarray, width: int, height: int) -> bool:
    """Whether less than one pixel lies between the box and the image's edge."""
    return bool(box[0] < 1 or box[1] < 1 or box[2] > width - 1 or box[3] > height - 1)


def crowding(box: np.ndarray) -> np.ndarray:
    """box: [n, 4]. float64 [n]: largest IoU of each box with another one; 0 for somebody alone."""
    overlap = box_iou(box, box)
    np.fill_diagonal(overlap, 0)
    return overlap.max(1, initial=0.0)


def rendered_people(image: LabelledImage, comparison: Comparison, masks: np.ndarray) -> list[PersonRecord]:
    """Everybody asked for in a rendered image. masks: [D, G] from `surface_accuracy.mask_overlap`."""
    height, width = image.label.shape[:2]
    painted = comparison.shown.iuv[..., 0]
    close = crowding(image.box)
    people = []
    for column, k in enumerate(np.flatnonzero(~image.ignore)):
        own = image.label[..., 3] == image.instance[k]
        true, predicted = image.label[own, 0], painted[own]
        side, painted_side = LIMB_SIDE[true], LIMB_SIDE[predicted]
        limb = (side > 0) & (painted_side > 0)
        number = int(comparison.number[column])
        people.append(
            PersonRecord(
                image=image.name,
                box=plain_box(image.box[k]),
                height_px=float(image.box[k, 3] - image.box[k, 1]) * LONG_SIDE_PX / max(height, width),
                cut=touches_frame(image.box[k], width, height),
                crowding=float(close[k]),
                groups_seen=len(np.setdiff1d(PART_TO_COARSE[true], [0])) / COARSE_COUNT,
                found=number > 0,
                mask_iou=float(masks[number - 1, column]) if number else 0.0,
                asked=len(true),
                right=int((true == predicted).sum()),
                limb=int(limb.sum()),
                same_side=int((side == painted_side)[limb].sum()),
            )
        )
    return people
