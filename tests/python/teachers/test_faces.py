"""Faces are found in windows of a photo, and their points lie in pixels of the photo, however the square was turned."""

import numpy as np
import pytest

from export.teachers import faces
from export.teachers.faces import DETECTOR_SIDE, POINTS, SIDE, FaceDetector, FaceNetwork, Square, faces_of, windows


def painted(shape=(300, 400)) -> np.ndarray:
    """A photo whose first channels tell where a pixel is."""
    y, x = np.mgrid[: shape[0], : shape[1]].astype(np.float32)
    return np.dstack([x / shape[1] * 250, y / shape[0] * 250, np.zeros(shape, np.float32)]).astype(np.uint8)


@pytest.mark.parametrize(("size", "turn"), [(60.0, 0.0), (180.0, 0.6), (200.0, -2.0)])
def test_a_square_shows_what_its_points_say(size, turn):
    """The pixel in the middle of a cell of the crop is the photo's pixel at the cell's share of the square."""
    image = painted()
    square = Square(np.array([200.0, 150.0]), size, turn)
    crop = square.cut(image, 64)
    for row, column in ((32, 32), (20, 40), (45, 22)):
        x, y = square.to_photo(np.array([[(column + 0.5) / 64, (row + 0.5) / 64]]))[0]
        assert abs(float(crop[row, column, 0]) - x / 400 * 250) < 1.6
        assert abs(float(crop[row, column, 1]) - y / 300 * 250) < 1.6


def test_outside_of_the_photo_a_square_is_grey():
    crop = Square(np.array([0.0, 0.0]), 100.0, 0.0).cut(painted(), 50)
    assert (crop[:20, :20] == 127).all()
    assert (crop[40, 40] != 127).any()


@pytest.mark.parametrize("shape", [(300, 400), (900, 600), (120, 500)])
def test_windows_cover_the_photo(shape):
    seen = np.zeros(shape, int)
    for window in windows(shape):
        low = np.round(window.centre - window.size / 2 + 0.5).astype(int)
        high = np.round(window.centre + window.size / 2 + 0.5).astype(int)
        seen[max(low[1], 0) : high[1], max(low[0], 0) : high[0]] += 1
    assert seen.min() >= 2 or min(shape) < 160
    assert seen.min() >= 1


class FakeDetector:
    """Sees one face by the anchor of row 5, column 8 of the grid of 16 x 16."""

    def set_tensor(self, index, value):
        assert value.shape == (1, DETECTOR_SIDE, DETECTOR_SIDE, 3)
        assert value.min() >= -1
        assert value.max() <= 1

    def invoke(self):
        pass

    def get_tensor(self, index):
        anchor = 2 * (5 * 16 + 8)
        if index == "scores":
            out = np.full((1, 896, 1), -20.0, np.float32)
            out[0, anchor] = 20
            return out
        out = np.zeros((1, 896, 16), np.float32)
        # Middle 4 px right of the anchor's, 32 px wide and high, eyes 8 px left and right, 6 above.
        out[0, anchor] = [4, 0, 32, 32, -4, -6, 12, -6, 4, 2, 4, 8, -10, 0, 18, 0]
        return out


def detector(net) -> FaceDetector:
    made = FaceDetector.__new__(FaceDetector)
    made._net, made._input = net, 0
    made._outputs = {"regressors": "rows", "classificators": "scores"}
    cells = [np.stack(np.meshgrid(*[(np.arange(n) + 0.5) / n] * 2), -1).reshape(-1, 2) for n in (16, 8)]
    made._anchors = np.concatenate([np.repeat(cells[0], 2, 0), np.repeat(cells[1], 6, 0)])
    return made


def test_boxes_lie_in_pixels_of_the_photo(monkeypatch):
    whole = Square(np.array([127.5, 127.5]), 256.0, 0.0)
    monkeypatch.setattr(faces, "windows", lambda shape: [whole])
    (square,) = detector(FakeDetector()).squares(np.zeros((256, 256, 3), np.uint8))
    middle = np.array([(8.5 / 16 * 128 + 4) * 2, 5.5 / 16 * 128 * 2]) - 0.5
    assert np.allclose(square.centre, middle, atol=1e-3)
    assert square.size == pytest.approx(1.5 * 64, abs=1e-3)
    assert square.turn == pytest.approx(0)


class FakeMesh:
    """Its points are a level face in the middle of whatever it is shown; presence as given."""

    def __init__(self, presence=20.0):
        self.presence, self.crops = presence, []

    def set_tensor(self, index, value):
        assert value.shape == (1, SIDE, SIDE, 3)
        assert value.min() >= 0
        assert value.max() <= 1
        self.crops.append(value[0])

    def invoke(self):
        pass

    def get_tensor(self, index):
        if index == 1:
            return np.full((1, 1), self.presence, np.float32)
        rows = np.zeros((POINTS, 3), np.float32)
        rows[:, 0] = 96 + 60 * np.sin(np.arange(POINTS))
        rows[:, 1] = 96 + 60 * np.cos(np.arange(POINTS))
        rows[faces.RIGHT_EYE, :2], rows[faces.LEFT_EYE, :2] = (66, 80), (126, 80)
        return rows.reshape(1, 1, 1, -1)


def network(net) -> FaceNetwork:
    made = FaceNetwork.__new__(FaceNetwork)
    made._net, made._input, made._points, made._presence = net, 0, 0, 1
    return made


def test_points_lie_in_pixels_of_the_photo_and_tell_how_far_they_wander():
    face = network(FakeMesh()).find(painted(), Square(np.array([200.0, 150.0]), 120.0, 0.0))
    assert np.linalg.norm(face.point.mean(0) - [200, 150]) < 3
    assert face.presence > 0.99
    # The fake says the same of every look, so in the photo its points move as the looks do.
    assert 1 < np.median(face.spread) < 12


def test_where_no_face_is_there_is_none():
    assert network(FakeMesh(-20.0)).find(painted(), Square(np.array([200.0, 150.0]), 120.0, 0.0)) is None


def test_a_face_found_twice_counts_once():
    class Two:
        def squares(self, image):
            return [Square(np.array([x, 150.0]), 120.0, 0.0) for x in (100.0, 104.0)]

    further = [Square(np.array([300.0, 150.0]), 120.0, 0.0)]
    assert len(faces_of(Two(), network(FakeMesh()), painted())) == 1
    assert len(faces_of(Two(), network(FakeMesh()), painted(), further)) == 2
