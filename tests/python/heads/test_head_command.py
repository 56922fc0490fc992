"""`maquette head` with the shipped bundles: its mesh in the hands of other programs."""

import io
import json
import os
import re
import struct
import subprocess
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

ROOT = Path(__file__).parents[3]
PROGRAM = ROOT / "build/release/stage/bin/maquette"
PHOTO = ROOT / "tests/media/photo.jpg"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    if not PROGRAM.exists():
        pytest.skip(f"{PROGRAM} is not built")
    made = tmp_path_factory.mktemp("head")
    environment = {key: value for key, value in os.environ.items() if not key.startswith("MAQ_")}
    words = ["head", PHOTO, "--out", "head.glb", "--save", "head.maqh", "--seconds", "0", "--cell", "4"]
    done = subprocess.run([PROGRAM, *words], cwd=made, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return made


def test_the_program_finds_its_bundles_and_makes_a_closed_head_in_metres(folder):
    mesh = trimesh.load(folder / "head.glb", force="mesh")
    mesh.merge_vertices(merge_tex=True, merge_norm=True)  # vertices on seams of the texture are there twice
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.body_count == 1
    width, height, depth = mesh.extents
    assert 0.13 < width < 0.35
    assert 0.18 < height < 0.4
    assert 0.15 < depth < 0.4


def test_assimp_reads_the_same_triangles(folder):
    told = subprocess.run(["assimp", "info", folder / "head.glb"], capture_output=True, text=True, check=True).stdout
    mesh = trimesh.load(folder / "head.glb", force="mesh")
    for what, count in (("Meshes", 1), ("Vertices", len(mesh.vertices)), ("Faces", len(mesh.faces))):
        assert re.search(rf"^{what}: +{count}$", told, re.MULTILINE), told


def test_a_saved_head_becomes_one_file_with_texture_actions_visemes_and_joints(folder):
    done = subprocess.run(
        [PROGRAM, "head", "export", "head.maqh", "--out", "whole.glb"],
        cwd=folder, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert done.stdout == "whole.glb: 5027 vertices, 9432 triangles, 67 morph targets\n"
    data = (folder / "whole.glb").read_bytes()
    length = struct.unpack("<I", data[12:16])[0]
    file, binary = json.loads(data[20 : 20 + length]), data[28 + length :]

    def bytes_of(view: int) -> bytes:
        found = file["bufferViews"][view]
        return binary[found["byteOffset"] : found["byteOffset"] + found["byteLength"]]

    assert Image.open(io.BytesIO(bytes_of(file["images"][0]["bufferView"]))).size == (2048, 2048)
    names = file["meshes"][0]["extras"]["targetNames"]
    assert {"jawOpen", "eyeBlinkLeft", "mouthSmileRight", "viseme_sil", "viseme_aa"} < set(names)
    assert len(file["meshes"][0]["primitives"][0]["targets"]) == len(names) == 52 + 15
    joints = [file["nodes"][node] for node in file["skins"][0]["joints"]]
    assert [joint["name"] for joint in joints] == ["Neck", "Head", "Jaw", "LeftEye", "RightEye"]
    left, right = joints[3]["translation"], joints[4]["translation"]
    assert left[0] > 0.02 > -0.02 > right[0]  # the person's left is at +x
    assert left[2] > 0.05  # before the spine
    attributes = file["meshes"][0]["primitives"][0]["attributes"]
    weights = np.frombuffer(bytes_of(file["accessors"][attributes["WEIGHTS_0"]]["bufferView"]), "<f4").reshape(-1, 4)
    numbers = np.frombuffer(bytes_of(file["accessors"][attributes["JOINTS_0"]]["bufferView"]), "u1").reshape(-1, 4)
    assert weights.sum(1) == pytest.approx(1, abs=1e-5)
    assert weights.min() >= 0
    assert numbers.max() == 4
    assert (numbers[weights == 0] == 0).all()
