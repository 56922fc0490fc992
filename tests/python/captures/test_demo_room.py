"""The room that comes with the repository: it opens, may be given away, and its cloud lies on its photos."""

import json
from pathlib import Path

import numpy as np
import pytest

from export.point_cloud import read_ply, write_ply
from export.scenes.captures import read_capture

ROOM = Path(__file__).parents[2] / "media" / "room"


@pytest.fixture(scope="module")
def room():
    return read_capture(ROOM)


def test_it_is_a_capture_with_photos_held_out(room):
    assert len(room.cameras) == 30
    assert len(room.held_out) == 5
    assert {(camera.width_px, camera.height_px) for camera in room.cameras} == {(640, 480)}
    assert len(room.cloud.positions) > 300_000
    assert room.cloud.dropped == 0
    assert room.up == (0, 0, 1)


def test_all_that_is_in_it_may_be_given_away():
    table = json.loads((ROOM / "transforms.json").read_text())
    assert table["licence"] == "CC0-1.0"
    assert {asset["licence"] for asset in table["assets"]} == {"CC0-1.0"}
    note = (ROOM.parent / "LICENSE-room.txt").read_text()
    for asset in table["assets"]:
        if asset["name"].startswith("model "):
            assert asset["name"].removeprefix("model ") in note
    assert sum(file.stat().st_size for file in ROOM.rglob("*") if file.is_file()) < 5_000_000


def colour_error(capture, k: int, turned_degrees: float = 0.0) -> float:
    """Median difference, of 255, between photo k and the nearest points in its pixels."""
    view = capture.view(k)
    camera = view.camera
    turn = np.radians(turned_degrees)
    aside = np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]])
    seen = (capture.cloud.positions - camera.centre) @ camera.rotation.T @ aside.T
    seen, colours = seen[seen[:, 2] > 50], capture.cloud.colours[seen[:, 2] > 50]  # millimetres
    at = np.round(seen[:, :2] / seen[:, 2:] * (camera.fx_px, camera.fy_px) + (camera.cx_px, camera.cy_px)).astype(int)
    inside = ((at >= 0) & (at < (camera.width_px, camera.height_px))).all(1)
    at, colours, depth = at[inside], colours[inside], seen[inside, 2]
    order = np.argsort(-depth, kind="stable")
    picture = np.full(view.image.shape, np.nan, np.float32)
    picture[at[order, 1], at[order, 0]] = colours[order]
    return 255 * float(np.nanmedian(np.abs(picture - view.image)))


def test_the_cloud_lies_on_photos_that_it_was_not_made_of(room):
    right = np.mean([colour_error(room, k) for k in room.held_out])
    wrong = np.mean([colour_error(room, k, 1.0) for k in room.held_out])
    assert right < 3
    assert wrong > 2 * right  # a turn by one degree is found


def test_clouds_of_short_coordinates_come_back_in_nine_bytes_a_point(tmp_path):
    places = np.array([[1, -2, 32767], [-32767, 0, 5]], np.int16)
    colours = np.array([[1, 2, 3], [255, 0, 7]], np.uint8)
    write_ply(tmp_path / "a.ply", places, colours)
    cloud = read_ply(tmp_path / "a.ply")
    assert np.array_equal(cloud.positions, places)
    assert np.allclose(cloud.colours * 255, colours)
    write_ply(tmp_path / "b.ply", np.tile(places, (50, 1)), np.tile(colours, (50, 1)))
    assert (tmp_path / "b.ply").stat().st_size - (tmp_path / "a.ply").stat().st_size == 98 * 9 + 2  # "100" for "2"
