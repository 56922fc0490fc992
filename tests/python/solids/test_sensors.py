"""Models of depth cameras: their noise where it is known, and what none of them may do."""

import numpy as np
import pytest

from export.solids.sensors import LEVELS, Outliers, Plain, Steps, Stereo, StructuredLight, TimeOfFlight, drawn

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


@pytest.mark.parametrize(("level", "unit_mm"), [("steps-0.1mm", 0.1), ("steps-0.25mm", 0.25), ("steps-1mm", 1)])
def test_depth_in_whole_units_is_the_nearest_one_and_ends_with_16_bits(level, unit_mm):
    depth = np.linspace(0.3, 80, 96 * 128, dtype=np.float32).reshape(96, 128)
    seen = LEVELS[level](depth, FOCAL_PX, np.random.default_rng(0))
    fits = depth / (unit_mm * 1e-3) < 65534
    assert (seen[depth / (unit_mm * 1e-3) > 65535.6] == 0).all()
    units = seen[fits].astype(np.float64) / (unit_mm * 1e-3)
    np.testing.assert_allclose(units, np.rint(units), atol=0.01)
    assert np.abs(seen - depth)[fits].max() <= 0.5001e-3 * unit_mm + 4e-6


def test_steps_lie_over_the_noise_of_the_sensor_beneath():
    depth = wall(1.0)
    fine, coarse = Stereo(), Steps(0.001, Stereo())
    a, b = (sensor(depth, FOCAL_PX, np.random.default_rng(5)) for sensor in (fine, coarse))
    np.testing.assert_allclose(b, np.rint(a / 0.001) * 0.001, atol=1e-6)


@pytest.mark.parametrize("at_m", [0.6, 1.0, 2.0, 3.0])
def test_structured_light_has_the_noise_of_nguyen_and_the_steps_of_its_disparity(at_m):
    """Nguyen et al. 2012: 1.2 mm + 1.9 mm (z - 0.4 m)^2, head-on; steps of an eighth of a pixel add their own."""
    focal_px = 580.0  # Kinect v1, on whose frames it was measured
    seen = StructuredLight(holes=0)(wall(at_m), focal_px, np.random.default_rng(2))
    step_m = at_m**2 / (8 * focal_px * 0.075)
    wanted = np.hypot(0.0012 + 0.0019 * (at_m - 0.4) ** 2, step_m / np.sqrt(12))
    assert (seen[seen > 0] - at_m).std() == pytest.approx(wanted, rel=0.15)


def test_time_of_flight_stays_under_the_random_error_of_a_published_camera():
    """17 mm, Azure Kinect's hardware specification, narrow field of view; farther than 3 m the model is noisier."""
    for at_m in (0.5, 1.0, 2.0, 3.0):
        assert (TimeOfFlight(holes=0)(wall(at_m), FOCAL_PX, np.random.default_rng(2)) - at_m).std() <= 0.017


@pytest.mark.parametrize("size_px", [0, 0.5, 1])
def test_a_share_of_pixels_is_wrong_by_up_to_half_and_none_appears_where_nothing_is(size_px):
    depth = wall(2.0)
    depth[:, 100:] = 0
    seen = Outliers(0.05, size_px)(depth, FOCAL_PX, np.random.default_rng(5))
    assert not seen[:, 100:].any()
    wrong = seen[:, :100] != 2.0
    assert wrong.mean() == pytest.approx(0.05, rel=0.2)
    assert seen[:, :100].min() >= 1.0
    assert seen[:, :100].max() <= 3.0
    assert abs(seen[:, :100][wrong] - 2.0).mean() == pytest.approx(0.5, rel=0.15)  # evenly between 1 and 3


def test_a_sensor_to_train_on_is_drawn_from_all_kinds():
    rng = np.random.default_rng(0)
    assert len({type(drawn(rng)) for _ in range(100)}) == 7  # Outliers among them
