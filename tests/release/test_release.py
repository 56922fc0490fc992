"""A release in build/dist as its user checks it: signature, checksums, content of each package (SBOM), first run.

    make test-release

MAQ_MINISIGN_PUBLIC_KEY: the public key of the release; default: the test key. MAQ_RELEASE: the folder.
"""

import base64
import csv
import hashlib
import io
import json
import os
import platform
import re
import shutil
import subprocess
import zipfile
from pathlib import Path

import pytest
from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator

ROOT = Path(__file__).parents[2]
DIST = Path(os.environ.get("MAQ_RELEASE", ROOT / "build/dist"))
KEY = Path(os.environ.get("MAQ_MINISIGN_PUBLIC_KEY", Path(__file__).with_name("TEST-ONLY.pub")))
VERSION = re.search(r"project\(maquette VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text())[1]
MACHINE = platform.machine()
SYSTEMS = ("densepose", "scenes", "edges", "heads", "prediction", "body")
KINDS = {
    f"maquette-{VERSION}-py3-none-manylinux_2_28_{MACHINE}.whl",
    f"maquette-{VERSION}-linux-{MACHINE}.tar.gz",
    *(f"maquette-models-{system}-{VERSION}.tar.gz" for system in SYSTEMS),
    *(f"{name}_{VERSION}_*.deb" for name in (f"libmaquette{VERSION.rsplit('.', 1)[0]}", "libmaquette-dev", "maquette")),
    *(f"maquette_models_{system}-{VERSION}-py3-none-any.whl" for system in SYSTEMS),
    f"maquette-models_{VERSION}_all.deb",
    f"maven/dev/maquette/maquette/{VERSION}/maquette-{VERSION}.aar",
    f"maven/dev/maquette/maquette/{VERSION}/maquette-{VERSION}.pom",
    f"maven/dev/maquette/maquette/{VERSION}/maquette-{VERSION}-sources.jar",
}
PACKAGES = sorted(path for path in DIST.rglob("*") if path.name.endswith((".whl", ".tar.gz", ".deb", ".aar")))


def verify(folder: Path) -> int:
    command = ["minisign", "-V", "-q", "-p", KEY, "-m", folder / "SHA256SUMS"]
    return subprocess.run(command, capture_output=True).returncode


def unpack(package: Path, folder: Path) -> Path:
    """The folder to which the package's SBOM refers."""
    if package.suffix == ".deb":
        subprocess.run(["dpkg-deb", "-x", package, folder], check=True)
    elif package.suffix == ".gz":
        subprocess.run(["tar", "xf", package, "-C", folder], check=True)
        (folder,) = folder.iterdir()
    else:
        with zipfile.ZipFile(package) as archive:
            archive.extractall(folder)
    return folder


@pytest.fixture(scope="module", params=PACKAGES, ids=lambda path: path.name)
def unpacked(request, tmp_path_factory) -> Path:
    return unpack(request.param, tmp_path_factory.mktemp("package"))


def test_every_kind_of_package_is_there_once():
    assert {kind: len(list(DIST.glob(kind))) for kind in KINDS} == dict.fromkeys(KINDS, 1)


def test_the_signature_fits_and_no_other_text(tmp_path):
    assert verify(DIST) == 0
    for name in ("SHA256SUMS", "SHA256SUMS.minisig"):
        shutil.copy(DIST / name, tmp_path)
    with (tmp_path / "SHA256SUMS").open("a") as sums:
        sums.write("\n")
    assert verify(tmp_path) != 0


def test_every_file_has_its_checksum():
    listed = {}
    for line in (DIST / "SHA256SUMS").read_text().splitlines():
        digest, name = line.split("  ")
        listed[name] = digest
    files = {path.relative_to(DIST).as_posix(): path for path in DIST.rglob("*") if path.is_file()}
    del files["SHA256SUMS"], files["SHA256SUMS.minisig"]
    assert listed == {name: hashlib.sha256(path.read_bytes()).hexdigest() for name, path in files.items()}


def test_the_sbom_is_valid_and_lists_exactly_the_files(unpacked):
    (file,) = unpacked.rglob("*.cdx.json")
    assert JsonStrictValidator(SchemaVersion.V1_6).validate_str(file.read_text()) is None
    parts = json.loads(file.read_text())["components"]
    listed = {part["name"]: part["hashes"][0]["content"] for part in parts if part["type"] == "file"}
    files = [path for path in unpacked.rglob("*") if path.is_file() and not path.is_symlink()]
    files = [path for path in files if path != file and not path.match("*.dist-info/RECORD")]
    assert listed == {p.relative_to(unpacked).as_posix(): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


def test_the_sbom_names_libraries_and_models(unpacked):
    (file,) = unpacked.rglob("*.cdx.json")
    parts = {part["name"] for part in json.loads(file.read_text())["components"] if part["type"] != "file"}
    names = {path.name for path in unpacked.rglob("*")}
    if any(name.startswith(("libonnxruntime", "libmaquetteort")) for name in names):
        assert "onnxruntime" in parts
    if any(name.startswith("libmaquette.so") for name in names):
        assert {"xxHash", "nlohmann-json"} <= parts
    assert {path.parent.name for path in unpacked.rglob("manifest.json")} <= parts


def test_the_record_of_a_wheel_fits():
    for wheel in DIST.glob("*.whl"):
        with zipfile.ZipFile(wheel) as archive:
            (record,) = (name for name in archive.namelist() if name.endswith(".dist-info/RECORD"))
            rows = {row[0]: row[1] for row in csv.reader(io.StringIO(archive.read(record).decode())) if row}
            assert set(rows) == {name for name in archive.namelist() if not name.endswith("/")}
            for name, listed in rows.items():
                digest = base64.urlsafe_b64encode(hashlib.sha256(archive.read(name)).digest()).rstrip(b"=").decode()
                assert name == record or listed == f"sha256={digest}", name


def test_the_debian_packages_are_clean():
    packages = sorted(DIST.glob("*.deb"))
    done = subprocess.run(
        ["lintian", "--allow-root", "--fail-on", "error,warning", *packages], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture
def tarball(tmp_path) -> Path:
    (packed,) = DIST.glob(f"maquette-{VERSION}-linux-{MACHINE}.tar.gz")
    (tmp_path / "unpacked").mkdir()
    return unpack(packed, tmp_path / "unpacked")


def test_pkg_config_links_a_program_to_the_tarball_by_the_commands_of_the_guide(tarball, tmp_path):
    guide = (ROOT / "docs/guide/link.md").read_text().split("## From the tarball of a release")[1]
    commands = guide.split("```sh\n")[1].split("```")[0].splitlines()
    commands[0] = f"ln -s {tarball} $(basename {commands[0].split()[-1]} .tar.gz)"  # unpacked already
    done = subprocess.run(["sh", "-ec", "\n".join(commands)], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    photo = f"image:{ROOT / 'tests/media/photo.jpg'}"
    done = subprocess.run([tmp_path / "people", photo], env={}, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("person 0.")


def test_cmake_finds_the_tarball_and_builds_its_examples(tarball, tmp_path):
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.25)\nproject(app CXX)\nfind_package(maquette REQUIRED)\n"
        f"add_executable(app {tarball / 'examples/cpp/count_people.cpp'})\n"
        "target_link_libraries(app PRIVATE maquette::maquette)\n"
    )
    for command in (
        ["cmake", "-S", ".", "-B", "build", f"-DCMAKE_PREFIX_PATH={tarball}"],
        ["cmake", "--build", "build"],
    ):
        subprocess.run(command, cwd=tmp_path, check=True)
    source = "stub:pattern?frames=1&size=320x256"
    done = subprocess.run([tmp_path / "build/app", source], env={}, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "0 people\n"), done.stderr
    assert (tarball / "README.md").exists()


def test_the_program_of_the_tarball_finds_people_in_a_photo(tarball, tmp_path):
    photo = ROOT / "tests/media/photo.jpg"
    command = [tarball / "bin/maquette", "densepose", photo, "--out", tmp_path / "results"]
    done = subprocess.run(command, env={"HOME": str(tmp_path)}, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert list((tmp_path / "results").iterdir())
