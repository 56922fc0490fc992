"""Poses of fitted people, for rendering others in them: writes what `export.people.motion` reads.

From each fit that is believed: how hips, chest and head are turned and where the limbs point that the photo shows, with
the direction that the person faces taken out. Head shots that show no whole limb are left out. Only photographs to
train on have fits there.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from export.keypoints import NAMES
from export.people.body import Body
from export.people.motion import LIMBS, PHOTO_POSES, limb_directions, without_yaw
from export.teachers.body_model import JOINT
from export.teachers.fit import PhotoFits
from export.teachers.fitting import inside
from export.teachers.label import PhotoLabels
from export.teachers.pose_start import SHOWN

EPILOG = """\
example:
  python -m export.teachers.fit && python -m export.teachers.poses
"""


_ENDS = {"upper_arm": ("shoulder", "elbow"), "lower_arm": ("elbow", "wrist"),
         "upper_leg": ("hip", "knee"), "lower_leg": ("knee", "ankle")}  # fmt: skip


def shown_limbs(labels: PhotoLabels, person: int) -> list[bool]:
    """Which of `LIMBS` have both ends seen inside the photo. (A fit also has limbs beyond its border: guesses.)"""
    seen = (labels.visible[person] >= SHOWN) & inside(labels.point[person], labels.mask.shape[1:])
    sides = {"L": "left", "R": "right"}
    ends = [[f"{sides[limb[-1]]} {end}" for end in _ENDS[limb[:-2]]] for limb in LIMBS]
    return [bool(seen[[NAMES.index(name) for name in pair]].all()) for pair in ends]


def pose_of(body: Body, rotations: np.ndarray, shown: list[bool]) -> dict:
    """rotations [19, 3, 3] of one fit, shown [8]. Rotation vectors of `root`, `chest` and `head` in radians, and a
    direction of each limb or None where it is hidden."""
    limbs = limb_directions(body, {name: rotations[JOINT[name]] for name in LIMBS})
    root, chest, head = (rotations[None, JOINT[name]] for name in ("pelvis", "chest", "head"))
    *turned, limbs = without_yaw(root, chest, head, limbs[None])
    row = {
        key: Rotation.from_matrix(value[0]).as_rotvec().round(3).tolist()
        for key, value in zip(("root", "chest", "head"), turned, strict=True)
    }
    directions = zip(limbs[0].round(3).tolist(), shown, strict=True)
    return row | {"limbs": [limb if seen else None for limb, seen in directions]}


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m export.teachers.poses", description=__doc__, epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    add = parser.add_argument
    add("--fits", type=Path, default=Path(".data/teachers/fits"), metavar="DIR", help="PhotoFits (%(default)s)")
    add("--labels", type=Path, default=Path(".data/teachers/labels"), metavar="DIR", help="PhotoLabels (%(default)s)")
    add("--out", type=Path, default=PHOTO_POSES, metavar="FILE", help="(export/people/photo_poses.json)")
    options = parser.parse_args(argv)
    paths = sorted(options.fits.glob("*.npz"))
    if not paths:
        print(f"No fits in {options.fits}: run `python -m export.teachers.fit` first.", file=sys.stderr)
        return 1
    body, rows = Body(), []
    for path in paths:
        fits, labels = PhotoFits.load(path), PhotoLabels.load(options.labels / path.name)
        for k in np.flatnonzero(fits.accepted):
            person = int(fits.person[k])
            if any(shown := shown_limbs(labels, person)):
                rows.append({"photo": path.stem, "person": person} | pose_of(body, fits.rotations[k], shown))
    lines = ",\n".join(json.dumps(row) for row in rows)
    options.out.write_text(f'{{"poses": [\n{lines}\n]}}\n')
    print(f"{len(rows)} poses of {len({row['photo'] for row in rows})} photographs in {options.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
