"""The table from (I, U, V) to points of the template body and back, as bundles carry it (docs/reference/formats.md)."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from export.surface import PART_COUNT

FILE = "surface.grid"
_MAGIC = b"MAQGRID1"
_HEADER = struct.Struct("<8sII6f")
_NONE = 65535
_FINER = 4  # nodes between two nodes when a point is looked up


@dataclass(frozen=True)
class SurfaceGrid:
    """points: float32 [24, n, n, 3] metres (x to the body's left, y to its back, z up) at U = i / (n - 1) and
    V = j / (n - 1) of each part; NaN where the chart does not reach."""

    points: np.ndarray

    def save(self, path: Path) -> None:
        known = self.points[~np.isnan(self.points).any(-1)]
        low, high = known.min(0), known.max(0)
        scaled = np.nan_to_num((self.points - low) / (high - low) * (_NONE - 1), nan=_NONE)
        header = _HEADER.pack(_MAGIC, len(self.points), self.points.shape[1], *low, *high)
        path.write_bytes(header + np.round(scaled).astype("<u2").tobytes())

    @staticmethod
    def load(path: Path) -> SurfaceGrid:
        """Raises ValueError for a file that is no such table."""
        data = path.read_bytes()
        if len(data) < _HEADER.size or not data.startswith(_MAGIC):
            raise ValueError(f"{path} is not a surface grid")
        _, parts, nodes, *box = _HEADER.unpack_from(data)
        if parts != PART_COUNT or nodes < 2 or len(data) != _HEADER.size + 6 * parts * nodes**2:
            raise ValueError(f"{path} is a damaged surface grid: {parts} parts, {nodes} nodes, {len(data)} bytes")
        stored = np.frombuffer(data, "<u2", offset=_HEADER.size).reshape(parts, nodes, nodes, 3)
        low, high = np.array(box[:3]), np.array(box[3:])
        points = low + stored / (_NONE - 1) * (high - low)
        return SurfaceGrid(np.where(stored == _NONE, np.nan, points).astype(np.float32))

    def point_of(self, part: np.ndarray, uv: np.ndarray) -> np.ndarray:
        """part: [K] in 1..24; uv: [K, 2] in 0..1. float32 [K, 3] metres, bilinear between the nodes around that the
        chart reaches; NaN where it reaches none of them."""
        nodes = self.points.shape[1]
        at = np.clip(uv, 0, 1) * (nodes - 1)
        low = np.minimum(at.astype(int), nodes - 2)
        share = at - low
        total, weight = np.zeros((len(part), 3)), np.zeros(len(part))
        for i in (0, 1):
            for j in (0, 1):
                corner = self.points[np.asarray(part) - 1, low[:, 0] + i, low[:, 1] + j]
                counts = np.where(i, share[:, 0], 1 - share[:, 0]) * np.where(j, share[:, 1], 1 - share[:, 1])
                # A node that is reached counts a little even from afar, so that the chart's rim has an answer.
                counts = np.where(np.isnan(corner).any(1), 0, np.maximum(counts, 1e-6))
                total += counts[:, None] * np.nan_to_num(corner)
                weight += counts
        with np.errstate(invalid="ignore"):
            return (total / weight[:, None]).astype(np.float32)

    def label_of(self, points: np.ndarray) -> np.ndarray:
        """points: [K, 3] metres on or near the template's surface. uint8 [K, 3] = (I, U*255, V*255) of the nearest
        point of the table."""
        tree, labels = self._finer
        return labels[tree.query(points)[1]]

    @cached_property
    def _finer(self) -> tuple[cKDTree, np.ndarray]:
        nodes = self.points.shape[1]
        u, v = np.meshgrid(*[np.linspace(0, 1, _FINER * (nodes - 1) + 1)] * 2, indexing="ij")
        uv = np.stack([u.ravel(), v.ravel()], 1)
        points, labels = [], []
        for part in range(1, PART_COUNT + 1):
            found = self.point_of(np.full(len(uv), part), uv)
            reached = ~np.isnan(found).any(1)
            points.append(found[reached])
            labels.append(np.insert(np.round(255 * uv[reached]), 0, part, 1))
        return cKDTree(np.concatenate(points)), np.concatenate(labels).astype(np.uint8)
