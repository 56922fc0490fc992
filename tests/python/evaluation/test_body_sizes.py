"""Sizes of bodies: what the evaluation takes from a mesh, and how it counts errors and intervals."""

import numpy as np
import pytest

pytest.importorskip("moderngl")

from export.evaluation.body_sizes import SIZES, Tailor, camera_at, needed_factors, summary
from export.people.body import Shape


def rows_of(true, value, low, high):
    """The same numbers for each size: [N, 5, 4]."""
    return np.repeat(np.stack([true, value, low, high], -1)[:, None], len(SIZES), 1)


def test_errors_widths_and_intervals_are_those_of_the_numbers():
    true = np.array([1.0, 2.0, 1.0, 2.0])
    value = true * [1.1, 0.9, 1.0, 1.2]
    found = summary(rows_of(true, value, value / 1.1, value * 1.1), is_height_known=False)["waist"]
    assert found["error"] == pytest.approx(0.1)
    assert found["bias"] == pytest.approx(0.05)
    assert found["width"] == pytest.approx(np.log(1.1))
    assert found["inside"] == pytest.approx(0.5)  # 0.9 / 1.1 and 1.2 / 1.1 are outside; 1.1 is at the bound
    assert found["average"] == pytest.approx((0.5 + 0.25) / 2)


def test_the_average_person_is_scaled_to_a_known_height():
    true = np.array([1.6, 1.8, 2.0])
    rows = rows_of(true, true, true, true)
    assert summary(rows, is_height_known=True)["hip"]["average"] == pytest.approx(0)
    assert summary(rows, is_height_known=False)["hip"]["average"] > 0.05


def test_factors_of_intervals_put_nine_of_ten_inside():
    true = np.ones(1001)
    value = np.exp(np.linspace(-0.2, 0.2, 1001))
    rows = rows_of(true, value, value / np.exp(0.06), value * np.exp(0.06))
    factor = needed_factors(rows)[1]
    assert factor == pytest.approx(0.18 / 0.06, rel=0.01)
    exact = rows_of(true, true, true, true)
    assert needed_factors(exact) == [1.0] * len(SIZES)


def test_cameras_show_the_whole_person_or_the_upper_half():
    counts = {True: 0, False: 0}
    for seed in range(60):
        camera = camera_at(np.random.default_rng(seed), 480, 640, 1.8, 1.8)
        (top, soles), depth = camera.projected(np.array([[0, 0, 1.8], [0, 0, 0.0]]))
        assert (depth > 0).all()
        assert -40 < top[1] < 320
        counts[bool(soles[1] < 640)] += 1
    assert counts[True] > 30
    assert counts[False] > 8


def test_a_body_that_grows_by_a_tenth_has_sizes_that_do(body):
    tailor = Tailor(body)
    sizes = dict(zip(SIZES, tailor.sizes_m(body.template), strict=True))
    assert sizes["waist"] < min(sizes["chest"], sizes["hip"])
    assert sizes["chest"] == pytest.approx(0.98, abs=0.03)
    assert 0.42 * sizes["height"] < sizes["inseam"] < 0.52 * sizes["height"]
    grown = tailor.sizes_m(Shape(1.1 * body.template.vertices, 1.1 * body.template.heads))
    assert grown == pytest.approx(1.1 * np.array(list(sizes.values())), rel=1e-6)
