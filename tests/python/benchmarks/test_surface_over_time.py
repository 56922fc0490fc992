"""Figures of surfaces over time, on frames whose changes are counted by hand."""

import numpy as np
import pytest

from benchmarks.people_over_time.surface_over_time import STEP, SurfaceScores, rate
from export.people.outfit import GRID
from export.surface_grid import SurfaceGrid

FPS = 10.0
TRUNK, LEFT_ARM, RIGHT_ARM = 2, 15, 16  # of DensePose's parts


@pytest.fixture(scope="module")
def grid():
    return SurfaceGrid.load(GRID)


def frame(part, painted=None, u=128, painted_u=None, person=1):
    """A true label of 4 x 4 pixels that are looked at, and what was painted. part, painted: one number or 16."""
    label = np.zeros((4 * STEP, 4 * STEP, 4), np.uint8)
    iuv = np.zeros((4 * STEP, 4 * STEP, 3), np.uint8)
    rows = np.broadcast_to(part, 16).reshape(4, 4), np.broadcast_to(part if painted is None else painted, 16)
    label[::STEP, ::STEP, 0], iuv[::STEP, ::STEP, 0] = rows[0], rows[1].reshape(4, 4)
    label[..., 1], label[..., 2], label[..., 3] = u, 128, person * (label[..., 0] > 0)
    iuv[..., 1], iuv[..., 2] = u if painted_u is None else painted_u, 128
    return label, iuv, np.array([True])


def figures(grid, *frames):
    scores = SurfaceScores()
    rate(scores, frames, FPS, grid)
    return scores.figures()


def test_parts_and_sides_of_all_pixels(grid):
    painted = [TRUNK] * 4 + [0] * 4 + [LEFT_ARM] * 8
    found = figures(grid, frame([TRUNK] * 8 + [LEFT_ARM] * 4 + [RIGHT_ARM] * 4, painted))
    assert found["part"] == (4 + 4) / 16
    assert found["left/right"] == 4 / 8


def test_people_who_need_not_be_found_do_not_count(grid):
    label, iuv, _ = frame(TRUNK, 0)
    assert figures(grid, (label, iuv, np.array([False])), frame(TRUNK))["part"] == 1


def test_a_changed_part_is_a_flip_only_where_the_truth_stays(grid):
    flips = [TRUNK] * 12 + [LEFT_ARM] * 4
    assert figures(grid, frame(TRUNK), frame(TRUNK, flips))["flips"] == pytest.approx(4 / 16 * FPS)
    assert figures(grid, frame(TRUNK), frame(flips))["flips"] == 0
    gone = [TRUNK] * 12 + [0] * 4
    assert figures(grid, frame(TRUNK), frame(TRUNK, gone))["flips"] == 0
    assert figures(grid, frame(TRUNK), frame(TRUNK, LEFT_ARM, person=2))["flips"] == 0


def test_tremble_is_the_change_of_the_error(grid):
    still = figures(grid, frame(TRUNK, painted_u=134), frame(TRUNK, painted_u=134))
    assert still["tremble p50"] == 0
    assert still["error"] > 0
    ends = grid.point_of(np.array([TRUNK, TRUNK]), np.array([[134, 128], [128, 128]]) / 255)
    found = figures(grid, frame(TRUNK, painted_u=134), frame(TRUNK))
    assert found["tremble p90"] == pytest.approx(100 * np.linalg.norm(ends[0] - ends[1]), rel=1e-3)


def test_a_surface_that_stays_behind_lags(grid):
    ends = grid.point_of(np.array([TRUNK, TRUNK]), np.array([[128, 128], [140, 128]]) / 255)
    step_cm = 100 * np.linalg.norm(ends[0] - ends[1])
    behind = figures(grid, frame(TRUNK), frame(TRUNK, u=140, painted_u=128))
    assert behind["lag"] == pytest.approx(step_cm, rel=1e-3)
    assert figures(grid, frame(TRUNK), frame(TRUNK, u=140))["lag"] == 0
    assert np.isnan(behind["tremble p50"])
