"""Ways to see a place anew without a network: each shows what its name says."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from box_scene import BoxScene, looking, ring, write_capture

from benchmarks.scenes.baselines import Cloud, cloud_of, moved_px, nearest_photo
from export.scenes.captures import read_capture
from export.scenes.picture_quality import psnr_db

RED, GREEN, GREY = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.5, 0.5, 0.5)
AHEAD = looking((0, 0, 4), (0, 0, 0), 32, 16, focal=1.0)


def cloud(*points: tuple[tuple[float, float, float], tuple[float, float, float]]) -> Cloud:
    places, colours = zip(*points, strict=True)
    return Cloud(torch.tensor(places, dtype=torch.float64), torch.tensor(colours), torch.tensor(GREY))


def test_a_point_is_one_pixel_and_the_nearest_wins():
    picture = cloud(((0.06, -0.06, 0), RED), ((0.06, -0.06, 1), GREEN)).points(AHEAD)
    assert picture.shape == (16, 32, 3)
    painted = np.argwhere((picture != GREY).any(2))
    assert painted.tolist() == [[8, 16]]
    assert picture[8, 16].tolist() == list(GREEN)


def test_a_square_covers_its_neighbours_but_nothing_nearer():
    picture = cloud(((0.06, -0.06, 0), RED), ((0.14, -0.05, 1), GREEN)).squares(AHEAD)
    assert picture[7:10, 15].tolist() == [list(RED)] * 3
    assert picture[7:10, 16:19].reshape(-1, 3).tolist() == [list(GREEN)] * 9
    assert ((picture != GREY).any(2)).sum() == 12


def test_the_pyramid_has_no_holes_and_keeps_the_points():
    made = cloud(((0.06, -0.06, 0), RED), ((-1.5, 0.5, 0), GREEN))
    plain, filled = made.points(AHEAD), made.pyramid(AHEAD)
    shown = (plain != GREY).any(2)
    assert shown.sum() == 2
    assert np.array_equal(filled[shown], plain[shown])
    # Both 16 x 16 pixels of the coarsest raster have a point, so that nothing is behind.
    assert not (np.abs(filled - GREY).max(2) < 0.2).any()
    assert filled[2, 31, 0] > 0.9


def test_a_pyramid_of_a_picture_of_any_size_has_that_size():
    assert cloud(((0, 0, 0), RED)).pyramid(looking((0, 0, 4), (0, 0, 0), 37, 21)).shape == (21, 37, 3)


def test_the_nearest_camera_moves_points_least():
    places = BoxScene(0).cloud(ring(3))[0]
    here, *others = (looking((x, 0.2, 2.4), (0, -0.5, 0)) for x in (0, 0.1, 0.5, 1.5))
    moved = [moved_px(here, other, places) for other in (here, *others)]
    assert moved[0] == 0
    assert moved == sorted(moved)
    away = looking((0, 0.2, 2.4), (0, 0.2, 5))
    assert moved_px(here, away, places) == pytest.approx(np.hypot(96, 64))
    assert moved_px(away, here, places[:0]) == pytest.approx(np.hypot(96, 64))


def test_the_nearest_photo_is_a_source_photo_at_the_size_asked_for(tmp_path):
    write_capture(tmp_path / "room", seed=1, views=5)
    capture = read_capture(tmp_path / "room")
    assert np.array_equal(nearest_photo(capture, capture.cameras[2]), capture.view(2).image)
    held_out = replace(capture, held_out=frozenset({2}))
    picture = nearest_photo(held_out, capture.cameras[2])
    assert any(np.array_equal(picture, capture.view(k).image) for k in (1, 3))
    assert nearest_photo(capture, replace(capture.cameras[2], width_px=48, height_px=32)).shape == (32, 48, 3)


def test_behind_the_points_is_what_photos_show_where_no_point_is(tmp_path):
    write_capture(tmp_path / "room", seed=1, views=3)
    capture = read_capture(tmp_path / "room")
    none = replace(capture, cloud=replace(capture.cloud, positions=np.array([[0.0, 1e6, 0.0]])))
    mean = np.mean([capture.view(k).image.mean((0, 1)) for k in range(3)], 0)
    np.testing.assert_allclose(cloud_of(none).behind.numpy(), mean, atol=1e-5)
    assert cloud_of(capture).positions.shape == capture.cloud.positions.shape


def test_filling_holes_helps(tmp_path):
    write_capture(tmp_path / "room", seed=2, views=6)
    capture = read_capture(tmp_path / "room")
    sparse = replace(capture.cloud, positions=capture.cloud.positions[::20], colours=capture.cloud.colours[::20])
    made, view = cloud_of(replace(capture, cloud=sparse)), capture.view(2)
    plain, squares, pyramid = (psnr_db(make(view.camera), view.image) for make in (made.points, made.squares,
                                                                                   made.pyramid))  # fmt: skip
    assert plain < squares
    assert plain + 1 < pyramid
