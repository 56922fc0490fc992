"""Animals are read from the game's meshes, stand on the ground and are background in every image."""

import struct

import numpy as np
import pytest

from export.people import assets
from export.people.animals import Animal, load_animals, read_mesh

needs_animals = pytest.mark.skipif(
    not (assets.UNPACKED / "0ad" / "art" / "actors").exists(),
    reason="the game's animals are not unpacked: run `python -m export.people.assets 0ad-data`",
)


def mesh(vertices: np.ndarray, triangles: np.ndarray, layers: int = 1) -> bytes:
    """A PMD file, version 4; vertices [n, 8] are position, normal, texture coordinates."""
    rows = b"".join(
        np.asarray(v, "<f4").tobytes() + np.zeros(2 * (layers - 1), "<f4").tobytes() + bytes(20) for v in vertices
    )
    body = struct.pack("<II", len(vertices), layers) + rows
    body += struct.pack("<I", len(triangles)) + np.asarray(triangles, "<u2").tobytes() + struct.pack("<I", 0)
    return b"PSMD" + struct.pack("<II", 4, len(body)) + body


VERTICES = np.arange(32, dtype=float).reshape(4, 8)
TRIANGLES = np.array([[0, 1, 2], [3, 1, 0]])


@pytest.mark.parametrize("layers", [1, 2])
def test_a_mesh_is_read_as_it_was_written(layers):
    corners, normals, uv = read_mesh(mesh(VERTICES, TRIANGLES, layers))
    assert np.array_equal(corners, VERTICES[TRIANGLES][..., :3])
    assert np.array_equal(normals, VERTICES[TRIANGLES][..., 3:6])
    assert np.array_equal(uv[..., 0], VERTICES[TRIANGLES][..., 6])
    assert np.array_equal(uv[..., 1], 1 - VERTICES[TRIANGLES][..., 7])


def test_damaged_meshes_are_refused():
    whole = mesh(VERTICES, TRIANGLES)
    for damaged in (b"nothing", whole[:60], whole[:-12], mesh(VERTICES, [[0, 1, 4]]), whole[:4] + b"\x09" + whole[5:]):
        with pytest.raises((ValueError, struct.error)):
            read_mesh(damaged)


def test_an_animal_keeps_its_feet_on_the_ground_when_it_is_scaled(tmp_path):
    from PIL import Image

    Image.new("RGB", (8, 8), (10, 20, 30)).save(tmp_path / "coat.png")
    corners = np.array([[[0, 0, 0], [0, -1.0, 0], [0, 0, 2.0]]])
    normals = np.broadcast_to([1.0, 0, 0], (1, 3, 3))
    animal = Animal("dog", corners, normals, np.zeros((1, 3, 2)), (tmp_path / "coat.png",))
    prop = animal.scaled(np.random.default_rng(0), 0.5)
    assert prop.corners[..., 2].min() == 0
    assert 0.85 < prop.corners[..., 2].max() < 1.15
    assert prop.points is None  # background
    turned = prop.moved(0, 0, np.pi / 2).corners_in(np.eye(3), np.zeros(3))
    assert np.allclose(turned[..., 3:], [0, 1, 0], atol=1e-6)


@needs_animals
def test_splits_share_no_animal_and_normals_point_outwards():
    names = {split: {a.species for a in load_animals(split)} for split in ("train", "val", "test")}
    assert len(names["train"]) > 20
    assert names["val"]
    assert names["test"]
    assert not names["train"] & (names["val"] | names["test"])
    for animal in load_animals("test"):
        a, b, c = np.moveaxis(animal.corners, 1, 0)
        facing = (np.cross(b - a, c - a) * animal.normals.mean(1)).sum(1)
        assert np.mean(facing > 0) > 0.9, animal.name
