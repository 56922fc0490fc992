"""Curves and boxes that the library finds, beside the true ones: of rendered solids, and of the simulated depth camera.

The simulated camera's truth comes from the program print_solids_truth.
"""

from __future__ import annotations

import json
import statistics
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from tqdm import tqdm

from benchmarks.edges.quality import LEVELS
from benchmarks.edges.speed import SCENES, SMALL_PX
from benchmarks.edges.views import View, polyline
from export.edges.curve_metrics import score
from export.evaluation.edges_api import LINE, Curves, Edges, depth_frames

TRUTH = Path("build/release/benchmarks/native/print_solids_truth")
MIN_LINE_R = 20.0  # shorter lines have no angle to speak of
SAME_LINE_R = 3.0  # from a found line's middle to the true line that it is compared with
NOISES = {"none": "clean", "tof": "tof", "stereo": "stereo"}  # of stub:solids, and the level of each
BOX_SEEDS, BOX_FRAMES, STEADY_FRAMES = 20, 5, 100
SCENE_FRAMES = 20


def view_score(found: Curves, view: View) -> dict[str, float]:
    """Scores of export.edges.curve_metrics: what is found may lie on any true curve, but only those have to be found
    that are surely sharp; with the median angle of lines, degrees."""
    focal_px = view.camera.focal_px
    true = [polyline(c) for c in view.curves["curves"]]
    sure = [polyline(c) for c in view.curves["curves"] if c["sure"]]
    figures = score(found.points, sure, focal_px)
    figures["precision"] = score(found.points, true, focal_px)["precision"]
    lines = [polyline(c) for c in view.curves["curves"] if c["type"] == "line"]
    return with_f_score(figures) | {"angle_deg": line_angle_deg(found, lines, focal_px)}


def with_f_score(figures: dict[str, float]) -> dict[str, float]:
    both = figures["precision"] + figures["recall"]
    return figures | {"f_score": 2 * figures["precision"] * figures["recall"] / both if both > 0 else 0.0}


def line_angle_deg(found: Curves, true: Sequence[np.ndarray], focal_px: float) -> float:
    """Median angle between found lines and the true ones that they lie along; NaN without such lines."""
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


def mean_of(rows: Sequence[Mapping[str, float]]) -> dict[str, float | None]:
    """Means over frames, of each figure those that have it."""
    found = {}
    for name in rows[0]:
        values = [row[name] for row in rows if not np.isnan(row[name])]
        found[name] = float(np.mean(values)) if values else None
    return found


def measure_solids(views: Sequence[View], edges: Edges) -> list[dict]:
    """Rows by sensor, means over views with a curve that is surely sharp."""
    rows = []
    wanted = [view for view in views if any(c["sure"] for c in (view.curves or {"curves": []})["curves"])]
    for level in tqdm(LEVELS, desc="edges: curves", unit="level", disable=None):
        scores, ms = [], []
        for view in wanted:
            found = edges.run(view.seen(level), view.camera, curves=True).curves
            scores.append(view_score(found, view))
            ms.append(found.curves_ms)
        if scores:
            rows.append({"level": level, "views": len(scores), **mean_of(scores), "ms": statistics.median(ms)})
    return rows


def truth_of(scene: str, seed: int, frames: int) -> dict:
    """Raises FileNotFoundError without the program, CalledProcessError where it fails."""
    if not TRUTH.exists():
        raise FileNotFoundError(f"{TRUTH} is not there: cmake --build --preset release --target {TRUTH.name}")
    command = [str(TRUTH), scene, str(seed), *map(str, SMALL_PX), str(frames)]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def frames_of(scene: str, noise: str, seed: int, count: int):
    return depth_frames(f"stub:solids?scene={scene}&noise={noise}&seed={seed}&size={SMALL_PX[0]}x{SMALL_PX[1]}", count)


