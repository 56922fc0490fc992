"""Fuses the fields of several posed views: the pairwise rule of DEF (arXiv 2011.15081), in float64.

For each ordered pair of views, the points of the target view are moved into the camera of the source view, and the
source's field is interpolated where that view saw the same surface. A target then has at most one value from each view,
including its own, and gets the mean of the smaller half of them. This is the reference for sdk/src/edges/fusion, whose
targets are points on a grid instead of pixels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from export.camera import Camera
from export.edges.config import EPS_R

REACH_R = 6.0  # of the four pixels about a point's place those count that are so near it
MIN_WEIGHT = 0.25  # of these four, or the view did not see the point: that of the nearest pixel at least
FAR = 0.9  # of EPS_R: a view whose distance is beyond says no more than that
FACING = 0.1  # cosine between a surface and the way to the camera, at least
WINDOW_PX = 2  # to either side, in which a surface's normal is fitted
MIXED = 0.3  # length of the mean normal of a cell's points, at least


@dataclass(frozen=True, eq=False)
class FieldView:
    """A view's field: depth float64 [H, W] in metres, 0 where unknown; distance and its spread [H, W] in r."""

    camera: Camera
    depth: np.ndarray
    distance: np.ndarray
    spread: np.ndarray

    @property
    def focal_px(self) -> float:
        return float(np.sqrt(self.camera.fx_px * self.camera.fy_px))

    @cached_property
    def points(self) -> np.ndarray:
        """[H, W, 3], camera coordinates; NaN where depth is unknown."""
        c = self.camera
        y, x = np.mgrid[: c.height_px, : c.width_px]
        ray = np.stack([(x - c.cx_px) / c.fx_px, (y - c.cy_px) / c.fy_px, np.ones_like(x, float)], -1)
        return ray * np.where(self.depth > 0, self.depth, np.nan)[..., None]

    @cached_property
    def normals(self) -> np.ndarray:
        """[H, W, 3], camera coordinates, of length 1 and towards the camera: of the plane through inverse depth
        (which is linear in the pixel) within WINDOW_PX, by least squares over pixels that are near in depth; the way to
        the camera where they do not determine one."""
        c, z = self.camera, self.depth
        known = z > 0
        w = np.where(known, 1 / np.where(known, z, 1), 0)
        padded, sums = np.pad(w, WINDOW_PX), np.zeros((9, *z.shape))
        height, width = z.shape
        for dy in range(-WINDOW_PX, WINDOW_PX + 1):
            for dx in range(-WINDOW_PX, WINDOW_PX + 1):
                other = padded[WINDOW_PX + dy :, WINDOW_PX + dx :][:height, :width]
                # Along a surface that leans by 75 degrees depth changes by 4 r a pixel.
                near = (other > 0) & known & (np.abs(other - w) * self.focal_px <= other * 4 * (abs(dx) + abs(dy)))
                d = np.where(near, other - w, 0)
                for k, term in enumerate((1, dx, dy, dx * dx, dx * dy, dy * dy)):
                    sums[k] += near * term
                sums[6] += d
                sums[7] += d * dx
                sums[8] += d * dy
        n, sx, sy, xx, xy, yy, b, bx, by = sums
        n = np.maximum(n, 1)
        xx, xy, yy, bx, by = xx - sx * sx / n, xy - sx * sy / n, yy - sy * sy / n, bx - sx * b / n, by - sy * b / n
        det = xx * yy - xy * xy
        ok = known & (det > 1e-6 * np.maximum(xx * yy, 1e-300))
        safe = np.where(ok, det, 1)
        slope_x, slope_y = (bx * yy - by * xy) / safe, (by * xx - bx * xy) / safe
        # Inverse depth w0 + slope_x dx + slope_y dy is the plane slope_x fx X + slope_y fy Y + (w at the axis) Z = 1.
        y, x = np.mgrid[:height, :width]
        at_axis = w + (b - slope_x * sx - slope_y * sy) / n + slope_x * (c.cx_px - x) + slope_y * (c.cy_px - y)
        normal = -np.stack([slope_x * c.fx_px, slope_y * c.fy_px, at_axis], -1)
        view = np.where(known[..., None], -self.points, [0, 0, -1.0])
        view /= np.linalg.norm(view, axis=-1, keepdims=True)
        length = np.linalg.norm(normal, axis=-1, keepdims=True)
        normal = np.where(ok[..., None] & (length > 0), normal / np.where(length > 0, length, 1), view)
        return np.where((normal * view).sum(-1, keepdims=True) > 0, normal, view)

    def in_world(self, vectors: np.ndarray) -> np.ndarray:
        """Directions [..., 3] of the camera -> of the world."""
        return vectors @ self.camera.rotation


@dataclass(frozen=True, eq=False)
class Targets:
    """Points [N, 3] and normals [N, 3] in the world, and the footprint [N] in metres in which they are answered."""

    point: np.ndarray
    normal: np.ndarray
    r_m: np.ndarray


