"""Nothing is sent anywhere: every command of the program, and the Python package, run under strace, which records each
system call of the network. No call may leave the machine."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

ROOT = Path(__file__).parents[3]
PROGRAM = ROOT / "build/release/stage/bin/maquette"
MEDIA = ROOT / "tests/media"
PEOPLE = "stub:people?count=1&size=160x120&seed=1"
TRACE = ["strace", "-f", "--seccomp-bpf", "-qq", "-e", "trace=network,io_uring_setup"]
# A call that reaches for an address of the internet, or requests by io_uring, which strace cannot see.
LEAVES = re.compile(r"\b(connect|sendto|sendmsg|sendmmsg)\(.*\bAF_INET6?\b|\bio_uring_setup\(")
LOCAL = re.compile(r"\b(AF_UNIX|AF_LOCAL|AF_NETLINK)\b")

# Arguments of each command, with cheap inputs; "{}" is a folder for results, in which files of earlier commands lie.
COMMANDS = {
    "info": [],
    "sources": [],
    "doctor": [],
    "play": [PEOPLE, "--frames", "2"],
    "record": [PEOPLE, "{}/take.maqrec", "--frames", "2"],
    "predict": [PEOPLE, "--from", "4", "--frames", "2", "--method", "sampled", "--out", "{}/next"],
    "health": [PEOPLE, "--max-frames", "4"],
    "densepose": [f"image:{MEDIA}/photo.jpg?size=256x256", "--out", "{}/people", "--overlay"],
    "edges": [f"image:{MEDIA}/box_depth.png?depth_unit=0.001&fx=600", "--out", "{}/edges", "--overlay", "--boxes",
              "--format", "step,dxf"],
    "edges build": ["{}/depth", "--out", "{}/model.dxf", "--min-views", "1"],
    "edges info": [],
    "head": [f"{MEDIA}/photo.jpg", "--seconds", "0", "--cell", "8", "--save", "{}/head.maqh", "--out", "{}/head.glb"],
    "head info": ["{}/head.maqh"],
    "body": [f"image:{MEDIA}/photo.jpg?size=256x256", "--out", "{}/body.glb"],
    "head render": ["{}/head.maqh", "--cell", "8", "--size", "80x60", "--out", "{}/head.png"],
    "head export": ["{}/head.maqh", "--triangles", "500", "--out", "{}/exported.obj"],
    "scene make": ["film.mp4", "--out", "{}/made.maqs"],
    "scene build": [f"{MEDIA}/room", "--points", "2000", "--views", "2", "--long-side", "160", "--out", "{}/room.maqs"],
    "scene render": ["{}/room.maqs", "--path", "orbit", "--size", "80x60", "--seconds", "0.1", "--out", "{}/room.mp4"],
    "scene info": ["{}/room.maqs"],
    "scene export": ["{}/room.maqs", "--out", "{}/room.spz"],
    "bench": [PEOPLE, "--warm-up", "1", "--runs", "2", "--seconds", "0.01"],
}  # fmt: skip
GROUPS = {"scene"}  # commands that only hold others
# These may end with 1: one does without a camera, the other tells what to run instead.
MAY_END_WITH_1 = {"doctor", "scene make"}

SESSION = """
import numpy as np
import maquette

frame = maquette.Source("stub:people?count=1&size=160x120&seed=1").read()
maquette.DensePose(threads=1).run(frame)
solids = maquette.Source("stub:solids?scene=box&size=160x120&seed=1")
maquette.Edges(threads=1).run(solids.read(), solids.intrinsics, curves=True)
predictor = maquette.Predictor()
predictor.push(frame)
predictor.predict(0.1)
maquette.CameraHealth().push(frame)
with maquette.HeadBuilder(threads=1) as builder:
    try:
        builder.add_photo(np.zeros((64, 64, 3), np.uint8))
    except maquette.MaquetteError as error:
        print(error)
