"""Frames of films: equal motion between them, the sharp ones, cuts; films that show nothing end with advice."""

import maquette
import numpy as np
import pytest
from maquette.scene_making.film import prepare_film
from maquette.scene_making.motion import motion_between, sharpness, shrunk
from moving_pictures import SIZE, texture, window, write_film

DIAGONAL = np.hypot(*SIZE)


@pytest.fixture(scope="module")
def wall():
    return texture()


def prepared(path, tmp_path, max_frames=60):
    target = tmp_path / "photos"
    target.mkdir()
    result = prepare_film(path, target, max_frames, lambda done: None)
    assert sorted(file.name for file in target.iterdir()) == sorted(photo.file for photo in result.photos)
    return result


def seconds(result) -> np.ndarray:
    return np.array([float(photo.origin.split()[0]) for photo in result.photos])


def test_motion_is_measured_to_a_pixel(wall):
    images = [shrunk(window(wall, x).mean(2)) for x in (100, 100, 112, 130)]
    assert motion_between(images[0], images[1]) == pytest.approx(0, abs=1e-3)
    for k, moved in ((2, 12), (3, 30)):
        assert motion_between(images[0], images[k]) == pytest.approx(moved / DIAGONAL, abs=1.5 / DIAGONAL)
    assert motion_between(images[0], shrunk(window(texture(5), 50).mean(2))) is None


def test_frames_stand_where_the_camera_moved_equally_far(wall, tmp_path):
    """Slow at first, then three times as fast."""
    places = np.cumsum([4.0] * 20 + [12.0] * 20)
    film = write_film(tmp_path / "film.avi", [window(wall, x) for x in places])
    times = seconds(prepared(film, tmp_path, max_frames=12))
    slow, fast = (times < 2).sum(), (times >= 2).sum()
    assert 8 <= len(times) <= 12
    assert slow < 0.6 * fast


def test_of_neighbouring_frames_the_sharp_one_is_chosen(wall, tmp_path):
    frames = []
    for k in range(32):
        image = window(wall, 6 * k).astype(float)
        if k % 4 != 1:  # blurred by motion
            image = sum(np.roll(image, shift, 1) for shift in range(-6, 7)) / 13
        frames.append(image.astype(np.uint8))
    assert sharpness(frames[1].mean(2).astype(np.uint8)) > 2 * sharpness(frames[2].mean(2).astype(np.uint8))
    times = seconds(prepared(write_film(tmp_path / "film.avi", frames), tmp_path, max_frames=6))
    assert all(round(10 * time) % 4 == 1 for time in times)


def test_a_cut_is_named_and_a_film_without_one_is_not(wall, tmp_path):
    other = texture(9)
    frames = [window(wall, 6 * k) for k in range(15)] + [window(other, 300 - 6 * k) for k in range(15)]
    result = prepared(write_film(tmp_path / "film.avi", frames), tmp_path)
    assert not result.ordered
    assert result.notes == ["The film has a cut at 1.5 s; one take without cuts is better."]
    (tmp_path / "photos").rename(tmp_path / "old")
    assert prepared(write_film(tmp_path / "whole.avi", frames[:15]), tmp_path).ordered


@pytest.mark.parametrize(
    ("frame", "advice"),
    [
        (np.zeros((240, 320, 3), np.uint8), "black"),
        (np.full((240, 320, 3), 255, np.uint8), "overexposed"),
        (np.full((240, 320, 3), 120, np.uint8), "plain area"),
        (texture(2)[:240, :320], "does not move"),
    ],
    ids=["black", "overexposed", "plain", "still"],
)
def test_a_film_that_shows_no_depth_says_what_to_film_instead(frame, advice, tmp_path):
    film = write_film(tmp_path / "film.avi", [np.ascontiguousarray(frame)] * 12)
    with pytest.raises(maquette.MaquetteError, match=advice) as caught:
        prepared(film, tmp_path)
    assert any(word in caught.value.text for word in ("Film ", "Walk "))


def test_dark_frames_at_the_start_are_left_out(wall, tmp_path):
    frames = [np.zeros((240, 320, 3), np.uint8)] * 10 + [window(wall, 6 * k) for k in range(15)]
    result = prepared(write_film(tmp_path / "film.avi", frames), tmp_path)
    assert seconds(result).min() >= 0.9
    assert [(entry.name, entry.reason) for entry in result.left_out] == [("10 frames", "black")]


def test_what_is_no_film_is_refused(tmp_path):
    path = tmp_path / "film.mp4"
    path.write_bytes(b"no film" * 100)
    with pytest.raises(maquette.MaquetteError, match="cannot be opened as a video"):
        prepared(path, tmp_path)
