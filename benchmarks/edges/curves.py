"""Compares curves and boxes of the library with the true ones, on rendered solids and the simulated depth camera.

The truth of the simulated camera comes from the program print_solids_truth.
"""

from __future__ import annotations

import json
import statistics
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from tqdm import tqdm

from benchmarks.edges.curve_scores import line_angle_deg, view_score, with_f_score
from benchmarks.edges.edges_api import Edges, depth_frames
from benchmarks.edges.methods import SHIPPED
from benchmarks.edges.quality import LEVELS
from benchmarks.edges.speed import SCENES, SMALL_PX
from benchmarks.edges.views import View
from export.edges.curve_metrics import score

TRUTH = Path("build/release/benchmarks/native/print_solids_truth")
NOISES = {"none": "clean", "tof": "tof", "stereo": "stereo"}  # noise of stub:solids, and its level
BOX_SEEDS, BOX_FRAMES, STEADY_FRAMES = 20, 5, 100
SCENE_FRAMES = 20


def mean_of(rows: Sequence[Mapping[str, float]]) -> dict[str, float | None]:
    """Returns means over frames; frames without a metric are left out of its mean."""
    found = {}
    for name in rows[0]:
        values = [row[name] for row in rows if not np.isnan(row[name])]
        found[name] = float(np.mean(values)) if values else None
    return found


def with_curves(views: Sequence[View]) -> list[View]:
    """Returns the views with a curve that is certainly sharp."""
    return [view for view in views if any(c["sure"] for c in (view.curves or {"curves": []})["curves"])]


def measure_solids(views: Sequence[View], edges: Edges) -> list[dict]:
    """Returns a row for each sensor: means over views with a curve that is certainly sharp."""
    rows, wanted = [], with_curves(views)
    for level in tqdm(LEVELS if wanted else (), desc="edges: curves", unit="level", disable=None):
        scores, ms = [], []
        for view in wanted:
            found = edges.run(view.seen(level), view.camera, curves=True).curves
            scores.append(view_score(found, view))
            ms.append(found.curves_ms)
        metrics = {"views": len(scores), **mean_of(scores), "ms": statistics.median(ms)}
        rows.append({"level": level, "way": SHIPPED, **metrics})
    return rows


def truth_of(scene: str, seed: int, frames: int) -> dict:
    """Returns the ground truth of a scene. Raises FileNotFoundError without the program, CalledProcessError if it
    fails."""
    if not TRUTH.exists():
        raise FileNotFoundError(f"{TRUTH} is not there: cmake --build --preset release --target {TRUTH.name}")
    command = [str(TRUTH), scene, str(seed), *map(str, SMALL_PX), str(frames)]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def frames_of(scene: str, noise: str, seed: int, count: int):
    return depth_frames(f"stub:solids?scene={scene}&noise={noise}&seed={seed}&size={SMALL_PX[0]}x{SMALL_PX[1]}", count)


def measure_scenes(bundle: Path, threads: int, frames: int) -> list[dict]:
    """Returns rows by scene and noise of the simulated camera, with planes skipped: milliseconds of the field, curves
    and boxes, and the score of the curves."""
    rows = []
    with Edges(bundle, threads, skip_planes=1) as edges:
        for scene in tqdm(SCENES, desc="edges: scenes", unit="scene", disable=None):
            truth = truth_of(scene, 1, frames + 1)["frames"]
            for noise in NOISES:
                scores, ms = [], {"field": [], "curves": [], "boxes": []}
                for number, (depth, camera) in enumerate(frames_of(scene, noise, 1, frames + 1)):
                    result = edges.run(depth, camera, curves=True)
                    if not number:  # the first frame prepares the network
                        continue
                    lines = [np.array(line) for line in truth[number]]
                    metrics = with_f_score(score(result.curves.points, lines, camera.focal_px))
                    scores.append(metrics | {"angle_deg": line_angle_deg(result.curves, lines, camera.focal_px)})
                    ms["field"].append(result.stats.total_ms)
                    ms["curves"].append(result.curves.curves_ms)
                    ms["boxes"].append(result.curves.boxes_ms)
                total = [sum(times) for times in zip(*ms.values(), strict=True)]
                medians = {f"{name}_ms": statistics.median(times) for name, times in ms.items()}
                rows.append({"scene": scene, "noise": noise, **mean_of(scores), **medians,
                             "ms": statistics.median(total)})  # fmt: skip
    return rows


def measure_boxes(edges: Edges, seeds: int, frames: int, steady_frames: int) -> list[dict]:
    """Returns a row for each noise of `seeds` boxes of stub:solids?scene=box, `frames` frames each: the fraction of
    frames with a box, the median error of its sides in mm, and the largest standard deviation of a side of one box
    while the camera orbits it for `steady_frames`."""
    rows = []
    for noise in tqdm(NOISES, desc="edges: boxes", unit="noise", disable=None):
        errors, found, looked = [], 0, 0
        for seed in range(1, seeds + 1):
            true = np.sort(truth_of("box", seed, 0)["cartons_m"][0])[::-1]
            for boxes in _boxes_of(edges, noise, seed, frames):
                looked += 1
                found += bool(boxes)
                errors += list(1000 * np.abs(np.array(boxes[0]) - true)) if boxes else []
        sides = np.array([boxes[0] for boxes in _boxes_of(edges, noise, 1, steady_frames) if boxes])
        rows.append({"noise": noise, "way": SHIPPED, "frames": looked, "with_box": found / looked,
                     "median_mm": float(np.median(errors)) if errors else None,
                     "p90_mm": float(np.percentile(errors, 90)) if errors else None,
                     "steady_frames": len(sides), "turned_frames": steady_frames,
                     "deviation_mm": float(1000 * sides.std(0).max()) if len(sides) > 1 else None})  # fmt: skip
    return rows


def _boxes_of(edges: Edges, noise: str, seed: int, frames: int) -> list[list[tuple[float, float, float]]]:
    """Returns the sides in metres of all boxes in each frame, the largest box first."""
    return [edges.run(depth, camera, curves=True).curves.boxes_m
            for depth, camera in frames_of("box", noise, seed, frames)]  # fmt: skip


def _frames_with_box(row: Mapping) -> str:
    return f"a box was found in {row['steady_frames']} of {row['turned_frames']} frames"


def scene_metrics_from(scenes: Sequence[Mapping]) -> dict[str, float]:
    """Returns the metrics with a target."""
    return {f"edges_fps_{row['scene']}": 1000 / row["ms"] for row in scenes if row["noise"] == "tof"}


def metrics_from(solids: Sequence[Mapping], boxes: Sequence[Mapping]) -> tuple[dict[str, float], dict[str, str]]:
    """Returns the metrics with a target, and why others are missing."""
    metrics = {f"edges_curves_{row['level']}": row["f_score"] for row in solids if row["way"] == SHIPPED}
    missing, by_noise = {}, {row["noise"]: row for row in boxes if row["way"] == SHIPPED}
    for noise in ("tof", "stereo"):
        row, name = by_noise[noise], f"edges_box_mm_{noise}"
        if row["median_mm"] is None:
            missing[name] = f"no box was found in {row['frames']} frames"
        else:
            metrics[name] = row["median_mm"]
    row = by_noise["tof"]
    if row["deviation_mm"] is None:
        missing["edges_box_deviation_mm"] = _frames_with_box(row)
    else:
        metrics["edges_box_deviation_mm"] = row["deviation_mm"]
    for level in LEVELS:
        if f"edges_curves_{level}" not in metrics:
            missing[f"edges_curves_{level}"] = "the test views have no curves stored"
    return metrics, missing
