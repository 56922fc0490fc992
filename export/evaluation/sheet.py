"""Draws what a backend sees in photographs: one contact sheet, to be looked at."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import cv2
import numpy as np
from maquette import MaquetteError
from tqdm import tqdm

from export.evaluation.backends import Prediction, open_backend
from export.evaluation.paint import labelled_tile, mosaic, paint
from export.shards import read_images

SUFFIXES = {".jpg", ".jpeg", ".png", ".webp", ".bmp"}
CLIPS = {".mp4", ".avi", ".mov", ".mkv"}

EPILOG = """\
examples:
  python -m export.photos people && python -m export.evaluation.sheet .data/photos/photo
  python -m export.evaluation.sheet tests/media/clip.mp4 --backend onnx --frames 12
  python -m export.evaluation.sheet .data/people/test/shard-00000.npz --backend torch --limit 24
"""


def pictures(source: Path, limit: int, frames: int) -> list[tuple[str, np.ndarray]]:
    """(name, uint8 [H, W, 3] RGB) of a photo, a folder of photos, a clip (`frames` of it) or a shard."""
    if source.suffix == ".npz":
        return [(item.name, item.image) for item in read_images([source], limit)]
    if source.suffix.lower() in CLIPS:
        return clip_frames(source, frames)
    files = sorted(source.iterdir()) if source.is_dir() else [source]
    found = []
    for file in [f for f in files if f.suffix.lower() in SUFFIXES][:limit]:
        image = cv2.imread(str(file), cv2.IMREAD_COLOR)
        if image is None:
            raise ValueError(f"{file} cannot be read as an image.")
        found.append((file.stem, image[..., ::-1].copy()))
    if not found:
        raise FileNotFoundError(f"{source} holds no photo ({', '.join(sorted(SUFFIXES))}), clip or shard.")
    return found


def clip_frames(source: Path, count: int) -> list[tuple[str, np.ndarray]]:
    """`count` frames of a clip, evenly spread."""
    clip = cv2.VideoCapture(str(source))
    frames = []
    while True:
        ok, frame = clip.read()
        if not ok:
            break
        frames.append(frame)
    if not frames:
        raise ValueError(f"{source} cannot be read as a clip.")
    chosen = np.linspace(0, len(frames) - 1, min(count, len(frames))).round().astype(int)
    return [(f"{source.stem} {k}", frames[k][..., ::-1].copy()) for k in chosen]


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m export.evaluation.sheet", description=__doc__, epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("source", type=Path, help="a photo, a folder of photos, a clip or a shard")
    parser.add_argument("--backend", default="capi", help="kind or kind=path, as in export.evaluation (default: capi)")
    parser.add_argument("--out", type=Path, default=Path("build/evaluation/sheet.png"), metavar="PNG")
    parser.add_argument("--threshold", type=float, help="lowest score shown (default: the model's)")
    parser.add_argument("--limit", type=int, default=48, metavar="N", help="at most so many photos (default 48)")
    parser.add_argument("--frames", type=int, default=12, metavar="N", help="frames of a clip (default 12)")
    parser.add_argument("--columns", type=int, default=6)
    parser.add_argument("--side", type=int, default=320, metavar="PX", help="tile size (default 320)")
    arguments = parser.parse_args(argv)
    try:
        backend = open_backend(arguments.backend, 0.05 if arguments.threshold is None else arguments.threshold)
        threshold = backend.threshold if arguments.threshold is None else arguments.threshold
        tiles = []
        for name, image in tqdm(
            pictures(arguments.source, arguments.limit, arguments.frames), unit="photo", disable=None
        ):
            shown = backend.predict(image).above(threshold)
            tiles.append(labelled_tile(paint(image, shown), caption(name, shown), arguments.side, arguments.side))
    except (MaquetteError, FileNotFoundError, ValueError) as error:
        print(f"No sheet was drawn: {error}", file=sys.stderr)
        return 1
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    sheet = mosaic(tiles, min(arguments.columns, len(tiles)))
    cv2.imwrite(str(arguments.out), sheet[..., ::-1])
    print(f"{len(tiles)} pictures by {backend.kind} {backend.path}: {arguments.out}")
    return 0


def caption(name: str, shown: Prediction) -> str:
    return f"{name}: {len(shown.score)}" + (" person" if len(shown.score) == 1 else " people")


if __name__ == "__main__":
    sys.exit(main())
