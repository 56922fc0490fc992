"""Models of depth cameras: their noise where it is known, and what none of them may do."""

import numpy as np
import pytest

from export.solids.sensors import LEVELS, Plain, Stereo, drawn

FOCAL_PX = 300.0


def wall(at_m: float) -> np.ndarray:
    return np.full((96, 128), at_m, np.float32)


@pytest.mark.parametrize("level", LEVELS)
def test_what_a_sensor_reports_depends_on_its_random_numbers_alone_and_is_finite(level):
    depth = wall(1.0)
    depth[30:60, 40:80] = 0.6
    depth[:, 100:] = 0
    first, again = (LEVELS[level](depth, FOCAL_PX, np.random.default_rng(3)) for _ in range(2))
    assert np.array_equal(first, again)
    assert first.dtype == np.float32
    assert np.isfinite(first).all()
    assert (first >= 0).all()
    assert (first[10:20, 10:30] > 0).mean() > 0.5


@pytest.mark.parametrize("level", LEVELS)
def test_where_nothing_is_nothing_is_reported(level):
    assert not LEVELS[level](np.zeros((48, 64), np.float32), FOCAL_PX, np.random.default_rng(0)).any()


@pytest.mark.parametrize("at_m", [0.5, 1.0, 2.0])
def test_the_noise_of_stereo_grows_with_the_square_of_the_distance(at_m):
    sensor = Stereo(sigma_px=0.08, window_px=7, baseline_m=0.05, step_px=1e-4, holes=0)
    seen = sensor(wall(at_m), FOCAL_PX, np.random.default_rng(1))
    wanted = at_m**2 * 0.08 / (FOCAL_PX * 0.05)
    assert (seen[seen > 0] - at_m).std() == pytest.approx(wanted, rel=0.15)


def test_plain_noise_is_in_footprints():
    seen = Plain(2.0)(wall(1.5), FOCAL_PX, np.random.default_rng(1))
    assert (seen - 1.5).std() == pytest.approx(2 * 1.5 / FOCAL_PX, rel=0.05)


def test_a_sensor_to_train_on_is_drawn_from_all_kinds():
    rng = np.random.default_rng(0)
    assert len({type(drawn(rng)) for _ in range(100)}) == 6
