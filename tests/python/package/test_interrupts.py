"""Ctrl-C ends every wait, processes of fork() have the library, and exceptions travel between processes."""

import copy
import multiprocessing
import pickle
import signal
import subprocess
import sys
import time
from pathlib import Path

import maquette
import pytest

ROOT = Path(__file__).parents[3]
SILENT = "stub:pattern?size=64x48&live=1&stall=600s@0.2s"  # a camera that stalls after some frames
PROGRAM = ROOT / "build/release/stage/bin/maquette"
WAITS = f"""
import maquette
def waits():
    yield "source", maquette.Source({SILENT!r})
    yield "concealer", maquette.Concealer(maquette.Source({SILENT!r}))
    yield "pipeline", maquette.Pipeline({SILENT!r})
for name, stream in waits():
    try:
        for _ in stream:
            print(name, flush=True)
    except KeyboardInterrupt:
        print(name, "interrupted", flush=True)
"""


def test_ctrl_c_ends_a_wait_for_a_silent_camera():
    child = subprocess.Popen(
        [sys.executable, "-c", WAITS], stdout=subprocess.PIPE, text=True, env={"PYTHONPATH": str(ROOT / "python")}
    )
    ended, asked = [], set()
    for line in child.stdout:
        name, *rest = line.split()
        if rest:
            ended.append(name)
        elif name not in asked:
            asked.add(name)
            time.sleep(0.6)  # the camera is silent, and nobody looks for Ctrl-C but the wait
            child.send_signal(signal.SIGINT)
    assert ended == ["source", "concealer", "pipeline"]
    assert child.wait(30) == 0


def test_ctrl_c_ends_commands_that_wait_for_a_silent_camera(tmp_path):
    options = {
        "play": [],
        "record": [tmp_path / "a.maqrec"],
        "densepose": ["--out", tmp_path],
        "predict": [],
        "health": [],
    }
    children = {
        name: subprocess.Popen([PROGRAM, name, SILENT, *more], stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        for name, more in options.items()
    }
    time.sleep(2)
    for child in children.values():
        child.send_signal(signal.SIGINT)
    for name, child in children.items():
        text, _ = child.communicate(timeout=30)
        assert child.returncode >= 0, f"{name}: {text}"


def _first_sequence(uri: str) -> int:
    with maquette.Source(uri) as source:
        return source.read().sequence


def _people(_: int) -> int:
    with maquette.DensePose(threads=1) as model:
        return len(model.run(maquette.Source("stub:people?count=1&seed=3&size=320x240").read()).people)


def _fails(uri: str) -> None:
    maquette.Source(uri)


@pytest.mark.filterwarnings("ignore:.*fork")
def test_children_of_fork_make_their_own_objects_and_their_errors_come_back():
    assert _people(0) == 1
    parents = maquette.Source("stub:pattern?size=32x24")
    with multiprocessing.get_context("fork").Pool(2) as pool:
        assert pool.map(_first_sequence, ["stub:pattern?size=32x24"] * 4) == [0] * 4
        assert pool.map(_people, [0]) == [1]
        with pytest.raises(maquette.MaquetteError, match="nowhere") as caught:
            pool.map(_fails, ["nowhere"])
        assert caught.value.status == "MAQ_ERROR_NOT_FOUND"
        with pytest.raises(maquette.MaquetteError, match="in the child"):
            pool.apply(_read_of_parent)
    assert parents.read().sequence == 0


PARENTS = []


def _read_of_parent() -> None:
    PARENTS[0].read()


@pytest.fixture(autouse=True, scope="module")
def _object_of_the_parent():
    PARENTS.append(maquette.Source("stub:pattern?size=32x24"))


def test_errors_and_results_are_pickled_and_objects_say_that_they_are_not():
    error = maquette.MaquetteError("Nothing is there.", "MAQ_ERROR_NOT_FOUND")
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.status) == (str(error), error.status)
    model = maquette.DensePose(threads=1)
    result = model.run(maquette.Source("stub:people?count=1&seed=3&size=320x240").read())
    copied = pickle.loads(pickle.dumps(result))
    assert (copied.part == result.part).all()
    assert copied.people == result.people
    with pytest.raises(maquette.MaquetteError, match="only its arrays"):
        copied.save("nowhere")
    boxes = maquette.Source("stub:solids?scene=box&noise=none&size=320x240&seed=1")
    edges = maquette.Edges(threads=1).run(boxes.read(), curves=True)
    assert repr(pickle.loads(pickle.dumps(edges)).curves.boxes) == repr(edges.curves.boxes)
    with pytest.raises(TypeError, match="cannot be pickled or copied"):
        copy.deepcopy(model)
