"""Metrics on real photographs, against what permissively licensed teachers say about them (export.teachers).

python -m export.evaluation.photos --help
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
from maquette import MaquetteError
from tqdm import tqdm

from export.evaluation.average_precision import ImageMatches, ranked
from export.evaluation.backends import Backend, Prediction, fingerprint, open_backend
from export.evaluation.breakdown import GroupMetrics, breakdown, left_right, mean_mask_iou, part_accuracy
from export.evaluation.calibration import Calibration, calibrate
from export.evaluation.failures import Case, worst_cases
from export.evaluation.json_values import plain
from export.evaluation.keypoints import KeypointMetrics, KeypointTally
from export.evaluation.machine import describe_machine
from export.evaluation.people import (
    LONG_SIDE_PX,
    MATCH_IOU,
    FalseAlarm,
    PersonRecord,
    compare,
    crowding,
    plain_box,
    touches_frame,
)
from export.evaluation.surface_accuracy import fraction
from export.keypoints import NAMES
from export.surface import LIMB_SIDE
from export.teachers.label import PhotoLabels

MIN_HEIGHT_PX = 64
MIN_TEACHER_SCORE = 0.5
MIN_VISIBLE = 0.6
MIN_LIMB_LANDMARKS = 4  # of a person who is judged by left and right
PRECISION = 0.9
MIN_SHOULDERS = 0.4  # of the trunk's length: people who show less of them stand sideways
MIN_TORSO_PIXELS = 50
BACK, CHEST = 1, 2
# Which parts may be painted at a landmark of BlazePose. A landmark lies inside the body, so front and back both count.
_ALLOWED = {
    "nose": {23, 24}, "left ear": {23, 24}, "right ear": {23, 24},
    "left shoulder": {1, 2, 15, 17}, "right shoulder": {1, 2, 16, 18},
    "left elbow": {15, 17, 19, 21}, "right elbow": {16, 18, 20, 22},
    "left wrist": {4, 19, 21}, "right wrist": {3, 20, 22},
    "left index finger": {4}, "right index finger": {3},
    "left hip": {1, 2, 8, 10}, "right hip": {1, 2, 7, 9},
    "left knee": {8, 10, 12, 14}, "right knee": {7, 9, 11, 13},
    "left ankle": {5, 12, 14}, "right ankle": {6, 11, 13},
    "left toe": {5}, "right toe": {6},
}  # fmt: skip

EPILOG = """\
metrics:
  recall at precision .9   of people taller than 64 px whom the teacher's detector gives a score of .5 or more;
                           smaller and less sure ones count neither way
  mask IoU                 mean over people with a teacher's mask; nobody found there counts as 0
  part at landmark         fraction of visible landmarks of those people with one of the parts painted there that belong
                           there; nothing painted is wrong
  left/right               of the landmarks of limbs with a limb painted, those with the right side
  chest or back            of people with a torso painted whose shoulders show which way they face, those with more
                           of the right side of it
  keypoints                of the visible landmarks of people who show their torso, those with a keypoint within 0.1
                           torsos; and of limbs' keypoints near a landmark or its mirror, those nearer to the landmark
  false people             shown per photo without people; per photo of animals

example:
  python -m export.teachers && python -m export.evaluation.photos --backends capi
