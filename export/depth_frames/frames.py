"""A real depth frame, and how it becomes a whole view of `export.solids.records`.

The distance to the nearest edge is not known in a real frame. Where surfaces are known to be smooth (round metrics, a
flat board) the label is "no edge within 16 r", elsewhere there is none.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from export.solids.records import LIMIT_R, NO_PATCH, NONE, Record, packed


@dataclass(frozen=True, eq=False)
class DepthFrame:
    """depth: float32 [H, W] in metres (of images without a known scale: any unit), 0 where unknown. intrinsics: fx,
    fy, cx, cy in pixels. smooth: bool [H, W], where it is known that no edge is within 16 r. boxes: true sizes."""

    name: str
    depth: np.ndarray
    intrinsics: tuple[float, float, float, float]
    smooth: np.ndarray
    boxes: Sequence[dict] = field(default_factory=tuple)

    def record(self) -> Record:
        """Its curves are empty but for `boxes`, which `records.Record.seen_curves` returns."""
        # Networks take multiples of 16 pixels: the last columns and rows are left out.
        height, width = (side - side % 16 for side in self.depth.shape)
        depth, smooth = self.depth[:height, :width], self.smooth[:height, :width]
        planes = {
            "depth": depth.astype(np.float32),
            "distance": np.full(depth.shape, LIMIT_R, np.float16),
            "kind": np.full(depth.shape, NONE, np.uint8),
            "ignore": ~smooth | (depth <= 0),
            "patch": np.full(depth.shape, NO_PATCH, np.uint16),
        }
        curves = json.dumps({"curves": [], "corners": [], "boxes": list(self.boxes)})
        return packed(self.name, planes, self.intrinsics, curves)
