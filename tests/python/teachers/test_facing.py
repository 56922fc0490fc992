"""The direction of a person is told by shoulders and hips, whatever the roll, and only where all answers agree."""

import cv2
import numpy as np
import pytest

from export.keypoints import NAMES
from export.teachers import facing
from export.teachers.facing import BACK, CHEST, PhotoFacing, agreed, face_photo, facing_of, main, trunk_part
from export.teachers.label import PhotoLabels
from export.teachers.landmarks import Landmarks

IMAGE = np.zeros((100, 200, 3), np.uint8)


def body(turn_degrees: float, roll_degrees: float = 0) -> np.ndarray:
    """World landmarks of somebody upright, turned from the camera towards the image's right, then rolled clockwise."""
    turn, roll = np.radians([turn_degrees, roll_degrees])
    world = np.zeros((33, 3))
    for name, height, half in (("shoulder", -0.5, 0.2), ("hip", 0.0, 0.1)):
        for side, sign in (("left", 1), ("right", -1)):
            world[NAMES.index(f"{side} {name}")] = sign * half * np.cos(turn), height, sign * half * np.sin(turn)
    rolled = world.copy()
    rolled[:, 0] = np.cos(roll) * world[:, 0] - np.sin(roll) * world[:, 1]
    rolled[:, 1] = np.sin(roll) * world[:, 0] + np.cos(roll) * world[:, 1]
    return rolled


def found(world: np.ndarray) -> Landmarks:
    return Landmarks(np.zeros((33, 2)), np.zeros(33), np.ones(33), world, 0.9, np.zeros((100, 200), np.float32))


def photo_labels(world: np.ndarray) -> PhotoLabels:
    """Somebody with landmarks between (60, 10) and (80, 90), and somebody without."""
    point = np.zeros((2, 33, 2), np.float32)
    point[0] = np.linspace((60, 10), (80, 90), 33)
    return PhotoLabels(
        box=np.zeros((2, 4), np.float32), score=np.ones(2, np.float32), outlined=np.array([True, True]),
        sure=np.array([True, False]), point=point, visible=np.ones((2, 33), np.float32),
        world=np.stack([world, world]).astype(np.float32), mask=np.zeros((2, 100, 200), bool),
        doubt=np.zeros((2, 100, 200), bool),
    )  # fmt: skip


@pytest.mark.parametrize("roll", [0, 30, -90, 180])
@pytest.mark.parametrize("turn", [0, 40, 90, 150, -120])
def test_the_direction_does_not_depend_on_the_roll(turn, roll):
    assert facing_of(body(turn, roll)) == pytest.approx(turn, abs=1e-6)


def test_answers_that_differ_give_no_direction():
    assert agreed([10, 20, 0, 10]) == pytest.approx(10)
    assert agreed([170, -170, 180]) == pytest.approx(180, abs=1e-6) or agreed([170, -170, 180]) == pytest.approx(-180)
    assert np.isnan(agreed([0, 0, 0, 90]))
    assert np.isnan(agreed([0, 180]))
    assert np.isnan(agreed([10, np.nan]))


def test_a_trunk_shows_the_chest_or_the_back_or_a_side():
    assert [trunk_part(d) for d in (0, -59, 61, -100, 121, -180, np.nan)] == [CHEST, CHEST, 0, 0, BACK, BACK, 0]


def test_mirrored_answers_count_mirrored_and_those_without_landmarks_are_not_asked_about():
    asked = []

    def find(image, box):
        asked.append(box)
        return found(body(40 if len(asked) == 1 else -40))

    degrees = face_photo(IMAGE, photo_labels(body(40)), find).degrees
    assert degrees[0] == pytest.approx(40, abs=1e-4)
    assert np.isnan(degrees[1])
    assert np.allclose(asked, [[58, 2, 82, 98], [120, 10, 140, 90], [118, 2, 142, 98]])


def test_a_network_that_prefers_a_side_or_sees_nobody_gives_no_direction():
    for answer in (found(body(90)), None):
        assert np.isnan(face_photo(IMAGE, photo_labels(body(90)), lambda image, box, a=answer: a).degrees).all()


class FakeNetwork:
    def find(self, image, box):
        return found(body(180))


def test_the_command_goes_on_where_it_stopped(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(facing, "_network", FakeNetwork)
    arguments = ["--photos", str(tmp_path / "photos"), "--labels", str(tmp_path / "labels")]
    arguments += ["--out", str(tmp_path / "facing"), "--processes", "0"]
    assert main(arguments) == 1
    assert "python -m export.teachers" in capsys.readouterr().err
    (tmp_path / "photos").mkdir()
    for name in "ab":
        cv2.imwrite(str(tmp_path / "photos" / f"{name}.jpg"), IMAGE)
        photo_labels(body(180)).save(tmp_path / "labels" / f"{name}.npz")
    PhotoFacing(np.array([0, 90], np.float32)).save(tmp_path / "facing/a.npz")
    assert main(arguments) == 0
    assert "2 photos, the direction of 3 of 4 people is known: 1 show the chest, 1 the back, 1 a side" in (
        capsys.readouterr().out
    )
