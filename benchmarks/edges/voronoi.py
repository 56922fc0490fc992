"""Voronoi covariance (VCM; Mérigot, Ovsjanikov and Guibas 2011, "Voronoi-based curvature and feature estimation from
point clouds") as a way to edges without a network: an own reference in numpy, so slow that a sample of views is
measured.

The covariance of a point is that of its Voronoi cell about it, as far as the cell lies within a ball around it. On a
plane cells are needles along the normal, at an edge fans between two normals: the middle eigenvalue says how sharp.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.ndimage import maximum_filter
from scipy.spatial import cKDTree

from benchmarks.edges.methods import SHIPPED, Method, RivalField
from benchmarks.edges.quality import LEVELS, OWN_CUTS, figures_of
from benchmarks.edges.rivals import Rival, points_of, tuned
from benchmarks.edges.views import View
from export.edges.metrics import summary

NAME = "Voronoi covariance (own reference)"
PITCH_PX = 2  # of the lattice that fills the balls; cells are averaged over more than that
TUNING_VIEWS, TEST_VIEWS = 6, 24
PAIRS = [(i, j) for i in range(3) for j in range(i, 3)]


def cell_covariances(depth: np.ndarray, focal_px: float, ball_r: float, pitch_px: float = PITCH_PX) -> np.ndarray:
    """[H, W, 6], in r^5: xx, xy, xz, yy, yz, zz of each pixel's Voronoi cell within ball_r around its point; 0 where
    depth is unknown. Space is summed on a lattice of pitch_px in the picture and pitch_px * r along the ray."""
    height, width = depth.shape
    known = depth > 0
    covariance = np.zeros((height, width, 6))
    if not known.any():
        return covariance
    points = points_of(depth, focal_px).astype(np.float64)[known]
    r = depth[known].astype(np.float64) / focal_px
    # Layers of equal r: z = near * exp(layer * pitch / focal length).
    near, reach = np.log(depth[known].min()), int(np.ceil(1.25 * ball_r / pitch_px))
    layer = np.round((np.log(depth[known]) - near) * focal_px / pitch_px).astype(int) + reach
    y, x = np.nonzero(known)
    # Frame and balls around its border.
    cells = np.zeros((int(height / pitch_px) + 2 * reach + 1, int(width / pitch_px) + 2 * reach + 1,
                      layer.max() + reach + 1), bool)  # fmt: skip
    cells[(y / pitch_px).astype(int) + reach, (x / pitch_px).astype(int) + reach, layer] = True
    rows, columns, layers = np.nonzero(maximum_filter(cells, 2 * reach + 1))
    z = np.exp(near + (layers - reach) * pitch_px / focal_px)
    across = ((columns - reach + 0.5) * pitch_px - 0.5 - (width - 1) / 2) * z / focal_px
    down = ((rows - reach + 0.5) * pitch_px - 0.5 - (height - 1) / 2) * z / focal_px
    places = np.stack([across, down, z], -1)
    far = ball_r * r.max() * 1.001
    metres, owner = cKDTree(points, compact_nodes=False, balanced_tree=False).query(places, distance_upper_bound=far)
    inside = metres < np.inf
    inside[inside] = metres[inside] <= ball_r * r[owner[inside]]
    owner, places = owner[inside], places[inside]
    offset = (places - points[owner]) / r[owner, None]
    weight = (pitch_px * places[:, 2] / focal_px / r[owner]) ** 3
    flat = np.stack([np.bincount(owner, weight * offset[:, i] * offset[:, j], len(points)) for i, j in PAIRS], -1)
    covariance[known] = flat
    return covariance


def averaged(covariance: np.ndarray, depth: np.ndarray, focal_px: float, over_r: float) -> np.ndarray:
    """Sums over the points within over_r of each pixel's, as far as they are over_r px or less from it."""
    points, total = points_of(depth, focal_px).astype(np.float64), np.zeros_like(covariance)
    limit, reach = (over_r * depth / focal_px) ** 2, int(over_r)
    height, width = depth.shape
    for dy in range(-reach, reach + 1):
        for dx in range(-reach, reach + 1):
            if dy * dy + dx * dx > over_r * over_r:
                continue
            own = slice(max(0, -dy), height - max(0, dy)), slice(max(0, -dx), width - max(0, dx))
            other = slice(max(0, dy), height - max(0, -dy)), slice(max(0, dx), width - max(0, -dx))
            near = ((points[own] - points[other]) ** 2).sum(-1) <= limit[own]
            total[own] += np.where(near[..., None], covariance[other], 0)
    return total


def middle_fraction(covariance: np.ndarray) -> np.ndarray:
    """The middle eigenvalue by the sum of all three: 0 on planes."""
    matrix = np.zeros((*covariance.shape[:-1], 3, 3))
    for k, (i, j) in enumerate(PAIRS):
        matrix[..., i, j] = matrix[..., j, i] = covariance[..., k]
    values = np.linalg.eigvalsh(matrix)
    return values[..., 1] / np.maximum(values.sum(-1), 1e-30)


def strength(depth: np.ndarray, focal_px: float, radii_r: tuple[float, float], cuts: Sequence[float]) -> np.ndarray:
    """radii_r: of the ball that cuts cells off, and of the neighbourhood that is averaged over."""
    ball_r, over_r = radii_r
    sums = averaged(cell_covariances(depth, focal_px, ball_r), depth, focal_px, over_r)
    return np.where(depth > 0, middle_fraction(sums), 0)


VORONOI = Rival(strength, ((6.0, 3.0), (12.0, 3.0)))


def measure(
    val: Sequence[View], test: Sequence[View], shipped: Method, shipped_cuts: Mapping[str, Mapping[float, int]]
) -> dict:
    """Rows by level of this way and of the network, both on the same sample of views. shipped_cuts: by level, where
    distances of the network are cut."""
    val, test = evenly(val, TUNING_VIEWS), evenly(test, TEST_VIEWS)
    rows, settings = [], {}
    for level in LEVELS:
        seen = [view.seen(level) for view in val]
        focal, truth = [view.camera.focal_px for view in val], [view.frame.distance for view in val]
        counts = [view.frame.counts & (depth > 0) for view, depth in zip(val, seen, strict=True)]
        chosen = tuned(VORONOI, seen, focal, truth, counts)
        ways: Mapping[str, Method] = {SHIPPED: shipped, NAME: RivalField(chosen)}
        for name, way in ways.items():
            figures = [figures_of(way, view, view.seen(level))[0] for view in test]
            row = summary(figures, OWN_CUTS if name == NAME else shipped_cuts[level])
            rows.append({"level": level, "way": name, **row, "ms": float(np.median([f["ms"] for f in figures]))})
        settings[level] = {"radii_r": chosen.setting, "cut": chosen.cut}
    return {"views": {"val": len(val), "test": len(test)}, "settings": settings, "rows": rows}


def evenly(views: Sequence[View], count: int) -> list[View]:
    return list(views[:: max(1, len(views) // count)])[:count]
