"""Each library whose code becomes part of the installed files has its licence text among them."""

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
BUILD = ROOT / "build/release"

# Headers by their beginning, and the licence texts of the code that they bring into our files.
HEADER_LIBRARIES = {"nlohmann/": "nlohmann-json.txt", "xxhash.h": "xxhash.txt", "CLI/": "cli11.txt"}
# Libraries that our files link, or open, and that come with licence texts of their own.
LINKED = ("onnxruntime", "png.h", "webp/", "vpx/", "turbojpeg.h", "libcamera/", "depthai/", "camera/Ndk", "media/Ndk")
SYSTEM = re.compile(r"[a-z_0-9]+(\.h)?|(sys|linux|arpa|asm|android|maquette|app)/.*")


def foreign_headers() -> set[str]:
    files = [path for root in ("sdk/src", "sdk/tools") for path in (ROOT / root).rglob("*")]
    text = "\n".join(path.read_text() for path in files if path.suffix in (".h", ".cpp"))
    found = set(re.findall(r"^\s*#\s*include <([^>]+)>", text, re.MULTILINE))
    known = (*HEADER_LIBRARIES, *LINKED)
    return {name for name in found if name.startswith(known) or not SYSTEM.fullmatch(name)}


def test_each_foreign_header_is_of_a_library_with_a_licence_text():
    headers = foreign_headers()
    assert {"nlohmann/json.hpp", "xxhash.h", "CLI/CLI.hpp"} <= headers
    unknown = sorted(name for name in headers if not name.startswith((*HEADER_LIBRARIES, *LINKED)))
    assert not unknown, f"Add the licence of {unknown} to sdk/licenses, install it, and list it here."


def test_licence_texts_are_installed(tmp_path):
    if not (BUILD / "cmake_install.cmake").exists():
        pytest.skip("there is no release build")
    install = ["cmake", "--install", BUILD, "--prefix", tmp_path, "--component", "runtime"]
    subprocess.run(install, check=True, capture_output=True)
    folder = tmp_path / "share/maquette/licenses"
    for name in ("LICENSE", "onnxruntime/LICENSE.txt", *HEADER_LIBRARIES.values()):
        text = (folder / name).read_text()
        assert "Copyright" in text, name
        assert len(text) > 1000, name
