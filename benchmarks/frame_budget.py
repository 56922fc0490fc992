"""Measures a device that throttles: deadlines met and labels kept, with a frame budget and without.

    python -m benchmarks --only frame_budget    some minutes; `make bench` builds the program

The same stream goes through a pipeline (benchmarks/native/measure_frame_budget.cpp) on one thread, at the full
processor time and at fractions of it. Linux control groups limit the process to that fraction, which needs the right to
create a group.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from tqdm import tqdm

from benchmarks.frame_time import OthersFraction
from benchmarks.ui_latency import DENSE_POSE, PROGRAMS

FRACTIONS = (1.0, 0.5, 0.25)  # fractions of the processor time
ROOM = 1.3  # ratio of the budget to the median time of a frame at full processor time
WIDTH, HEIGHT = 480, 360
PERIOD_US, MIN_QUOTA_US = 4000, 1000  # short, so that each frame is slowed down evenly; the minimum of the kernel
GROUPS = Path("/sys/fs/cgroup")


@dataclass(frozen=True)
class Run:
    """ms, side_px, is_key: one entry for each frame. labels: uint8 [frames, height, width], body parts, 0 for
    background."""

    ms: np.ndarray
    side_px: np.ndarray
    is_key: np.ndarray
    labels: np.ndarray


@contextmanager
def processor_fraction(fraction: float) -> Iterator[list[str]]:
    """Returns the words before a command that limit it to that fraction of a core. Raises OSError if no control group
    can be created."""
    if fraction >= 1:
        yield []
        return
    is_unified = (GROUPS / "cgroup.controllers").exists()
    group = (GROUPS if is_unified else GROUPS / "cpu") / f"maquette-{os.getpid()}"
    group.mkdir()
    try:
        quota_us = max(MIN_QUOTA_US, round(fraction * PERIOD_US))
        if is_unified:
            (group / "cpu.max").write_text(f"{quota_us} {PERIOD_US}")
        else:
            (group / "cpu.cfs_period_us").write_text(str(PERIOD_US))
            (group / "cpu.cfs_quota_us").write_text(str(quota_us))
        yield ["sh", "-c", f'echo $$ > {group}/cgroup.procs && exec "$@"', "sh"]
    finally:
        group.rmdir()


def run_stream(frames: int, fraction: float, budget_ms: float) -> Run:
    """Runs the program. Raises FileNotFoundError without it, CalledProcessError, OSError if the process cannot be
    throttled."""
    program = PROGRAMS / "measure_frame_budget"
    if not program.exists():
        raise FileNotFoundError(f"{program} is not there: make bench builds it")
    source = f"stub:people?count=2&seed=7&size={WIDTH}x{HEIGHT}&frames={frames}"
    with tempfile.TemporaryDirectory() as folder, processor_fraction(fraction) as throttled:
        path = Path(folder) / "labels"
        command = [*throttled, str(program), str(DENSE_POSE), source, f"{budget_ms:.3f}", str(path)]
        printed = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout
        ms, side_px, is_key = (np.array(column) for column in zip(*json.loads(printed), strict=True))
        return Run(ms, side_px, is_key, np.fromfile(path, np.uint8).reshape(-1, HEIGHT, WIDTH))


def agreement(labels: np.ndarray, wanted: np.ndarray) -> float:
    """Returns the fraction of pixels with the same part, among pixels that are a person in either."""
    body = (labels > 0) | (wanted > 0)
    return float((labels == wanted)[body].mean())


def row(run: Run, wanted: np.ndarray, budget_ms: float, fraction: float, has_budget: bool) -> dict:
    """Returns the row of a run for the table. met_late: deadlines met in the second half, after the budget was
    found."""
    met = run.ms <= budget_ms
    changes = np.flatnonzero(np.diff(run.side_px)) + 1
    # Compares the first frame after a change of the input size with the median of the ten frames after it.
    costs = [run.ms[k] / np.median(run.ms[k + 1 : k + 11]) for k in changes if k + 11 < len(met)]
    return {
        "fraction": fraction,
        "budget": has_budget,
        "met": round(float(met.mean()), 3),
        "met_late": round(float(met[len(met) // 2 :].mean()), 3),
        "time": round(float(np.median(run.ms)) / budget_ms, 3),
        "agreement": round(agreement(run.labels, wanted), 3),
        "side_px": int(run.side_px[-1]),
        "key_frames": round(float(run.is_key[len(met) // 2 :].mean()), 3),
        "side_changes": len(changes),
        "change_cost": [round(float(cost), 2) for cost in costs],
    }


def throttle_missing() -> str:
    """Returns why the processor cannot be throttled, "" if it can."""
    try:
        with processor_fraction(FRACTIONS[-1]):
            return ""
    except OSError as error:
        return f"no control group can be made: {error}"


def measure(quick: bool) -> dict:
    missing = throttle_missing()
    if missing:
        return {"missing": missing}
    frames = 60 if quick else 400
    others = OthersFraction()
    first = run_stream(frames, 1, 0)
    budget_ms = ROOM * statistics.median(first.ms)
    rows = []
    for fraction in tqdm(FRACTIONS, desc="frame budget", unit="fraction", disable=None):
        for has_budget in (False, True):
            run = run_stream(frames, fraction, budget_ms if has_budget else 0)
            rows.append(row(run, first.labels, budget_ms, fraction, has_budget))
    return {"frames": frames, "room": ROOM, "others": round(others.now(), 3), "rows": rows}


def section(measured: dict) -> tuple[str, list]:
    """Returns the title and the parts of the section."""
    title = "A frame budget while a device throttles"
    if "missing" in measured:
        return title, [f"Not measured: {measured['missing']}."]
    table = [["processor", "frame budget", "deadlines met", "of the second half", "median time / budget",
              "same part", "long side at the end", "key frames"]]  # fmt: skip
    for found in measured["rows"]:
        table.append([f"{found['fraction']:.0%}", "yes" if found["budget"] else "no", f"{found['met']:.0%}",
                      f"{found['met_late']:.0%}", f"{found['time']:.2f}", f"{found['agreement']:.3f}",
                      f"{found['side_px']} px", f"{found['key_frames']:.0%}"])  # fmt: skip
    costs = [cost for found in measured["rows"] for cost in found["change_cost"]]
    change = (
        f" The first frame with an input of another size, a key frame, took {statistics.median(costs):.1f} times as "
        f"long as those after it (median of {len(costs)})." if costs else ""
    )  # fmt: skip
    return title, [
        table,
        f"{measured['frames']} frames of two people, {WIDTH} x {HEIGHT}, one thread, which gets that fraction of each "
        f"{PERIOD_US / 1000:g} ms. The budget is {measured['room']:g} times the median time of a frame at 100 %. Same "
        "part: of the pixels on a body, those with the label that they have without throttle and budget. Other work "
        f"used {measured['others']:.0%} of the processor meanwhile, so that only ratios of this table count." + change,
    ]
