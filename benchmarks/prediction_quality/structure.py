"""Measures the SSIM of predicted frames by method and frames ahead."""

from __future__ import annotations

from collections.abc import Sequence

import maquette
import numpy as np

from benchmarks.concealment import FIRST_START, START_STEP
from benchmarks.prediction_quality.dis import Dis
from export.scenes.image_quality import ssim

START_STEP_OF_SSIM = 2 * START_STEP  # SSIM takes longer than the predictions


def structure_of(bgr: np.ndarray, fps: float, horizons: Sequence[int], threads: int = 1) -> dict[str, list[float]]:
    """Returns the mean SSIM by method and frames ahead, for frames BGR uint8 [T, H, W, 3]."""
    predictors = {name: maquette.Predictor(name, threads=threads) for name in ("last", "motion", "auto")}
    rgb = np.ascontiguousarray(bgr[..., ::-1])
    dis = Dis(*bgr.shape[1:3])
    found: dict[str, list[list[float]]] = {name: [] for name in (*predictors, "dis")}
    for t in range(len(bgr) - max(horizons)):
        frame = maquette.Frame(rgb[t], timestamp_ns=round(t * 1e9 / fps))
        for predictor in predictors.values():
            predictor.push(frame)
        if t < FIRST_START or (t - FIRST_START) % START_STEP_OF_SSIM:
            continue
        truth = [rgb[t + horizon] / 255 for horizon in horizons]
        pictures = {
            name: [predictor.predict(horizon / fps).pixels() for horizon in horizons]
            for name, predictor in predictors.items()
        }
        to_before = dis.motion(bgr[t], bgr[t - 1])
        pictures["dis"] = [dis.moved(rgb[t], to_before, horizon) for horizon in horizons]
        for name, made in pictures.items():
            found[name].append([ssim(picture / 255, true) for picture, true in zip(made, truth, strict=True)])
    return {name: np.mean(rows, 0).tolist() for name, rows in found.items()}
