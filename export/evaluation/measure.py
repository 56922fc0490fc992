"""Runs one backend over labelled images and turns what it says into metrics."""

from __future__ import annotations

import functools
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from tqdm import tqdm

from export.evaluation.average_precision import THRESHOLDS, ImageMatches, average_precision
from export.evaluation.backends import Backend, Prediction, open_backend
from export.evaluation.breakdown import GroupMetrics, breakdown, left_right
from export.evaluation.calibration import Calibration, calibrate
from export.evaluation.failures import Case, worst_cases
from export.evaluation.people import FalseAlarm, PersonRecord, compare, rendered_people
from export.evaluation.rolled import rolled
from export.evaluation.surface_accuracy import PixelAccuracy, PointAccuracy, SurfaceTable, fraction, mask_overlap
from export.jobs import Workers, results
from export.shards import LabelledImage, count_images, read_images

# Under GPS a detection that overlaps somebody too small or too hidden by this much counts neither way.
IGNORE_IOU = 0.5
MIN_LIMB_PX = 200  # of a person who is judged by left and right
IMAGES_A_JOB = 50


@dataclass(frozen=True)
class Metrics:
    """One backend's metrics. Shares are 0..1, errors in cm, times in seconds; NaN: nothing to measure.

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
    groups: list[GroupMetrics]
    failures: dict[str, list[Case]]


class Tally:
    """Adds up images of one backend; tallies of parts of a set can be merged. `threshold`: score from which people are
    shown."""

    def __init__(self, threshold: float) -> None:
        self.threshold = float(threshold)
        self.pixels, self.points = PixelAccuracy(), PointAccuracy()
        self.matches: list[ImageMatches] = []
        self.masks: list[np.ndarray] = []
        self.people: list[PersonRecord] = []
        self.alarms: list[FalseAlarm] = []
        self.shown: list[int] = []
        self.ignored = 0
        self.seconds = 0.0

    def add(self, backend: Backend, image: LabelledImage) -> None:
        start = time.perf_counter()
        found = backend.predict(image.image)
        self.seconds += time.perf_counter() - start
        check(found, image)
        asked = ~image.ignore
        self.ignored += int(image.ignore.sum())
        comparison = compare(found, image.box, asked, self.threshold)
        self.matches.append(comparison.matches)
        self.masks.append(mask_overlap(found.inds, len(found.score), image.label[..., 3], image.instance[asked]))
        self.people += rendered_people(image, comparison, self.masks[-1])
        self.alarms += comparison.false_alarms(image.name)
        self.shown.append(len(comparison.shown.score))
        self.pixels.add(image.label, comparison.shown.iuv)
        self.points.add(image, found.iuv, found.inds, len(found.score))

    def merge(self, other: Tally) -> None:
        """The other's images follow those that are here."""
        self.pixels.merge(other.pixels)
        self.points.merge(other.points)
        self.matches += other.matches
        self.masks += other.masks
        self.people += other.people
        self.alarms += other.alarms
        self.shown += other.shown
        self.ignored += other.ignored
        self.seconds += other.seconds

    def metrics(self, table: SurfaceTable) -> Metrics:
        surface = self.points.solve(table)
        gps = surface.similarity()
        gpsm = [np.sqrt(similarity * mask) for similarity, mask in zip(gps, self.masks, strict=True)]
        ap_box = [average_precision(self.matches, t) for t in THRESHOLDS]
        ap_gps, ap_gpsm = (_surface_precision(self.matches, similarity) for similarity in (gps, gpsm))
        visible = _visible(surface, self.shown)
        right_part, painted = surface.median_error_cm(visible)
        du, dv = self.pixels.median_difference()
        right = sum(person.found for person in self.people)
        return Metrics(
            images=len(self.matches),
            people=len(self.people),
            ignored=self.ignored,
            found=sum(self.shown),
            threshold=self.threshold,
            ap_box=float(np.mean(ap_box)),
            ap_box_50=ap_box[0],
            ap_gps=float(np.mean(ap_gps)),
            ap_gps_50=ap_gps[0],
            ap_gpsm=float(np.mean(ap_gpsm)),
            ap_gpsm_50=ap_gpsm[0],
            recall_shown=fraction(right, len(self.people)),
            precision_shown=fraction(right, right + len(self.alarms)),
            part_accuracy=self.pixels.part_accuracy(),
            left_right=left_right(self.people),
            mask_iou=self.pixels.mask_iou(),
            median_du=du,
            median_dv=dv,
            error_cm_right_part=right_part,
            error_cm_painted=painted,
            seconds_per_image=self.seconds / max(len(self.matches), 1),
            ap_box_by_threshold=ap_box,
            ap_gps_by_threshold=ap_gps,
            ap_gpsm_by_threshold=ap_gpsm,
            pixel_fates=self.pixels.fates(),
            part_recall=self.pixels.part_recall().tolist(),
            part_precision=self.pixels.part_precision().tolist(),
            part_error_cm=surface.part_error_cm(visible),
            calibration=calibrate(self.matches),
            groups=breakdown(self.people),
            failures=worst_cases(self.people, self.alarms, MIN_LIMB_PX),
        )


@dataclass(frozen=True)
class ImageRange:
    """Images `first` to `first + count` of a shard, for one backend (as for `open_backend`). roll: degrees by which
    each is turned (`rolled`); None: shown as it is."""

    backend: str
    score_floor: float
    shard: Path
    first: int
    count: int
    roll: float | None = None


def image_ranges(
    backend: str, score_floor: float, paths: list[Path], limit: int | None = None, roll: float | None = None
) -> list[ImageRange]:
    """The first `limit` images of the shards, in ranges that one worker does in half a minute or so."""
    ranges = []
    left = np.inf if limit is None else limit
    for path in paths:
        images = min(count_images([path]), left)
        for first in range(0, int(images), IMAGES_A_JOB):
            count = int(min(IMAGES_A_JOB, images - first))
            ranges.append(ImageRange(backend, score_floor, path, first, count, roll))
        left -= images
    return ranges


def measure(ranges: list[ImageRange], table: SurfaceTable, workers: Workers) -> Metrics:
    """Raises ValueError when a backend's answers are no predictions of the images."""
    tallies = {}
    name = ranges[0].backend
    with tqdm(total=sum(r.count for r in ranges), desc=name, unit="image", disable=None) as bar:
        for done, tally in results(workers.run(_tally, ranges)):
            tallies[done] = tally
            bar.update(done.count)
    first, *others = (tallies[r] for r in ranges)
    for other in others:
        first.merge(other)
    return first.metrics(table)


def _tally(images: ImageRange) -> Tally:
    backend = _backend(images.backend, images.score_floor)
    tally = Tally(backend.threshold)
    for image in read_images([images.shard], first=images.first, limit=images.count):
        tally.add(backend, image if images.roll is None else rolled(image, images.roll))
    return tally


_backend = functools.cache(open_backend)  # of a worker's process


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
