"""Measures times of sampling, beside one sample that is decoded code after code."""

from __future__ import annotations

import statistics
import time
from pathlib import Path

import maquette
import numpy as np

from benchmarks.sampling.continuations import DRAWN, GIVEN, SEED, shown

CASES = {  # samples, frames, passes
    "1 sample": (1, 1, 0),
    "4 samples": (4, 1, 0),
    "16 samples": (16, 1, 0),
    "1 pass": (1, 1, 1),
    "4 passes": (1, 1, 4),
    "8 passes": (1, 1, 8),
    "16 passes": (1, 1, 16),
    "1 sample, 11 frames": (1, 11, 0),
    "4 samples, 11 frames": (4, 11, 0),
}


CELLS_A_FRAME = 256  # cells of a frame
RECOMPUTING = "all cells again for each, estimated"


def times_ms(bundle: Path, frames: np.ndarray, step_s: float, threads: int = 1, rounds: int = 11) -> dict[str, float]:
    """Returns the median time of sampling by case; the cases alternate. RECOMPUTING estimates a frame without stored
    keys and values: each cell would take a pass over all cells. It follows from the time of a further pass."""
    predictors = {}
    for passes in sorted({passes for _, _, passes in CASES.values()}):
        predictors[passes] = maquette.Predictor(
            method="network", network_mode=DRAWN, bundle_path=bundle, threads=threads, temperature=1, seed=SEED,
            passes=passes,
        )  # fmt: skip
        shown(predictors[passes], frames[:GIVEN], step_s)
    found: dict[str, list[float]] = {name: [] for name in CASES}
    for name, (samples, count, passes) in CASES.items():
        predictors[passes].draw(samples, count, step_s)  # opens the networks and takes memory
        for _ in range(rounds):
            begin = time.perf_counter()
            predictors[passes].draw(samples, count, step_s)
            found[name].append(1e3 * (time.perf_counter() - begin))
    medians = {name: statistics.median(own) for name, own in found.items()}
    further = predictors[16].stats["pass_count"] - 1  # fewer than 15 if sampling converged earlier
    a_pass = (medians["16 passes"] - medians["1 pass"]) / max(further, 1)
    return medians | {RECOMPUTING: medians["1 pass"] + (CELLS_A_FRAME - 1) * a_pass}


def metrics_of(times: dict[str, float]) -> dict[str, float]:
    return {
        "four_samples_times": times["4 samples, 11 frames"] / times["1 sample, 11 frames"],
        "sampled_frames_a_second": 1000 / times["1 sample"],
        "passes_frames_a_second": 1000 / times["4 passes"],
        "recomputing_times": times[RECOMPUTING] / times["1 sample"],
    }
