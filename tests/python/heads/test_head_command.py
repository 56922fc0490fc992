"""`maquette head` with the shipped bundles: its mesh in the hands of other programs."""

import os
import re
import subprocess
from pathlib import Path

import pytest
import trimesh

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
