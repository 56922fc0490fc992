"""Time, processor time, memory and start of the products. All alternate within one run, and one computes at a time.

Clips: each product runs a window of consecutive frames as a stream, then the next product runs the same window.
Photographs: each product runs one, then the next product. A process is bound to one core or to two.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from tqdm import tqdm

from benchmarks.frame_time import MAX_OTHERS, OthersFraction
from benchmarks.products.clips import name_of
from benchmarks.products.running import Product, Running, size_mb
from export.evaluation.photos import read_photo
from export.people.clips.clip_file import read_clip

CORES = (1, 2)
WARM_UP = 5  # frames of a window that do not count
_WINDOW = 25
_QUIET_S = 3.0


def windows_of(paths: Sequence[Path], length: int = _WINDOW) -> dict[str, tuple[list[np.ndarray], int]]:
    """Consecutive frames, uint8 [H, W, 3] RGB, from the middle of each clip, and the nanoseconds between two."""
    windows = {}
    for path in paths:
        clip = read_clip(path)
        first = max(0, (clip.truth.frames - length) // 2)
        chosen = range(first, min(first + length, clip.truth.frames))
        step_ns = int(np.diff(clip.truth.time_ns).mean())
        windows[name_of(path)] = [np.ascontiguousarray(clip.image(t)[..., ::-1]) for t in chosen], step_ns
    return windows


class Times:
    """Milliseconds, processor milliseconds and people of the counted frames of a product."""

    def __init__(self) -> None:
        self.frames: dict[str, list[float]] = {"ms": [], "cpu_ms": [], "people": []}

    def add(self, timed: dict) -> None:
        for key, values in self.frames.items():
            values += timed[key] if isinstance(timed[key], list) else [timed[key]]

    def metrics(self) -> dict[str, float]:
        ms = self.frames["ms"]
        return {
            "ms": round(statistics.median(ms), 2),
            "ms_p90": round(float(np.percentile(ms, 90)), 2),
            "cpu_ms": round(statistics.mean(self.frames["cpu_ms"]), 2),
            "people": round(statistics.mean(self.frames["people"]), 2),
            "frames": len(ms),
        }


def measure(
    products: Sequence[Product], clips: Sequence[Path], photographs: Sequence[Path], log: Path, rounds: int = 4,
    starts: int = 7,
) -> dict:  # fmt: skip
    """clips: of `export.people.clips`. photographs: image files. starts: new processes of each product."""
    warnings = [_busy()]
    windows = windows_of(clips)
    photos = [read_photo(path) for path in photographs]
    measured: dict[str, dict] = {product.name: {"clips": {}, "photographs": {}} for product in products}
    for cores in CORES:
        for key, times in _alternated(products, windows, photos, cores, rounds, log).items():
            for name, own in times.items():
                measured[name][key][str(cores)] = own.metrics()
        warnings.append(_busy())
    for name, row in _starts(products, photos[0], windows, starts, log).items():
        measured[name] |= row
    warnings.append(_busy())
    for product in products:
        measured[product.name] |= {
            "networks_mb": round(size_mb(product.networks), 2),
            "library_mb": round(size_mb(product.library), 1),
        }
    said = [text for text in dict.fromkeys(warnings) if text]
    return {"windows": len(windows), "photos": len(photos), "rounds": rounds, "starts": starts,
            "products": measured, "warnings": said}  # fmt: skip


def _busy() -> str:
    """A warning if other processes compute while the products wait, or ""."""
    others = OthersFraction()
    time.sleep(_QUIET_S)
    busy = others.now()
    return f"other processes used {busy:.0%} of the processor: the times are not reliable" if busy > MAX_OTHERS else ""


def _alternated(
    products: Sequence[Product], windows: dict, photos: list[np.ndarray], cores: int, rounds: int, log: Path
) -> dict[str, dict[str, Times]]:
    times = {key: {product.name: Times() for product in products} for key in ("clips", "photographs")}
    running = [Running(product, cores, log / f"{product.name}.log") for product in products]
    total = rounds * len(products) * (len(windows) + len(photos))
    try:
        for process in running:
            for name, (frames, _) in windows.items():
                process.ask("keep", {str(k): frame for k, frame in enumerate(frames)}, name=name)
            process.ask("keep", {str(k): photo for k, photo in enumerate(photos)}, name="photographs")
            process.ask("time_photo", name="photographs", index=0)  # networks are loaded
        with tqdm(total=total, desc=f"{cores} cores" if cores > 1 else "1 core", unit="block", disable=None) as bar:
            for turn in range(rounds):
                ordered = running[turn % len(running) :] + running[: turn % len(running)]
                for name, (_, step_ns) in windows.items():
                    for process in ordered:
                        timed = process.ask("time_frames", name=name, warm_up=WARM_UP, step_ns=step_ns)
                        times["clips"][process.product.name].add(timed)
                        bar.update()
                for index in range(len(photos)):
                    for process in ordered:
                        timed = process.ask("time_photo", name="photographs", index=index)
                        times["photographs"][process.product.name].add(timed)
                        bar.update()
    finally:
        for process in running:
            process.close()
    return times


def _starts(
    products: Sequence[Product], photo: np.ndarray, windows: dict, starts: int, log: Path
) -> dict[str, dict[str, float]]:
    """New processes, from the first instruction to the people of a photograph, and the memory after a window of frames,
    which then have been computed by a process that holds nothing else."""
    rows: dict[str, list[dict[str, float]]] = {product.name: [] for product in products}
    frames, step_ns = next(iter(windows.values()))
    for _ in tqdm(range(starts), desc="starts", unit="round", disable=None):
        for product in products:
            begin_s = time.perf_counter()
            with Running(product, CORES[-1], log / f"{product.name}.log") as process:
                process.photo(photo)
                first_s = time.perf_counter() - begin_s
                cpu_s = process.ask("usage")["cpu_s"]
                process.ask("start")
                for k, frame in enumerate(frames):
                    process.frame(frame, k, k * step_ns)
                used = process.ask("usage")
            rows[product.name].append({"start_s": first_s, "start_cpu_s": cpu_s, "peak_rss_mb": used["peak_rss_mb"],
                                       "rss_mb": used["rss_mb"], "threads": used["threads"]})  # fmt: skip
    return {name: {key: round(statistics.median(run[key] for run in runs), 3) for key in runs[0]}
            for name, runs in rows.items()}  # fmt: skip