"""


@dataclass(frozen=True)
class PhotoSet:
    """photos: image files that have labels; labels: folder of NAME.npz (PhotoLabels); empty: photos without
    people; animals: photos of animals without people."""

    photos: list[Path]
    labels: Path
    empty: list[Path]
    animals: list[Path] = field(default_factory=list)

    @staticmethod
    def find(photos: list[Path], labels: Path, empty: list[Path], animals: list[Path] | None = None) -> PhotoSet:
        every = [p for folder in photos for p in sorted(folder.glob("*"))]
        labelled = [p for p in every if (labels / f"{p.stem}.npz").exists()]

        def photos_in(folders: list[Path]) -> list[Path]:
            return [p for folder in folders for p in sorted(folder.glob("*.jpg"))]

        return PhotoSet(labelled, labels, photos_in(empty), photos_in(animals or []))


@dataclass(frozen=True)
class PhotoMetrics:
    """Fractions 0..1; NaN: nothing to measure. Calibration is over photos with people. landmark: fraction right by
    landmark name. keypoints: None where the backend has none. groups, failures: as for rendered images, with landmarks
    in place of pixels."""

    photos: int
    people: int
    masks: int
    recall_at_precision: float
    recall_shown: float
    precision_shown: float
    mask_iou: float
    part_at_landmark: float
    left_right: float
    chest_or_back: float
    empty_photos: int
    false_people: float
    animal_photos: int
    false_people_by_animals: float
    landmark: dict[str, float]
    keypoints: KeypointMetrics | None
    calibration: Calibration
    groups: list[GroupMetrics]
    failures: dict[str, list[Case]]


class Tally:
    """Adds up photos of one backend. `threshold`: score from which people are shown."""

    def __init__(self, threshold: float) -> None:
        self.threshold = threshold
        self.matches: list[ImageMatches] = []
        self.people: list[PersonRecord] = []
        self.alarms: list[FalseAlarm] = []
        self.in_empty: list[FalseAlarm] = []
        self.by_animals: list[FalseAlarm] = []
        self.landmarks: dict[str, list[bool]] = {name: [] for name in _ALLOWED}
        self.facing: list[bool] = []  # of each person whose chest or back is painted, whether it is the right one
        self.keypoints: KeypointTally | None = None
        self.photos = self.empty = self.animals = 0

    def add(self, name: str, found: Prediction, labels: PhotoLabels) -> None:
        self.photos += 1
        heights = labels.box[:, 3] - labels.box[:, 1]
        wanted = (heights > MIN_HEIGHT_PX) & (labels.score >= MIN_TEACHER_SCORE)
        comparison = compare(found, labels.box, wanted, self.threshold)
        self.matches.append(comparison.matches)
        self.alarms += comparison.false_alarms(name)
        height, width = found.inds.shape
        close = crowding(labels.box)
        if found.keypoint is not None and self.keypoints is None:
            self.keypoints = KeypointTally()
        for k, number in zip(np.flatnonzero(wanted), comparison.number.tolist(), strict=True):
            painted = (comparison.shown.inds == number) & (number > 0)
            part = np.where(painted, comparison.shown.iuv[..., 0], 0)
            asked, right, limb, same_side = self._landmarks(part, labels, k) if labels.sure[k] else (0, 0, 0, 0)
            if self.keypoints is not None and labels.sure[k]:
                own = comparison.shown.keypoint[number - 1] if number else None
                self.keypoints.add(own, labels.point[k], labels.visible[k])
            side = shown_side(labels, int(k))
            torso = [int((part == value).sum()) for value in (BACK, CHEST)]
            if side and sum(torso) >= MIN_TORSO_PIXELS:
                self.facing.append(side == (CHEST if torso[1] > torso[0] else BACK))
            iou = float((painted & labels.mask[k]).sum() / max((painted | labels.mask[k]).sum(), 1))
            self.people.append(
                PersonRecord(
                    image=name,
                    box=plain_box(labels.box[k]),
                    height_px=float(heights[k]) * LONG_SIDE_PX / max(height, width),
                    cut=touches_frame(labels.box[k], width, height),
                    crowding=float(close[k]),
                    groups_seen=float("nan"),
                    found=number > 0,
                    mask_iou=iou if labels.outlined[k] else float("nan"),
                    asked=asked,
                    right=right,
                    limb=limb,
                    same_side=same_side,
                )
            )

    def _landmarks(self, part: np.ndarray, labels: PhotoLabels, k: int) -> tuple[int, int, int, int]:
        """part: uint8 [H, W], painted on person k. Landmarks asked for, with the right part, of limbs, of their side"""
        height, width = part.shape
        hits, sides = [], []
        for name, allowed in _ALLOWED.items():
            index = NAMES.index(name)
            x, y = np.floor(labels.point[k, index]).astype(int)
            inside = 0 <= x < width and 0 <= y < height
            if not inside or labels.visible[k, index] < MIN_VISIBLE or not labels.mask[k, y, x]:
                continue
            hits.append(int(part[y, x]) in allowed)
            self.landmarks[name].append(hits[-1])
            side = LIMB_SIDE[part[y, x]]
            if side and "ear" not in name and name != "nose":
                sides.append(side == (1 if name.startswith("left") else 2))
        return len(hits), sum(hits), len(sides), int(sum(sides))

    def add_empty(self, name: str, found: Prediction, animals: bool = False) -> None:
        """found: on a photo without people, of animals or not."""
        nobody = np.zeros((0, 4)), np.zeros(0, bool)
        alarms = compare(found, *nobody, self.threshold).false_alarms(name)
        if animals:
            self.animals += 1
            self.by_animals += alarms
        else:
            self.empty += 1
            self.in_empty += alarms

    def metrics(self) -> PhotoMetrics:
        right = sum(person.found for person in self.people)
        return PhotoMetrics(
            photos=self.photos,
            people=len(self.people),
            masks=sum(not np.isnan(person.mask_iou) for person in self.people),
            recall_at_precision=recall_at_precision(self.matches, PRECISION),
            recall_shown=fraction(right, len(self.people)),
            precision_shown=fraction(right, right + len(self.alarms)),
            mask_iou=mean_mask_iou(self.people),
            part_at_landmark=part_accuracy(self.people),
            left_right=left_right(self.people),
            chest_or_back=fraction(sum(self.facing), len(self.facing)),
            empty_photos=self.empty,
            false_people=fraction(len(self.in_empty), self.empty),
            animal_photos=self.animals,
            false_people_by_animals=fraction(len(self.by_animals), self.animals),
            landmark={name: fraction(sum(hits), len(hits)) for name, hits in self.landmarks.items()},
            keypoints=None if self.keypoints is None else self.keypoints.metrics(),
            calibration=calibrate(self.matches),
            groups=breakdown(self.people),
            failures=worst_cases(self.people, self.alarms + self.in_empty + self.by_animals, MIN_LIMB_LANDMARKS),
        )


def shown_side(labels: PhotoLabels, person: int) -> int:
    """CHEST where a person's left shoulder lies to the right of the other, seen along the trunk, BACK where it lies to
    the left; 0 where the landmarks don't say."""
    joints = [NAMES.index(name) for name in ("left shoulder", "right shoulder", "left hip", "right hip")]
    if not labels.sure[person] or (labels.visible[person, joints] < MIN_VISIBLE).any():
        return 0
    left, right, *hips = labels.point[person, joints].astype(np.float64)
    trunk = (left + right) / 2 - np.mean(hips, 0)  # y points down
    length = float(np.hypot(*trunk))
    across = float((left - right) @ np.array([-trunk[1], trunk[0]])) / max(length * length, 1e-9)
    return 0 if abs(across) < MIN_SHOULDERS else CHEST if across > 0 else BACK


