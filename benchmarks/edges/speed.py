"""Measures error against run time of fields, and the saving of each option: all settings alternate on the same
frames."""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
from tqdm import tqdm

from benchmarks.edges.edges_api import Edges, Pinhole, depth_frames
from benchmarks.edges.methods import SHIPPED, Method
from benchmarks.edges.quality import LEVELS, of_pixels
from benchmarks.edges.views import View
from export.edges.config import EPS_R

FULL_PX = 640, 480
SIZES = (640, 320, 160)  # widths to which frames of FULL_PX are reduced
OPTIONS = {"skip planes": {"skip_planes": 1}}  # options of maq_edges_config, by the work that they skip
SCENES = {"wall": "empty wall", "box": "one box", "shelf": "full shelf"}
NOISES = ("none", "tof", "stereo")
SMALL_PX = 320, 240
PROGRAM = Path("build/release/benchmarks/native/measure_edges")
COUNTER = Path("benchmarks/count_allocations.c")
STREAM, STREAM_FRAMES = "stub:solids?scene=shelf&noise=tof&size=640x480", 40


@dataclass
class Setting:
    """axis: the varied option. bundle: networks. width_px: width of the reduced frames. options: of
    maq_edges_config."""

    name: str
    axis: str
    bundle: str
    width_px: int = FULL_PX[0]
    options: dict[str, int] = field(default_factory=dict)
    ms: list[float] = field(default_factory=list)
    metrics: dict[str, list[dict]] = field(default_factory=lambda: {level: [] for level in LEVELS})


def settings(bundles: Sequence[str]) -> list[Setting]:
    """Returns the measured settings; bundles: names of networks, the shipped one first."""
    made = []
    for name in bundles:
        axis = "shipped" if name == SHIPPED else "networks"
        for width in SIZES:
            size = f"{width} x {width * 3 // 4}"
            made.append(Setting(f"{name}, {size}", axis, name, width))
            if name == SHIPPED:
                made += [Setting(f"{name}, {size}, {said}", "savings", name, width, options)
                         for said, options in OPTIONS.items()]  # fmt: skip
    return made


def reduced(way: Method, depth: np.ndarray, camera: Pinhole, width_px: int) -> tuple[np.ndarray, float]:
    """Returns the field of every n-th pixel in both directions, scaled to the frame's size and its r, and the total
    milliseconds."""
    step = depth.shape[1] // width_px
    if step == 1:
        return way.run(depth, camera)
    start = time.perf_counter()
    small = np.ascontiguousarray(depth[::step, ::step])
    before = 1000 * (time.perf_counter() - start)
    found, ms = way.run(small, Pinhole(camera.focal_px / step, camera.cx_px / step, camera.cy_px / step))
    start = time.perf_counter()
    matrix = np.array([[1 / step, 0, 0], [0, 1 / step, 0]], np.float32)
    size, flags = depth.shape[::-1], cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    full = cv2.warpAffine(found, matrix, size, flags=flags, borderMode=cv2.BORDER_REPLICATE)
    full = np.minimum(full * step, EPS_R)
    return full, ms + before + 1000 * (time.perf_counter() - start)


def measure(
    views: Sequence[View], bundles: Mapping[str, Path], baselines: Mapping[str, Mapping[str, Method]], threads: int
) -> list[dict]:
    """Returns rows of every setting and baseline on frames of FULL_PX: median milliseconds, and RMSE in r of the full
    frame, by level and their mean. baselines: by level."""
    wanted = settings(list(bundles))
    baseline_rows = [Setting(name, "without a network", "") for name in next(iter(baselines.values()), {})]
    with ExitStack() as stack:
        ways = {}
        for setting in wanted:
            key = setting.bundle, *setting.options.items()
            if key not in ways:
                ways[key] = stack.enter_context(Edges(bundles[setting.bundle], threads, **setting.options))
        for number, view in enumerate(tqdm([views[0], *views], desc="edges: run time", unit="view", disable=None)):
            for level in LEVELS:
                depth = view.seen(level)
                counts = view.frame.counts & (depth > 0)
                for setting in [*wanted, *baseline_rows]:
                    if setting.bundle:
                        way: Method = _Library(ways[setting.bundle, *setting.options.items()])
                    else:
                        way = baselines[level][setting.name]
                    distance, ms = reduced(way, depth, view.camera, setting.width_px)
                    if number:  # the first frame of a size prepares the network
                        setting.ms.append(ms)
                        setting.metrics[level].append(of_pixels(distance, view, counts))
    rows = []
    for setting in [*wanted, *baseline_rows]:
        rmse = {level: float(np.nanmean([f["rmse_r"] for f in found])) for level, found in setting.metrics.items()}
        rows.append({"setting": setting.name, "axis": setting.axis, "width_px": setting.width_px,
                     "ms": round(statistics.median(setting.ms), 3), "ms_p90": round(_p90(setting.ms), 3),
                     "rmse_r": round(float(np.mean(list(rmse.values()))), 4),
                     "by_level": {level: round(value, 4) for level, value in rmse.items()}})  # fmt: skip
    return rows


