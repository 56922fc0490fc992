"""How far a field is from the true one: the paper's metrics, of one frame, then averaged over frames."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from export.edges.config import EPS_R, SHARP_R

MAX_FALSE_POSITIVES = {1.0: 0.005, 4.0: 0.02}  # of pixels that are not sharp, at each threshold of SHARP_R
STEPS = 256  # thresholds tried between 0 and EPS_R


def frame_metrics(distance: np.ndarray, true: np.ndarray, counts: np.ndarray) -> dict[str, object]:
    """distance, true: [H, W] in r; counts: bool [H, W]. Root mean square and 95 % quantile of the error, the first also
    over pixels within 4 r of an edge; for each threshold of SHARP_R the share of sharp pixels found and of others
    called sharp, [STEPS + 1] over where the distance is cut."""
    distance, true = np.clip(distance[counts], 0, EPS_R), true[counts]
    error = np.abs(distance - true)
    metrics: dict[str, object] = {
        "rmse_r": float(np.sqrt(np.mean(error**2))) if error.size else np.nan,
        "q95_r": float(np.quantile(error, 0.95)) if error.size else np.nan,
    }
    near = true < SHARP_R[-1]
    metrics["rmse_near_r"] = float(np.sqrt(np.mean(error[near] ** 2))) if near.any() else np.nan
    at = np.minimum((distance / EPS_R * STEPS).astype(int), STEPS - 1)
    for sharp_r in SHARP_R:
        sharp = true < sharp_r
        for name, mask in (("found", sharp), ("false", ~sharp)):
            below = np.concatenate([[0], np.cumsum(np.bincount(at[mask], minlength=STEPS))])
            metrics[f"{name}_{sharp_r:g}r"] = below / mask.sum() if mask.any() else np.full(STEPS + 1, np.nan)
    return metrics


def cuts(frames: Sequence[Mapping[str, object]]) -> dict[float, int]:
    """For each threshold of SHARP_R where to cut distances so that the mean share of false positives stays in bounds;
    to be chosen on validation frames."""
    return {
        sharp_r: int(np.flatnonzero(_mean(frames, f"false_{sharp_r:g}r") <= MAX_FALSE_POSITIVES[sharp_r])[-1])
        for sharp_r in SHARP_R
    }


def summary(frames: Sequence[Mapping[str, object]], at: Mapping[float, int]) -> dict[str, float]:
    """Means over frames, with distances cut as `cuts` of other frames says."""
    metrics = {name: float(_mean(frames, name)) for name in ("rmse_r", "rmse_near_r", "q95_r")}
    for sharp_r in SHARP_R:
        metrics[f"recall_{sharp_r:g}r"] = float(_mean(frames, f"found_{sharp_r:g}r")[at[sharp_r]])
        metrics[f"fpr_{sharp_r:g}r"] = float(_mean(frames, f"false_{sharp_r:g}r")[at[sharp_r]])
    return metrics


def _mean(frames: Sequence[Mapping[str, object]], name: str) -> np.ndarray:
    return np.nanmean(np.stack([np.asarray(frame[name], np.float64) for frame in frames]), 0)