def measure_scenes(bundle: Path, threads: int, frames: int) -> list[dict]:
    """Rows by scene and noise of the simulated camera, planes skipped: milliseconds of the field, curves and boxes, and
    the score of the curves."""
    rows = []
    with Edges(bundle, threads, skip_planes=1) as edges:
        for scene in tqdm(SCENES, desc="edges: scenes", unit="scene", disable=None):
            truth = truth_of(scene, 1, frames + 1)["frames"]
            for noise in NOISES:
                scores, ms = [], {"field": [], "curves": [], "boxes": []}
                for number, (depth, camera) in enumerate(frames_of(scene, noise, 1, frames + 1)):
                    result = edges.run(depth, camera, curves=True)
                    if not number:  # prepares the network
                        continue
                    lines = [np.array(line) for line in truth[number]]
                    figures = with_f_score(score(result.curves.points, lines, camera.focal_px))
                    scores.append(figures | {"angle_deg": line_angle_deg(result.curves, lines, camera.focal_px)})
                    ms["field"].append(result.stats.total_ms)
                    ms["curves"].append(result.curves.curves_ms)
                    ms["boxes"].append(result.curves.boxes_ms)
                total = [sum(times) for times in zip(*ms.values(), strict=True)]
                medians = {f"{name}_ms": statistics.median(times) for name, times in ms.items()}
                rows.append({"scene": scene, "noise": noise, **mean_of(scores), **medians,
                             "ms": statistics.median(total)})  # fmt: skip
    return rows


def measure_boxes(bundle: Path, threads: int, seeds: int, frames: int, steady_frames: int) -> list[dict]:
    """Rows by noise: of `seeds` cartons of stub:solids?scene=box, seen in `frames` frames each, how many frames have a
    box, the median error of its sides in mm, and the largest standard deviation of a side of one carton while the
    camera turns around it for `steady_frames`."""
    rows = []
    with Edges(bundle, threads) as edges:
        for noise in tqdm(NOISES, desc="edges: boxes", unit="noise", disable=None):
            errors, found, looked = [], 0, 0
            for seed in range(1, seeds + 1):
                true = np.sort(truth_of("box", seed, 0)["cartons_m"][0])[::-1]
                for depth, camera in frames_of("box", noise, seed, frames):
                    boxes = edges.run(depth, camera, curves=True).curves.boxes_m
                    looked += 1
                    found += bool(boxes)
                    errors += list(1000 * np.abs(np.array(boxes[0]) - true)) if boxes else []
            sides = [edges.run(depth, camera, curves=True).curves.boxes_m[:1]
                     for depth, camera in frames_of("box", noise, 1, steady_frames)]  # fmt: skip
            sides = np.array([boxes[0] for boxes in sides if boxes])
            rows.append({"noise": noise, "frames": looked, "with_box": found / looked,
                         "median_mm": statistics.median(errors) if errors else None,
                         "p90_mm": float(np.percentile(errors, 90)) if errors else None,
                         "steady_frames": len(sides), "turned_frames": steady_frames,
                         "deviation_mm": float(1000 * sides.std(0).max()) if len(sides) > 1 else None})  # fmt: skip
    return rows


def _frames_with_box(row: Mapping) -> str:
    return f"a box was found in {row['steady_frames']} of {row['turned_frames']} frames"


def figures_from(
    solids: Sequence[Mapping], scenes: Sequence[Mapping], boxes: Sequence[Mapping]
) -> tuple[dict[str, float], dict[str, str]]:
    """Those that are gates, and why others are missing."""
    figures = {f"edges_curves_{row['level']}": row["f_score"] for row in solids}
    figures |= {f"edges_fps_{row['scene']}": 1000 / row["ms"] for row in scenes if row["noise"] == "tof"}
    missing, by_noise = {}, {row["noise"]: row for row in boxes}
    for noise in ("tof", "stereo"):
        row, name = by_noise[noise], f"edges_box_mm_{noise}"
        if row["median_mm"] is None:
            missing[name] = f"no box was found in {row['frames']} frames"
        else:
            figures[name] = row["median_mm"]
    row = by_noise["tof"]
    if row["deviation_mm"] is None:
        missing["edges_box_deviation_mm"] = _frames_with_box(row)
    else:
        figures["edges_box_deviation_mm"] = row["deviation_mm"]
    for level in LEVELS:
        if f"edges_curves_{level}" not in figures:
            missing[f"edges_curves_{level}"] = "the test views have no curves stored"
    return figures, missing
