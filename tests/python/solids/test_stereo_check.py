"""Figures that compare the model of stereo with real matching: known errors are found."""

import numpy as np
import pytest

pytest.importorskip("OCP", reason="OpenCascade is not installed: scripts/make-venv.sh dev,solids")

from export.solids.stereo_check import figures


@pytest.fixture
def steps():
    """Disparities of a near plate of 40 px before a wall of 20 px."""
    true = np.full((200, 260), 20.0)
    true[60:140, 80:180] = 40
    return true


def figure(true, seen, name):
    total, count = figures(true, seen, 300.0)[name]
    return total / count


def test_noise_is_measured_away_from_jumps(steps):
    rng = np.random.default_rng(0)
    seen = steps + rng.normal(0, 0.1, steps.shape)
    assert figure(steps, seen, "noise, px") == pytest.approx(0.1, rel=0.05)
    assert abs(figure(steps, seen, "shared with the next pixel")) < 0.05
    rows = steps + np.repeat(rng.normal(0, 0.1, (200, 52)), 5, 1)
    assert figure(steps, rows, "shared with the next pixel") == pytest.approx(0.8, abs=0.05)
    assert abs(figure(steps, rows, "with the fourth") - 0.2) < 0.05


@pytest.mark.parametrize("width_px", [0, 2, 4])
def test_fattening_is_how_far_the_near_side_reaches(steps, width_px):
    seen = steps.copy()
    seen[60 - width_px : 140 + width_px, 80 - width_px : 180 + width_px] = 40
    assert figure(steps, seen, "fattened by, px") == pytest.approx(width_px, abs=0.15)


def test_what_is_lost_is_counted_and_what_was_hidden_with_it(steps):
    seen = steps.copy()
    seen[:, 240:] = 0
    assert figure(steps, seen, "lost") == pytest.approx(20 / 240, rel=0.1)
    assert figure(steps, seen, "of these hidden") < 0.01
    seen = steps.copy()
    seen[60:140, 61:80] = 0  # what the plate hides from the right camera: 20 px, all but its rounding
    assert figure(steps, seen, "of these hidden") > 0.9
