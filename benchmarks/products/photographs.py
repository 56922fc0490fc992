"""Products on photographs: people found, false people, masks and joints, by the project's metrics for photographs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from tqdm import tqdm

from benchmarks.products.running import Product, Running
from export.evaluation.breakdown import breakdown, mean_mask_iou
from export.evaluation.json_values import plain
from export.evaluation.keypoints import KeypointTally
from export.evaluation.people import compare
from export.evaluation.photos import MIN_HEIGHT_PX, MIN_TEACHER_SCORE, PhotoSet, Tally, read_photo
from export.evaluation.surface_accuracy import fraction
from export.teachers.label import PhotoLabels

_CORES = 2


@dataclass(frozen=True)
class Photographs:
    """sets: photographs of people with labels, by the name of the set. empty, animals: photographs without people."""

    sets: dict[str, PhotoSet]
    empty: list[Path]
    animals: list[Path]

    @staticmethod
    def find(data: Path, max_photos: int | None = None) -> Photographs:
        """The sets in `data` that have labels there; a set without labels is named and left out."""
        photos, labels = data / "photos", data / "runs/people/labels"
        folders = {
            "test": [photos / "photo", photos / "test"],
            "fresh": [photos / "fresh"],
            "held out": [data / "runs/people/photos/pack/heldout"],
        }
        sets = {}
        for name, wanted in folders.items():
            known = PhotoSet.find(wanted, labels, [])
            if not known.photos:
                print(f"Photographs '{name}' are left out: {labels} has no labels for them "
                      "(scripts/train-people.sh label).")  # fmt: skip
                continue
            sets[name] = PhotoSet(known.photos[:max_photos], labels, [])
        without = PhotoSet.find([], labels, [data / "backgrounds/test", photos / "empty"], [photos / "animals"])
        return Photographs(sets, without.empty[:max_photos], without.animals[:max_photos])


class PhotoTally:
    """One product: a tally of each set, and joints of all sets. common: whether every product finds the person, in the
    order of the sets."""

    def __init__(self, names: Sequence[str]) -> None:
        self.sets = {name: Tally(0.0) for name in names}
        self.without = Tally(0.0)
        self.joints, self.common_joints = KeypointTally(), KeypointTally()
        self.common: list[bool] = []

    def metrics(self) -> dict:
        people = [person for tally in self.sets.values() for person in tally.people]
        same = [person for person, common in zip(people, self.common, strict=True) if common]
        joints, common = self.joints.metrics(), self.common_joints.metrics()
        found = {"sets": {name: _counts(tally) for name, tally in self.sets.items()}}
        right, false = sum(p.found for p in people), sum(len(tally.alarms) for tally in self.sets.values())
        alone, crowded = ([p for p in people if (p.crowding == 0) == is_alone] for is_alone in (True, False))
        without = self.without.metrics()
        found |= {
            "people": len(people),
            "found": fraction(right, len(people)),
            "precision": fraction(right, right + false),
            "alone": len(alone),
            "found_alone": fraction(sum(p.found for p in alone), len(alone)),
            "crowded": len(crowded),
            "found_crowded": fraction(sum(p.found for p in crowded), len(crowded)),
            "mask_iou": mean_mask_iou(people),
            "common_people": len(same),
            "common_mask_iou": mean_mask_iou(same),
            "joints_people": joints.people,
            "joints": joints.pck,
            "common_joints_people": common.people,
            "common_joints": common.pck,
            "common_left_right": common.left_right,
            "groups": breakdown(people),
            "empty_photos": without.empty_photos,
            "false_people": without.false_people,
            "animal_photos": without.animal_photos,
            "false_people_by_animals": without.false_people_by_animals,
        }
        return plain(found)


def _counts(tally: Tally) -> dict:
    right = sum(person.found for person in tally.people)
    return {
        "photos": tally.photos,
        "people": len(tally.people),
        "found": fraction(right, len(tally.people)),
        "precision": fraction(right, right + len(tally.alarms)),
    }


def wanted(labels: PhotoLabels) -> np.ndarray:
    """bool [N]: who must be found, as in `export.evaluation.photos`."""
    height = labels.box[:, 3] - labels.box[:, 1]
    return (height > MIN_HEIGHT_PX) & (labels.score >= MIN_TEACHER_SCORE)


def measure(products: Sequence[Product], chosen: Photographs, log: Path) -> dict:
    """The metrics of each product by its name. Products that know no single people have no metrics here."""
    asked = [product for product in products if product.has_people]
    tallies = {product.name: PhotoTally(list(chosen.sets)) for product in asked}
    running = [Running(product, _CORES, log / f"{product.name}.log") for product in asked]
    total = sum(len(photos.photos) for photos in chosen.sets.values()) + len(chosen.empty) + len(chosen.animals)
    try:
        with tqdm(total=total, desc="photographs", unit="photo", disable=None) as bar:
            for name, photos in chosen.sets.items():
                for path in photos.photos:
                    _add_photo(name, path, PhotoLabels.load(photos.labels / f"{path.stem}.npz"), running, tallies)
                    bar.update()
            for path in [*chosen.empty, *chosen.animals]:
                image = read_photo(path)
                for process in running:
                    found = process.photo(image)
                    tallies[process.product.name].without.add_empty(path.name, found, path in chosen.animals)
                bar.update()
    finally:
        for process in running:
            process.close()
    photos = {name: len(own.photos) for name, own in chosen.sets.items()}
    return {"photos": photos, "products": {name: tally.metrics() for name, tally in tallies.items()}}


def _add_photo(
    of_set: str, path: Path, labels: PhotoLabels, running: list[Running], tallies: dict[str, PhotoTally]
) -> None:
    image, must = read_photo(path), wanted(labels)
    answers = {process.product.name: process.photo(image) for process in running}
    comparisons = {name: compare(found, labels.box, must, 0.0) for name, found in answers.items()}
    by_all = np.all([comparison.number > 0 for comparison in comparisons.values()], axis=0)
    for name, found in answers.items():
        tally, comparison = tallies[name], comparisons[name]
        tally.sets[of_set].add(path.name, found, labels)
        tally.common += by_all.tolist()
        for person, number, common in zip(np.flatnonzero(must), comparison.number.tolist(), by_all, strict=True):
            if not labels.sure[person]:
                continue
            own = comparison.shown.keypoint[number - 1] if number else None
            tally.joints.add(own, labels.point[person], labels.visible[person])
            if common:
                tally.common_joints.add(own, labels.point[person], labels.visible[person])
