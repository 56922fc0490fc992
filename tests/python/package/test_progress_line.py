"""The progress of a long call is one line of a terminal, and one line for each stage of a log."""

import io
import os
import pty
import subprocess
import sys
from pathlib import Path

import maquette

ROOT = Path(__file__).parents[3]


class Terminal(io.StringIO):
    def isatty(self):
        return True


def tell(file, monkeypatch, columns):
    monkeypatch.setenv("COLUMNS", str(columns))
    show = maquette.ProgressLine(file)
    for k in range(1000):
        show(k / 1000, "A first shape." if k == 0 else "Fitting shape and colours to the pixels.")
    show(1.0, "Fitting shape and colours to the pixels.")
    show(1.0, "Done.")
    return file.getvalue()


def test_a_terminal_shows_one_line_that_fits_in_its_width(monkeypatch):
    shown = tell(Terminal(), monkeypatch, 30)
    assert shown.count("\n") == 1
    assert shown.endswith("\n")
    lines = shown.removesuffix("\n").split("\r")
    assert 2 <= len(lines) <= 10, "a thousand calls within milliseconds"
    assert max(len(line.removesuffix("\x1b[K")) for line in lines) == 29


def test_a_log_has_one_line_for_each_stage(monkeypatch):
    told = tell(io.StringIO(), monkeypatch, 80)
    assert told.splitlines() == ["A first shape.", "Fitting shape and colours to the pixels.", "Done."]


def test_the_example_of_heads_does_not_flood_a_log(tmp_path):
    command = [
        sys.executable,
        ROOT / "examples/python/photo_to_head.py",
        ROOT / "tests/media/photo.jpg",
        "head.glb",
        "0",
    ]
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "python")}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
    assert 1 <= len(done.stderr.splitlines()) <= 3, done.stderr
    assert (tmp_path / "head.glb").exists()


def test_the_command_line_shows_one_line_of_a_narrow_terminal(tmp_path):
    program = maquette.library_path().parent.parent / "bin/maquette"
    ours, theirs = pty.openpty()
    command = ["stty", "cols", "40"]
    subprocess.run(command, stdin=theirs, check=True)
    command = [program, "head", ROOT / "tests/media/photo.jpg", "--out", "head.glb", "--seconds", "1"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=theirs) as running:
        os.close(theirs)
        shown = b""
        try:
            while part := os.read(ours, 65536):
                shown += part
        except OSError:  # the end of a terminal
            pass
    os.close(ours)
    assert running.returncode == 0, shown
    lines = shown.decode().replace("\r\n", "\n").removesuffix("\n").split("\r")
    assert "\n" not in "".join(lines), shown
    assert len(lines) <= 20, "redrawn some ten times a second"
    assert all(len(line.removesuffix("\x1b[K")) < 40 for line in lines)
    assert "%" in lines[-1]
