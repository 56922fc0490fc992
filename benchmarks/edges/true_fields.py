"""Measures curves from the true fields of views: the limit of extraction, which has a target of its own, and the result
with the depth of sensors, whose error along the ray stays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np
from tqdm import tqdm

from benchmarks.edges.curve_extraction import PROGRAM, extracted, pack_field
from benchmarks.edges.curve_scores import view_score
from benchmarks.edges.curves import mean_of, with_curves
from benchmarks.edges.edges_api import TYPES, Curves
from benchmarks.edges.quality import LEVELS
from benchmarks.edges.views import View
from export.edges.config import EPS_R

METRIC = "edges_curves_true"


def measure(views: Sequence[View], folder: Path) -> list[dict]:
    """Returns rows by sensor: means over views with a curve that is certainly sharp, as curves.measure_solids; none
    without such views. Raises FileNotFoundError without the program, CalledProcessError if it fails."""
    if not PROGRAM.exists():
        raise FileNotFoundError(f"{PROGRAM} is not there: cmake --build --preset release --target {PROGRAM.name}")
    wanted, path = with_curves(views), folder / "edges-true-fields"
    rows = []
    for level in tqdm(LEVELS if wanted else (), desc="edges: true fields", unit="level", disable=None):
        try:
            with path.open("wb") as file:
                for view in wanted:
                    _pack(view, view.seen(level), file)
            scores = [view_score(_curves(found["curves"]), view)
                      for view, found in zip(wanted, extracted(path), strict=True)]  # fmt: skip
        finally:
            path.unlink(missing_ok=True)
        rows.append({"level": level, "views": len(scores), **mean_of(scores)})
    return rows


def _pack(view: View, depth: np.ndarray, file: BinaryIO) -> None:
    """Appends the true field where depth [H, W] in metres is known."""
    camera, frame, known = view.camera, view.frame, depth > 0
    intrinsics = camera.focal_px, camera.focal_px, camera.cx_px, camera.cy_px
    distance, kind = np.where(known, frame.distance, EPS_R), np.where(known, frame.kind, 0)
    pack_field(file, intrinsics, distance, depth, kind)


def _curves(found: Sequence[Mapping]) -> Curves:
    types, kinds = [TYPES.index(c["type"]) for c in found], [c["kind"] for c in found]
    return Curves(types, kinds, [np.array(c["points"]) for c in found], [], 0.0, 0.0)


def found_in(views: Sequence[View], folder: Path) -> tuple[list[dict], str]:
    """Returns the result of `measure`, or nothing and why it cannot be measured."""
    try:
        return measure(views, folder), "the test views have no curves stored"
    except FileNotFoundError as error:
        return [], str(error)


def metrics_from(rows: Sequence[Mapping]) -> dict[str, float]:
    by_level = {row["level"]: row["f_score"] for row in rows}
    return {METRIC: by_level["clean"]} if "clean" in by_level else {}
