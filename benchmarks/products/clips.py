"""Products on rendered clips with exact truth: people, masks, joints, sides, jitter and ids."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from tqdm import tqdm

from benchmarks.people_over_time.detections import Detections
from benchmarks.people_over_time.over_time import counted, rated
from benchmarks.products.jitter import Jitter
from benchmarks.products.running import Product, Running
from export.evaluation.backends import Prediction
from export.evaluation.breakdown import breakdown, mean_mask_iou
from export.evaluation.json_values import plain
from export.evaluation.keypoints import LIMBS, KeypointMetrics, KeypointTally
from export.evaluation.people import MATCH_IOU, Comparison, PersonRecord, compare, rendered_people
from export.evaluation.surface_accuracy import fraction, mask_overlap
from export.keypoints import COUNT, NAMES
from export.people.clips.clip_file import PeopleClip, Truth, read_clip
from export.shards import LabelledImage

# The joints of a clip that are keypoints, too: pelvis, neck and head are not.
_SAME = ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")


def name_of(path: Path) -> str:
    """Splits number their clips alike."""
    return f"{path.parent.name}-{path.stem}"


def labelled(clip: PeopleClip, t: int, image: np.ndarray, must: np.ndarray) -> LabelledImage:
    """Frame t. must: bool [P], who must be found; the other people count neither way."""
    truth = clip.truth
    seen = np.flatnonzero(truth.visible_px[t])
    name, box = f"{name_of(clip.path)}-{t}", truth.visible_box[t, seen].astype(np.float32)
    return LabelledImage(name, image, clip.label(t), None, box, (seen + 1).astype(np.uint8), ~must[seen])


def keypoints_of(truth: Truth, t: int, person: int) -> tuple[np.ndarray, np.ndarray]:
    """The true joints as keypoints: point [33, 2], and visible [33], 1 where the image shows the joint."""
    point, visible = np.zeros((COUNT, 2)), np.zeros(COUNT)
    for j, name in enumerate(truth.facts["joints"]):
        side, _, base = name.rpartition("_")
        if base in _SAME:
            k = NAMES.index(f"{side} {base}")
            point[k], visible[k] = np.nan_to_num(truth.joints_px[t, person, j]), truth.joint_visible[t, person, j]
    return point, visible


@dataclass
class ClipTally:
    """One product. Two lists of people: all who must be found, and those in frames in which every product finds them
    (`common`), which is a comparison of the same people."""

    people: list[PersonRecord] = field(default_factory=list)
    found_by_mask: int = 0
    shown: int = 0
    false: int = 0
    shared_px: int = 0
    union_px: int = 0
    common: list[bool] = field(default_factory=list)
    joints: KeypointTally = field(default_factory=KeypointTally)
    common_joints: KeypointTally = field(default_factory=KeypointTally)
    jitter: Jitter = field(default_factory=Jitter)
    tracks: dict[str, list[Detections]] = field(default_factory=dict)

    def add_foreground(self, found: Prediction, label: np.ndarray) -> None:
        """All people as one mask."""
        shown, true = found.inds > 0, label[..., 3] > 0
        self.shared_px += int((shown & true).sum())
        self.union_px += int((shown | true).sum())

    def add_frame(
        self, clip: PeopleClip, t: int, found: Prediction, ids: np.ndarray, image: LabelledImage
    ) -> Comparison:
        """Returns the detection of each person."""
        asked = ~image.ignore
        comparison = compare(found, image.box, asked, 0.0)
        masks = mask_overlap(found.inds, len(found.score), image.label[..., 3], image.instance[asked])
        self.people += rendered_people(image, comparison, masks)
        self.found_by_mask += int((masks.max(0, initial=0) >= MATCH_IOU).sum())
        self.shown += len(found.score)
        self.false += int(comparison.false.sum())
        time_ns = int(clip.truth.time_ns[t])
        own = Detections(time_ns, found.box.astype(float), found.score.astype(float), ids)
        self.tracks.setdefault(name_of(clip.path), []).append(own)
        return comparison

    def add_joints(
        self, clip: PeopleClip, t: int, comparison: Comparison, people: np.ndarray, by_all: np.ndarray
    ) -> None:
        """people: numbers, from 0, of those who must be found; by_all: bool, those whom every product finds."""
        truth = clip.truth
        for person, number, common in zip(people.tolist(), comparison.number.tolist(), by_all.tolist(), strict=True):
            point, visible = keypoints_of(truth, t, person)
            own = comparison.shown.keypoint[number - 1] if number else None
            self.joints.add(own, point, visible)
            self.common.append(common)
            if not common:
                continue
            self.common_joints.add(own, point, visible)
            box = comparison.shown.box[number - 1]
            self.jitter.add(name_of(clip.path), t, person, own, point, visible, box, truth.visible_box[t, person])

    def metrics(self, truths: dict[str, Truth]) -> dict:
        joints, common = self.joints.metrics(), self.common_joints.metrics()
        right = sum(person.found for person in self.people)
        same = [person for person, common in zip(self.people, self.common, strict=True) if common]
        ids = rated([(truth, self.tracks[name]) for name, truth in truths.items()], lambda own: [d.ids for d in own])
        found = {
            "people": len(self.people),
            "found": fraction(right, len(self.people)),
            "found_by_mask": fraction(self.found_by_mask, len(self.people)),
            "precision": fraction(right, right + self.false),
            "mask_iou": mean_mask_iou(self.people),
            "common_people": len(same),
            "common_mask_iou": mean_mask_iou(same),
            "joints_people": joints.people,
            "joints": limbs(joints),
            "torso_joints": _mean(joints, ("shoulder", "hip")),
            "common_joints_people": common.people,
            "common_joints": limbs(common),
            "common_torso_joints": _mean(common, ("shoulder", "hip")),
            "common_left_right": common.left_right,
            "joints_by_name": common.by_name,
            "groups": breakdown(self.people),
            "ids": ids,
            **self.jitter.metrics(),
        }
        return plain(found)


def limbs(found: KeypointMetrics) -> float:
    """Mean PCK of elbows, wrists, knees and ankles, whose definition is the same for all products."""
    return _mean(found, tuple(NAMES[k].partition(" ")[2] for k in LIMBS if NAMES[k].partition(" ")[2] in _SAME))


def _mean(found: KeypointMetrics, parts: Sequence[str]) -> float:
    values = [value for name, value in found.by_name.items() if name.partition(" ")[2] in parts]
    known = [value for value in values if not np.isnan(value)]
    return float(np.mean(known)) if known else float("nan")


def measure(products: Sequence[Product], paths: Sequence[Path], log: Path, max_frames: int | None = None) -> dict:
    """The metrics of each product by its name. The products see the same frames, one after the other; each sees a clip
    as a stream. max_frames: of each clip."""
    tallies = {product.name: ClipTally() for product in products}
    running = [Running(product, _CORES, log / f"{product.name}.log") for product in products]
    truths = {}
    try:
        for path in paths:
            clip = read_clip(path)
            truths[name_of(path)] = _first_frames(clip.truth, max_frames)
            _add_clip(clip, truths[name_of(path)].frames, running, tallies)
    finally:
        for process in running:
            process.close()
    rows = {}
    for product in products:
        tally = tallies[product.name]
        rows[product.name] = tally.metrics(truths) if product.has_people else {}
        rows[product.name]["foreground_iou"] = fraction(tally.shared_px, tally.union_px)
    frames = sum(truth.frames for truth in truths.values())
    return {"clips": len(truths), "frames": frames, "products": plain(rows)}


_CORES = 2


def _first_frames(truth: Truth, count: int | None) -> Truth:
    arrays = {name: value if name in ("intrinsics", "facts") else value[:count] for name, value in vars(truth).items()}
    return Truth(**arrays)


def _add_clip(clip: PeopleClip, frames: int, running: list[Running], tallies: dict[str, ClipTally]) -> None:
    must = counted(clip.truth)
    for process in running:
        process.ask("start")
    for t in tqdm(range(frames), desc=name_of(clip.path), unit="frame", disable=None):
        image = labelled(clip, t, np.ascontiguousarray(clip.image(t)[..., ::-1]), must[t])
        people = image.instance[~image.ignore].astype(int) - 1
        comparisons = {}
        for process in running:
            name = process.product.name
            found, ids = process.frame(image.image, t, int(clip.truth.time_ns[t]))
            tallies[name].add_foreground(found, image.label)
            if process.product.has_people:
                comparisons[name] = tallies[name].add_frame(clip, t, found, ids, image)
        numbers = [comparison.number > 0 for comparison in comparisons.values()]
        by_all = np.all(numbers, axis=0) if numbers else np.zeros(len(people), bool)
        for name, comparison in comparisons.items():
            tallies[name].add_joints(clip, t, comparison, people, by_all)
