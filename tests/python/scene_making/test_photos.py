"""Photos of a folder: turned upright, scaled down, grouped by camera; what is refused and why."""

import struct

import maquette
import numpy as np
import pytest
from maquette.scene_making.exif import camera_of
from maquette.scene_making.matching import pairs_to_match
from maquette.scene_making.photos import prepare_photos
from moving_pictures import texture


def exif(model: bytes, focal_mm: int, orientation: int, order: str) -> bytes:
    """A segment of a JPEG file with these tags."""
    head = {"<": b"II", ">": b"MM"}[order] + struct.pack(order + "HI", 42, 8)
    data_at = 8 + 2 + 3 * 12 + 4
    nested_at = data_at + len(model) + 1 + (len(model) + 1) % 2
    first = struct.pack(order + "H", 3)
    first += struct.pack(order + "HHII", 0x0110, 2, len(model) + 1, data_at)
    first += struct.pack(order + "HHIHH", 0x0112, 3, 1, orientation, 0)
    first += struct.pack(order + "HHII", 0x8769, 4, 1, nested_at) + bytes(4)
    nested = struct.pack(order + "H", 1) + struct.pack(order + "HHIHH", 0xA405, 3, 1, focal_mm, 0) + bytes(4)
    tiff = (head + first + model + b"\0").ljust(nested_at, b"\0") + nested
    return b"\xff\xe1" + struct.pack(">H", len(tiff) + 8) + b"Exif\0\0" + tiff


def write(path, image, tags=b"") -> None:
    maquette.Frame(np.ascontiguousarray(image)).save(path)
    data = path.read_bytes()
    path.write_bytes(data[:2] + tags + data[2:])


def prepared(folder, tmp_path, max_photos=60):
    target = tmp_path / "target"
    target.mkdir()
    return prepare_photos(folder, target, max_photos, lambda done: None), target


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "photos").mkdir()
    return tmp_path / "photos"


@pytest.mark.parametrize("order", ["<", ">"])
def test_exif_tells_camera_and_focal_length(folder, order):
    write(folder / "a.jpg", texture(0, 300), exif(b"Phone 7", 24, 1, order))
    assert camera_of(folder / "a.jpg") == ("Phone 7", pytest.approx(24 / 36))
    write(folder / "b.jpg", texture(0, 300))
    assert camera_of(folder / "b.jpg") == ("", 0)
    data = (folder / "a.jpg").read_bytes()
    for end in range(2, 140, 3):
        (folder / "c.jpg").write_bytes(data[:end])
        camera_of(folder / "c.jpg")  # a damaged file is no error


def test_photos_are_upright_small_and_grouped_by_camera(folder, tmp_path):
    wide = np.ascontiguousarray(np.tile(texture(1, 700), (1, 2, 1)))
    write(folder / "IMG_10.jpg", wide, exif(b"Phone", 24, 1, "<"))
    write(folder / "IMG_9.jpg", np.ascontiguousarray(wide[::-1]), exif(b"Phone", 24, 6, "<"))
    write(folder / "IMG_11.jpg", np.ascontiguousarray(wide[:, ::-1]), exif(b"Phone", 48, 1, "<"))
    result, target = prepared(folder, tmp_path)
    assert [photo.origin for photo in result.photos] == ["IMG_9.jpg", "IMG_10.jpg", "IMG_11.jpg"]
    assert [(photo.width, photo.height) for photo in result.photos] == [(480, 960), (960, 480), (960, 480)]
    assert [photo.focal_px for photo in result.photos] == pytest.approx([640, 640, 1280], abs=1)
    assert len({photo.camera for photo in result.photos}) == 3
    assert maquette.Frame.open(target / result.photos[0].file).shape == (960, 480)


def test_what_cannot_be_used_is_named_with_the_reason(folder, tmp_path):
    write(folder / "good.jpg", texture(1, 300))
    write(folder / "good copy.jpg", texture(1, 300))
    write(folder / "black.jpg", np.zeros((300, 300, 3), np.uint8))
    write(folder / "white.png", np.full((300, 300, 3), 254, np.uint8))
    write(folder / "tiny.png", texture(1, 60))
    (folder / "broken.jpg").write_bytes(b"\xff\xd8 no photo")
    (folder / "phone.HEIC").write_bytes(b"ftypheic")
    (folder / "notes.txt").write_text("no photo")
    result, _ = prepared(folder, tmp_path)
    assert [photo.origin for photo in result.photos] == ["good copy.jpg"]
    reasons = {entry.name: entry.reason for entry in result.left_out}
    assert set(reasons) == {"good.jpg", "black.jpg", "white.png", "tiny.png", "broken.jpg", "phone.HEIC"}
    words = {
        "good.jpg": "same picture as good copy.jpg",
        "black.jpg": "black",
        "white.png": "overexposed",
        "tiny.png": "60 x 60",
        "broken.jpg": "cannot be read",
        "phone.HEIC": "JPEG",
    }
    for name, word in words.items():
        assert word in reasons[name]


def test_of_many_photos_a_part_is_taken_evenly_and_said(folder, tmp_path):
    for k in range(11):
        write(folder / f"{k}.png", texture(k, 240))
    result, _ = prepared(folder, tmp_path, max_photos=6)
    assert [photo.origin for photo in result.photos] == [f"{k}.png" for k in range(0, 11, 2)]
    assert "6 of 11 photos are used" in result.notes[0]


def test_films_match_neighbours_and_powers_of_two_photos_all_pairs():
    assert len(pairs_to_match(20, ordered=False)) == 190
    steps = {b - a for a, b in pairs_to_match(50, ordered=True)}
    assert steps == {1, 2, 3, 4, 5, 6, 7, 8, 16, 32}
    assert {b - a for a, b in pairs_to_match(200, ordered=False)} == steps | {64, 128}
    assert pairs_to_match(3, ordered=True) == [(0, 1), (0, 2), (1, 2)]