def grid_targets(views: Sequence[FieldView], cell_m: float | None = None) -> tuple[Targets, np.ndarray, float]:
    """Points of all views, their mean and mean normal in each cell of a grid, in the order of z, y, x; r_m is the
    smallest. Relative to the origin, which comes next, amid the cameras; last the cell's width: without cell_m the
    median of the views' median footprints. Cells whose normals point apart (two sides of a thing) are left out."""
    known = [view.depth > 0 for view in views]
    origin = np.array([_middle([view.camera.centre[axis] for view in views]) for axis in range(3)])
    if cell_m is None:
        cell_m = _middle([_middle(v.depth[k]) / v.focal_px for v, k in zip(views, known, strict=True)])
    parts = [(v.in_world(v.points[k]) + (v.camera.centre - origin), v.in_world(v.normals[k]), v.depth[k] / v.focal_px)
             for v, k in zip(views, known, strict=True)]  # fmt: skip
    point, normal, r_m = (np.concatenate(part) for part in zip(*parts, strict=True))
    place = np.floor(point / cell_m).astype(np.int64)
    _, own, count = np.unique(place[:, ::-1], axis=0, return_inverse=True, return_counts=True)
    own = own.reshape(-1)

    def mean(values: np.ndarray) -> np.ndarray:
        return np.stack([np.bincount(own, values[:, axis]) for axis in range(3)], 1) / count[:, None]

    smallest = np.full(len(count), np.inf)
    np.minimum.at(smallest, own, r_m)
    point, normal = mean(point), mean(normal)
    length = np.linalg.norm(normal, axis=1)
    keep = length >= MIXED
    return Targets(point[keep], (normal / np.maximum(length, 1e-300)[:, None])[keep], smallest[keep]), origin, cell_m


def _middle(values: Sequence[float]) -> float:
    return float(np.sort(np.asarray(values, np.float64))[len(values) // 2])


@dataclass(frozen=True, eq=False)
class Values:
    """Predictions of each view for each target: distance and expected error [V, N] in metres, NaN where the view did
    not see the target. Distances beyond FAR of the view's reach become EPS_R of the target."""

    distance: np.ndarray
    spread: np.ndarray


def targets_of(view: FieldView, step_px: int = 1) -> Targets:
    """Every pixel of known depth, or of every so many rows and columns."""
    part = np.s_[::step_px, ::step_px]
    known = view.depth[part] > 0
    point = view.in_world(view.points[part][known]) + view.camera.centre
    return Targets(point, view.in_world(view.normals[part][known]), view.depth[part][known] / view.focal_px)


def values_of(views: Sequence[FieldView], targets: Targets, reach_r: float = REACH_R) -> Values:
    """Interpolated between those of the four pixels about each target's place that lie within reach_r of it."""
    shape = len(views), len(targets.point)
    distance, spread = np.full(shape, np.nan), np.full(shape, np.nan)
    for k, view in enumerate(views):
        # The camera's place first: far from the origin, differences of coordinates are what is exact.
        at = (targets.point - view.camera.centre) @ view.camera.rotation.T
        d, s, depth = _bilinear(view, at, reach_r)
        facing = -((targets.normal @ view.camera.rotation.T) * at).sum(1) / np.linalg.norm(at, axis=1)
        d = np.where(facing > FACING, d, np.nan)
        r = depth / view.focal_px
        far = d > FAR * EPS_R
        distance[k] = np.where(far, EPS_R * targets.r_m, np.minimum(d * r, EPS_R * targets.r_m))
        distance[k, np.isnan(d)] = np.nan
        spread[k] = s * r
    return Values(distance, spread)


def _bilinear(view: FieldView, at: np.ndarray, reach_r: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Distance and spread in r and depth at camera coordinates [N, 3]; NaN where the view did not see them."""
    c = view.camera
    z = at[:, 2]
    front = z > 0
    safe = np.where(front, z, 1)
    x, y = at[:, 0] / safe * c.fx_px + c.cx_px, at[:, 1] / safe * c.fy_px + c.cy_px
    inside = front & (x >= -0.5) & (y >= -0.5) & (x <= c.width_px - 0.5) & (y <= c.height_px - 0.5)
    x, y = (np.clip(np.where(inside, p, 0), 0, size - 1) for p, size in ((x, c.width_px), (y, c.height_px)))
    left = np.minimum(np.floor(x).astype(int), max(c.width_px - 2, 0))
    top = np.minimum(np.floor(y).astype(int), max(c.height_px - 2, 0))
    u, v = x - left, y - top
    sums, total = np.zeros((3, len(at))), np.zeros(len(at))
    for dy, dx, weight in ((0, 0, (1 - u) * (1 - v)), (0, 1, u * (1 - v)), (1, 0, (1 - u) * v), (1, 1, u * v)):
        row, column = np.minimum(top + dy, c.height_px - 1), np.minimum(left + dx, c.width_px - 1)
        depth = view.depth[row, column]
        away = np.linalg.norm(view.points[row, column] - at, axis=1)
        weight = np.where(inside & (depth > 0) & (away * view.focal_px <= reach_r * depth), weight, 0)
        sums += weight * np.stack([view.distance[row, column], view.spread[row, column], depth])
        total += weight
    seen = total >= MIN_WEIGHT
    return tuple(np.where(seen, plane / np.where(seen, total, 1), np.nan) for plane in sums)


def fused(values: Values) -> np.ndarray:
    """Distance [N] in metres: the mean of the smaller half of the views' values, including the middle one of an odd
    number; NaN where no view saw the target."""
    order = np.sort(values.distance, 0)  # NaN last
    count = (~np.isnan(order)).sum(0)
    half = (count + 1) // 2
    rank = np.arange(len(order))[:, None]
    mean = np.where(rank < half, np.nan_to_num(order), 0).sum(0) / np.maximum(half, 1)
    return np.where(count > 0, mean, np.nan)
