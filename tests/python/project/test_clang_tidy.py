"""clang-tidy runs again where something changed, and only there; what it says fails the run."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path("scripts/clang_tidy.py").resolve()
# Stands in for clang-tidy: notes each source that it is given, and complains about those with "BAD" in them.
FAKE = """#!/bin/sh
[ "$1" = --version ] && echo fake && exit
for last; do :; done
echo "$last" >>"$FAKE_LOG"
! grep -n BAD "$last"
"""


@pytest.fixture
def project(tmp_path):
    """A folder with a.cpp, which includes a.h, and b.cpp; called, it gives (exit status, output, sources checked)."""
    if shutil.which("c++") is None:
        pytest.skip("no C++ compiler")
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin/clang-tidy").write_text(FAKE)
    (tmp_path / "bin/clang-tidy").chmod(0o755)
    (tmp_path / "a.h").write_text("int a();\n")
    (tmp_path / "a.cpp").write_text('#include "a.h"\n')
    (tmp_path / "b.cpp").write_text("int b();\n")
    commands = [{"directory": str(tmp_path), "file": name, "command": f"ccache c++ -o {name}.o -c {name}"}
                for name in (str(tmp_path / "a.cpp"), str(tmp_path / "b.cpp"))]  # fmt: skip
    (tmp_path / "compile_commands.json").write_text(json.dumps(commands))
    log = tmp_path / "log"
    environment = os.environ | {"PATH": f"{tmp_path / 'bin'}:{os.environ['PATH']}", "FAKE_LOG": str(log)}

    def run(*names):
        log.write_text("")
        command = [sys.executable, SCRIPT, "--build", tmp_path, *(tmp_path / name for name in names)]
        ran = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=tmp_path)
        return ran.returncode, ran.stdout + ran.stderr, sorted(Path(line).name for line in log.read_text().splitlines())

    run.folder = tmp_path
    return run


def test_a_clean_file_is_checked_once_and_again_when_a_header_or_the_settings_change(project):
    assert project("a.cpp", "b.cpp") == (0, "", ["a.cpp", "b.cpp"])
    assert project("a.cpp", "b.cpp") == (0, "", [])
    (project.folder / "a.h").write_text("int a(int);\n")
    assert project("a.cpp", "b.cpp") == (0, "", ["a.cpp"])
    (project.folder / ".clang-tidy").write_text("Checks: '*'\n")
    assert project("a.cpp", "b.cpp") == (0, "", ["a.cpp", "b.cpp"])


def test_what_it_says_fails_the_run_until_it_is_mended(project):
    (project.folder / "b.cpp").write_text("int b();  // BAD\n")
    for _ in range(2):
        status, said, checked = project("b.cpp")
        assert (status, checked) == (1, ["b.cpp"])
        assert "BAD" in said
    (project.folder / "b.cpp").write_text("int b();\n")
    assert project("b.cpp")[0] == 0


def test_a_file_that_the_build_does_not_compile_is_named(project):
    (project.folder / "c.cpp").write_text("")
    status, said, checked = project("c.cpp")
    assert (status, checked) == (0, [])
    assert "c.cpp" in said
