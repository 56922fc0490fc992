"""Measures error against run time for settings of dense pose, on rendered people that no training saw."""

from __future__ import annotations

import statistics
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
from maquette import DensePose
from tqdm import tqdm

from export.evaluation.backends import Prediction, prediction_of
from export.evaluation.measure import Tally
from export.evaluation.surface_accuracy import SurfaceTable
from export.shards import LabelledImage

SCORE_FLOOR = 0.05  # boxes with a lower score are ignored
BLOCK = 10  # images that one setting processes before the next setting's turn
MOTION = 0.01  # fraction of the image width a frame, for moving images


@dataclass(frozen=True)
class Setting:
    """axis: the varied option. bundle: "int8" or "fp32". options: fields of maq_densepose_config."""

    name: str
    axis: str
    bundle: str = "int8"
    options: dict[str, int] = field(default_factory=dict)

    @property
    def frames(self) -> int:
        """Returns the number of frames of a moving image: from one key frame to the last frame that follows it."""
        return self.options.get("key_frame_interval", 1)


def settings(long_sides: tuple[int, ...] = (160, 192, 224, 256, 288, 320, 384)) -> list[Setting]:
    """Returns the measured settings. The first is the shipped bundle with default options."""
    made = [Setting("as shipped", "shipped"), Setting("fp32", "precision", "fp32")]
    made += [Setting(f"{side} px", "input size", options={"long_side_px": side}) for side in long_sides]
    made += [Setting(f"fp32, {side} px", "precision", "fp32", {"long_side_px": side}) for side in (192, 384)]
    made += [Setting(f"{n} proposals", "proposals", options={"max_proposals": n}) for n in (10, 25, 100)]
    made += [Setting(f"key frame every {n}", "key frames", options={"key_frame_interval": n}) for n in (2, 4, 8)]
    made += [Setting(f"no person below {n} px", "min. person", options={"min_person_height_px": n}) for n in (64, 128)]
    made += [
        Setting(f"crops of {who}, {side} px", "crops", options={"person_crops": k, "person_crop_px": side})
        for k, who in ((1, "the small and leaning"), (2, "all"))
        for side in (192, 256)
    ]
    for side, frames in ((224, 1), (384, 1), (288, 2), (288, 4), (288, 8)):
        options = {"person_crops": 2, "long_side_px": side, "key_frame_interval": frames}
        often = f", key frame every {frames}" if frames > 1 else ""
        made.append(Setting(f"{side} px, crops of all{often}", "crops", options=options))
    made.append(Setting("parts alone", "detail", options={"detail": 1}))
    for side, proposals in ((224, 25), (192, 25), (160, 10)):
        options = {"long_side_px": side, "max_proposals": proposals, "key_frame_interval": 4}
        made.append(Setting(f"{side} px, {proposals} proposals, key frame every 4", "together", options=options))
    return made


@dataclass
class Measured:
    """ms: median milliseconds of a frame, for a moving image the mean over its frames. error: 1 - AP by GPS. error_cm:
    median surface error of labelled pixels."""

    setting: Setting
    ms: float
    ms_p90: float
    error: float
    error_cm: float
    box_ap: float
    part_accuracy: float


def moving(image: np.ndarray, frames: int) -> Iterator[np.ndarray]:
    """Returns `frames` images that move by MOTION of the width each; the last one is `image`."""
    height, width = image.shape[:2]
    for k in range(frames - 1, 0, -1):
        shift = np.float64([[1, 0, -k * MOTION * width], [0, 1, 0]])
        yield cv2.warpAffine(image, shift, (width, height), borderMode=cv2.BORDER_REPLICATE)
    yield image


class Column:
    """One setting with its results for each image."""

    def __init__(self, setting: Setting, bundle: Path, threads: int) -> None:
        self.setting = setting
        options = dict(setting.options)
        self._densepose = DensePose(bundle, score_threshold=SCORE_FLOOR, threads=threads, **options)
        # The time is measured as in an app, which does not ask for boxes below the shown score.
        self._timed = DensePose(bundle, threads=threads, **options)
        self.ms: list[float] = []
        self._results: list[tuple] = []

    def run(self, image: np.ndarray, counted: bool) -> None:
        self._densepose.reset(), self._timed.reset()
        total = 0.0
        for frame in moving(image, self.setting.frames):
            found = prediction_of(self._densepose.run(frame))
            total += self._timed.run(frame).stats["total_ms"]
        if counted:
            self.ms.append(total / self.setting.frames)
        planes = np.dstack([found.iuv, found.inds])
        self._results.append((found.box, found.score, planes.shape, zlib.compress(planes.tobytes(), 1)))

    def predictions(self) -> Iterator[Prediction]:
        for box, score, shape, packed in self._results:
            planes = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(shape)
            yield Prediction(box, score, planes[..., :3], planes[..., 3])

    def close(self) -> None:
        self._densepose.close(), self._timed.close()


class Replay:
    """A backend (export.evaluation.backends) that returns stored results."""

    kind = "capi"

    def __init__(self, column: Column, precision: str, path: Path, threshold: float) -> None:
        self.precision, self.path, self.threshold = precision, path, threshold
        self._left = column.predictions()

    def predict(self, image: np.ndarray) -> Prediction:
        return next(self._left)


def measure(
    images: list[LabelledImage],
    bundles: dict[str, Path],
    table: SurfaceTable,
    wanted: list[Setting],
    threshold: float,
    threads: int = 2,
) -> list[Measured]:
    """Runs all settings on the same images, alternately, BLOCK images each. The first image of a block is not timed."""
    columns = [Column(setting, bundles[setting.bundle], threads) for setting in wanted]
    with tqdm(total=len(images) * len(columns), desc="error against run time", unit="image", disable=None) as progress:
        for start in range(0, len(images), BLOCK):
            for column in columns:
                for k, image in enumerate(images[start : start + BLOCK]):
                    column.run(image.image, counted=k > 0)
                    progress.update()
    measured = []
    for column in columns:
        column.close()
        backend = Replay(column, column.setting.bundle, bundles[column.setting.bundle], threshold)
        tally = Tally(threshold)
        for image in images:
            tally.add(backend, image)
        metrics = tally.metrics(table)
        measured.append(
            Measured(
                setting=column.setting,
                ms=round(statistics.median(column.ms), 3),
                ms_p90=round(float(np.percentile(column.ms, 90)), 3),
                error=round(1 - metrics.ap_gps, 4),
                error_cm=round(metrics.error_cm_painted, 2),
                box_ap=round(metrics.ap_box, 4),
                part_accuracy=round(metrics.part_accuracy, 4),
            )
        )
    return measured


def pareto(points: list[tuple[float, float]]) -> list[int]:
    """Returns the indices of the Pareto front of (run time, error), by increasing run time."""
    front, least = [], float("inf")
    for k in sorted(range(len(points)), key=lambda k: points[k]):
        if points[k][1] < least:
            front.append(k)
            least = points[k][1]
    return front
