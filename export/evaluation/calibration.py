"""Whether a score is the chance of being right: of detections with score .7, seven of ten should be people.

Reliability table and expected calibration error (ECE): Guo et al., "On Calibration of Modern Neural Networks",
ICML 2017, equation 3, with detections for images and "box IoU >= .5 with a person" for "right class".
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from export.evaluation.average_precision import ImageMatches, ranked

BINS = 10
RIGHT_IOU = 0.5


@dataclass(frozen=True)
class Calibration:
    """Detections in BINS bins of equal width over scores 0..1.

    count: detections in each bin. mean_score, fraction_right: of each bin, NaN where it is empty. expected_error: mean
    of |fraction_right - mean_score|, weighted by count; NaN without detections.
    """

    count: list[int]
    mean_score: list[float]
    fraction_right: list[float]
    expected_error: float


def calibrate(images: list[ImageMatches]) -> Calibration:
    """images: detections and their box IoU. Detections of ignored people count neither way."""
    score, right = ranked(images, RIGHT_IOU)
    place = np.minimum((score * BINS).astype(int), BINS - 1)
    count = np.bincount(place, minlength=BINS)
    full = np.maximum(count, 1)
    mean_score = np.where(count, np.bincount(place, score, minlength=BINS) / full, np.nan)
    fraction_right = np.where(count, np.bincount(place, right, minlength=BINS) / full, np.nan)
    error = np.nansum(count * np.abs(fraction_right - mean_score)) / count.sum() if len(score) else np.nan
    return Calibration(count.tolist(), mean_score.tolist(), fraction_right.tolist(), float(error))