"""


@pytest.fixture(scope="module", autouse=True)
def strace():
    if not PROGRAM.exists():
        pytest.skip(f"{PROGRAM} is not built")
    if shutil.which("strace") is None:
        pytest.skip("strace is not installed: scripts/install-packages.sh test")
    tried = subprocess.run([*TRACE, "true"], capture_output=True, text=True, check=False)
    if tried.returncode != 0:
        pytest.skip(f"strace cannot trace here: {tried.stderr.strip()}")


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """With a capture of one depth image in `depth`."""
    made = tmp_path_factory.mktemp("no_network")
    (made / "depth").mkdir()
    depth = cv2.imread(str(MEDIA / "box_depth.png"), cv2.IMREAD_UNCHANGED)
    cv2.imwrite(str(made / "depth/depth.png"), depth[::2, ::2])
    cv2.imwrite(str(made / "depth/photo.png"), np.zeros((240, 320, 3), np.uint8))
    frame = {"file_path": "photo.png", "depth_file_path": "depth.png", "transform_matrix": np.eye(4).tolist()}
    camera = {"w": 320, "h": 240, "fl_x": 300, "fl_y": 300, "cx": 160, "cy": 120}
    (made / "depth/transforms.json").write_text(json.dumps(camera | {"frames": [frame]}))
    return made


def network_calls(words: list[str], folder: Path) -> tuple[list[str], list[str], subprocess.CompletedProcess]:
    """Calls that leave the machine, calls that stay on it, and how the program ended."""
    log = folder / "network.strace"
    environment = {key: value for key, value in os.environ.items() if not key.startswith("MAQ_")}
    environment["PYTHONPATH"] = str(ROOT / "python")
    done = subprocess.run(
        [*TRACE, "-o", log, *words],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    lines = log.read_text().splitlines()
    return [s for s in lines if LEAVES.search(s)], [s for s in lines if LOCAL.search(s)], done


def subcommands(*path: str) -> list[str]:
    """Every command, with those inside it, as `--help` lists them."""
    told = subprocess.run([PROGRAM, *path, "--help"], capture_output=True, text=True, check=True).stdout
    listed = re.search(r"^Subcommands:\n((?: .*\n|\n)*)", told, re.MULTILINE)
    names = re.findall(r"^  (\w[\w-]*)", listed[1], re.MULTILINE) if listed else []
    return [full for name in names for full in (" ".join((*path, name)), *subcommands(*path, name))]


def test_every_command_has_a_test():
    assert set(subcommands()) - GROUPS == set(COMMANDS)


def test_a_call_that_leaves_the_machine_is_found(tmp_path):
    connects = "import socket; socket.socket(socket.AF_INET, socket.SOCK_DGRAM).connect(('192.0.2.1', 9))"
    leaving, _, _ = network_calls([sys.executable, "-c", connects], tmp_path)
    assert len(leaving) == 1


@pytest.mark.parametrize("command", COMMANDS)
def test_no_command_leaves_the_machine(command, folder):
    words = [word.replace("{}", str(folder)) for word in COMMANDS[command]]
    leaving, local, done = network_calls([str(PROGRAM), *command.split(), *words], folder)
    assert done.returncode == 0 or (done.returncode == 1 and command in MAY_END_WITH_1), done.stderr
    print(f"maquette {command}: {len(leaving)} calls leave the machine, {len(local)} are local", *local, sep="\n  ")
    assert leaving == []


def test_the_python_package_does_not_leave_the_machine(folder):
    leaving, local, done = network_calls([sys.executable, "-c", SESSION], folder)
    assert done.returncode == 0, done.stderr
    print(f"python: {len(leaving)} calls leave the machine, {len(local)} are local", *local, sep="\n  ")
    assert leaving == []


def test_finding_cameras_does_not_leave_the_machine(folder):
    pytest.importorskip("pycolmap", reason="pycolmap is not installed: maquette[scenes]")
    (folder / "photos").mkdir()
    for k in range(10, 15):
        photo = cv2.imread(str(MEDIA / f"room/images/{k:03d}.jpg"), cv2.IMREAD_REDUCED_COLOR_2)
        cv2.imwrite(str(folder / f"photos/{k}.jpg"), photo)
    words = [sys.executable, "-m", "maquette", "scene", "make", "photos", "--out", "photos.maqs"]
    leaving, local, done = network_calls(words, folder)
    assert done.returncode == 0, done.stderr
    print(f"scene make: {len(leaving)} calls leave the machine, {len(local)} are local", *local, sep="\n  ")
    assert leaving == []
