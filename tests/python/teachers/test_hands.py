"""Hands are looked for where landmarks say that they are, and believed where they are found there."""

import numpy as np
import pytest

from export.keypoints import NAMES
from export.teachers import hands
from export.teachers.hands import Hand, hands_of
from export.teachers.label import PhotoLabels

SHAPE = (200, 200)


def labels_with(points: dict[str, tuple[float, float]], visible: float = 0.9) -> PhotoLabels:
    """One person with these landmarks."""
    point, seen = np.zeros((1, 33, 2), np.float32), np.zeros((1, 33), np.float32)
    for name, at in points.items():
        point[0, NAMES.index(name)], seen[0, NAMES.index(name)] = at, visible
    one = np.ones(1, bool)
    return PhotoLabels(
        box=np.array([[0, 0, 200, 200]], np.float32), score=np.ones(1, np.float32), outlined=one, sure=one,
        point=point, visible=seen, world=np.zeros((1, 33, 3), np.float32), mask=np.ones((1, *SHAPE), bool),
        doubt=np.zeros((1, *SHAPE), bool),
    )  # fmt: skip


class FakeNetwork:
    """Sees a hand of 20 pixels where `at` says, whatever it is asked."""

    def __init__(self, at=None):
        self.at, self.asked = at, []

    def find(self, image, wrist, knuckles):
        self.asked.append((wrist.tolist(), knuckles.tolist()))
        middle = knuckles if self.at is None else np.array(self.at)
        return Hand(middle + np.linspace(-10, 10, 42).reshape(21, 2), 0.9)


LEFT = {"left wrist": (50, 100), "left index finger": (60, 80), "left little finger": (50, 80)}
RIGHT = {name.replace("left", "right"): (x + 100, y) for name, (x, y) in LEFT.items()}


def test_each_visible_wrist_is_looked_at():
    network = FakeNetwork()
    found = hands_of(network, np.zeros((*SHAPE, 3), np.uint8), labels_with(LEFT | RIGHT))
    assert set(found) == {(0, "left"), (0, "right")}
    assert network.asked[0] == ([50, 100], [55, 80])
    assert not hands_of(network, np.zeros((*SHAPE, 3), np.uint8), labels_with(LEFT | RIGHT, visible=0.3))


def test_one_hand_that_both_sides_claim_is_left_out():
    together = hands_of(FakeNetwork(at=(100, 90)), np.zeros((*SHAPE, 3), np.uint8), labels_with(LEFT | RIGHT))
    assert together == {}
    alone = hands_of(FakeNetwork(at=(100, 90)), np.zeros((*SHAPE, 3), np.uint8), labels_with(LEFT))
    assert set(alone) == {(0, "left")}


@pytest.mark.parametrize("turn", [0, 40, 180])
def test_the_mask_covers_palm_and_fingers(turn):
    spread = np.linspace(-0.4, 0.4, 5)
    point = [(0.0, 0.5)] + [(x * (1 + 0.3 * j), 0.1 - 0.2 * j) for x in spread for j in range(4)]
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    hand = Hand(60 * np.array(point) @ np.array([[c, s], [-s, c]]) + 100, 1.0)
    mask = hand.mask(SHAPE)
    for x, y in hand.point:
        assert mask[round(y), round(x)]
    assert mask[round(hand.point[[0, 5, 17]].mean(0)[1]), round(hand.point[[0, 5, 17]].mean(0)[0])]
    assert 0.2 < mask.sum() / hand.size**2 < 1
    assert not mask[:20].any()


def test_a_hand_far_from_where_it_was_looked_for_is_another():
    network = hands.HandNetwork.__new__(hands.HandNetwork)
    seen = Hand(np.array([150.0, 150]) + np.linspace(-10, 10, 42).reshape(21, 2), 0.95)
    network._look = lambda image, centre, size, up: seen
    image = np.zeros((*SHAPE, 3), np.uint8)
    assert network.find(image, np.array([150.0, 170]), np.array([150.0, 155])) is seen
    assert network.find(image, np.array([60.0, 80]), np.array([60.0, 60])) is None
    assert network.find(image, np.array([60.0, 60]), np.array([60.0, 59])) is None  # of two pixels
