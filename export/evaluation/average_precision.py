"""Average precision with the COCO matching rules, for any similarity between detections and truth.

Sources: COCO's evaluation protocol (Lin et al., "Microsoft COCO", ECCV 2014) for matching and the 101 recall
points; Guler et al., "DensePose", CVPR 2018, for the same with geodesic point similarity instead of box IoU.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

THRESHOLDS = tuple(round(0.5 + 0.05 * k, 2) for k in range(10))
RECALLS = np.linspace(0, 1, 101)
MAX_DETECTIONS = 20


@dataclass(frozen=True)
class ImageMatches:
    """One image's detections and how they compare with the people asked for.

    score: float [D]. similarity: float [D, G], 0..1, G people that are asked for. ignorable: float [D], the
    largest similarity to anything that is neither rewarded nor punished (0 if there is none).
    """

    score: np.ndarray
    similarity: np.ndarray
    ignorable: np.ndarray


def box_iou(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Intersection over union of boxes a [n, 4] and b [m, 4] (x0, y0, x1, y1): float64 [n, m]."""
    a, b = a.astype(np.float64), b.astype(np.float64)
    low = np.maximum(a[:, None, :2], b[None, :, :2])
    high = np.minimum(a[:, None, 2:], b[None, :, 2:])
    shared = np.clip(high - low, 0, None).prod(-1)
    area_a, area_b = (a[:, 2:] - a[:, :2]).prod(-1), (b[:, 2:] - b[:, :2]).prod(-1)
    union = area_a[:, None] + area_b[None] - shared
    return np.where(union > 0, shared / np.where(union > 0, union, 1), 0.0)


def match(matches: ImageMatches, threshold: float, ignore_threshold: float) -> tuple[np.ndarray, np.ndarray]:
    """Gives each detection, best score first, the most similar person that is still free.

    Returns (person, dropped), int64 and bool [D] each in the order of `matches`: the person's column, or -1 for a
    detection that is right about nobody. Dropped ones are among those, but similar enough to something ignored.
    """
    person = np.full(len(matches.score), -1)
    free = np.ones(matches.similarity.shape[1], bool)
    for d in np.argsort(-matches.score, kind="stable"):
        similarity = np.where(free, matches.similarity[d], -1)
        if len(similarity) and similarity.max() >= threshold:
            person[d] = similarity.argmax()
            free[person[d]] = False
    return person, (person < 0) & (matches.ignorable >= ignore_threshold)


def ranked(
    images: list[ImageMatches], threshold: float, ignore_threshold: float | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Score and rightness, float and bool [N], of all images' detections but the dropped ones, best score first.

    threshold: similarity from which a detection is right. ignore_threshold: the same for being dropped
    (default: threshold).
    """
    scores, hits = [np.zeros(0)], [np.zeros(0, bool)]
    for image in images:
        best = np.argsort(-image.score, kind="stable")[:MAX_DETECTIONS]
        kept = ImageMatches(image.score[best], image.similarity[best], image.ignorable[best])
        person, dropped = match(kept, threshold, threshold if ignore_threshold is None else ignore_threshold)
        scores.append(kept.score[~dropped])
        hits.append(person[~dropped] >= 0)
    score = np.concatenate(scores)
    order = np.argsort(-score, kind="stable")
    return score[order], np.concatenate(hits)[order]


def average_precision(images: list[ImageMatches], threshold: float, ignore_threshold: float | None = None) -> float:
    """Mean over 101 recalls of the best precision at that recall or a higher one; thresholds as in `ranked`.

    Without anybody to find the value is NaN.
    """
    wanted = sum(image.similarity.shape[1] for image in images)
    if wanted == 0:
        return float("nan")
    _, hit = ranked(images, threshold, ignore_threshold)
    found = np.cumsum(hit)
    precision = found / np.arange(1, len(hit) + 1)
    precision = np.maximum.accumulate(precision[::-1])[::-1]
    position = np.searchsorted(found / wanted, RECALLS, side="left")
    return float(np.append(precision, 0.0)[np.minimum(position, len(hit))].mean())
