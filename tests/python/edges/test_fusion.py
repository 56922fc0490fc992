"""Fusion of views in float64: against distances that are known, and what the C++ is compared with."""

import json

import numpy as np
import pytest

from export.camera import Camera
from export.edges.config import EPS_R
from export.edges.fusion import (
    FieldView,
    Values,
    fused,
    grid_targets,
    targets_of,
    values_of,
)
from tests.native.generate.make_edge_fusion import FILE, made

FOCAL_PX = 50.0
BACKWARD = np.diag([-1.0, 1.0, -1.0])


def wall(x_m: float = 0.0, rotation: np.ndarray | None = None, z_m: float = 0.0, has_edge: bool = True) -> FieldView:
    """A wall 1 m away with an edge along the middle row."""
    rotation = np.eye(3) if rotation is None else rotation
    camera = Camera.centred(40, 30, FOCAL_PX, rotation, np.array([x_m, 0, z_m]))
    field = np.repeat(0.9 * np.abs(np.arange(30) - 14.5)[:, None], 40, 1) if has_edge else np.full((30, 40), EPS_R)
    return FieldView(camera, np.ones((30, 40)), np.minimum(field, EPS_R), np.full((30, 40), 0.5))


def values(*columns: tuple[float, ...]) -> Values:
    rows = np.array(columns, float).T
    return Values(rows, np.ones_like(rows))


def test_the_metrics_that_the_runtime_is_compared_with_are_those_of_this_reference():
    stored, now = json.loads(FILE.read_text()), made()
    for name in ("points", "normals", "distance_m", "views_of_point", "origin"):
        np.testing.assert_allclose(stored[name], now[name], atol=2e-6, err_msg=name)


def test_a_views_own_pixels_have_its_own_values():
    view = wall()
    targets = targets_of(view)
    np.testing.assert_allclose(values_of([view], targets).distance[0], view.distance.ravel() * targets.r_m, atol=1e-9)
    np.testing.assert_allclose(targets.normal, np.tile([0, 0, -1.0], (1200, 1)), atol=1e-9)


def test_between_pixels_of_another_view_the_field_is_interpolated():
    source, target = wall(), wall(0.013)  # 0.65 px aside
    found = values_of([source], targets_of(target)).distance[0].reshape(30, 40)
    np.testing.assert_allclose(found[:, :39], (target.distance / FOCAL_PX)[:, :39], atol=1e-9)
    assert np.isnan(found[:, 39]).all()  # beyond the source's frame


def test_nothing_goes_through_a_plate_of_two_footprints():
    front, back = wall(), wall(0, BACKWARD, 2 + 2 / FOCAL_PX, has_edge=False)
    assert np.isnan(values_of([front], targets_of(back)).distance).all()


def test_fusion_takes_the_mean_of_the_smaller_half():
    column = values((4, 1, 2, np.nan, 9), (np.nan, 3, np.nan, np.nan, np.nan), (2, 1, 6, np.nan, np.nan))
    np.testing.assert_allclose(fused(column), [1.5, 3, 1.5])
    assert np.isnan(fused(values((np.nan, np.nan)))).all()


def test_points_on_the_grid_do_not_depend_on_the_order_of_views():
    views = [wall(0), wall(0.3), wall(0.1)]
    (first, origin, cell_m), (second, other, _) = grid_targets(views), grid_targets(views[::-1])
    np.testing.assert_allclose(first.point, second.point, atol=1e-12)
    np.testing.assert_array_equal(origin, other)
    assert cell_m == pytest.approx(1 / FOCAL_PX)
    assert len(first.point) < 3 * 1200
