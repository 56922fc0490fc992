"""A head's distance at the corners of a grid: where rays go in, roughly (sdk/src/head/fit/distance_grid)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import map_coordinates

SIDE = 32  # corners along each axis
MAX_SLOPE = 1.5  # of the distance, which steps along a ray count on


@dataclass(frozen=True, eq=False)
class Passage:
    """Passages of N rays: is_in_domain; distance [N]: of the point nearest to the head, 0 for a hit; begin and end [N]:
    depths of the section on the way inwards. Values of a ray outside the domain are undefined."""

    is_in_domain: np.ndarray
    distance: np.ndarray
    begin: np.ndarray
    end: np.ndarray


class DistanceGrid:
    def __init__(self, low: np.ndarray, high: np.ndarray, distance: Callable[[np.ndarray], np.ndarray]) -> None:
        """Between the corners low and high [3], dm, of the domain. distance: of points [N, 3]."""
        self.low, self.high = low.astype(np.float64), high.astype(np.float64)
        self.cells_per_dm = (SIDE - 1) / (self.high - self.low)
        axes = [self.low[axis] + np.arange(SIDE) / self.cells_per_dm[axis] for axis in (2, 1, 0)]
        z, y, x = np.meshgrid(*axes, indexing="ij")
        points = np.stack([x, y, z], -1).reshape(-1, 3)
        self.values = distance(points).reshape(SIDE, SIDE, SIDE).astype(np.float64)

    @property
    def cell_dm(self) -> float:
        return float(1 / self.cells_per_dm.min())

    def at(self, points: np.ndarray) -> np.ndarray:
        """[N, 3] -> [N], linear along each axis between the corners."""
        index = (points - self.low) * self.cells_per_dm
        return map_coordinates(self.values, index[:, ::-1].T, order=1, mode="nearest")

    def passage(self, base: np.ndarray, direction: np.ndarray, first: float, enough_dm: float) -> Passage:
        """Passages of rays base + depth * direction, [N, 3] each, depth > first. A passage begins `enough_dm` outside,
        or where the domain does, and ends as far inside, or where the ray no longer comes nearer."""
        with np.errstate(divide="ignore", invalid="ignore"):
            a, b = (self.low - base) / direction, (self.high - base) / direction
        start, stop = np.maximum(np.minimum(a, b).max(1), first), np.minimum(np.maximum(a, b).min(1), 1e9)
        speed = np.linalg.norm(direction, axis=1)
        in_domain = start < stop
        least = 0.5 * self.cell_dm / speed
        distance = np.full(len(base), 1e9)
        begin, end, outside, depth = start.copy(), start.copy(), start.copy(), start.copy()
        going, met = in_domain.copy(), np.zeros(len(base), bool)
        while going.any():
            i = np.nonzero(going)[0]
            f = self.at(base[i] + depth[i, None] * direction[i])
            inside = f <= 0
            hit = i[inside]
            met[hit], distance[hit], begin[hit] = True, 0, outside[hit]
            end[hit] = self._inwards(base[hit], direction[hit], depth[hit], stop[hit], least[hit], f[inside], enough_dm)
            i, f = i[~inside], f[~inside]
            going[hit] = False
            far = i[f >= enough_dm]
            outside[far] = depth[far]
            nearer = f < distance[i]
            near = i[nearer]
            distance[near], end[near], begin[near] = f[nearer], depth[near], outside[near]
            going[i[~(depth[i] < stop[i])]] = False
            depth[i] = np.minimum(stop[i], depth[i] + np.maximum(least[i], f / (MAX_SLOPE * speed[i])))
        return Passage(in_domain, distance, begin, end)

    def _inwards(
        self, base: np.ndarray, direction: np.ndarray, depth: np.ndarray, stop: np.ndarray, least: np.ndarray,
        low: np.ndarray, enough_dm: float,
    ) -> np.ndarray:  # fmt: skip
        """From the first point inside on, whose distances are `low`: where the passage ends."""
        depth, low, end = depth.copy(), low.copy(), depth.copy()
        going = (depth < stop) & (low > -enough_dm)
        while going.any():
            i = np.nonzero(going)[0]
            depth[i] = np.minimum(stop[i], depth[i] + least[i])
            then = self.at(base[i] + depth[i, None] * direction[i])
            lower = then < low[i]
            kept = i[lower]
            low[kept], end[kept] = then[lower], depth[kept]
            going[i] = lower & (depth[i] < stop[i]) & (low[i] > -enough_dm)
        return end
