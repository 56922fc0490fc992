"""The examples in Python and the notebook run from top to bottom."""

import json
import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import cv2
import maquette
import pytest

ROOT = Path(__file__).parents[3]
EXAMPLES = ROOT / "examples"
MEDIA = ROOT / "tests/media"


def run(name: str, monkeypatch, *arguments: object) -> None:
    path = EXAMPLES / f"python/{name}.py"
    monkeypatch.setattr(sys, "argv", [str(path), *map(str, arguments)])
    runpy.run_path(str(path))


@pytest.mark.parametrize(
    ("name", "more"),
    [("box_size", ["60"]), ("live", []), ("new_view", ["o.png"]), ("camera_health", []), ("photo_to_head", ["o.glb"]),
     ("photo_to_hint", ["o.png"]), ("photo_to_iuv", ["o"]), ("record", ["o.maqrec"])],
)  # fmt: skip
def test_an_example_ends_with_the_sentence_about_a_wrong_input_and_exit_code_1(name, more, tmp_path):
    (tmp_path / "text.jpg").write_text("no image")
    for file in ("missing.jpg", "text.jpg"):
        command = [sys.executable, EXAMPLES / f"python/{name}.py", file, *more]
        environment = {**os.environ, "PYTHONPATH": str(ROOT / "python")}
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
        assert done.returncode == 1, done.stderr
        told = done.stderr.splitlines()
        assert re.match(rf"(\w+\.)*(MaquetteError|FileNotFoundError): .*{file}", told[-1]), done.stderr


@pytest.mark.parametrize(
    ("name", "arguments", "printed"),
    [
        ("live", ["stub:people?count=1&size=320x240&frames=3"], "1 person"),
        ("box_size", [MEDIA / "box_depth.png", 56.1], "<Box 4"),
        ("camera_health", ["stub:people?frames=6&size=320x240"], "6 frames"),
    ],
)
def test_an_example_prints(name, arguments, printed, monkeypatch, capsys):
    run(name, monkeypatch, *arguments)
    assert printed in capsys.readouterr().out


def test_an_example_records(monkeypatch, tmp_path):
    run("record", monkeypatch, "stub:pattern?size=32x24&frames=3", tmp_path / "take.maqrec")
    assert len(list(maquette.Source(tmp_path / "take.maqrec"))) == 3


def test_examples_write_images_and_meshes_of_a_photo(monkeypatch, tmp_path):
    photo = MEDIA / "photo.jpg"
    run("photo_to_iuv", monkeypatch, photo, tmp_path / "results/photo")
    run("photo_to_hint", monkeypatch, photo, tmp_path / "hint.png", "magicanimate")
    run("photo_to_head", monkeypatch, photo, tmp_path / "head.glb", 0)
    size = cv2.imread(str(photo)).shape
    iuv = cv2.imread(str(tmp_path / "results/photo_IUV.png"))
    hint = cv2.imread(str(tmp_path / "hint.png"))
    assert iuv.shape == hint.shape == size
    assert ((hint != (84, 1, 68)).any(-1) == (iuv[..., 0] > 0)).all()
    assert (tmp_path / "head.glb").read_bytes()[:4] == b"glTF"


def test_an_example_builds_a_scene(monkeypatch, tmp_path):
    run("new_view", monkeypatch, ROOT / "tests/native/data/tiny_scene/capture", tmp_path / "view.png")
    assert cv2.imread(str(tmp_path / "view.png")).shape == (480, 640, 3)


def test_the_notebook_runs_from_top_to_bottom(monkeypatch, capsys):
    monkeypatch.chdir(EXAMPLES)
    cells = json.loads((EXAMPLES / "tour.ipynb").read_text())["cells"]
    names: dict = {}
    for cell in cells:
        if cell["cell_type"] == "code":
            assert cell["outputs"] == []
            exec(compile("".join(cell["source"]), f"tour.ipynb {cell['id']}", "exec"), names)
    assert "<Box" in repr(names["edges"].curves.boxes)
    assert names["view"].rgb.any()


def test_every_example_is_listed():
    listed = (EXAMPLES / "README.md").read_text()
    files = [path for path in EXAMPLES.rglob("*") if path.is_file() and "__pycache__" not in path.parts]
    missing = [str(path.relative_to(EXAMPLES)) for path in files if str(path.relative_to(EXAMPLES)) not in listed]
    assert missing == ["README.md"]
