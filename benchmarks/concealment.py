"""Measures concealed gaps: PSNR of predicted frames beside the last frame repeated, by the length of the gap.

A gap begins after every third frame of a clip and is at most 300 ms long. Its frames are predicted from the frames
before it alone, as a concealer does. Part of `python -m benchmarks.prediction`.
"""

from __future__ import annotations

from typing import Protocol

import maquette
import numpy as np

MAX_GAP_S = 0.3  # default max_gap_ms of a concealer
FIRST_START, START_STEP = 4, 3  # predictions begin after these frames, as in native/measure_prediction.cpp
METRICS = ("concealment_gain_db", "concealment_worst_db")


class Film(Protocol):
    name: str
    bgr: np.ndarray  # uint8 [T, H, W, 3]
    fps: float


def longest_gap(fps: float) -> int:
    """Returns the length of the longest gap in frames."""
    return int(MAX_GAP_S * fps + 0.5)


def psnr_db(one: np.ndarray, other: np.ndarray) -> float:
    squares = np.mean((one.astype(np.float32) - other) ** 2)
    return float(10 * np.log10(255**2 / max(squares, 0.01)))


def bridged(film: Film, threads: int = 1) -> np.ndarray:
    """Returns the PSNR in dB of the last frame and of the prediction by AUTO, by frames ahead: [starts, frames, 2]."""
    predictor = maquette.Predictor(threads=threads)
    longest, found = longest_gap(film.fps), []
    for t in range(len(film.bgr) - longest):
        # The channel order does not change the PSNR.
        predictor.push(maquette.Frame(np.ascontiguousarray(film.bgr[t]), timestamp_ns=round(t * 1e9 / film.fps)))
        if t < FIRST_START or (t - FIRST_START) % START_STEP:
            continue
        rows = []
        for ahead in range(1, longest + 1):
            truth, made = film.bgr[t + ahead], predictor.predict(ahead / film.fps).pixels()
            rows.append((psnr_db(film.bgr[t], truth), psnr_db(made, truth)))
        found.append(rows)
    return np.array(found)


def by_gap(found: np.ndarray) -> np.ndarray:
    """Returns the mean PSNR over all frames of gaps of 1, 2, ... frames, from a result of `bridged`: [frames, 2]."""
    by_frame = found.mean(0)
    return np.cumsum(by_frame, 0) / np.arange(1, len(by_frame) + 1)[:, None]


def metrics_of(films: dict[str, np.ndarray]) -> dict[str, float]:
    """Returns the gain in dB over the last frame: the mean over clips and lengths of gaps, and the smallest of a
    clip."""
    gains = [float(np.mean(rows[:, 1] - rows[:, 0])) for rows in films.values()]
    return {"concealment_gain_db": float(np.mean(gains)), "concealment_worst_db": min(gains)}


def measure(films: list[Film], threads: int = 1) -> dict[str, np.ndarray]:
    """Returns `by_gap` by name for each clip that is long enough for a gap."""
    return {
        film.name: by_gap(bridged(film, threads))
        for film in films if len(film.bgr) > FIRST_START + longest_gap(film.fps)
    }  # fmt: skip


def table_of(films: dict[str, np.ndarray]) -> list[list[str]]:
    """Returns a header and a row for each clip: PSNR of the last frame and of the prediction, by length of the gap."""
    longest = max(len(rows) for rows in films.values())
    table = [["clip, PSNR in dB", *(f"gap of {n}" for n in range(1, longest + 1))]]
    for name, rows in films.items():
        cells = [f"{last:.1f} / {made:.1f}" for last, made in rows]
        table.append([name, *cells, *[""] * (longest - len(cells))])
    return table
