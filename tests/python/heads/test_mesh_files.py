"""Meshes of heads as other programs read them: the bytes that the native test writes again (tests/native/head)."""

import io
import json
import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

DATA = Path("tests/native/data/head_mesh")
NAMES = ("example.glb", "example.obj", "example.ply", "textured.glb", "textured.obj", "morphing.glb")


def load(name: str) -> trimesh.Trimesh:
    return trimesh.load(DATA / name, force="mesh", process=False)


@pytest.fixture(scope="module")
def expected() -> trimesh.Trimesh:
    return load("example.ply")


@pytest.mark.parametrize("name", NAMES)
def test_trimesh_reads_the_same_closed_surface(name, expected):
    mesh = load(name)
    assert (len(mesh.vertices), len(mesh.faces)) == (len(expected.vertices), len(expected.faces))
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume == pytest.approx(expected.volume, rel=1e-5)
    assert mesh.volume == pytest.approx(4 / 3 * np.pi * 0.06 * 0.08 * 0.1, rel=0.1)
    # Metres: as wide, high and deep as the head frame's x, z and y.
    assert mesh.extents == pytest.approx([0.12, 0.2, 0.16], rel=0.02)


@pytest.mark.parametrize("name", NAMES)
def test_its_normals_point_outwards(name):
    mesh = load(name)
    away = np.einsum("ij,ij->i", mesh.vertex_normals, mesh.vertices / np.array([0.06, 0.1, 0.08]) ** 2)
    assert (away > 0).all()


@pytest.mark.parametrize("name", ["example.obj", "example.ply"])
def test_trimesh_reads_the_colours_of_vertices(name):
    mesh = trimesh.load(DATA / name, force="mesh", process=False, skip_materials=True)
    colours = np.asarray(mesh.visual.vertex_colors)[:, :3].astype(int)
    assert np.abs(colours[:, 0] - 255 * (mesh.vertices[:, 1] * 10 + 1.1) / 2.2).max() <= 2
    assert set(colours[:, 1]) <= {127, 128}


def test_the_ply_has_template_points(expected):
    data = expected.metadata["_ply_raw"]["vertex"]["data"]
    found = np.stack([np.ravel(data[f"template_{axis}"]) for axis in "xyz"], 1)
    assert np.abs(found - expected.vertices - [0, 0.05, 0]).max() < 1e-6


@pytest.mark.parametrize("name", ["textured.glb", "textured.obj"])
def test_trimesh_finds_the_texture_and_where_it_goes(name):
    mesh = load(name)
    material = mesh.visual.material
    image = getattr(material, "baseColorTexture", None) or material.image
    kept = np.asarray(Image.open(DATA / "texture.png"))
    assert np.array_equal(np.asarray(image.convert("RGB")), kept)
    # trimesh counts v from below.
    assert np.abs(mesh.visual.uv[:, 1] - (mesh.vertices[:, 1] * 10 / 4 + 0.5)).max() < 1e-5


def test_the_texture_in_the_glb_is_the_file_that_was_given():
    data = (DATA / "textured.glb").read_bytes()
    length = struct.unpack("<I", data[12:16])[0]
    file = json.loads(data[20 : 20 + length])
    view = file["bufferViews"][file["images"][0]["bufferView"]]
    begin = 28 + length + view["byteOffset"]
    texture = data[begin : begin + view["byteLength"]]
    assert texture == (DATA / "texture.png").read_bytes()
    assert Image.open(io.BytesIO(texture)).size == (16, 16)


def read_glb(name: str) -> tuple[dict, bytes]:
    """The JSON and the bytes of a file."""
    data = (DATA / name).read_bytes()
    length = struct.unpack("<I", data[12:16])[0]
    return json.loads(data[20 : 20 + length]), data[28 + length :]


def test_morph_targets_are_sparse_and_say_where_vertices_go(expected):
    file, data = read_glb("morphing.glb")
    mesh = file["meshes"][0]
    assert mesh["extras"]["targetNames"] == ["jawOpen", "eyeBlinkLeft"]
    opened, still = (file["accessors"][target["POSITION"]] for target in mesh["primitives"][0]["targets"])
    assert "sparse" not in still
    assert "bufferView" not in still
    sparse = opened["sparse"]

    def numbers(part: str, form: str) -> np.ndarray:
        view = file["bufferViews"][sparse[part]["bufferView"]]
        return np.frombuffer(data, form, view["byteLength"] // 4, view["byteOffset"])

    below = np.flatnonzero(np.asarray(expected.vertices)[:, 1] <= -0.04)  # y is up in files
    assert numbers("indices", "<u4").tolist() == below.tolist()
    moves = numbers("values", "<f4").reshape(-1, 3)
    assert len(moves) == sparse["count"] == len(below)
    assert np.abs(moves - [0, -0.02, -0.002]).max() < 1e-8
