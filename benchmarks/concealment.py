"""How much nearer the truth a bridged gap is than the last frame repeated: PSNR of the frames that a concealer makes
up, by the length of the gap. A part of `python -m benchmarks.prediction`.

A gap begins after every third frame of a clip, and its frames are predicted from those before it alone, as a concealer
has them; it is at most 300 ms long.
"""

from __future__ import annotations

from typing import Protocol

import maquette
import numpy as np

MAX_GAP_S = 0.3  # max_gap_ms of a concealer, by default
FIRST_START, START_STEP = 4, 3  # predictions begin after these frames; native/measure_prediction.cpp has them as well
METRICS = ("concealment_gain_db", "concealment_worst_db")


class Film(Protocol):
    name: str
    bgr: np.ndarray  # uint8 [T, H, W, 3]
    fps: float


def longest_gap(fps: float) -> int:
    """In frames."""
    return int(MAX_GAP_S * fps + 0.5)


def psnr_db(one: np.ndarray, other: np.ndarray) -> float:
    squares = np.mean((one.astype(np.float32) - other) ** 2)
    return float(10 * np.log10(255**2 / max(squares, 0.01)))


def bridged(film: Film, threads: int = 1) -> np.ndarray:
    """PSNR in dB of the last frame and of what AUTO predicts, by how many frames after it: [starts, frames, 2]."""
    predictor = maquette.Predictor(threads=threads)
    longest, found = longest_gap(film.fps), []
    for t in range(len(film.bgr) - longest):
        # Its format and channels do not matter to PSNR.
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
    """Of `bridged`: the mean PSNR over all frames of gaps of 1, 2, ... frames [frames, 2]."""
    by_frame = found.mean(0)
    return np.cumsum(by_frame, 0) / np.arange(1, len(by_frame) + 1)[:, None]


def metrics_of(films: dict[str, np.ndarray]) -> dict[str, float]:
    """What bridging gains over the last frame, mean over clips and lengths of gaps; and of the clip where that is
    least."""
    gains = [float(np.mean(rows[:, 1] - rows[:, 0])) for rows in films.values()]
    return {"concealment_gain_db": float(np.mean(gains)), "concealment_worst_db": min(gains)}


def measure(films: list[Film], threads: int = 1) -> dict[str, np.ndarray]:
    """`by_gap` of each clip that is long enough for a gap, by its name."""
    return {
        film.name: by_gap(bridged(film, threads))
        for film in films if len(film.bgr) > FIRST_START + longest_gap(film.fps)
    }  # fmt: skip


def table_of(films: dict[str, np.ndarray]) -> list[list[str]]:
    """A head and a row a clip: the last frame repeated, what is predicted, by frames of the gap."""
    longest = max(len(rows) for rows in films.values())
    table = [["clip, PSNR in dB", *(f"gap of {n}" for n in range(1, longest + 1))]]
    for name, rows in films.items():
        cells = [f"{last:.1f} / {made:.1f}" for last, made in rows]
        table.append([name, *cells, *[""] * (longest - len(cells))])
    return table
