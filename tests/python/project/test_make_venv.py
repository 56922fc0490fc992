"""scripts/make-venv.sh leaves a complete environment or none, with a Python and a pip that are stand-ins."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[3] / "scripts/make-venv.sh"

# Answers as the interpreter that PYTHON names, and is copied into each environment as its python.
INTERPRETER = """#!/bin/sh
case "$1 $2" in
"-c import pip") test -e "$(dirname "$0")/../pip" ;;
"-c "*) exit 0 ;;
"-m venv")
    mkdir -p "$3/bin" && cp "$0" "$3/bin/python" && echo "#!$PWD/.venv.new/bin/python" >"$3/bin/tool"
    test -n "$NO_ENSUREPIP" && { echo "ensurepip is not available"; exit 1; }
    touch "$3/pip" ;;
"-m pip")
    test -z "$PIP_SAYS" || { echo "$PIP_SAYS" >&2; exit 1; }
    case "$*" in *" uv=="*) exit 0 ;; esac
    echo "$*" >>installed.txt ;;
"-m uv")
    test -z "$UV_SAYS" || { echo "$UV_SAYS" >&2; exit 1; }
    echo "$*" >>installed.txt ;;
esac
"""


@pytest.fixture
def project(tmp_path):
    (tmp_path / "scripts").mkdir()
    shutil.copy(SCRIPT, tmp_path / "scripts")
    (tmp_path / "pyproject.toml").write_text("")
    (tmp_path / "interpreter").write_text(INTERPRETER)
    (tmp_path / "interpreter").chmod(0o755)
    return tmp_path


def make_venv(project, *extras, **environment):
    return subprocess.run(
        [project / "scripts/make-venv.sh", *extras],
        env=os.environ | {"PYTHON": str(project / "interpreter")} | environment,
        capture_output=True, text=True,
    )  # fmt: skip


def test_packages_are_installed_once_until_the_list_changes(project):
    assert make_venv(project, "dev").returncode == 0
    assert make_venv(project, "dev").returncode == 0
    installed = project / "installed.txt"
    assert len(installed.read_text().splitlines()) == 1
    assert installed.read_text().startswith("-m uv pip install")
    assert "-e .[dev]" in installed.read_text()
    os.utime(project / "pyproject.toml", (2**32, 2**32))
    make_venv(project, "dev")
    assert len(installed.read_text().splitlines()) == 2


def test_pip_installs_what_uv_cannot(project):
    done = make_venv(project, "dev", UV_SAYS="no such index")
    assert done.returncode == 0
    assert done.stderr == ""
    assert (project / "installed.txt").read_text().startswith("-m pip install")


def test_programs_of_the_environment_name_its_place(project):
    make_venv(project)
    assert (project / ".venv/bin/tool").read_text() == f"#!{project}/.venv/bin/python\n"


def test_a_python_that_cannot_create_environments_leaves_nothing_and_names_the_package(project):
    done = make_venv(project, NO_ENSUREPIP="1")
    assert done.returncode == 1
    assert "python3-venv" in done.stderr
    assert not list(project.glob(".venv*"))


def test_an_environment_without_pip_is_made_again(project):
    (project / ".venv/bin").mkdir(parents=True)
    (project / ".venv/bin/python").symlink_to(project / "interpreter")
    (project / ".venv/.ready-light").touch()
    assert make_venv(project).returncode == 0
    assert (project / ".venv/pip").exists()
    assert (project / "installed.txt").exists()


def test_a_missing_network_has_an_exit_status_of_its_own(project):
    assert make_venv(project, PIP_SAYS="NewConnectionError: name resolution failed").returncode == 69
    assert make_venv(project, PIP_SAYS="No matching distribution found").returncode == 1
    assert not list(project.glob(".venv/.ready*"))
