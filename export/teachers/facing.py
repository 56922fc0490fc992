"""Which way people in labelled photographs face, by the shoulders and hips of the landmark network.

The network is asked four times about each person: as the label was made, enlarged, and both mirrored. A person has a
direction only if all four answers agree. The label of a trunk then says whether it shows the chest or the back.
"""

from __future__ import annotations

import argparse
import functools
import sys
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from tqdm import tqdm

from export.jobs import Workers, results
from export.keypoints import NAMES
from export.photos.packages import PackageError
from export.teachers.label import Find, PhotoLabels
from export.teachers.stored import Stored

EPILOG = """\
example:
  python -m export.teachers && python -m export.teachers.facing

Writes OUT/NAME.npz for every photo with labels (export.teachers.facing.PhotoFacing). Photos that have one are skipped
unless their labels are newer, so an interrupted run goes on where it stopped. export.teachers.shards takes the files.
"""
MAX_APART_DEGREES = 30.0  # of each answer from the mean of all
CHEST_WITHIN_DEGREES = 60.0  # of the camera's direction; the back from 180 - 60 on; between them both may show
BACK, CHEST = 1, 2  # parts of the trunk
_ENLARGED = 1.2
_LEFT, _RIGHT, _SHOULDERS, _HIPS = (
    [k for k, name in enumerate(NAMES) if name in names]
    for names in (
        ("left shoulder", "left hip"), ("right shoulder", "right hip"),
        ("left shoulder", "right shoulder"), ("left hip", "right hip"),
    )
)  # fmt: skip


@dataclass(frozen=True)
class PhotoFacing(Stored):
    """degrees: float32 [N] of the people of `PhotoLabels`: the turn about the body's axis, 0 towards the camera, 90
    towards the right of the upright person's image, 180 or -180 away; NaN where nobody knows."""

    degrees: np.ndarray


def facing_of(world: np.ndarray) -> float:
    """The direction in degrees of a body with landmarks `world` [33, 3] (`Landmarks.world`)."""
    across = (world[_LEFT] - world[_RIGHT]).sum(0)
    up = world[_SHOULDERS].mean(0) - world[_HIPS].mean(0)
    ahead = np.cross(across, up)
    length = np.hypot(*up[:2])
    # The image's right for somebody who stands upright in it, whatever the body's roll is.
    right = np.array([-up[1], up[0]]) / length if length > 1e-6 else np.array([1.0, 0.0])
    return float(np.degrees(np.arctan2(ahead[:2] @ right, -ahead[2])))


def agreed(degrees: list[float]) -> float:
    """The mean direction, or NaN where one answer is missing (NaN) or off by more than MAX_APART_DEGREES."""
    turns = np.exp(1j * np.radians(degrees))
    mean = turns.mean()
    apart = np.degrees(np.abs(np.angle(turns / mean))) if abs(mean) > 1e-6 else np.inf
    return float(np.degrees(np.angle(mean))) if np.all(apart <= MAX_APART_DEGREES) else np.nan


def trunk_part(degrees: float) -> int:
    """CHEST or BACK, or 0 where the trunk may show both."""
    if abs(degrees) <= CHEST_WITHIN_DEGREES:
        return CHEST
    return BACK if abs(degrees) >= 180 - CHEST_WITHIN_DEGREES else 0


def face_photo(image: np.ndarray, labels: PhotoLabels, find: Find) -> PhotoFacing:
    """image: uint8 [H, W, 3] BGR; find: as `LandmarkNetwork.find`."""
    degrees = np.full(len(labels.box), np.nan, np.float32)
    mirrored, width = np.ascontiguousarray(image[:, ::-1]), image.shape[1]
    for k in np.flatnonzero(labels.sure):
        low, high = labels.point[k].min(0), labels.point[k].max(0)
        answers = [facing_of(labels.world[k])]
        for scale, is_mirrored in ((_ENLARGED, False), (1.0, True), (_ENLARGED, True)):
            margin = (scale - 1) / 2 * (high - low)
            box = np.concatenate([low - margin, high + margin])
            if is_mirrored:
                box[[0, 2]] = width - box[[2, 0]]
            found = find(mirrored if is_mirrored else image, box)
            turn = np.nan if found is None else facing_of(found.world)
            answers.append(-turn if is_mirrored else turn)
            if not np.isfinite(agreed(answers)):
                break
        degrees[k] = agreed(answers)
    return PhotoFacing(degrees)


def _face(job: tuple[Path, Path, Path]) -> None:
    photo, labels, kept = job
    image = cv2.imread(str(photo))
    if image is None:
        raise ValueError(f"{photo} is not an image that can be read")
    face_photo(image, PhotoLabels.load(labels), _network().find).save(kept)


def _is_newer(kept: Path, labels: Path) -> bool:
    return kept.exists() and kept.stat().st_mtime >= labels.stat().st_mtime


@functools.cache
def _network():
    from export.teachers.landmarks import LandmarkNetwork

    return LandmarkNetwork()


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m export.teachers.facing", description=__doc__, epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    add = parser.add_argument
    add("--photos", type=Path, nargs="+", default=[Path(".data/photos/train")], metavar="DIR")
    add("--labels", type=Path, default=Path(".data/teachers/labels"), metavar="DIR", help="PhotoLabels (%(default)s)")
    add("--out", type=Path, default=Path(".data/teachers/facing"), metavar="DIR", help="(%(default)s)")
    Workers.add_arguments(parser)
    arguments = parser.parse_args(argv)
    every = [(p, arguments.labels / f"{p.stem}.npz") for f in arguments.photos for p in sorted(f.glob("*.jpg"))]
    jobs = [(photo, labels, arguments.out / labels.name) for photo, labels in every if labels.exists()]
    if not jobs:
        folders = " ".join(map(str, arguments.photos))
        print(f"No labels in {arguments.labels} for the photos in {folders}: run "
              f"`python -m export.teachers --photos {folders}` first.", file=sys.stderr)  # fmt: skip
        return 1
    asked = [job for job in jobs if not _is_newer(job[2], job[1])]
    try:
        with tqdm(total=len(jobs), initial=len(jobs) - len(asked), unit="photo", disable=None) as bar:
            for _ in results(Workers.of(arguments).run(_face, asked)):
                bar.update()
    except (PackageError, OSError, RuntimeError, ValueError) as error:
        print(error, file=sys.stderr)
        return 1
    degrees = np.concatenate([PhotoFacing.load(kept).degrees for _, _, kept in jobs])
    parts = [trunk_part(d) for d in degrees[np.isfinite(degrees)]]
    print(f"{len(jobs)} photos, the direction of {len(parts)} of {len(degrees)} people is known: "
          f"{parts.count(CHEST)} show the chest, {parts.count(BACK)} the back, {parts.count(0)} a side")  # fmt: skip
    return 0


if __name__ == "__main__":
    sys.exit(main())
