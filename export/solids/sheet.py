"""A contact sheet of crops, to be looked at: depth, shaded normals, distance, kind.

    python -m export.solids.sheet .data/solids/train --out sheet.png

Distance: white on a curve, black from 16 r on, magenta where there is no label. Kind: green a convex crease, red a
concave one, blue a boundary; grey beyond 16 r.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from pathlib import Path

import cv2
import numpy as np

from export.solids.records import BOUNDARY, CONCAVE, CONVEX, LIMIT_R, NONE, Record, RecordError, read_records

_COLOURS = {NONE: (90, 90, 90), CONVEX: (60, 220, 60), CONCAVE: (230, 60, 60), BOUNDARY: (60, 130, 255)}


def painted_depth(depth: np.ndarray) -> np.ndarray:
    """float32 [H, W] metres -> uint8 [H, W, 3] RGB: near is bright, black is nothing."""
    seen = depth > 0
    if not seen.any():
        return np.zeros((*depth.shape, 3), np.uint8)
    inverse = np.where(seen, 1 / np.where(seen, depth, 1), 0)
    low, high = np.quantile(inverse[seen], (0.01, 0.99))
    scaled = np.clip(0.1 + 0.9 * (inverse - low) / max(high - low, 1e-9), 0.05, 1)
    colours = cv2.applyColorMap((255 * scaled).astype(np.uint8), cv2.COLORMAP_TURBO)[..., ::-1]
    return np.where(seen[..., None], colours, 0).astype(np.uint8)


def shaded(depth: np.ndarray, intrinsics: tuple[float, ...]) -> np.ndarray:
    """Normals of the depth as colours, uint8 [H, W, 3]; differences that cross a jump in depth show it."""
    fx, fy, cx, cy = intrinsics
    height, width = depth.shape
    x, y = (np.arange(width) - cx) / fx, (np.arange(height) - cy) / fy
    point = depth[..., None] * np.stack([*np.meshgrid(x, y), np.ones_like(depth)], -1)
    normal = np.cross(np.gradient(point, axis=0), np.gradient(point, axis=1))
    normal /= np.maximum(np.linalg.norm(normal, axis=2, keepdims=True), 1e-12)
    return np.where(depth[..., None] > 0, 127.5 + 127.5 * normal, 0).astype(np.uint8)


def painted_distance(distance: np.ndarray, ignore: np.ndarray) -> np.ndarray:
    grey = (255 * (1 - distance.astype(np.float32) / LIMIT_R)).astype(np.uint8)
    return np.where(ignore[..., None], np.uint8((255, 0, 255)), grey[..., None])


def column(record: Record) -> np.ndarray:
    """uint8 [4 H, W, 3]"""
    planes = record.decoded()
    colours = np.array([_COLOURS[k] for k in sorted(_COLOURS)], np.uint8)
    kind = np.where(planes["depth"][..., None] > 0, colours[planes["kind"]], 0).astype(np.uint8)
    cells = [
        painted_depth(planes["depth"]),
        shaded(planes["depth"], record.intrinsics),
        painted_distance(planes["distance"], planes["ignore"]),
        kind,
    ]
    return np.concatenate([cv2.copyMakeBorder(c, 1, 1, 1, 1, cv2.BORDER_CONSTANT) for c in cells])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--first", type=int, default=0, help="number of the first crop (default %(default)s)")
    parser.add_argument("--every", type=int, default=6, help="of so many crops one is shown (default %(default)s)")
    parser.add_argument("--columns", type=int, default=14)
    parser.add_argument("--rows", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("solids-sheet.png"))
    options = parser.parse_args()
    last = options.first + options.every * options.columns * options.rows
    try:
        chosen = list(itertools.islice(read_records(options.folder), options.first, last, options.every))
    except RecordError as error:
        print(error, file=sys.stderr)
        return 1
    columns = [column(record) for record in chosen]
    columns += [np.zeros_like(columns[0])] * (-len(columns) % options.columns)
    rows = [np.concatenate(columns[k : k + options.columns], 1) for k in range(0, len(columns), options.columns)]
    cv2.imwrite(str(options.out), np.concatenate(rows)[..., ::-1])
    print(f"wrote {options.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
