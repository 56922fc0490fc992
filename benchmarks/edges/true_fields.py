"""Curves from the true fields of views: what extraction can reach at most, and its own gate.

The program is that of benchmarks.edge_curves, which also says why what is missing is missing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from tqdm import tqdm

from benchmarks.edge_curves import PROGRAM, extracted, pack_field
from benchmarks.edges.curve_scores import view_score
from benchmarks.edges.curves import mean_of, with_curves
from benchmarks.edges.views import View
from export.evaluation.edges_api import TYPES, Curves

FIGURE = "edges_curves_true"


def measure(views: Sequence[View], folder: Path) -> dict | None:
    """Means over views with a curve that is surely sharp, as curves.measure_solids; None without any. Raises
    FileNotFoundError without the program, CalledProcessError where it fails."""
    if not PROGRAM.exists():
        raise FileNotFoundError(f"{PROGRAM} is not there: cmake --build --preset release --target {PROGRAM.name}")
    wanted, path, scores = with_curves(views), folder / "edges-true-fields", []
    if not wanted:
        return None
    try:
        with path.open("wb") as file:
            for view in wanted:
                camera, frame = view.camera, view.frame
                intrinsics = camera.focal_px, camera.focal_px, camera.cx_px, camera.cy_px
                pack_field(file, intrinsics, frame.distance, frame.depth, frame.kind)
        for view, found in zip(tqdm(wanted, desc="edges: true fields", disable=None), extracted(path), strict=True):
            scores.append(view_score(_curves(found["curves"]), view))
    finally:
        path.unlink(missing_ok=True)
    return {"views": len(scores), **mean_of(scores)}


def _curves(found: Sequence[Mapping]) -> Curves:
    types, kinds = [TYPES.index(c["type"]) for c in found], [c["kind"] for c in found]
    return Curves(types, kinds, [np.array(c["points"]) for c in found], [], 0.0, 0.0)


def found_in(views: Sequence[View], folder: Path) -> tuple[dict | None, str]:
    """What `measure` says, or None and why it cannot be measured."""
    try:
        return measure(views, folder), "the test views have no curves stored"
    except FileNotFoundError as error:
        return None, str(error)


def figures_from(found: Mapping | None) -> dict[str, float]:
    return {} if found is None else {FIGURE: found["f_score"]}
