"""Labels of many photographs as files, made by several processes (which cannot find functions of a `__main__`)."""

from __future__ import annotations

import functools
from pathlib import Path

import cv2
from tqdm import tqdm

from export.jobs import Workers, results
from export.teachers.label import label_photo


def label_all(photos: list[Path], out: Path, workers: Workers, force: bool = False) -> dict[Path, Path]:
    """Makes labels of every photo, unless they were made earlier, in `out`. Returns each photo's file of labels.

    Raises ValueError for a file that is not an image.
    """
    out.mkdir(parents=True, exist_ok=True)
    files = {photo: out / f"{photo.stem}.npz" for photo in photos}
    jobs = [(photo, path) for photo, path in files.items() if force or not path.exists()]
    with tqdm(total=len(photos), initial=len(photos) - len(jobs), desc="labelling", unit="photo", disable=None) as bar:
        for _ in results(workers.run(_label, jobs)):
            bar.update()
    return files


def _label(job: tuple[Path, Path]) -> None:
    photo, path = job
    image = cv2.imread(str(photo))
    if image is None:
        raise ValueError(f"{photo} is not an image that can be read")
    label_photo(image, *_teachers()).save(path)


@functools.cache
def _teachers():
    from export.teachers.detector import PersonDetector
    from export.teachers.landmarks import LandmarkNetwork
    from export.teachers.matte import MatteNetwork

    return PersonDetector().detect, LandmarkNetwork().find, MatteNetwork().find
