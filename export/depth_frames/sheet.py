"""Real depth frames with the field that a bundle finds in them, to be looked at, and what is an edge by mistake."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import cv2
import numpy as np

from export.edges.data import Frame, frame_of
from export.edges.validation import field_image
from export.solids.records import Record
from export.solids.sheet import painted_depth, shaded

TILE_PX = 240


def false_positives(field: Callable[[np.ndarray, float], np.ndarray], frames: Sequence[Frame]) -> dict[str, float]:
    """Shares of pixels where no edge is within 16 r that a field puts within 1 r and 4 r of one, and their number."""
    found = np.concatenate([field(f.depth, f.focal_px)[f.counts] for f in frames])
    return {"pixels": int(found.size), "under_1r": float((found < 1).mean()), "under_4r": float((found < 4).mean())}


def row_of(record: Record, field: Callable[[np.ndarray, float], np.ndarray]) -> np.ndarray:
    """uint8 [h, 4 TILE_PX, 3], RGB: depth, normals of the depth, field (bright at edges), where no edge is right."""
    planes, frame = record.decoded(), frame_of(record)
    known = frame.depth > 0
    made = np.where(known[..., None], field_image(field(frame.depth, frame.focal_px)), 0).astype(np.uint8)
    smooth = np.where(frame.counts[..., None], made, made // 4)
    tiles = [painted_depth(planes["depth"]), shaded(planes["depth"], record.intrinsics), made, smooth]
    size = TILE_PX, round(TILE_PX * record.height / record.width)
    return np.hstack([cv2.resize(tile, size, interpolation=cv2.INTER_AREA) for tile in tiles])
