"""Measures edges fused over views of solids, beside one view: error, time and memory.

Solids are of the split `val`, as in export.edges.compare_fusion, which compares fusion rules in float64. Here the
library fuses, and its points are compared with the truth.
"""

from __future__ import annotations

import statistics
import subprocess
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial import cKDTree
from tqdm import tqdm

from benchmarks.edges.edges_api import Edges, EdgesResult, Pinhole
from benchmarks.edges.fusion_api import Fusion
from benchmarks.edges.fusion_memory import in_child
from benchmarks.edges.quality import LEVELS
from export.edges.config import EPS_R
from export.edges.curve_metrics import score
from export.edges.data import seen_by
from export.edges.evaluation_mask import JudgedPixels, judged_pixels
from export.edges.fusion import FieldView
from export.solids import sensors

if TYPE_CHECKING:
    from export.solids.multiview import MultiView

METRICS, TIME_METRIC = ("edges_fusion_memory_mb", "edges_fusion_rmse"), "edges_fusion_s"
SOLIDS, QUICK_SOLIDS = 6, 2
VIEWS, TIMED_VIEWS = 12, 24
TIMED_LEVEL = "tof"
LARGE_PX, MANY = (640, 480), 1_000_000  # size of the views and number of points for the measurement of memory
ALONE_EVERY = 3  # step between views whose curves are scored without fusion
FAR = 1e7  # in r: at this distance a solid of some thousand r has one footprint
NEAR_CELLS = 2.0  # largest distance from a pixel's point to the fused point it belongs to
INSTALL = "scripts/make-venv.sh dev,solids"


