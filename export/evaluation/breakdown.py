"""Metrics by size, truncation, crowding and visible fraction of the person."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from export.evaluation.people import PersonRecord
from export.evaluation.surface_accuracy import fraction

# Criteria, names of groups, and their conditions. A person with an unknown value (NaN) belongs to no group of that
# criterion.
GROUPS: tuple[tuple[str, str, Callable[[PersonRecord], bool]], ...] = (
    ("size", "box lower than 64 px", lambda p: p.height_px < 64),
    ("size", "64 to 128 px", lambda p: 64 <= p.height_px <= 128),
    ("size", "higher than 128 px", lambda p: p.height_px > 128),
    ("truncation", "inside the frame", lambda p: not p.cut),
    ("truncation", "touching the frame", lambda p: p.cut),
    ("crowding", "alone", lambda p: p.crowding == 0),
    ("crowding", "boxes touch, IoU up to .3", lambda p: 0 < p.crowding <= 0.3),
    ("crowding", "boxes overlap by more", lambda p: p.crowding > 0.3),
    ("visibility", "under half of the body groups", lambda p: p.groups_seen < 0.5),
    ("visibility", "half to three quarters", lambda p: 0.5 <= p.groups_seen < 0.75),
    ("visibility", "three quarters or more", lambda p: p.groups_seen >= 0.75),
)


@dataclass(frozen=True)
class GroupMetrics:
    """Shares 0..1; NaN: nothing to measure.

    recall: fraction found at box IoU .5. part_accuracy: fraction of these people's visible pixels (in photographs:
    landmarks) with the right part. mask_iou: mean over the people. Missed people count as wrong everywhere.
    """

    by: str
    name: str
    people: int
    recall: float
    part_accuracy: float
    mask_iou: float


def breakdown(people: list[PersonRecord]) -> list[GroupMetrics]:
    """One entry for each group that has people in it."""
    metrics = []
    for by, name, belongs in GROUPS:
        members = [person for person in people if belongs(person)]
        if members:
            metrics.append(
                GroupMetrics(
                    by=by,
                    name=name,
                    people=len(members),
                    recall=float(np.mean([p.found for p in members])),
                    part_accuracy=part_accuracy(members),
                    mask_iou=mean_mask_iou(members),
                )
            )
    return metrics


def part_accuracy(people: list[PersonRecord]) -> float:
    return fraction(sum(p.right for p in people), sum(p.asked for p in people))


def left_right(people: list[PersonRecord]) -> float:
    """Fraction with the right side among limb pixels (or landmarks) that are labelled as a limb."""
    return fraction(sum(p.same_side for p in people), sum(p.limb for p in people))


def mean_mask_iou(people: list[PersonRecord]) -> float:
    known = [p.mask_iou for p in people if not np.isnan(p.mask_iou)]
    return float(np.mean(known)) if known else float("nan")
