"""HOTA, IDF1, MOTA and id switches of tracks, as TrackEval computes them.

HOTA: Luiten et al., IJCV 2021. IDF1: Ristani et al., ECCVW 2016. MOTA: Bernardin and Stiefelhagen, 2008. Several clips
are one sequence in which every clip has ids of its own: this gives the same sums as combining them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

ALPHAS = np.arange(0.05, 0.99, 0.05)
MATCH_IOU = 0.5  # of MOTA and IDF1
_EPS = np.finfo(float).eps


@dataclass(frozen=True, eq=False)
class Frame:
    """true_ids [N], ids [M]: numbers from 0, each at most once. iou [N, M] of their boxes."""

    true_ids: np.ndarray
    ids: np.ndarray
    iou: np.ndarray


def iou_of(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Boxes [N, 4] and [M, 4] (left, top, right, bottom) -> [N, M]."""
    first, second = np.reshape(first, (-1, 1, 4)), np.reshape(second, (1, -1, 4))
    sides = np.minimum(first[..., 2:], second[..., 2:]) - np.maximum(first[..., :2], second[..., :2])
    shared = np.clip(sides, 0, None).prod(-1)
    areas = [np.clip(b[..., 2:] - b[..., :2], 0, None).prod(-1) for b in (first, second)]
    return shared / np.maximum(areas[0] + areas[1] - shared, 1e-9)


def _counts(frames: Sequence[Frame]) -> tuple[np.ndarray, np.ndarray]:
    """How often each true id and each id occurs."""
    true_ids = np.concatenate([f.true_ids for f in frames] or [np.zeros(0)]).astype(int)
    ids = np.concatenate([f.ids for f in frames] or [np.zeros(0)]).astype(int)
    return np.bincount(true_ids, minlength=1), np.bincount(ids, minlength=1)


def hota(frames: Sequence[Frame]) -> dict[str, float]:
    """HOTA, DetA and AssA, means over the thresholds `ALPHAS` of the IoU, 0 to 1."""
    true_count, count = _counts(frames)
    together = np.zeros((len(true_count), len(count)))
    for f in frames:
        apart = f.iou.sum(0)[None] + f.iou.sum(1)[:, None] - f.iou
        share = np.divide(f.iou, apart, out=np.zeros_like(f.iou), where=apart > _EPS)
        together[np.ix_(f.true_ids, f.ids)] += share
    alignment = together / np.maximum(true_count[:, None] + count[None] - together, 1e-9)
    matched = np.zeros((len(ALPHAS), *together.shape))
    for f in frames:
        rows, columns = linear_sum_assignment(-alignment[np.ix_(f.true_ids, f.ids)] * f.iou)
        for a, alpha in enumerate(ALPHAS):
            good = f.iou[rows, columns] >= alpha - _EPS
            matched[a, f.true_ids[rows[good]], f.ids[columns[good]]] += 1
    hits = matched.sum((1, 2))
    detection = hits / np.maximum(true_count.sum() + count.sum() - hits, 1)
    union = np.maximum(true_count[:, None] + count[None] - matched, 1)
    association = (matched * matched / union).sum((1, 2)) / np.maximum(hits, 1)
    return {
        "HOTA": float(np.sqrt(detection * association).mean()),
        "DetA": float(detection.mean()),
        "AssA": float(association.mean()),
    }


def identity(frames: Sequence[Frame]) -> dict[str, float]:
    """IDF1: tracks are matched one to one with people, so that the most boxes agree."""
    true_count, count = _counts(frames)
    agree = np.zeros((len(true_count), len(count)))
    for f in frames:
        rows, columns = np.nonzero(f.iou >= MATCH_IOU)
        np.add.at(agree, (f.true_ids[rows], f.ids[columns]), 1)
    hits = agree[linear_sum_assignment(-agree)].sum()
    return {"IDF1": float(2 * hits / max(true_count.sum() + count.sum(), 1))}


def matches(frames: Sequence[Frame]) -> list[tuple[np.ndarray, np.ndarray]]:
    """Rows and columns that belong together in each frame, by IoU. A pair of the frame before stays together if its IoU
    is still high enough."""
    before: dict[int, int] = {}
    found = []
    for f in frames:
        kept = np.array([[before.get(int(g)) == t for t in f.ids] for g in f.true_ids], float).reshape(f.iou.shape)
        score = np.where(f.iou >= MATCH_IOU - _EPS, 1000 * kept + f.iou, 0)
        rows, columns = linear_sum_assignment(-score)
        good = score[rows, columns] > _EPS
        rows, columns = rows[good], columns[good]
        before = dict(zip(f.true_ids[rows].tolist(), f.ids[columns].tolist(), strict=True))
        found.append((rows, columns))
    return found


def clear(frames: Sequence[Frame]) -> dict[str, float]:
    """MOTA, recall and precision of boxes, and the number of id switches."""
    last: dict[int, int] = {}
    hits = switches = 0
    for f, (rows, columns) in zip(frames, matches(frames), strict=True):
        for person, track in zip(f.true_ids[rows].tolist(), f.ids[columns].tolist(), strict=True):
            switches += last.get(person, track) != track
            last[person] = track
        hits += len(rows)
    true_count, count = (int(c.sum()) for c in _counts(frames))
    return {
        "MOTA": (hits - (count - hits) - switches) / max(true_count, 1),
        "switches": switches,
        "recall": hits / max(true_count, 1),
        "precision": hits / max(count, 1),
    }


def scores(frames: Sequence[Frame]) -> dict[str, float]:
    return {**hota(frames), **identity(frames), **clear(frames)}
