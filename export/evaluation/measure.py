"""Runs one backend over labelled images and turns what it says into figures."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import asdict, dataclass

import numpy as np
from tqdm import tqdm

from export.evaluation.average_precision import THRESHOLDS, ImageMatches, average_precision, box_iou
from export.evaluation.backends import Backend, Prediction
from export.evaluation.shards import LabelledImage
from export.evaluation.surface_accuracy import PixelAccuracy, PointAccuracy, SurfaceTable

# Under GPS a detection that overlaps somebody too small or too hidden by this much counts neither way.
IGNORE_IOU = 0.5


@dataclass(frozen=True)
class Figures:
    """One backend's figures. Shares are 0..1, errors in cm, times in seconds; NaN: nothing to measure.

    ap_box, ap_gps: mean over THRESHOLDS; *_by_threshold: at each. Pixel figures are at `threshold`, AP over
    all scores. part_recall: of parts 0 (background) to 24.
    """

    images: int
    people: int
    ignored: int
    found: int
    threshold: float
    ap_box: float
    ap_box_50: float
    ap_gps: float
    ap_gps_50: float
    part_accuracy: float
    mask_iou: float
    median_du: float
    median_dv: float
    error_cm_right_part: float
    error_cm_painted: float
    seconds_per_image: float
    ap_box_by_threshold: list[float]
    ap_gps_by_threshold: list[float]
    part_recall: list[float]

    def as_json(self) -> dict:
        """Plain values; NaN becomes None."""

        def plain(value: object) -> object:
            if isinstance(value, list):
                return [plain(v) for v in value]
            if isinstance(value, float):
                return None if np.isnan(value) else round(value, 6)
            return value

        return {name: plain(value) for name, value in asdict(self).items()}


def measure(
    backend: Backend,
    images: Iterable[LabelledImage],
    table: SurfaceTable,
    total: int | None = None,
) -> Figures:
    """images: labelled images with surface points. total: their number, for the progress bar."""
    pixels, points = PixelAccuracy(), PointAccuracy()
    boxes, ignorable, scores, shown = [], [], [], []
    people = ignored = 0
    seconds = 0.0
    for image in tqdm(images, total=total, desc=f"{backend.kind} {backend.precision}", unit="image", disable=None):
        start = time.perf_counter()
        found = backend.predict(image.image)
        seconds += time.perf_counter() - start
        check(found, image)
        asked = ~image.ignore
        people, ignored = people + int(asked.sum()), ignored + int(image.ignore.sum())
        overlap = box_iou(found.box, image.box)
        boxes.append(overlap[:, asked])
        ignorable.append(overlap[:, image.ignore].max(1, initial=0.0))
        scores.append(found.score)
        above = found.above(backend.threshold)
        shown.append(len(above.score))
        pixels.add(image.label, above.iuv)
        points.add(image, found.iuv, found.inds, len(found.score))

    surface = points.solve(table)
    box_matches = [ImageMatches(*row) for row in zip(scores, boxes, ignorable, strict=True)]
    gps_matches = [ImageMatches(*row) for row in zip(scores, surface.similarity(), ignorable, strict=True)]
    ap_box = [average_precision(box_matches, t) for t in THRESHOLDS]
    ap_gps = [average_precision(gps_matches, t, ignore_threshold=IGNORE_IOU) for t in THRESHOLDS]
    right_part, painted = surface.median_error_cm(_visible(surface, shown))
    du, dv = pixels.median_difference()
    return Figures(
        images=len(scores),
        people=people,
        ignored=ignored,
        found=sum(shown),
        threshold=float(backend.threshold),
        ap_box=float(np.mean(ap_box)),
        ap_box_50=ap_box[0],
        ap_gps=float(np.mean(ap_gps)),
        ap_gps_50=ap_gps[0],
        part_accuracy=pixels.part_accuracy(),
        mask_iou=pixels.mask_iou(),
        median_du=du,
        median_dv=dv,
        error_cm_right_part=right_part,
        error_cm_painted=painted,
        seconds_per_image=seconds / max(len(scores), 1),
        ap_box_by_threshold=ap_box,
        ap_gps_by_threshold=ap_gps,
        part_recall=[float(r) for r in pixels.part_recall()],
    )


def _visible(surface: object, shown: list[int]) -> np.ndarray:
    """bool [K]: whether each sampled point belongs to one of the first `shown` people of its image."""
    limit = np.zeros(len(surface.owner), np.int64)
    for (slices, _), count in zip(surface.images, shown, strict=True):
        for points in slices:
            limit[points] = count
    return surface.owner <= limit


def check(found: Prediction, image: LabelledImage) -> None:
    """Raises ValueError when a backend's answer is not a Prediction of this image."""
    height, width = image.image.shape[:2]
    if found.iuv.shape != (height, width, 3) or found.inds.shape != (height, width):
        raise ValueError(f"{image.name}: planes {found.iuv.shape}, {found.inds.shape} for {height} x {width}")
    if np.any(np.diff(found.score) > 0) or found.inds.max(initial=0) > len(found.score):
        raise ValueError(f"{image.name}: scores out of order, or a painted person without a box")
