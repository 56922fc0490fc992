"""Draws the worst cases that the evaluation found: the image beside what was painted, with the figure that chose it.

The cases and their order are those of evaluation.json (export.evaluation.failures); nothing is chosen by hand.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import cv2
import numpy as np
from maquette import MaquetteError

from export.evaluation.backends import Backend, fingerprint, open_backend
from export.evaluation.failures import KINDS
from export.evaluation.paint import labelled_tile, mosaic, paint
from export.evaluation.photos import read_photo
from export.evaluation.report import column_of
from export.shards import read_image

# Photographs that may be redistributed, and where they lie (tests/media/README.md); all others are told in words.
REDISTRIBUTABLE = {"astronaut.png": Path("tests/media/photo.jpg")}
CAPTIONS = {
    "missed": "missed, {:.0f} px high",
    "false": "score {:.2f}",
    "mask": "mask IoU {:.2f}",
    "side": "side correct {:.2f}",
}
TILE = (480, 216)  # width, height
COLUMNS = 4
HEADER_PX = 22
JPEG_QUALITY = 85
_MARK = (255, 230, 0)

EPILOG = """\
examples:
  python -m export.evaluation && python -m export.evaluation.gallery
  python -m export.evaluation.gallery --all-photos --out build/evaluation/all-failures.jpg     not to be committed
"""


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m export.evaluation.gallery", description=__doc__, epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("--evaluation", type=Path, default=Path("build/evaluation/evaluation.json"), metavar="JSON")
    parser.add_argument("--backend", default="capi", help="one that was measured (default: capi)")
    parser.add_argument("--out", type=Path, default=Path("docs/images/failures.jpg"), metavar="JPG")
    parser.add_argument("--cases", type=int, default=3, metavar="N", help="rendered cases of each kind (default 3)")
    parser.add_argument(
        "--all-photos", action="store_true", help="also photographs that may not be redistributed: do not commit"
    )
    arguments = parser.parse_args(argv)
    try:
        document = json.loads(arguments.evaluation.read_text())
        backend = open_backend(arguments.backend, 0.05)
        metrics = column_of(document, fingerprint(backend.path))
        rows = [
            draw_kind(kind, backend, document["data"], metrics, arguments.cases, arguments.all_photos) for kind in KINDS
        ]
    except (MaquetteError, FileNotFoundError, ValueError) as error:
        print(f"No gallery was drawn: {error}", file=sys.stderr)
        return 1
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(arguments.out), np.vstack(rows)[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    print(f"{arguments.out}: {arguments.out.stat().st_size / 1e3:.0f} kB")
    for kind in KINDS if metrics["photos"] else ():
        print(f"photographs, {KINDS[kind]}:")
        for case in metrics["photos"]["failures"][kind]:
            print(f"  {case['image']}: {CAPTIONS[kind].format(case['figure'])}")
    return 0


def draw_kind(kind: str, backend: Backend, data: dict, metrics: dict, count: int, all_photos: bool) -> np.ndarray:
    """The worst cases of one kind: at most `count` rendered images, then the photographs that may be shown.

    data, metrics: as in evaluation.json. Returns uint8 [H, COLUMNS * tile width, 3] RGB: a title and rows of tiles.
    """
    shown = [
        (case, read_image(Path(data["folder"]), case["image"]).image) for case in metrics["failures"][kind][:count]
    ]
    for case in metrics["photos"]["failures"][kind] if metrics["photos"] else ():
        path = REDISTRIBUTABLE.get(case["image"])
        if path is None and all_photos:
            folders = (Path(data["photos"]), Path(data["empty"]))
            path = next((f / case["image"] for f in folders if (f / case["image"]).exists()), None)
        if path is not None:
            shown.append((case, read_photo(path)))
    tiles = [draw_case(kind, case, image, backend) for case, image in shown]
    header = np.zeros((HEADER_PX, COLUMNS * TILE[0], 3), np.uint8)
    title = KINDS[kind] if tiles else f"{KINDS[kind]}: none"
    cv2.putText(header, title, (3, 16), cv2.FONT_HERSHEY_SIMPLEX, 0.5, _MARK, 1, cv2.LINE_AA)
    return np.vstack([header, mosaic(tiles, COLUMNS)]) if tiles else header


def draw_case(kind: str, case: dict, image: np.ndarray, backend: Backend) -> np.ndarray:
    """uint8 [TILE] RGB: the image with the box of the person or false detection, and what a user would be shown."""
    marked = image.copy()
    x0, y0, x1, y1 = np.round(case["box"]).astype(int).tolist()
    cv2.rectangle(marked, (x0, y0), (x1 - 1, y1 - 1), _MARK, max(1, round(max(image.shape[:2]) / 200)))
    painted = paint(image, backend.predict(image).above(backend.threshold))
    text = f"{case['image']}: {CAPTIONS[kind].format(case['figure'])}"
    return labelled_tile(np.hstack([marked, painted]), text, *TILE)


if __name__ == "__main__":
    sys.exit(main())
