"""Labelled images turned in their plane."""

import numpy as np
import pytest

from export.evaluation.rolled import rolled
from export.shards import LabelledImage

HEIGHT, WIDTH = 60, 80


@pytest.fixture
def image() -> LabelledImage:
    """One upright person and one whom the label is not sure of; the image tells where it came from."""
    rng = np.random.default_rng(0)
    label = np.zeros((HEIGHT, WIDTH, 4), np.uint8)
    label[10:50, 20:32] = [3, 100, 200, 1]
    label[20:40, 60:70] = [1, 10, 20, 2]
    point = np.zeros((HEIGHT, WIDTH, 3), np.float32)
    point[10:50, 20:32, 1] = np.linspace(0, 1, 40)[:, None]
    return LabelledImage(
        "shard/0000", rng.integers(0, 255, (HEIGHT, WIDTH, 3), np.uint8), label, point,
        np.float32([[20, 10, 32, 50], [60, 20, 70, 40]]), np.uint8([1, 2]), np.array([False, True]),
        np.float32([[0, -1], [np.nan, np.nan]]),
    )  # fmt: skip


def test_no_turn_puts_the_image_on_a_square_that_holds_any_turn(image):
    turned = rolled(image, 0)
    assert turned.image.shape == (100, 100, 3)
    assert turned.box.tolist() == [[30, 30, 42, 70], [70, 40, 80, 60]]
    assert np.array_equal(turned.label[20:80, 10:90], image.label)
    assert np.array_equal(turned.image[20:80, 10:90], image.image)
    assert turned.label[:20].max() == 0


def test_a_quarter_turn_clockwise_lays_people_down_with_their_points_and_axes(image):
    turned = rolled(image, 90)
    assert turned.box.tolist() == [[30, 30, 70, 42], [40, 70, 60, 80]]
    assert turned.ignore.tolist() == [False, True]
    assert np.allclose(turned.axis[0], [1, 0], atol=1e-6)  # the head is on the right
    assert turned.point[35, 69, 1] == 0
    assert turned.point[35, 30, 1] == 1
    assert (turned.label[..., 3] == 1).sum() == (image.label[..., 3] == 1).sum()


def test_boxes_of_a_slanted_person_hold_the_outline(image):
    turned = rolled(image, 30)
    x0, y0, x1, y1 = turned.box[0]
    assert x1 - x0 == pytest.approx(40 * np.sin(np.pi / 6) + 12 * np.cos(np.pi / 6), abs=2)
    assert y1 - y0 == pytest.approx(40 * np.cos(np.pi / 6) + 12 * np.sin(np.pi / 6), abs=2)
