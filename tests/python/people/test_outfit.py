"""The outfit of the desktop demo's try-on view: an atlas as DensePose lays them out, drawn on the body's surface."""

import cv2
import numpy as np
import pytest

from export.people import outfit
from export.surface_grid import SurfaceGrid


@pytest.fixture(scope="module")
def grid():
    return SurfaceGrid.load(outfit.GRID)


@pytest.fixture(scope="module")
def shipped():
    return cv2.imread(str(outfit.OUTFIT))


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
