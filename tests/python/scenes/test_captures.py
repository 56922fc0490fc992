"""Captures on disk: read as written, and refused with a sentence where they are damaged."""

import json

import cv2
import numpy as np
import pytest
from box_scene import ring, write_capture, write_ply

from export.point_cloud import PointCloudError, read_ply
from export.scenes.captures import CaptureError, read_capture, read_captures


@pytest.fixture
def folder(tmp_path):
    write_capture(tmp_path / "room", seed=0, views=3, width=48, height=32)
    return tmp_path / "room"


def changed(folder, **fields) -> None:
    path = folder / "transforms.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | fields))


def test_a_capture_is_read_as_it_was_written(folder):
    capture = read_captures(folder.parent)[0]
    assert capture.name == "room"
    for found, expected in zip(capture.cameras, ring(3, 48, 32, 0), strict=True):
        np.testing.assert_allclose(found.rotation, expected.rotation, atol=1e-12)
        np.testing.assert_allclose(found.centre, expected.centre)
        assert (found.fx_px, found.cx_px, found.cy_px) == (expected.fx_px, expected.cx_px, expected.cy_px)
    view = capture.view(1)
    assert view.image.shape == (32, 48, 3)
    picture = cv2.imread(str(folder / "1.png"))[..., ::-1]
    np.testing.assert_allclose(view.image, picture / 255, atol=1e-6)
    assert len(capture.cloud.positions) == 3 * 24 * 16


def test_held_out_photos_and_the_worlds_up_are_found(folder):
    capture = read_capture(folder)
    assert (capture.up, capture.sources()) == ((0, 1, 0), [0, 1, 2])
    changed(folder, test_filenames=["1.png"], maquette={"up_axis": [0, 0, 1]})
    capture = read_capture(folder)
    assert (capture.up, capture.sources(), capture.held_out) == ((0, 0, 1), [0, 2], {1})


def test_a_smaller_photo_has_the_same_field_of_view(folder):
    view = read_capture(folder).view(0, long_side_px=24)
    assert view.image.shape == (16, 24, 3)
    assert (view.camera.width_px, view.camera.height_px) == (24, 16)
    assert view.camera.cx_px == pytest.approx(11.5)


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"frames": []}, "0 frames"),
        ({"frames": 5}, "another kind"),
        ({"fl_x": None}, "another kind"),
        ({"fl_x": float("nan")}, "finite"),
        ({"fl_x": -1}, "focal lengths"),
        ({"w": 10**9}, "pixels"),
        ({"k1": 0.1}, "undistort"),
        ({"up": [0, 0, 0]}, "direction"),
        ({"maquette": {"up_axis": [0, 1]}}, "direction"),
        ({"maquette": 3}, "another kind"),
        ({"test_filenames": 3}, "another kind"),
        ({"frames": [{"file_path": "0.png", "transform_matrix": np.zeros((4, 4)).tolist()}]}, "rotation"),
        ({"frames": [{"file_path": "0.png", "transform_matrix": [[1]]}]}, "4 x 4"),
        ({"frames": [{"file_path": "../../secret", "transform_matrix": np.eye(4).tolist()}]}, "outside"),
        ({"frames": [{"file_path": "no.png", "transform_matrix": np.eye(4).tolist()}]}, "cannot be read"),
    ],
)
def test_a_damaged_capture_is_refused_with_a_sentence(folder, fields, says):
    changed(folder, **fields)
    with pytest.raises(CaptureError, match=says):
        read_capture(folder)


def test_what_is_no_json_or_no_folder_is_refused(folder):
    (folder / "transforms.json").write_text("{")
    with pytest.raises(CaptureError, match="JSON"):
        read_capture(folder)
    with pytest.raises(CaptureError, match="no folders"):
        read_captures(folder / "nothing")


def test_a_single_photo_or_no_points_are_nothing_to_learn_from(folder):
    frames = json.loads((folder / "transforms.json").read_text())["frames"]
    changed(folder, frames=frames[:1])
    with pytest.raises(CaptureError, match="1 photos to learn from and 1152 points"):
        read_captures(folder.parent)
    changed(folder, frames=frames)
    write_ply(folder / "cloud.ply", np.zeros((0, 3)), np.zeros((0, 3)))
    with pytest.raises(CaptureError, match="3 photos to learn from and 0 points"):
        read_captures(folder.parent)


