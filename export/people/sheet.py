"""Draws a contact sheet of rendered samples beside their labels, to be looked at.

python -m export.people.sheet --split test --out sheet.png
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2
import numpy as np

from export.people.augmentation import VARIETIES
from export.people.scene import SPLITS, Studio
from export.shards import visible_boxes


def part_colours() -> np.ndarray:
    """A colour (BGR) for each of 25 labels; neighbours in number differ in hue, background is black."""
    hue = (np.arange(25) * 67) % 180
    hsv = np.stack([hue, np.full(25, 190), np.full(25, 235)], 1).astype(np.uint8)
    colours = cv2.cvtColor(hsv[None], cv2.COLOR_HSV2BGR)[0]
    colours[0] = 0
    return colours


def painted(image: np.ndarray, label: np.ndarray) -> np.ndarray:
    """The labels over a dimmed image: part colours, dark lines at every eighth of U and V, boxes."""
    person = label[..., 3] > 0
    out = (image * 0.35).astype(np.uint8)
    out[person] = part_colours()[label[person][:, 0]]
    lines = (((label[..., 1:3].astype(np.int32)) % 32) < 4).any(-1) & person
    out[lines] = out[lines] // 2
    for box, ignore in zip(*visible_boxes(label)[::2], strict=True):
        x0, y0, x1, y1 = box.astype(int)
        cv2.rectangle(out, (x0, y0), (x1 - 1, y1 - 1), (0, 0, 255) if ignore else (255, 255, 255), 1)
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--split", choices=SPLITS, default="train")
    parser.add_argument("--variety", choices=VARIETIES, default="close", help="as for export.people.dataset")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--rows", type=int, default=5)
    parser.add_argument("--columns", type=int, default=3)
    parser.add_argument("--out", type=Path, default=Path("people-sheet.png"))
    parser.add_argument("--places", type=Path, default=Path(".data"), help="folder of backgrounds and panoramas")
    options = parser.parse_args()
    variety = VARIETIES[options.variety]
    studio = Studio(options.split, *variety.sizes[0], options.places, points=False, variety=variety)
    rng = np.random.default_rng([SPLITS[options.split], options.seed, 99])
    rows = []
    for _ in range(options.rows):
        samples = [studio.sample(rng) for _ in range(options.columns)]
        rows.append(np.concatenate([x for s in samples for x in (s.image, painted(s.image, s.label))], 1))
    cv2.imwrite(str(options.out), np.concatenate(rows))
    print(f"wrote {options.out}")


if __name__ == "__main__":
    main()
