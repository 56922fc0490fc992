"""How far extracted curves are from the true ones, by length: precision, recall, F-score, Chamfer, Hausdorff.

Lengths are in footprints r = depth / focal length of the place that is looked from, so that a curve counts as found
where one of the other set is within 2 r.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
from scipy.spatial import cKDTree

WITHIN_R = 2.0
STEP_R = 0.5  # between the places at which curves are compared
FARTHEST_R = 100.0  # what has nothing near it counts as so far away in Chamfer and Hausdorff


def curves_of(document: Mapping) -> list[np.ndarray]:
    """The polylines [n, 3] of a file of curves (docs/reference/formats.md), camera coordinates in metres."""
    return [np.asarray(curve["points"], np.float64).reshape(-1, 3) for curve in document["curves"]]


def places_on(curves: Sequence[np.ndarray], focal_px: float, step_r: float = STEP_R) -> np.ndarray:
    """Places [n, 3] along polylines [k, 3], each the middle of an equal piece of at most `step_r`."""
    found = [np.zeros((0, 3))]
    for curve in curves:
        for a, b in pairwise(curve):
            step_m = step_r * max(min(a[2], b[2]), 1e-12) / focal_px
            count = max(1, int(np.ceil(np.linalg.norm(b - a) / step_m)))
            found.append(a + (b - a) * ((np.arange(count) + 0.5) / count)[:, None])
    return np.concatenate(found)


def score(
    found: Sequence[np.ndarray], true: Sequence[np.ndarray], focal_px: float, within_r: float = WITHIN_R
) -> dict[str, float]:
    """found, true: polylines [n, 3]. Precision (of found length near a true curve), recall (of true length near a found
    one), their harmonic mean, the mean of both mean distances (Chamfer) and the largest distance (Hausdorff), r. Of an
    empty set the fraction is 1: nothing found is not wrong."""
    ours, theirs = places_on(found, focal_px), places_on(true, focal_px)
    to_true, to_found = _distances(ours, theirs, focal_px), _distances(theirs, ours, focal_px)
    precision = float((to_true <= within_r).mean()) if len(ours) else 1.0
    recall = float((to_found <= within_r).mean()) if len(theirs) else 1.0
    both = [d for d in (to_true, to_found) if len(d)]
    return {
        "precision": precision,
        "recall": recall,
        "f_score": 2 * precision * recall / (precision + recall) if precision + recall > 0 else 0.0,
        "chamfer_r": float(np.mean([d.mean() for d in both])) if both else 0.0,
        "hausdorff_r": float(max(d.max() for d in both)) if both else 0.0,
    }


def _distances(places: np.ndarray, others: np.ndarray, focal_px: float) -> np.ndarray:
    """From each place to the nearest of the others, r of the place, at most FARTHEST_R."""
    if not len(places) or not len(others):
        return np.full(len(places), FARTHEST_R)
    distance_m, _ = cKDTree(others).query(places)
    return np.minimum(distance_m * focal_px / np.maximum(places[:, 2], 1e-12), FARTHEST_R)
