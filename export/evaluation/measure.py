"""Runs one backend over labelled images and turns what it says into figures."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from tqdm import tqdm

from export.evaluation.average_precision import THRESHOLDS, ImageMatches, average_precision
from export.evaluation.backends import Backend, Prediction
from export.evaluation.breakdown import GroupFigures, breakdown, left_right
from export.evaluation.calibration import Calibration, calibrate
from export.evaluation.failures import Case, worst_cases
from export.evaluation.people import FalseAlarm, PersonRecord, compare, rendered_people
from export.evaluation.surface_accuracy import PixelAccuracy, PointAccuracy, SurfaceTable, fraction, mask_overlap
from export.shards import LabelledImage

# Under GPS a detection that overlaps somebody too small or too hidden by this much counts neither way.
IGNORE_IOU = 0.5
MIN_LIMB_PX = 200  # of a person who is judged by left and right


@dataclass(frozen=True)
class Figures:
    """One backend's figures. Shares are 0..1, errors in cm, times in seconds; NaN: nothing to measure.

    ap_box, ap_gps, ap_gpsm: mean over THRESHOLDS; *_by_threshold: at each. AP and calibration are over all scores, the
    others at `threshold`. pixel_fates: by the names of `surface_accuracy.FATES`. part_recall, part_precision,
    part_error_cm: of parts 0 (background) to 24.
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
    ap_gpsm: float
    ap_gpsm_50: float
    recall_shown: float
    precision_shown: float
    part_accuracy: float
    left_right: float
    mask_iou: float
    median_du: float
    median_dv: float
    error_cm_right_part: float
    error_cm_painted: float
    seconds_per_image: float
    ap_box_by_threshold: list[float]
    ap_gps_by_threshold: list[float]
    ap_gpsm_by_threshold: list[float]
    pixel_fates: dict[str, float]
    part_recall: list[float]
    part_precision: list[float]
    part_error_cm: list[float]
    calibration: Calibration
    groups: list[GroupFigures]
    failures: dict[str, list[Case]]


def measure(
    backend: Backend,
    images: Iterable[LabelledImage],
    table: SurfaceTable,
    total: int | None = None,
) -> Figures:
    """images: labelled images with surface points. total: their number, for the progress bar."""
    pixels, points = PixelAccuracy(), PointAccuracy()
    matches: list[ImageMatches] = []
    masks: list[np.ndarray] = []
    people: list[PersonRecord] = []
    alarms: list[FalseAlarm] = []
    shown: list[int] = []
    ignored = 0
    seconds = 0.0
    for image in tqdm(images, total=total, desc=f"{backend.kind} {backend.precision}", unit="image", disable=None):
        start = time.perf_counter()
        found = backend.predict(image.image)
        seconds += time.perf_counter() - start
        check(found, image)
        asked = ~image.ignore
        ignored += int(image.ignore.sum())
        comparison = compare(found, image.box, asked, backend.threshold)
        matches.append(comparison.matches)
        masks.append(mask_overlap(found.inds, len(found.score), image.label[..., 3], image.instance[asked]))
        people += rendered_people(image, comparison, masks[-1])
        alarms += comparison.false_alarms(image.name)
        shown.append(len(comparison.shown.score))
        pixels.add(image.label, comparison.shown.iuv)
        points.add(image, found.iuv, found.inds, len(found.score))

    surface = points.solve(table)
    gps = surface.similarity()
    gpsm = [np.sqrt(similarity * mask) for similarity, mask in zip(gps, masks, strict=True)]
    ap_box = [average_precision(matches, t) for t in THRESHOLDS]
    ap_gps, ap_gpsm = (_surface_precision(matches, similarity) for similarity in (gps, gpsm))
    visible = _visible(surface, shown)
    right_part, painted = surface.median_error_cm(visible)
    du, dv = pixels.median_difference()
    right = sum(person.found for person in people)
    return Figures(
        images=len(matches),
        people=len(people),
        ignored=ignored,
        found=sum(shown),
        threshold=float(backend.threshold),
        ap_box=float(np.mean(ap_box)),
        ap_box_50=ap_box[0],
        ap_gps=float(np.mean(ap_gps)),
        ap_gps_50=ap_gps[0],
        ap_gpsm=float(np.mean(ap_gpsm)),
        ap_gpsm_50=ap_gpsm[0],
        recall_shown=fraction(right, len(people)),
        precision_shown=fraction(right, right + len(alarms)),
        part_accuracy=pixels.part_accuracy(),
        left_right=left_right(people),
        mask_iou=pixels.mask_iou(),
        median_du=du,
        median_dv=dv,
        error_cm_right_part=right_part,
        error_cm_painted=painted,
        seconds_per_image=seconds / max(len(matches), 1),
        ap_box_by_threshold=ap_box,
        ap_gps_by_threshold=ap_gps,
        ap_gpsm_by_threshold=ap_gpsm,
        pixel_fates=pixels.fates(),
        part_recall=pixels.part_recall().tolist(),
        part_precision=pixels.part_precision().tolist(),
        part_error_cm=surface.part_error_cm(visible),
        calibration=calibrate(matches),
        groups=breakdown(people),
        failures=worst_cases(people, alarms, MIN_LIMB_PX),
    )


def _surface_precision(boxes: list[ImageMatches], similarity: list[np.ndarray]) -> list[float]:
    """AP at each of THRESHOLDS by GPS or GPSm [D, G] of each image; who is ignored is still a question of boxes."""
    matches = [ImageMatches(b.score, s, b.ignorable) for b, s in zip(boxes, similarity, strict=True)]
    return [average_precision(matches, t, ignore_threshold=IGNORE_IOU) for t in THRESHOLDS]


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
