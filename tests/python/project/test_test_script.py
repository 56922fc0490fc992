"""scripts/test.sh stops when its tools cannot be made, and runs failed tests once more; its tools are stand-ins."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPTS = Path(__file__).parents[3] / "scripts"

# Writes the report of one test, which fails in the first run and has the outcome RETRY in the second.
CTEST = """#!/bin/sh
outcome=fail
while [ $# -gt 0 ]; do
    case "$1" in --rerun-failed) outcome=${RETRY:-run} ;; --output-junit) report=$2 ;; esac
    shift
done
echo "<testsuite><testcase name='native.one' status='$outcome'/></testsuite>" >"$report"
[ $outcome = run ]
"""


@pytest.fixture
def project(tmp_path):
    """A project whose environment and build are complete, and whose one native test fails at first."""

    def write(name, text):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        path.chmod(0o755)

    for name in ("test.sh", "sum_test_results.py"):
        (tmp_path / "scripts").mkdir(exist_ok=True)
        shutil.copy(SCRIPTS / name, tmp_path / "scripts")
    write("scripts/make-venv.sh", "#!/bin/sh\n")
    write("scripts/build.sh", "#!/bin/sh\n")
    write("bin/ctest", CTEST)
    write(".venv/bin/python", f'#!/bin/sh\n[ "$1" = -m ] || exec {sys.executable} "$@"\n')
    return tmp_path, write


def run(folder, *groups, **environment):
    path = f"{folder}/bin:{os.environ['PATH']}"
    return subprocess.run(
        [folder / "scripts/test.sh", *groups], env=os.environ | {"PATH": path} | environment,
        capture_output=True, text=True, timeout=60,
    )  # fmt: skip


@pytest.mark.parametrize("broken", ["make-venv.sh", "build.sh"])
def test_the_first_tool_that_cannot_be_made_ends_the_run_and_the_other(project, broken):
    folder, write = project
    other = {"make-venv.sh": "build.sh", "build.sh": "make-venv.sh"}[broken]
    write(f"scripts/{broken}", "#!/bin/sh\necho it is broken >&2; exit 1\n")
    write(f"scripts/{other}", "#!/bin/sh\nsleep 1000\n")
    done = run(folder, "release")
    assert done.returncode == 1
    assert "it is broken" in done.stderr
    assert "The tests cannot run" in done.stderr


def test_a_test_that_passes_when_it_runs_alone_is_named_as_flaky_and_the_run_passes(project):
    folder, _ = project
    done = run(folder, "release")
    assert done.returncode == 0, done.stdout + done.stderr
    last = done.stdout.splitlines()[-2:]
    assert last[0].startswith("flaky: ctest-release.xml: native.one failed")
    assert last[1] == "1 passed, 0 failed"


def test_a_test_that_fails_again_fails_the_run(project):
    folder, _ = project
    done = run(folder, "release", RETRY="fail")
    assert done.returncode == 1
    assert done.stdout.splitlines()[-1] == "0 passed, 1 failed"


def test_an_unknown_group_teaches(project):
    folder, _ = project
    done = run(folder, "nothing")
    assert done.returncode == 2
    assert "camera-vm" in done.stderr