def recall_at_precision(matches: list[ImageMatches], precision: float) -> float:
    """The largest recall at any score at which at least this fraction of the detections is right; NaN without
    people."""
    wanted = sum(image.similarity.shape[1] for image in matches)
    if not wanted:
        return float("nan")
    _, hit = ranked(matches, MATCH_IOU)
    found = np.cumsum(hit)
    enough = found >= precision * np.arange(1, len(hit) + 1)
    return float(found[enough].max(initial=0) / wanted)


def measure(backend: Backend, chosen: PhotoSet) -> PhotoMetrics:
    tally = Tally(backend.threshold)
    total = len(chosen.photos) + len(chosen.empty) + len(chosen.animals)
    with tqdm(total=total, desc=f"{backend.kind} {backend.precision}", unit="photo", disable=None) as bar:
        for path in chosen.photos:
            labels = PhotoLabels.load(chosen.labels / f"{path.stem}.npz")
            tally.add(path.name, backend.predict(read_photo(path)), labels)
            bar.update()
        for path in chosen.empty + chosen.animals:
            tally.add_empty(path.name, backend.predict(read_photo(path)), path in chosen.animals)
            bar.update()
    return tally.metrics()


def read_photo(path: Path) -> np.ndarray:
    """uint8 [H, W, 3] RGB. Raises ValueError for a file that is no image."""
    image = cv2.imread(str(path))
    if image is None:
        raise ValueError(f"{path} is not an image that can be read")
    return np.ascontiguousarray(image[..., ::-1])


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """--photos, --labels, --empty and --animals: the folders of a PhotoSet."""
    folder = Path(".data/photos")
    parser.add_argument(
        "--photos", type=Path, nargs="+", default=[folder / "photo", folder / "test"], metavar="DIR",
        help="of people (default: the two of the test; .data/photos/val to choose between recipes; fresh: never)",
    )  # fmt: skip
    parser.add_argument("--labels", type=Path, default=Path(".data/teachers/labels"), metavar="DIR")
    parser.add_argument(
        "--empty", type=Path, nargs="+", default=[Path(".data/backgrounds/test"), folder / "empty"], metavar="DIR",
        help="photos of nobody",
    )  # fmt: skip
    parser.add_argument(
        "--animals", type=Path, nargs="+", default=[folder / "animals"], metavar="DIR", help="photos of animals"
    )


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m export.evaluation.photos", description=__doc__, epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    add_arguments(parser)
    parser.add_argument("--backends", default="capi", help="as for export.evaluation; default: capi")
    parser.add_argument("--out", type=Path, default=Path("build/evaluation/photos.json"), metavar="FILE")
    arguments = parser.parse_args(argv)
    chosen = PhotoSet.find(arguments.photos, arguments.labels, arguments.empty, arguments.animals)
    if not chosen.photos:
        print(f"No labels in {arguments.labels}: run `python -m export.teachers` first.", file=sys.stderr)
        return 1
    results = {}
    try:
        for text in arguments.backends.split(","):
            backend = open_backend(text, 0.05)
            name = f"{backend.precision} {backend.kind} {backend.path}"
            metrics = measure(backend, chosen)
            results[name] = {"model": fingerprint(backend.path), **plain(metrics)}
            print_metrics(name, metrics)
    except (MaquetteError, FileNotFoundError, ValueError) as error:
        print(f"Evaluation stopped: {error}", file=sys.stderr)
        return 1
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    arguments.out.write_text(json.dumps({"machine": describe_machine(), "results": results}, indent=1) + "\n")
    print(f"Written: {arguments.out}")
    return 0


