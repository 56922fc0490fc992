"""The wheel as a user installs it: in a folder of its own, without the checkout."""

import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
LIBRARY = ROOT / "build/release/stage/lib/libmaquette.so"

pytestmark = pytest.mark.skipif(not LIBRARY.exists(), reason=f"{LIBRARY} is not built: run `make build`")

SCRIPT = """
import sys
import maquette
import maquette.native
import maquette.adapters.detectron2
result = maquette.DensePose(threads=1).run(maquette.Source("stub:people?count=1&size=320x240").read())
source = maquette.Source("stub:solids?scene=box&size=320x240")
edges = maquette.Edges(threads=1).run(source.read(), curves=True)
heads = maquette.HeadBuilder(threads=1).stats["threads"]
print(maquette.library_path(), len(result.people), len(edges.curves.curves) > 0, heads)
print("maquette._generated" in sys.modules)
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    installed = folder / "installed"
    subprocess.run(
        ["cmake", "--install", ROOT / "build/release", "--prefix", installed], check=True, capture_output=True
    )
    shutil.copytree(ROOT / "python", folder / "source", ignore=shutil.ignore_patterns("__pycache__"))
    command = [sys.executable, "-m", "pip", "wheel", "-q", "--disable-pip-version-check", "--no-deps",
               "--no-build-isolation", "--wheel-dir", folder, folder / "source"]  # fmt: skip
    subprocess.run(command, check=True, env={**os.environ, "MAQ_INSTALLED": str(installed)})
    (built,) = folder.glob("*.whl")
    command = [sys.executable, ROOT / "scripts/wheel/model_wheels.py", installed / "share/maquette", folder]
    subprocess.run(command, check=True)
    return built


def test_the_wheel_runs_without_the_checkout(wheel, tmp_path):
    for part in wheel.parent.glob("*.whl"):
        with zipfile.ZipFile(part) as archive:
            archive.extractall(tmp_path)
    environment = {k: v for k, v in os.environ.items() if not k.startswith("MAQ_")} | {"PYTHONPATH": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-P", "-c", SCRIPT], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )

    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == [str(tmp_path / "maquette/lib/libmaquette.so.0.3"), "1", "True", "1", "True"]


def test_the_wheel_says_what_it_is_and_holds_licences(wheel):
    assert re.fullmatch(r"maquette-0\.3\.0-py3-none-manylinux_\d+_\d+_\w+\.whl", wheel.name)
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        metadata = archive.read("maquette-0.3.0.dist-info/METADATA").decode()
    assert "Requires-Dist: cffi" in metadata
    assert "maquette.DensePose" in metadata  # the README
    for name in ("py.typed", "share/maquette/licenses/LICENSE", "bin/maquette",
                 "share/maquette/licenses/onnxruntime/LICENSE.txt",
                 ):  # fmt: skip
        assert f"maquette/{name}" in names
    assert not [name for name in names if "demo" in name or name.startswith("build")]
    assert not [name for name in names if "/models/" in name]
    models = {path.name.split("-")[0]: path for path in wheel.parent.glob("maquette_models_*")}
    assert len(models) == 6
    # Library, command line, ONNX Runtime (8.4 MB) and the networks of dense pose (2 MB).
    assert wheel.stat().st_size + models["maquette_models_densepose"].stat().st_size < 14e6


def test_the_wheel_is_not_built_without_the_library(tmp_path):
    shutil.copytree(ROOT / "python", tmp_path / "source")
    command = [sys.executable, "setup.py", "build_py"]
    environment = {k: v for k, v in os.environ.items() if k != "MAQ_INSTALLED"}
    done = subprocess.run(
        command, cwd=tmp_path / "source", env=environment, capture_output=True, text=True, check=False
    )

    assert done.returncode != 0
    assert "make wheel" in done.stderr
