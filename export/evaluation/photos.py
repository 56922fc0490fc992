"""Figures on real photographs, against what permissively licensed teachers say about them (export.teachers).

python -m export.evaluation.photos --help
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict, dataclass
from pathlib import Path

import cv2
import numpy as np
from tqdm import tqdm

from export.evaluation.average_precision import ImageMatches, box_iou, match
from export.evaluation.backends import Backend, Prediction, fingerprint, open_backend
from export.evaluation.machine import describe_machine
from export.evaluation.maquette_api import MaquetteError
from export.teachers.label import PhotoLabels
from export.teachers.landmarks import NAMES

LEAST_HEIGHT_PX = 64
LEAST_TEACHER_SCORE = 0.5
LEAST_VISIBLE = 0.6
MATCH_IOU = 0.5
PRECISION = 0.9
_LEFT, _RIGHT = {4, 5, 8, 10, 12, 14, 15, 17, 19, 21, 24}, {3, 6, 7, 9, 11, 13, 16, 18, 20, 22, 23}
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
figures:
  recall at precision .9   of people taller than 64 px whom the teacher's detector gives a score of .5 or more;
                           smaller and less sure ones count neither way
  mask IoU                 mean over people with a teacher's mask; nobody found there counts as 0
  part at landmark         share of visible landmarks of those people with one of the parts painted there that belong
                           there; nothing painted is wrong
  left/right               of the landmarks of limbs with a limb painted, those with the right side
  false people             shown per photo without people

example:
  python -m export.teachers && python -m export.evaluation.photos --backends capi
"""


@dataclass(frozen=True)
class PhotoFigures:
    """Shares 0..1; NaN: nothing to measure. landmark: share right by landmark name."""

    photos: int
    people: int
    masks: int
    recall_at_precision: float
    recall_shown: float
    precision_shown: float
    mask_iou: float
    part_at_landmark: float
    left_right: float
    empty_photos: int
    false_people: float
    landmark: dict[str, float]


class Tally:
    """Adds up photos of one backend. `threshold`: score from which people are shown."""

    def __init__(self, threshold: float) -> None:
        self.threshold = threshold
        self.matches: list[ImageMatches] = []
        self.shown = [0, 0, 0]  # right, wrong, wanted
        self.ious: list[float] = []
        self.landmarks: dict[str, list[bool]] = {name: [] for name in _ALLOWED}
        self.sides: list[bool] = []
        self.photos = self.empty = self.false = 0

    def add(self, found: Prediction, labels: PhotoLabels) -> None:
        self.photos += 1
        height = labels.box[:, 3] - labels.box[:, 1]
        wanted = (height > LEAST_HEIGHT_PX) & (labels.score >= LEAST_TEACHER_SCORE)
        overlap = box_iou(found.box, labels.box)
        this = ImageMatches(found.score, overlap[:, wanted], overlap[:, ~wanted].max(1, initial=0.0))
        self.matches.append(this)
        above = found.above(self.threshold)
        count = len(above.score)
        kept = ImageMatches(this.score[:count], this.similarity[:count], this.ignorable[:count])
        correct, dropped = match(kept, MATCH_IOU, MATCH_IOU)
        right = int(correct.sum())
        self.shown[0] += right
        self.shown[1] += int((~correct & ~dropped).sum())
        self.shown[2] += int(wanted.sum())
        for k in np.flatnonzero(labels.sure & wanted):
            self._person(above, labels, k)

    def _person(self, found: Prediction, labels: PhotoLabels, k: int) -> None:
        overlap = box_iou(found.box, labels.box[k : k + 1])[:, 0]
        own = int(overlap.argmax()) + 1 if len(overlap) and overlap.max() >= MATCH_IOU else 0
        painted = found.inds == own if own else np.zeros(found.inds.shape, bool)
        self.ious.append(float((painted & labels.mask[k]).sum() / max((painted | labels.mask[k]).sum(), 1)))
        height, width = found.inds.shape
        for name, allowed in _ALLOWED.items():
            index = NAMES.index(name)
            x, y = np.floor(labels.point[k, index]).astype(int)
            inside = 0 <= x < width and 0 <= y < height
            if not inside or labels.visible[k, index] < LEAST_VISIBLE or not labels.mask[k, y, x]:
                continue
            part = int(found.iuv[y, x, 0]) if painted[y, x] else 0
            self.landmarks[name].append(part in allowed)
            side = _LEFT if name.startswith("left") else _RIGHT
            if "ear" not in name and name != "nose" and part in (_LEFT | _RIGHT) - {23, 24}:
                self.sides.append(part in side)

    def add_empty(self, found: Prediction) -> None:
        """found: on a photo without people."""
        self.empty += 1
        self.false += len(found.above(self.threshold).score)

    def figures(self) -> PhotoFigures:
        right, wrong, wanted = self.shown
        every = [hit for hits in self.landmarks.values() for hit in hits]
        return PhotoFigures(
            photos=self.photos,
            people=wanted,
            masks=len(self.ious),
            recall_at_precision=recall_at_precision(self.matches, PRECISION),
            recall_shown=_share(right, wanted),
            precision_shown=_share(right, right + wrong),
            mask_iou=_mean(self.ious),
            part_at_landmark=_mean(every),
            left_right=_mean(self.sides),
            empty_photos=self.empty,
            false_people=_share(self.false, self.empty),
            landmark={name: _mean(hits) for name, hits in self.landmarks.items()},
        )


