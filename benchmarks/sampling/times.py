"""Measures times of sampling: one or several samples, one or several frames."""

from __future__ import annotations

import statistics
import time
from pathlib import Path

import maquette
import numpy as np

from benchmarks.sampling.continuations import GIVEN, SEED, shown

CASES = {  # samples, frames
    "1 sample": (1, 1),
    "4 samples": (4, 1),
    "16 samples": (16, 1),
    "1 sample, 11 frames": (1, 11),
    "4 samples, 11 frames": (4, 11),
}


def times_ms(bundle: Path, frames: np.ndarray, step_s: float, threads: int = 1, rounds: int = 11) -> dict[str, float]:
    """Returns the median time of maq_predictor_sample by case, in milliseconds."""
    predictor = maquette.Predictor("sampled", bundle_path=bundle, threads=threads, temperature=1, seed=SEED)
    shown(predictor, frames[:GIVEN], step_s)
    found: dict[str, list[float]] = {name: [] for name in CASES}
    for name, (samples, count) in CASES.items():
        predictor.sample(samples, count, step_s)  # opens the networks and takes memory
        for _ in range(rounds):
            begin = time.perf_counter()
            predictor.sample(samples, count, step_s)
            found[name].append(1e3 * (time.perf_counter() - begin))
    return {name: statistics.median(own) for name, own in found.items()}


def metrics_of(times: dict[str, float]) -> dict[str, float]:
    return {
        "four_samples_times": times["4 samples, 11 frames"] / times["1 sample, 11 frames"],
        "sampled_frames_a_second": 1000 / times["1 sample"],
    }