def print_metrics(name: str, metrics: PhotoMetrics) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(title=name, title_justify="left")
    table.add_column("")
    table.add_column("", justify="right")
    rows = [
        (f"recall at precision {PRECISION:g} ({metrics.people} people)", metrics.recall_at_precision),
        ("recall, precision as shown", (metrics.recall_shown, metrics.precision_shown)),
        (f"mask IoU ({metrics.masks} people)", metrics.mask_iou),
        ("part at landmark", metrics.part_at_landmark),
        ("left/right", metrics.left_right),
        ("chest or back", metrics.chest_or_back),
        (f"false people a photo ({metrics.empty_photos} photos)", metrics.false_people),
        (f"false people a photo of animals ({metrics.animal_photos} photos)", metrics.false_people_by_animals),
        *metrics.landmark.items(),
    ]
    if metrics.keypoints is not None:
        points = metrics.keypoints
        rows += [
            (f"keypoints within 0.1 torsos ({points.people} people)", points.pck),
            ("left/right of keypoints", points.left_right),
            *((f"keypoint: {name}", value) for name, value in points.by_name.items()),
        ]
    for label, value in rows:
        values = value if isinstance(value, tuple) else (value,)
        table.add_row(label, ", ".join("-" if np.isnan(v) else f"{v:.2f}" for v in values))
    Console(width=100).print(table)


if __name__ == "__main__":
    sys.exit(main())
