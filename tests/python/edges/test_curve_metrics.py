"""Scores of curves, on segments whose distances are known."""

import numpy as np
import pytest

from export.edges.curve_metrics import FARTHEST_R, places_on, score

FOCAL_PX = 500.0  # at 1 m a footprint is 2 mm


def segment(y_m: float, from_m: float = 0.0, to_m: float = 0.4) -> np.ndarray:
    return np.array([[from_m, y_m, 1.0], [to_m, y_m, 1.0]])


def test_the_same_curves_have_the_best_score():
    metrics = score([segment(0.0)], [segment(0.0)], FOCAL_PX)
    assert metrics == {"precision": 1, "recall": 1, "f_score": 1, "chamfer_r": 0, "hausdorff_r": 0}


def test_a_curve_counts_within_two_footprints():
    assert score([segment(0.0039)], [segment(0.0)], FOCAL_PX)["f_score"] == 1
    assert score([segment(0.0041)], [segment(0.0)], FOCAL_PX)["f_score"] == 0
    assert score([segment(0.003)], [segment(0.0)], FOCAL_PX)["chamfer_r"] == pytest.approx(1.5, abs=0.01)


def test_shares_are_by_length():
    metrics = score([segment(0.0, 0.0, 0.1)], [segment(0.0)], FOCAL_PX)
    assert metrics["precision"] == 1
    assert metrics["recall"] == pytest.approx(0.26, abs=0.003)  # a quarter, and 2 r more
    assert metrics["hausdorff_r"] == FARTHEST_R
    metrics = score([segment(0.0), segment(0.1, 0.0, 0.2)], [segment(0.0)], FOCAL_PX)
    assert metrics["precision"] == pytest.approx(2 / 3, abs=0.003)
    assert metrics["recall"] == 1


def test_cutting_a_curve_in_pieces_changes_nothing():
    pieces = [np.linspace(a, b, 5) for a, b in [((0, 0, 1), (0.13, 0, 1)), ((0.13, 0, 1), (0.4, 0, 1))]]
    assert score(pieces, [segment(0.0)], FOCAL_PX)["f_score"] == 1


def test_no_curves_are_no_error():
    assert score([], [], FOCAL_PX)["f_score"] == 1
    assert score([], [segment(0.0)], FOCAL_PX)["recall"] == 0
    assert score([], [segment(0.0)], FOCAL_PX)["f_score"] == 0
    assert score([segment(0.0)], [], FOCAL_PX)["precision"] == 0


def test_places_are_at_most_half_a_footprint_apart():
    gaps = np.linalg.norm(np.diff(places_on([segment(0.0)], FOCAL_PX), axis=0), axis=1)
    assert gaps.max() <= 0.001 + 1e-12
