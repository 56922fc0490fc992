"""Keypoints against landmarks."""

import numpy as np
import pytest

from export.evaluation.keypoints import KeypointTally
from export.keypoints import MIRROR, NAMES

SHOULDERS_Y, HIPS_Y = 100.0, 200.0  # a torso of 100 pixels


def landmarks() -> np.ndarray:
    """[33, 2]: the person's left is on our right."""
    point = np.zeros((33, 2), np.float32)
    for k, name in enumerate(NAMES):
        side = 1 if "left" in name else -1 if "right" in name else 0
        row = SHOULDERS_Y if "shoulder" in name else HIPS_Y if "hip" in name else 20.0 + 7 * (k // 2)
        point[k] = 300 + 40 * side, row
    return point


def metrics_of(found: np.ndarray | None, visible: np.ndarray | None = None):
    tally = KeypointTally()
    tally.add(found, landmarks(), np.ones(33) if visible is None else visible)
    return tally.metrics()


def with_confidence(point: np.ndarray) -> np.ndarray:
    return np.concatenate([point, np.ones((33, 1), np.float32)], 1)


def test_the_truth_is_perfect():
    metrics = metrics_of(with_confidence(landmarks()))
    assert (metrics.people, metrics.pck, metrics.left_right) == (1, 1, 1)


def test_a_mirrored_person_has_all_sides_wrong():
    metrics = metrics_of(with_confidence(landmarks()[MIRROR]))
    assert metrics.left_right == 0
    assert metrics.pck == pytest.approx(1 / 33)  # the nose


def test_a_keypoint_counts_within_a_tenth_of_the_torso():
    found = with_confidence(landmarks())
    found[NAMES.index("left knee"), 1] += 9.9
    found[NAMES.index("right knee"), 1] += 10.1
    metrics = metrics_of(found)
    assert metrics.by_name["left knee"] == 1
    assert metrics.by_name["right knee"] == 0


def test_somebody_who_is_not_found_has_all_keypoints_wrong_and_no_sides():
    metrics = metrics_of(None)
    assert metrics.pck == 0
    assert np.isnan(metrics.left_right)


def test_hidden_landmarks_are_not_asked_for_and_a_hidden_torso_leaves_the_person_out():
    visible = np.ones(33)
    visible[NAMES.index("left wrist")] = 0.2
    assert np.isnan(metrics_of(with_confidence(landmarks()), visible).by_name["left wrist"])
    visible[NAMES.index("left hip")] = 0.2
    assert metrics_of(with_confidence(landmarks()), visible).people == 0
