"""Scores the curves found in a view against the true curves: by length, and the angle of lines."""

from __future__ import annotations

import statistics
from collections.abc import Sequence

import numpy as np

from benchmarks.edges.edges_api import LINE, Curves
from benchmarks.edges.views import View, polyline
from export.edges.curve_metrics import score

MIN_LINE_R = 20.0  # shorter lines have no reliable angle
SAME_LINE_R = 3.0  # distance from the middle of a found line to the true line that it is compared with


def view_score(found: Curves, view: View) -> dict[str, float]:
    """Returns scores of export.edges.curve_metrics with the median angle of lines in degrees. A found curve may lie on
    any true curve, but only certainly sharp ones count as missing."""
    focal_px = view.camera.focal_px
    true = [polyline(c) for c in view.curves["curves"]]
    sure = [polyline(c) for c in view.curves["curves"] if c["sure"]]
    metrics = score(found.points, sure, focal_px)
    metrics["precision"] = score(found.points, true, focal_px)["precision"]
    lines = [polyline(c) for c in view.curves["curves"] if c["type"] == "line"]
    return with_f_score(metrics) | {"angle_deg": line_angle_deg(found, lines, focal_px)}


def with_f_score(metrics: dict[str, float]) -> dict[str, float]:
    both = metrics["precision"] + metrics["recall"]
    return metrics | {"f_score": 2 * metrics["precision"] * metrics["recall"] / both if both > 0 else 0.0}


def line_angle_deg(found: Curves, true: Sequence[np.ndarray], focal_px: float) -> float:
    """Returns the median angle between found lines and the true lines next to them; NaN without such lines."""
    angles = []
    for points in (p for p, kind in zip(found.points, found.types, strict=True) if kind == LINE):
        middle, along = (points[0] + points[-1]) / 2, points[-1] - points[0]
        r = middle[2] / focal_px
        if np.linalg.norm(along) < MIN_LINE_R * r:
            continue
        off = [_from_segment(middle, line) / r for line in true]
        if off and min(off) <= SAME_LINE_R:
            other = np.diff(true[int(np.argmin(off))][[0, -1]], axis=0)[0]
            cosine = abs(along @ other) / np.linalg.norm(along) / max(np.linalg.norm(other), 1e-12)
            angles.append(float(np.degrees(np.arccos(min(cosine, 1.0)))))
    return statistics.median(angles) if angles else np.nan


def _from_segment(point: np.ndarray, ends: np.ndarray) -> float:
    along = ends[-1] - ends[0]
    t = np.clip((point - ends[0]) @ along / max(along @ along, 1e-30), 0, 1)
    return float(np.linalg.norm(point - ends[0] - t * along))
