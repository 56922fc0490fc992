"""The worst cases, chosen by their metrics."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from export.evaluation.people import FalseAlarm, PersonRecord

KINDS = {
    "missed": "people without a box (IoU .5), the tallest first",
    "false": "boxes that fit no person, the best score first",
    "mask": "people with a box, the lowest mask IoU first",
    "side": "left and right confused, the smallest correct fraction first",
}
MIN_HEIGHT_PX = 64  # of people whose mask is judged: in smaller ones a pixel more or less decides
CASES = 6


@dataclass(frozen=True)
class Case:
    """image: name. box: x0, y0, x1, y1 pixels. figure: height in px, score, mask IoU, or fraction of limb pixels
    (landmarks) of the correct side."""

    image: str
    box: tuple[float, float, float, float]
    figure: float


def worst_cases(
    people: list[PersonRecord], alarms: list[FalseAlarm], min_limb: int, count: int = CASES
) -> dict[str, list[Case]]:
    """At most `count` cases of each of KINDS, worst first, not more than one an image.

    min_limb: pixels (or landmarks) of limbs that a person must have to be judged by left and right. Masks and sides
    that are more right than wrong are no failures.
    """
    masks = [p for p in people if p.found and p.height_px >= MIN_HEIGHT_PX and p.mask_iou < 0.5]
    sides = [p for p in people if p.limb >= min_limb and p.same_side < 0.5 * p.limb]
    return {
        "missed": _first((-p.height_px, Case(p.image, p.box, p.height_px)) for p in people if not p.found)[:count],
        "false": _first((-a.score, Case(a.image, a.box, a.score)) for a in alarms)[:count],
        "mask": _first((p.mask_iou, Case(p.image, p.box, p.mask_iou)) for p in masks)[:count],
        "side": _first((p.same_side / p.limb, Case(p.image, p.box, p.same_side / p.limb)) for p in sides)[:count],
    }


def _first(cases: Iterable[tuple[float, Case]]) -> list[Case]:
    """Cases by rising key; the first of each image."""
    chosen: dict[str, Case] = {}
    for _, case in sorted(cases, key=lambda item: (item[0], item[1].image)):
        chosen.setdefault(case.image, case)
    return list(chosen.values())