def _share(part: int, whole: int) -> float:
    return part / whole if whole else float("nan")


def _mean(values: list) -> float:
    return float(np.mean(values)) if values else float("nan")


def recall_at_precision(matches: list[ImageMatches], precision: float) -> float:
    """The largest recall at any score at which at least this share of the detections is right; NaN without people."""
    wanted = sum(image.similarity.shape[1] for image in matches)
    if not wanted:
        return float("nan")
    scores, hits = [], []
    for image in matches:
        correct, dropped = match(image, MATCH_IOU, MATCH_IOU)
        scores.append(image.score[~dropped])
        hits.append(correct[~dropped])
    hit = np.concatenate(hits)[np.argsort(-np.concatenate(scores), kind="stable")]
    found = np.cumsum(hit)
    enough = found >= precision * np.arange(1, len(hit) + 1)
    return float(found[enough].max(initial=0) / wanted)


def measure(backend: Backend, photos: list[Path], labels: Path, empty: list[Path]) -> PhotoFigures:
    tally = Tally(backend.threshold)
    bar = tqdm(total=len(photos) + len(empty), desc=f"{backend.kind} {backend.precision}", unit="photo", disable=None)
    with bar:
        for path in photos:
            tally.add(backend.predict(_read(path)), PhotoLabels.load(labels / f"{path.stem}.npz"))
            bar.update()
        for path in empty:
            tally.add_empty(backend.predict(_read(path)))
            bar.update()
    return tally.figures()


def _read(path: Path) -> np.ndarray:
    image = cv2.imread(str(path))
    if image is None:
        raise ValueError(f"{path} is not an image that can be read")
    return np.ascontiguousarray(image[..., ::-1])


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m export.evaluation.photos", description=__doc__, epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("--photos", type=Path, default=Path(".data/photos/photo"), metavar="DIR")
    parser.add_argument("--labels", type=Path, default=Path(".data/teachers/labels"), metavar="DIR")
    parser.add_argument("--empty", type=Path, default=Path(".data/backgrounds/test"), metavar="DIR", help="no people")
    parser.add_argument("--backends", default="capi", help="as for export.evaluation; default: capi")
    parser.add_argument("--out", type=Path, default=Path("build/evaluation/photos.json"), metavar="FILE")
    arguments = parser.parse_args(argv)
    photos = [p for p in sorted(arguments.photos.glob("*")) if (arguments.labels / f"{p.stem}.npz").exists()]
    if not photos:
        print(f"No labels in {arguments.labels}: run `python -m export.teachers` first.", file=sys.stderr)
        return 1
    results = {}
    try:
        for text in arguments.backends.split(","):
            backend = open_backend(text, 0.05)
            figures = measure(backend, photos, arguments.labels, sorted(arguments.empty.glob("*.jpg")))
            name = f"{backend.precision} {backend.kind} {backend.path}"
            results[name] = {"model": fingerprint(backend.path), **asdict(figures)}
            print_figures(name, figures)
    except (MaquetteError, FileNotFoundError, ValueError) as error:
        print(f"Evaluation stopped: {error}", file=sys.stderr)
        return 1
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    text = json.dumps({"machine": describe_machine(), "results": results}, indent=1)
    arguments.out.write_text(text.replace("NaN", "null") + "\n")
    print(f"Written: {arguments.out}")
    return 0


def print_figures(name: str, figures: PhotoFigures) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(title=name, title_justify="left")
    table.add_column("")
    table.add_column("", justify="right")
    rows = [
        (f"recall at precision {PRECISION:g} ({figures.people} people)", figures.recall_at_precision),
        ("recall, precision as shown", (figures.recall_shown, figures.precision_shown)),
        (f"mask IoU ({figures.masks} people)", figures.mask_iou),
        ("part at landmark", figures.part_at_landmark),
        ("left/right", figures.left_right),
        (f"false people a photo ({figures.empty_photos} photos)", figures.false_people),
        *figures.landmark.items(),
    ]
    for label, value in rows:
        values = value if isinstance(value, tuple) else (value,)
        table.add_row(label, ", ".join("-" if np.isnan(v) else f"{v:.2f}" for v in values))
    Console(width=100).print(table)


if __name__ == "__main__":
    sys.exit(main())
