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
for word; do
    [ "$word" != -- ] || break
    source=$word
done
echo "$source" >>"$FAKE_LOG"
! grep -n BAD "$source"
"""


@pytest.fixture
def project(tmp_path):
    """A folder with a.cpp, which includes a.h, and b.cpp; called, it gives (exit status, output, sources checked)
    in its `folder`, which can be changed."""
    if shutil.which("c++") is None:
        pytest.skip("no C++ compiler")
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin/clang-tidy").write_text(FAKE)
    (tmp_path / "bin/clang-tidy").chmod(0o755)
    (tmp_path / "a.h").write_text("int a();\n")
    (tmp_path / "a.cpp").write_text('#include "a.h"\n')
    (tmp_path / "b.cpp").write_text("int b();\n")
    compiler = "cmake -E env CCACHE_NOHASHDIR=1 /usr/bin/ccache c++"
    commands = [
        {"directory": str(tmp_path), "file": name, "command": f"{compiler} -o {name}.o -c {name}"}
        for name in (str(tmp_path / "a.cpp"), str(tmp_path / "b.cpp"))
    ]
    (tmp_path / "compile_commands.json").write_text(json.dumps(commands))
    log = tmp_path / "log"
    environment = os.environ | {
        "PATH": f"{tmp_path / 'bin'}:{os.environ['PATH']}",
        "FAKE_LOG": str(log),
        "XDG_CACHE_HOME": str(tmp_path / "cache"),
    }

    def run(*names):
        log.write_text("")
        folder = run.folder
        command = [sys.executable, SCRIPT, "--build", folder, *(folder / name for name in names)]
        ran = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=folder)
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


def test_files_that_are_compiled_as_one_are_checked_as_one(project):
    unity = project.folder / "Unity/unity_0_cxx.cxx"
    unity.parent.mkdir()
    unity.write_text(f'#include "{project.folder}/a.cpp"\n\n#include "{project.folder}/b.cpp"\n')
    commands = json.loads((project.folder / "compile_commands.json").read_text())
    commands.append({"directory": str(project.folder), "file": str(unity), "command": f"c++ -o u.o -c {unity}"})
    (project.folder / "compile_commands.json").write_text(json.dumps(commands))
    unified = (
        "UnifiedSource-unity_0_cxx.cpp"  # a name by which clang's analyzer knows that what is included is the source
    )
    assert project("a.cpp", "b.cpp") == (0, "", [unified])
    assert project("a.cpp", "b.cpp") == (0, "", [])
    for changed in ("a.h", "b.cpp"):
        (project.folder / changed).write_text(f"int {changed[0]}(float);\n")
        assert project("a.cpp", "b.cpp") == (0, "", [unified])


@pytest.mark.skipif(shutil.which("clang-tidy") is None, reason="no clang-tidy (make packages-lint)")
def test_the_analyzer_follows_functions_of_files_that_are_compiled_as_one(tmp_path):
    unity = tmp_path / "Unity/unity_0_cxx.cxx"
    unity.parent.mkdir()
    unity.write_text(f'#include "{tmp_path}/a.cpp"\n')
    (tmp_path / "a.cpp").write_text("int a(int n) {\n  int* p = nullptr;\n  return n > 3 ? *p : 0;\n}\n")
    (tmp_path / ".clang-tidy").write_text(
        "Checks: '-*,clang-analyzer-*,bugprone-suspicious-include'\nHeaderFilterRegex: a.cpp\n"
    )
    commands = [{"directory": str(tmp_path), "file": str(unity), "command": f"c++ -o u.o -c {unity}"}]
    (tmp_path / "compile_commands.json").write_text(json.dumps(commands))
    ran = subprocess.run(
        [sys.executable, SCRIPT, "--build", tmp_path, tmp_path / "a.cpp"], capture_output=True, text=True,
        env=os.environ | {"XDG_CACHE_HOME": str(tmp_path / "cache")}, cwd=tmp_path,
    )  # fmt: skip
    assert ran.returncode == 1
    assert "a.cpp:3:18: error: Dereference of null pointer" in ran.stdout
    assert "#include of file with '.cpp' extension" not in ran.stdout


def test_a_clean_file_is_known_in_another_checkout(project, tmp_path_factory):
    project("a.cpp")
    other = tmp_path_factory.mktemp("other")
    for name in ("a.cpp", "a.h"):
        (other / name).write_text((project.folder / name).read_text())
    commands = (project.folder / "compile_commands.json").read_text().replace(str(project.folder), str(other))
    (other / "compile_commands.json").write_text(commands)
    project.folder = other
    assert project("a.cpp") == (0, "", [])
    (other / "a.h").write_text("int a(int);\n")
    assert project("a.cpp") == (0, "", ["a.cpp"])


def test_what_it_says_fails_the_run_until_it_is_repaired(project):
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
