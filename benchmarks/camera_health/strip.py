"""Writes an image with an event of each kind in a film: a row for each, with what camera health says.

python -m benchmarks.camera_health.strip tests/media/clip.mp4 --other tests/media/photo.jpg --out events.png
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2
import numpy as np

from benchmarks.camera_health.detectors import by_camera_health
from benchmarks.camera_health.events import AFTER, BEFORE, KINDS, staged
from benchmarks.camera_health.films import read_film


def write_strip(film: np.ndarray, other: np.ndarray, fps: float, path: Path) -> dict[str, list[str]]:
    """Returns what was found in each row. film, other: BGR uint8 [BEFORE + AFTER, 336, 448, 3]."""
    rows, found = [], {}
    for k, kind in enumerate(KINDS):
        frames = staged(kind, film, other, k).frames
        says = dict(by_camera_health(frames, fps))
        found[kind] = list(says.values())
        at = next((frame for frame in says if frame >= BEFORE), BEFORE + 12)
        tiles = []
        for frame in (BEFORE - 1, BEFORE, BEFORE + 1, BEFORE + 3, at):
            tile = frames[frame].copy()
            text = says.get(frame, "-")
            cv2.rectangle(tile, (0, 0), (319, 20), (20, 20, 20), -1)
            cv2.putText(tile, f"{kind}, frame {frame - BEFORE:+d}: {text}", (4, 15), cv2.FONT_HERSHEY_SIMPLEX, 0.45,
                        (255, 255, 255), 1, cv2.LINE_AA)  # fmt: skip
            if text != "-":
                cv2.rectangle(tile, (1, 1), (318, 238), (60, 60, 230), 3)
            tiles.append(tile)
        rows.append(np.hstack(tiles))
    path.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(path), np.vstack(rows))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("film", type=Path)
    parser.add_argument("--other", type=Path, required=True, help="image or film of another scene, for cut and object")
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    film, fps = read_film(options.film)
    other, _ = read_film(options.other)
    if len(film) < BEFORE + AFTER:
        parser.error(f"{options.film} has {len(film)} frames; {BEFORE + AFTER} are needed.")
    other = np.concatenate([other, np.repeat(other[-1:], BEFORE + AFTER, 0)])
    moving = np.random.default_rng(0).integers(-2, 3, other.shape, np.int16)  # a still image would be a freeze
    other = np.clip(other + moving, 0, 255).astype(np.uint8)
    for kind, events in write_strip(
        film[: BEFORE + AFTER], other[: BEFORE + AFTER], fps if fps > 1 else 30, options.out
    ).items():
        print(f"{kind}: found {', '.join(events) or 'nothing'}")
    print(f"Written: {options.out}")


if __name__ == "__main__":
    main()