@dataclass(frozen=True)
class _Library:
    edges: Edges

    def run(self, depth: np.ndarray, camera: Pinhole) -> tuple[np.ndarray, float]:
        found = self.edges.run(depth, camera)
        return found.distance, found.stats.total_ms


def _p90(values: Sequence[float]) -> float:
    return float(np.percentile(values, 90))


def measure_savings(bundle: Path, threads: int, frames: int) -> list[dict]:
    """Returns for each scene, noise and option the medians of both times, and the difference of the fields."""
    rows = []
    with ExitStack() as stack:
        plain = stack.enter_context(Edges(bundle, threads))
        with_option = {name: stack.enter_context(Edges(bundle, threads, **o)) for name, o in OPTIONS.items()}
        for scene in tqdm(SCENES, desc="edges: savings", unit="scene", disable=None):
            for noise in NOISES:
                tally = {name: {"without": [], "with": [], "rms": [], "side": [], "fraction": []} for name in OPTIONS}
                uri = f"stub:solids?scene={scene}&noise={noise}&size={SMALL_PX[0]}x{SMALL_PX[1]}"
                for number, (depth, camera) in enumerate(depth_frames(uri, frames + 1)):
                    for name, saving in with_option.items():
                        ours, other = plain.run(depth, camera), saving.run(depth, camera)
                        if not number:
                            continue
                        known, own = depth > 0, tally[name]
                        own["without"].append(ours.stats.total_ms)
                        own["with"].append(other.stats.total_ms)
                        own["rms"].append(float(np.sqrt(np.mean((ours.distance - other.distance)[known] ** 2))))
                        own["side"].append(float(((ours.distance < 1) != (other.distance < 1))[known].mean()))
                        own["fraction"].append(other.stats.network_pixel_count / max(ours.stats.network_pixel_count, 1))
                for name, own in tally.items():
                    rows.append({"scene": scene, "noise": noise, "option": name,
                                 "ms_without": statistics.median(own["without"]), "ms": statistics.median(own["with"]),
                                 "difference_r": float(np.mean(own["rms"])), "other_side": float(np.mean(own["side"])),
                                 "network_fraction": float(np.mean(own["fraction"]))})  # fmt: skip
    return rows


def stream_cost(bundle: Path, threads: int, folder: Path) -> dict[str, float]:
    """Returns the cost of a stream of 640 x 480: `edges_memory_mb` added to the peak of a process, `edges_allocations`
    a frame in steady state, and `edges_own_allocations` without ONNX Runtime. Raises FileNotFoundError without the
    program, CalledProcessError if it fails."""
    if not PROGRAM.exists():
        raise FileNotFoundError(f"{PROGRAM} is not there: cmake --build --preset release --target {PROGRAM.name}")
    library, count = folder / "count_allocations.so", folder / "edges-allocations.json"
    subprocess.run(["cc", "-std=c11", "-O2", "-shared", "-fPIC", "-Isdk/include", "-o", str(library), str(COUNTER)],
                   check=True)  # fmt: skip
    command = [str(PROGRAM), str(bundle), STREAM, str(STREAM_FRAMES), str(threads)]
    said = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    first = STREAM_FRAMES // 2  # the first frames create a session and fill pools
    environment = {"LD_PRELOAD": str(library), "COUNT_FILE": str(count), "COUNT_FROM": str(first),
                   "COUNT_TO": str(STREAM_FRAMES - 1)}  # fmt: skip
    subprocess.run(command, check=True, capture_output=True, env={**os.environ, **environment})
    counted = json.loads(count.read_text())
    all_of_them, own = counted["allocations"], counted["allocations"] - counted["of_onnxruntime"]
    return {"edges_memory_mb": json.loads(said)["memory_mb"],
            "edges_allocations": all_of_them / counted["frames"],
            "edges_own_allocations": own / counted["frames"]}  # fmt: skip


def metrics_from(rows: Sequence[Mapping]) -> dict[str, float]:
    """Returns frames a second of the field, by size."""
    shipped = {row["width_px"]: row["ms"] for row in rows if row["axis"] == "shipped"}
    return {f"edges_fps_{width}": 1000 / shipped[width] for width in (320, 640)}
