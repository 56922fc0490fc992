"""Labels real photographs by permissively licensed networks: boxes, 33 landmarks and a mask for each person."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import cv2
import numpy as np

from export.jobs import Workers
from export.photos.packages import PackageError
from export.teachers.label import PhotoLabels, draw
from export.teachers.label_files import label_all

EPILOG = """\
example:
  python -m export.photos people && python -m export.teachers

Writes OUT/NAME.npz for every photo (export.teachers.label.PhotoLabels) and OUT/sheet.jpg to look at: green boxes where
detector, landmarks and mask agree, yellow ones without landmarks, red ones where only the detector speaks. Photos with
labels are not asked again.
"""
TILE = (420, 320)
MAX_TILES = 400  # of the sheet; more make an image that JPEG cannot hold


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m export.teachers", description=__doc__, epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument(
        "--photos", type=Path, nargs="+", metavar="DIR",
        default=[Path(".data/photos") / name for name in ("photo", "train", "val", "test", "fresh")],
        help="default: all of `export.photos people`",
    )  # fmt: skip
    parser.add_argument("--out", type=Path, default=Path(".data/teachers/labels"), metavar="DIR")
    parser.add_argument("--force", action="store_true", help="ask again for photos that have labels")
    Workers.add_arguments(parser)
    arguments = parser.parse_args(argv)
    every = [path for folder in arguments.photos for path in sorted(folder.glob("*"))]
    photos = [path for path in every if path.suffix in (".jpg", ".jpeg", ".png")]
    if not photos:
        folders = ", ".join(map(str, arguments.photos))
        print(f"No photos in {folders}: run `python -m export.photos people` first.", file=sys.stderr)
        return 1
    try:
        found = label_all(photos, arguments.out, Workers.of(arguments), arguments.force)
        tiles, people, sure = [], 0, 0
        for photo, path in found.items():
            labels = PhotoLabels.load(path)
            people, sure = people + len(labels.sure), sure + int(labels.sure.sum())
            if len(tiles) < MAX_TILES:
                tiles.append(tile(draw(cv2.imread(str(photo)), labels)))
    except (PackageError, OSError, RuntimeError, ValueError) as error:
        print(error, file=sys.stderr)
        return 1
    cv2.imwrite(str(arguments.out / "sheet.jpg"), sheet(tiles))
    print(
        f"{len(found)} photos, {people} people found, {sure} of them with landmarks and mask; {arguments.out}/sheet.jpg"
    )
    return 0


def tile(image: np.ndarray) -> np.ndarray:
    scale = min(TILE[0] / image.shape[1], TILE[1] / image.shape[0])
    small = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)[: TILE[1], : TILE[0]]
    out = np.zeros((TILE[1], TILE[0], 3), np.uint8)
    out[: small.shape[0], : small.shape[1]] = small
    return out


def sheet(tiles: list[np.ndarray], columns: int = 4) -> np.ndarray:
    blank = np.zeros_like(tiles[0])
    rows = [tiles[k : k + columns] for k in range(0, len(tiles), columns)]
    return np.vstack([np.hstack(row + [blank] * (columns - len(row))) for row in rows])


if __name__ == "__main__":
    sys.exit(main())
