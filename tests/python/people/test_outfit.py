"""The outfit of the desktop demo's try-on view: an atlas as DensePose lays them out, drawn on the body's surface."""

import cv2
import numpy as np
import pytest
from scipy.spatial import cKDTree

from export.people import outfit
from export.surface_grid import SurfaceGrid


@pytest.fixture(scope="module")
def grid():
    return SurfaceGrid.load(outfit.GRID)


@pytest.fixture(scope="module")
def shipped():
    return cv2.imread(str(outfit.OUTFIT))


def at_every_node(grid, part, count=200):
    """Points of a part, and the U, V that they have."""
    u, v = np.meshgrid(*[np.linspace(0, 1, count)] * 2)
    uv = np.stack([u.ravel(), v.ravel()], 1)
    points = grid.point_of(np.full(len(uv), part), uv)
    reached = ~np.isnan(points).any(1)
    return points[reached], uv[reached]


def test_the_shipped_image_is_what_the_command_draws(grid, shipped):
    drawn = outfit.drawn(grid)
    assert shipped.shape == drawn.shape == (768, 512, 3)
    # Processors round differently, and a tone then falls on the next step.
    assert (np.abs(shipped.astype(int) - drawn).max(2) <= 4).mean() > 0.999
    assert outfit.OUTFIT.stat().st_size < 150_000


def test_a_part_and_its_u_v_are_where_denseposes_notebook_looks_for_them():
    rng = np.random.default_rng(0)
    atlas = rng.integers(0, 256, (6 * 256, 4 * 256, 3), np.uint8)
    part, u, v = rng.integers(1, 25, 500), rng.integers(0, 256, 500), rng.integers(0, 256, 500)
    # There 24 tiles are cut out column by column, and read at [255 - V, U].
    tiles = [atlas[256 * j : 256 * (j + 1), 256 * i : 256 * (i + 1)] for i in range(4) for j in range(6)]
    wanted = np.array([tiles[p - 1][255 - b, a] for p, a, b in zip(part, u, v, strict=True)])
    assert np.array_equal(outfit.looked_up(atlas, part, np.stack([u, v], 1) / 255), wanted)


def test_stripes_go_on_across_the_borders_of_charts(grid, shipped):
    for one, other, low_z, high_z in ((2, 1, 1.06, 1.4), (15, 17, 1.0, 1.5), (16, 18, 1.0, 1.5), (19, 21, 1.14, 1.4)):
        points, uv = at_every_node(grid, one)
        other_points, other_uv = at_every_node(grid, other)
        distance, nearest = cKDTree(other_points).query(points)
        near = (distance < 0.004) & (points[:, 2] > low_z) & (points[:, 2] < high_z)
        assert near.sum() > 100
        light = outfit.looked_up(shipped, np.full(near.sum(), one), uv[near]).mean(1) > 120
        beyond = outfit.looked_up(shipped, np.full(near.sum(), other), other_uv[nearest[near]]).mean(1) > 120
        assert 0.3 < light.mean() < 0.7
        assert (light == beyond).mean() > 0.92, (one, other)


def test_seen_from_behind_the_number_reads_24(grid, shipped):
    picture = outfit.worn(grid, shipped, 800)
    behind = picture[:, picture.shape[1] // 2 :].astype(int)
    red = (behind[..., 2] > 150) & (behind[..., 1] < 90)
    red[: 800 // 8] = False  # the hat
    red[500:] = False  # the shoes
    rows, columns = np.nonzero(red)
    middle = (columns.min() + columns.max()) // 2
    foot = rows.max() - 3
    assert red[foot, :middle].sum() > 2 * red[foot, middle:].sum()  # a 2 stands on a bar, a 4 on its stem
    two = red[rows.min() : rows.max() + 1, columns.min() : middle - 2]
    at = [np.nonzero(two[round(share * len(two))])[0].mean() for share in (0.45, 0.7)]
    assert at[0] > at[1] + 0.1 * two.shape[1]  # its slope comes down to the left


def test_each_piece_has_its_colour(grid, shipped):
    def median(part):
        _, uv = at_every_node(grid, part, 60)
        return np.median(outfit.looked_up(shipped, np.full(len(uv), part), uv), 0)  # BGR

    for part in outfit.HANDS:
        assert (np.diff(median(part)) > 15).all()  # skin: blue below green below red
    for part in outfit.LEGS:
        assert (np.diff(median(part)) < -15).all()  # jeans