def test_photos_that_are_none_or_of_another_size_are_refused(folder):
    capture_of = read_capture
    (folder / "0.png").write_bytes(b"no picture")
    cv2.imwrite(str(folder / "1.png"), np.zeros((5, 6, 3), np.uint8))
    capture = capture_of(folder)
    with pytest.raises(CaptureError, match="cannot be decoded"):
        capture.view(0)
    with pytest.raises(CaptureError, match="6 x 5 pixels"):
        capture.view(1)


def test_clouds_in_text_and_binary_are_the_same(tmp_path):
    rng = np.random.default_rng(0)
    places, colours = rng.normal(size=(7, 3)).astype(np.float32), rng.random((7, 3))
    write_ply(tmp_path / "binary.ply", places, colours)
    lines = [f"{x} {y} {z} {r:.0f} {g:.0f} {b:.0f}" for (x, y, z), (r, g, b) in zip(places, colours * 255, strict=True)]
    header = (tmp_path / "binary.ply").read_bytes().split(b"end_header")[0].decode()
    text = header.replace("binary_little_endian", "ascii") + "end_header\n" + "\n".join(lines) + "\n"
    (tmp_path / "text.ply").write_text(text)
    for name in ("binary", "text"):
        cloud = read_ply(tmp_path / f"{name}.ply")
        np.testing.assert_allclose(cloud.positions, places, rtol=1e-6)
        np.testing.assert_allclose(cloud.colours, colours, atol=0.5 / 255 + 1e-6)


def test_points_that_are_not_finite_are_dropped_and_counted(tmp_path):
    places = np.zeros((4, 3))
    places[1, 2], places[3, 0] = np.nan, np.inf
    write_ply(tmp_path / "cloud.ply", places, np.zeros((4, 3)))
    cloud = read_ply(tmp_path / "cloud.ply")
    assert (len(cloud.positions), cloud.dropped) == (2, 2)


HEADER = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n"


@pytest.mark.parametrize(
    "text",
    [
        "",
        "ply\n",
        HEADER.replace("ascii", "binary_big_endian") + "1 2 3\n",
        HEADER.replace("vertex 1", "vertex 2") + "1 2 3\n",
        HEADER.replace("vertex 1", "vertex 99999999999") + "1 2 3\n",
        HEADER.replace("vertex 1", "vertex -1") + "1 2 3\n",
        HEADER.replace("vertex 1", "vertex " + "9" * 5000) + "1 2 3\n",
        HEADER.replace("vertex 1", "vertex 5\nelement vertex 1") + "1 2 3\n",
        HEADER.replace("float z", "float w") + "1 2 3\n",
        HEADER.replace("float z", "half z") + "1 2 3\n",
        HEADER.replace("float z", "float y") + "1 2 3\n",
        HEADER.replace("property float z", "property list uchar int z") + "1 2 3\n",
        HEADER + "1 2 three\n",
        HEADER.replace("element vertex 1", "element face 1\nproperty list uchar int v\nelement vertex 1") + "1 2 3\n",
        HEADER.replace("ascii", "binary_little_endian") + "12",
    ],
)
def test_a_damaged_cloud_is_refused(tmp_path, text):
    (tmp_path / "cloud.ply").write_text(text)
    with pytest.raises(PointCloudError, match=r"cloud\.ply"):
        read_ply(tmp_path / "cloud.ply")


def test_a_cloud_cut_at_any_byte_is_refused_or_read(tmp_path):
    write_ply(tmp_path / "cloud.ply", np.ones((2, 3)), np.ones((2, 3)))
    data = (tmp_path / "cloud.ply").read_bytes()
    for end in range(len(data)):
        (tmp_path / "cut.ply").write_bytes(data[:end])
        with pytest.raises(PointCloudError):
            read_ply(tmp_path / "cut.ply")
