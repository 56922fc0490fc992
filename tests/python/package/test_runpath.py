"""Programs and libraries search only absolute folders and folders beside themselves for other libraries, and no
installed file knows where it was built."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
BUILD = ROOT / "build/release"


@pytest.fixture(scope="module")
def installed(tmp_path_factory) -> Path:
    prefix = tmp_path_factory.mktemp("prefix")
    subprocess.run(["cmake", "--install", BUILD, "--prefix", prefix], check=True, capture_output=True)
    return prefix


@pytest.fixture(params=["staged", "installed"])
def folder(request) -> Path:
    return BUILD / "stage" if request.param == "staged" else request.getfixturevalue("installed")


def elf_files(folder: Path) -> list[Path]:
    files = [path for part in ("bin", "lib") for path in sorted((folder / part).rglob("*"))]
    return [
        path for path in files if path.is_file() and not path.is_symlink() and path.open("rb").read(4) == b"\x7fELF"
    ]


def searched(file: Path) -> list[str]:
    """The entries of RPATH and RUNPATH."""
    said = subprocess.run(["readelf", "--dynamic", file], check=True, capture_output=True, text=True).stdout
    paths = re.findall(r"\((?:RPATH|RUNPATH)\).*\[(.*)\]", said)
    return [entry for path in paths for entry in path.split(":")]


@pytest.mark.skipif(shutil.which("readelf") is None, reason="readelf is missing (binutils)")
def test_no_library_is_taken_from_the_current_folder(folder):
    files = elf_files(folder)
    names = {file.name for file in files}
    assert "maquette" in names
    assert any(name.startswith("libmaquette.so") for name in names)
    wrong = [
        f"{file.relative_to(folder)}: '{entry}'"
        for file in files
        for entry in searched(file)
        if not entry.startswith(("$ORIGIN", "/"))
    ]
    assert not wrong, wrong
    assert any(searched(file) for file in files)


def test_no_installed_file_has_the_path_of_the_build(installed):
    """Otherwise builds in two folders differ; `make test-reproducible` compares two whole builds."""
    files = [path for path in installed.rglob("*") if path.is_file()]
    assert len(files) > 50
    assert [path for path in files if bytes(ROOT) in path.read_bytes()] == []
