"""Results of the stages of a long job, in a folder: a job that was stopped goes on where it was."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path
from typing import Any

from maquette.native import MaquetteError

_FILE = "stages.json"


def write_atomically(path: Path, text: str) -> None:
    """Writes a file that appears complete or not at all. Raises OSError."""
    partial = path.with_name(f".{path.name}.partial")
    try:
        with open(partial, "w", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)


class WorkFolder:
    """key: what the results depend on; results of another key are deleted. Raises MaquetteError for a folder with other
    files, or one that another process uses."""

    def __init__(self, path: Path, key: dict[str, Any]) -> None:
        self.path = path
        stages = path / _FILE
        if path.exists() and not path.is_dir():
            raise MaquetteError(f"{path} is a file; the work folder has this name. Move it.", "MAQ_ERROR_UNWRITABLE")
        if path.is_dir() and any(path.iterdir()) and not stages.exists():
            problem = f"{path} is not a work folder of maquette scene make. Move it, or choose another --out."
            raise MaquetteError(problem, "MAQ_ERROR_INVALID_ARGUMENT")
        path.mkdir(parents=True, exist_ok=True)
        self._lock = _locked(path)
        known: dict[str, Any] = {}
        if stages.exists():
            try:
                known = json.loads(stages.read_text("utf-8"))
            except ValueError:
                known = {}
        if known.get("key") != key:
            self._empty()
            known = {"key": key, "stages": {}}
        self._known = known
        self._save()

    def result(self, stage: str) -> dict[str, Any] | None:
        """Returns the result that `finish` was given; None if the stage has not ended."""
        return self._known["stages"].get(stage)

    def finish(self, stage: str, result: dict[str, Any]) -> None:
        """Keeps a result. All files of the stage are written before. Raises OSError."""
        self._known["stages"][stage] = result
        self._save()

    def fresh_folder(self, name: str) -> Path:
        """An empty folder."""
        folder = self.path / name
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        return folder

    def close(self) -> None:
        self._lock.close()

    def _empty(self) -> None:
        for entry in self.path.iterdir():
            if entry.name == _LOCK:
                continue
            if entry.is_dir() and not entry.is_symlink():
                shutil.rmtree(entry)
            else:
                entry.unlink()

    def _save(self) -> None:
        write_atomically(self.path / _FILE, json.dumps(self._known, indent=1) + "\n")


_LOCK = ".lock"


def _locked(path: Path) -> Any:
    file = open(path / _LOCK, "w")  # noqa: SIM115  open as long as the folder is used
    try:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except ImportError:  # Windows
        pass
    except OSError:
        file.close()
        problem = f"{path} is in use by another process. Wait for its end, or choose another --out."
        raise MaquetteError(problem, "MAQ_ERROR_BUSY") from None
    return file