def distances_at(pixels: JudgedPixels, points: np.ndarray, cell_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns fused distances [N] in r of the pixels, from the nearest of POINT, and the limits [N] up to which they
    hold. The limit is that of the view nearest to the point, which may be less than EPS_R of this view. NaN without a
    near point: it has been left out."""
    if not len(points):
        return np.full((2, len(pixels.own)), np.nan)
    metres, nearest = cKDTree(points["point_m"]).query(pixels.targets.point)
    distance, r_m = (points[key][nearest] / pixels.targets.r_m for key in ("distance_m", "r_m"))
    reach = np.where(metres <= NEAR_CELLS * cell_m, np.minimum(EPS_R * r_m, EPS_R), np.nan)
    return np.minimum(distance, reach), reach


def errors_of(
    solid: MultiView, depths: Sequence[np.ndarray], results: Sequence[EdgesResult], points: np.ndarray, cell_m: float
) -> list[dict[str, float]]:
    """Returns for each view the RMSE in r of the view alone and of the fused points, against the nearest sharp curve of
    any view. Only pixels with a point count; all distances are clipped at the point's limit. known: fraction of counted
    pixels with a point."""
    rows = []
    for posed, depth, result in zip(solid.views, depths, results, strict=True):
        view = FieldView(posed.camera, *(p.astype(np.float64) for p in (depth, result.distance, result.spread)))
        pixels = judged_pixels(view, posed)
        fused, reach = distances_at(pixels, points, cell_m)
        known, true = ~np.isnan(fused), np.minimum(pixels.true, reach)
        if (pixels.counts & known).any():
            rows.append({"one_r": pixels.rmse(np.minimum(pixels.own, reach) - true, known),
                         "fused_r": pixels.rmse(fused - true, known),
                         "known": float(known[pixels.counts].mean())})  # fmt: skip
    return rows


@dataclass
class FusedViews:
    """depths: the sensor's report of each view at a level; results: edges of each. points, curves (both in the world)
    and info: of the fusion. seconds: time of the fusion, `s` wall-clock, `cpu_s` of all threads."""

    depths: list[np.ndarray]
    results: list[EdgesResult]
    points: np.ndarray
    curves: list[np.ndarray]
    info: Any
    seconds: dict[str, float]


def fused_views(solid: MultiView, level: str, seed: int, edges: Edges, threads: int) -> FusedViews:
    depths, results = [], []
    rng = np.random.default_rng([24, seed, len(level)])  # the same seeds as export.edges.compare_fusion
    with Fusion(edges, threads=max(threads, 0)) as fusion:
        for view in solid.views:
            depths.append(seen_by(sensors.LEVELS[level], view.depth, view.camera.fx_px, rng))
            results.append(fusion.add_view(depths[-1], view.camera))
        curves = fusion.finish().points
        seconds = {"s": fusion.seconds, "cpu_s": fusion.cpu_seconds}
        return FusedViews(depths, results, fusion.points(), curves, fusion.info, seconds)


def curve_rows(solid: MultiView, fused: FusedViews, edges: Edges) -> list[dict[str, float]]:
    """Returns precision, recall and F-score by length within WITHIN_R of the median pixel, against all curves that any
    view sees: first for the fused views, then for every ALONE_EVERY-th single view."""
    r_m = float(np.median([np.median(v.depth[v.depth > 0]) / v.camera.fx_px for v in solid.views if v.depth.any()]))
    rows = [world_score(fused.curves, solid.curves, r_m)]
    for view, depth in list(zip(solid.views, fused.depths, strict=True))[::ALONE_EVERY]:
        camera = view.camera
        found = edges.run(depth, Pinhole(camera.fx_px, camera.cx_px, camera.cy_px), curves=True).curves
        in_world = [points @ camera.rotation + camera.centre for points in found.points]
        rows.append(world_score(in_world, solid.curves, r_m))
    return rows


def world_score(found: Sequence[np.ndarray], true: Sequence[np.ndarray], r_m: float) -> dict[str, float]:
    """Returns export.edges.curve_metrics.score for polylines [n, 3] in the world, with a constant r."""
    # The lines are moved far away from a camera with as large a focal length, so that depth, and with it r, is
    # constant.
    away = np.array([0, 0, FAR])
    metrics = score([line / r_m + away for line in found], [line / r_m + away for line in true], FAR)
    return {key: metrics[key] for key in ("precision", "recall", "f_score")}


def solids(views: int, quick: bool, missing: list[str], said: str) -> Iterator[tuple[int, MultiView]]:
    """Yields seeds of `val` with their solids in `views` views; appends failures to `missing`. Raises ImportError
    without OpenCascade and Embree."""
    from export.solids.multiview import multiview
    from export.solids.recipe import RecipeError

    for seed in tqdm(range(QUICK_SOLIDS if quick else SOLIDS), desc=said, unit="solid", disable=None):
        try:
            yield seed, multiview("val", seed, views)
        except RecipeError as error:
            missing.append(f"val {seed}: {error}")


def measure(bundle: Path, threads: int, quick: bool, folder: Path) -> dict:
    """Returns errors by level, means over views of all solids; curves by level, means over solids, fused and single;
    memory of the first solid, in LARGE_PX. Raises ImportError as `solids`, CalledProcessError if the child process
    fails."""
    from export.solids.multiview import multiview

    rows: dict[str, list[dict]] = {level: [] for level in LEVELS}
    of_curves: dict[str, dict[str, list[dict]]] = {level: {"fused": [], "alone": []} for level in LEVELS}
    memory, missing = None, []
    with Edges(bundle, threads) as edges:
        for seed, solid in solids(VIEWS, quick, missing, "edges: fusion"):
            for level in LEVELS:
                found = fused_views(solid, level, seed, edges, threads)
                rows[level] += errors_of(solid, found.depths, found.results, found.points, found.info.cell_m)
                fused_row, *alone = curve_rows(solid, found, edges)
                of_curves[level]["fused"].append(fused_row)
                of_curves[level]["alone"] += alone
            if not memory:
                memory = memory_of(multiview("val", seed, TIMED_VIEWS, LARGE_PX), bundle, threads, folder)
    curves = [{"level": level, **{way: means_of(scores) for way, scores in ways.items()}}
              for level, ways in of_curves.items() if ways["fused"]]  # fmt: skip
    return {"errors": summed(rows), "curves": curves, "memory": memory, "missing": missing}


def means_of(rows: Sequence[Mapping[str, float]]) -> dict[str, float]:
    return {key: float(np.mean([row[key] for row in rows])) for key in rows[0]}


def measure_times(bundle: Path, threads: int, quick: bool) -> dict:
    """Returns the times of each solid in TIMED_VIEWS, without the networks of the views. Raises ImportError as
    `solids`."""
    times, missing = [], []
    with Edges(bundle, threads) as edges:
        for seed, solid in solids(TIMED_VIEWS, quick, missing, "edges: time of fusion"):
            found = fused_views(solid, TIMED_LEVEL, seed, edges, threads)
            points = int(found.info.point_count)
            times.append({"solid": f"{solid.family} {seed}", "points": points, **found.seconds})
    return {"times": times, "missing": missing}


def memory_of(solid: MultiView, bundle: Path, threads: int, folder: Path) -> dict:
    """Measures memory with cells so wide that there are about MANY points."""
    depths, cameras = [view.depth for view in solid.views], [view.camera for view in solid.views]
    usual = in_child(depths, cameras, bundle, threads, folder)
    return in_child(depths, cameras, bundle, threads, folder, usual["cell_m"] * (usual["points"] / MANY) ** 0.5)


def summed(rows: Mapping[str, Sequence[Mapping[str, float]]]) -> list[dict]:
    """Returns means by level, and the ratio of fused views to one view."""
    found = []
    for level, of_level in rows.items():
        if of_level:
            means = means_of(of_level)
            found.append({"level": level, "views": len(of_level), **means, "ratio": means["fused_r"] / means["one_r"]})
    return found


def found_by(measuring: Callable[[], dict]) -> tuple[dict | None, str]:
    """Returns the result of `measure` or `measure_times`, or None and why it cannot be measured."""
    try:
        return measuring(), ""
    except ImportError as error:
        return None, f"{error.name} is not installed: {INSTALL}"
    except subprocess.CalledProcessError as error:
        return None, error.stderr.strip().splitlines()[-1]


def metrics_from(found: Mapping | None) -> dict[str, float]:
    """Returns the metrics of METRICS and TIME_METRIC in `found`: seconds of the median solid, megabytes scaled to MANY
    points, and the ratio of the level with the smallest gain."""
    if found is None:
        return {}
    metrics = {}
    if found.get("times"):
        metrics[TIME_METRIC] = statistics.median(row["s"] for row in found["times"])
    memory = found.get("memory")
    if memory and memory["points"]:
        metrics["edges_fusion_memory_mb"] = memory["memory_mb"] * MANY / memory["points"]
    if found.get("errors"):
        metrics["edges_fusion_rmse"] = max(row["ratio"] for row in found["errors"])
    return metrics
