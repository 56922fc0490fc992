"""A contact sheet of places, to be looked at: images, their depth, and the cloud as points from the same cameras.

python -m export.places.sheet .data/places/val/place-0000* --out sheet.png
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import cv2
import numpy as np

from export.places.place import Place, PlaceError, load_place

_SIDE = 240  # pixels of a cell's longer side


def painted_depth(depth: np.ndarray) -> np.ndarray:
    """float32 [H, W] metres -> uint8 [H, W, 3] RGB: near is bright, black is nothing."""
    seen = depth > 0
    if not seen.any():
        return np.zeros((*depth.shape, 3), np.uint8)
    inverse = np.where(seen, 1 / np.maximum(depth, 1e-6), 0)
    low, high = np.quantile(inverse[seen], (0.01, 0.99))
    scaled = np.clip((inverse - low) / max(high - low, 1e-9), 0, 1)
    colours = cv2.applyColorMap((255 * scaled).astype(np.uint8), cv2.COLORMAP_TURBO)[..., ::-1]
    return np.where(seen[..., None], colours, 0).astype(np.uint8)


def splatted(place: Place, view: int, shrink: int = 1) -> np.ndarray:
    """The cloud as a camera sees it, one pixel a point, the nearest wins: uint8 [H, W, 3]; grey where no point is."""
    camera = place.camera(view)
    camera = camera.shrunk(shrink)
    pixel, depth = camera.projected(place.xyz)
    with np.errstate(invalid="ignore"):
        at = np.round(pixel)
        inside = (depth > 1e-6) & (at >= 0).all(1) & (at < [camera.width_px, camera.height_px]).all(1)
    order = np.flatnonzero(inside)
    order = order[np.argsort(-depth[order], kind="stable")]
    x, y = at[order].astype(int).T
    image = np.full((camera.height_px, camera.width_px, 3), 128, np.uint8)
    image[y, x] = place.rgb[order]
    return image


def _cell(image: np.ndarray) -> np.ndarray:
    scale = _SIDE / max(image.shape[:2])
    size = max(round(image.shape[1] * scale), 1), max(round(image.shape[0] * scale), 1)
    image = cv2.resize(image, size, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_NEAREST)
    out = np.full((_SIDE, _SIDE, 3), 255, np.uint8)
    out[: image.shape[0], : image.shape[1]] = image
    return out


def sheet_of(place: Place, columns: int = 6) -> np.ndarray:
    """Rows of images, depth and cloud of some views, held-out ones among them: uint8 [H, W, 3]."""
    own = np.linspace(0, len(place.source) - 1, columns - columns // 3).astype(int)
    other = np.linspace(0, len(place.held_out) - 1, columns // 3).astype(int) if len(place.held_out) else []
    views = [*(int(place.source[k]) for k in own), *(int(place.held_out[k]) for k in other)]
    rows = [
        [_cell(place.images[v]) for v in views],
        [_cell(painted_depth(place.depth[v])) for v in views],
        [_cell(splatted(place, v, 2)) for v in views],
    ]
    return np.concatenate([np.concatenate(row, 1) for row in rows])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", type=Path, nargs="+", metavar="PLACE")
    parser.add_argument("--columns", type=int, default=6)
    parser.add_argument("--out", type=Path, default=Path("places-sheet.png"))
    options = parser.parse_args()
    try:
        sheets = [sheet_of(load_place(folder), options.columns) for folder in options.folders]
    except PlaceError as error:
        print(error, file=sys.stderr)
        return 1
    cv2.imwrite(str(options.out), np.concatenate(sheets)[..., ::-1])
    print(f"wrote {options.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
