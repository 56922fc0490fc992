"""From points on the template's surface to labels: what the renderer asks for each pixel of a person."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from export.people.atlas import Atlas
from export.shards import mirror_iuv

CELL_M = 0.004
_MARGIN_M = 0.02


class LabelLookup:
    """The nearest face of the atlas by a grid of 4 mm cells over the right half; the left half is its mirror image.

    Points may lie a little off the surface, as those between two points of it do.
    """

    def __init__(self, atlas: Atlas) -> None:
        right = np.flatnonzero(atlas.rest[atlas.faces][..., 0].mean(1) < 0)
        corner = atlas.rest[atlas.faces[right]]
        self._part, self._uv = atlas.part[right], atlas.uv[right]
        # (U, V) is linear over a face: a gradient in space and an offset.
        first, p, q = corner[:, 0], corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
        pp, pq, qq = (p * p).sum(1), (p * q).sum(1), (q * q).sum(1)
        scale = 1 / np.maximum(pp * qq - pq**2, 1e-18)
        self._to_b = ((qq * scale)[:, None] * p - (pq * scale)[:, None] * q).astype(np.float32)
        self._to_c = ((pp * scale)[:, None] * q - (pq * scale)[:, None] * p).astype(np.float32)
        self._first = first.astype(np.float32)
        self._low = corner.min((0, 1)) - _MARGIN_M
        shape = np.ceil((corner.max((0, 1)) + _MARGIN_M - self._low) / CELL_M).astype(int)
        shape[0] = max(shape[0], int(np.ceil(-self._low[0] / CELL_M)))  # up to the middle
        self._faces = self._grid(corner, shape)

    def _grid(self, corner: np.ndarray, shape: np.ndarray) -> np.ndarray:
        """Index of a near face for every cell: [X, Y, Z] int32."""
        longest = np.linalg.norm(corner - np.roll(corner, 1, 1), axis=2).max(1)
        grid = np.full(shape, -1, np.int32)
        nearest = np.full(shape, np.inf, np.float32)
        for steps in np.unique(np.maximum(np.ceil(longest / (0.5 * CELL_M)).astype(int), 1)):
            own = np.flatnonzero(np.maximum(np.ceil(longest / (0.5 * CELL_M)).astype(int), 1) == steps)
            a, b = np.meshgrid(np.arange(steps + 1), np.arange(steps + 1), indexing="ij")
            inside = a + b <= steps
            weight = np.stack([steps - a[inside] - b[inside], a[inside], b[inside]], 1) / steps
            points = np.einsum("kc,fcx->fkx", weight, corner[own]).reshape(-1, 3)
            face = np.repeat(own, len(weight)).astype(np.int32)
            place = (points - self._low) / CELL_M
            cell = np.clip(place.astype(int), 0, shape - 1)
            distance = np.linalg.norm(place - cell - 0.5, axis=1).astype(np.float32)
            # The point nearest to the middle of a cell is written last, because points are sorted by falling distance.
            order = np.argsort(-distance, kind="stable")
            cell, face, distance = tuple(cell[order].T), face[order], distance[order]
            closer = distance < nearest[cell]
            cell = tuple(c[closer] for c in cell)
            grid[cell], nearest[cell] = face[closer], distance[closer]
        index = ndimage.distance_transform_edt(grid < 0, return_distances=False, return_indices=True)
        return grid[tuple(index)]

    def iuv(self, points: np.ndarray) -> np.ndarray:
        """points: [K, 3] metres on the template's surface. Labels uint8 [K, 3] = (I, U*255, V*255)."""
        left = points[:, 0] > 0
        points = points * np.where(left, -1, 1)[:, None] ** np.array([1, 0, 0])
        cell = np.clip(((points - self._low) / CELL_M).astype(int), 0, np.array(self._faces.shape) - 1)
        face = self._faces[tuple(cell.T)]
        relative = points - self._first[face]
        b, c = (relative * self._to_b[face]).sum(1), (relative * self._to_c[face]).sum(1)
        weight = np.clip(np.stack([1 - b - c, b, c], 1), 0, None)
        weight /= weight.sum(1, keepdims=True)
        uv = (weight[..., None] * self._uv[face]).sum(1)
        out = np.concatenate([self._part[face][:, None], np.round(np.clip(uv, 0, 1) * 255)], 1).astype(np.uint8)
        out[left] = mirror_iuv(out[left])
        return out
