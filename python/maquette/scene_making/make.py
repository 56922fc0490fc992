"""make_scene: from a film or photos to a scene, in stages that are kept."""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from maquette.native import MaquetteError
from maquette.scene_making.cameras import pose, require_pycolmap
from maquette.scene_making.capture import CLOUD, write_capture, write_cloud
from maquette.scene_making.depth import dense_cloud
from maquette.scene_making.film import ENDINGS, is_film, prepare_film
from maquette.scene_making.photos import LeftOut, Prepared, photo_files, prepare_photos
from maquette.scene_making.preview import Compared, write_preview
from maquette.scene_making.report import SceneReport
from maquette.scene_making.work_folder import WorkFolder
from maquette.scenes import Capture, Scene

Progress = Callable[[float, str], "bool | None"]

MAX_PHOTOS = 50
SPLATS = (".spz", ".ply")  # a .glb file could not be read for the preview
SPLAT_FIT_S = 60
_VERSION = 1  # of the results in work folders
_MIN_FREE_BYTES = 400_000_000
_FULL_BYTES = 1_000_000
# Share of each stage in the time, for the progress.
_STAGES = {"photos": 0.1, "cameras": 0.3, "depth": 0.45, "scene": 0.1, "preview": 0.05}
_SPARSE = "sparse.npy"
_UNNEEDED = ("photos", "database.db", "database.db-shm", "database.db-wal", "pairs.txt", _SPARSE)


def make_scene(
    source: str | os.PathLike[str],
    out: str | os.PathLike[str],
    progress: Progress | None = None,
    max_photos: int = MAX_PHOTOS,
    threads: int = 0,
) -> SceneReport:
    """Makes a scene of a film or a folder of photos, and writes it to `out`, with a preview and a report beside it:
    NAME-preview.jpg, NAME-report.json and NAME-report.txt. `out` is a scene file (.maqs), or splats for other programs
    (.spz, .ply), which are fitted to the photos for a minute.

    Frames of a film are chosen by sharpness and motion. Cameras are found by COLMAP (pip install 'maquette[scenes]').
    The unit of the scene is unknown, as photos alone do not tell metres. NAME-work keeps the result of each stage: the
    same call goes on there after Ctrl-C, a crash or a full disk. At the end it keeps the capture, for `Scene.build` and
    `maquette scene render --capture`.

    progress: called with the fraction done and the stage, a sentence; returns False to cancel. max_photos: photos or
    frames that are used; more take more time. threads: 0: all cores.

    Raises MaquetteError with a sentence that says what to film instead, or what to install; OSError if a file cannot be
    written.
    """
    source, out = Path(source), Path(out)
    if max_photos < 3:
        raise ValueError(f"max_photos is {max_photos}; a scene needs at least 3")
    job = _Job(source, out, progress, max_photos, threads or os.cpu_count() or 1)
    try:
        return job.run()
    except MaquetteError:
        raise
    except RuntimeError as error:  # of pycolmap
        if shutil.disk_usage(out.parent).free < _FULL_BYTES:
            raise MaquetteError(job.disk_is_full(), "MAQ_ERROR_UNWRITABLE") from None
        problem = f"COLMAP ended with an error: {error}. Run the same again, or delete {job.work_path} before."
        raise MaquetteError(problem, "MAQ_ERROR_INTERNAL") from error
    except OSError as error:
        if error.errno not in (errno.ENOSPC, errno.EDQUOT):
            raise
        raise MaquetteError(job.disk_is_full(), "MAQ_ERROR_UNWRITABLE") from None


class _Job:
    def __init__(self, source: Path, out: Path, progress: Progress | None, max_photos: int, threads: int) -> None:
        self.source, self.out, self.max_photos, self.threads = source, out, max_photos, threads
        self._progress, self._start, self._share = progress, 0.0, 0.0
        self.work_path = out.with_name(f"{out.stem}-work")
        self.seconds: dict[str, float] = {}

    def run(self) -> SceneReport:
        key = self._check_input()
        require_pycolmap()
        self.out.parent.mkdir(parents=True, exist_ok=True)
        if shutil.disk_usage(self.out.parent).free < _MIN_FREE_BYTES:
            raise MaquetteError(self.disk_is_full(), "MAQ_ERROR_UNWRITABLE")
        with contextlib.closing(WorkFolder(self.work_path, key)) as work:
            self.work = work
            prepared = Prepared.of_json(self._stage("photos", self._photos))
            cameras = self._stage("cameras", lambda: self._cameras(prepared))
            cloud = self._stage("depth", self._depth)
            built = self._stage("scene", self._scene, makes=self.out)
            compared = self._stage("preview", self._preview, makes=self.preview)["compared"]
            report = SceneReport(
                source=str(self.source),
                scene=str(self.out),
                preview=str(self.preview),
                capture=str(self.capture),
                found=prepared.found,
                used=len(prepared.photos),
                posed=cameras["posed"],
                left_out=[*prepared.left_out, *(LeftOut(**entry) for entry in cameras["left_out"])],
                notes=[*prepared.notes, *cameras["notes"]],
                mapper=cameras["mapper"],
                reprojection_error_px=cameras["reprojection_error_px"],
                sparse_points=cameras["points"],
                cloud_points=cloud["points"],
                scene_points=built["points"],
                scene_bytes=built["bytes"],
                compared=[Compared(**view) for view in compared],
                seconds=self.seconds,
            )
            report.save(self.out.with_name(f"{self.out.stem}-report"))
            for name in _UNNEEDED:
                self._remove(name)
        self._start, self._share = 1.0, 0.0
        self.tell(1.0, "done")
        return report

    # -- input -------------------------------------------------------------------------------------------------

    def _check_input(self) -> dict[str, Any]:
        """Returns the key of the work folder, with sizes and times of the files. Raises MaquetteError for anything
        but a film and a folder of photos."""
        if not self.source.exists():
            raise MaquetteError(f"{self.source} does not exist; check the path.", "MAQ_ERROR_NOT_FOUND")
        if self.source.is_dir():
            files, foreign = photo_files(self.source)
            if not files:
                raise MaquetteError(_no_photos(self.source, foreign), "MAQ_ERROR_NOT_FOUND")
        elif is_film(self.source):
            files = [self.source]
        else:
            raise MaquetteError(
                f"{self.source} is neither a film ({', '.join(ENDINGS[:6])}, ...) nor a folder of photos.",
                "MAQ_ERROR_UNSUPPORTED",
            )
        if self.out.suffix not in (".maqs", *SPLATS):
            raise MaquetteError(
                f"{self.out} is no name of a scene; use {self.out.stem}.maqs, or {self.out.stem}.spz for splats.",
                "MAQ_ERROR_UNWRITABLE",
            )
        stats = [(file.name, file.stat().st_size, file.stat().st_mtime_ns) for file in files]
        return {
            "version": _VERSION,
            "source": str(self.source.resolve()),
            "files": [list(entry) for entry in stats],
            "max_photos": self.max_photos,
        }

    # -- stages ------------------------------------------------------------------------------------------------

    @property
    def preview(self) -> Path:
        return self.out.with_name(f"{self.out.stem}-preview.jpg")

    @property
    def capture(self) -> Path:
        return self.work_path / "capture"

    def _stage(self, name: str, run: Callable[[], dict[str, Any]], makes: Path | None = None) -> dict[str, Any]:
        """The result of a stage: of an earlier run, or else of this one. makes: a file that is there after it, and that
        was made for this scene."""
        self._share = _STAGES[name]
        known = self.work.result(name)
        if known is None or (makes and not (makes.exists() and known.get("out") == self.out.name)):
            start = time.monotonic()
            known = run() | ({"out": self.out.name} if makes else {})
            known["seconds"] = time.monotonic() - start
            self.work.finish(name, known)
        self.seconds[name] = known["seconds"]
        self._start += self._share
        return known

    def tell(self, done: float, what: str) -> None:
        """Raises MaquetteError if the progress wants to cancel."""
        if self._progress is not None and self._progress(self._start + self._share * done, what) is False:
            raise MaquetteError("Making the scene was cancelled.", "MAQ_CANCELLED")

    def _photos(self) -> dict[str, Any]:
        folder = self.work.fresh_folder("photos")
        for name in _UNNEEDED[1:]:
            self._remove(name)
        if is_film(self.source):
            told = "choosing frames of the film"
            prepared = prepare_film(self.source, folder, self.max_photos, lambda done: self.tell(done, told))
        else:
            told = "reading photos"
            prepared = prepare_photos(self.source, folder, self.max_photos, lambda done: self.tell(done, told))
        return prepared.to_json()

    def _cameras(self, prepared: Prepared) -> dict[str, Any]:
        posed = pose(self.work.path, prepared.photos, prepared.ordered, self.source, self.threads, self.tell)
        folder = self.work.fresh_folder("capture")
        sparse = write_capture(posed.model, prepared.photos, self.work.path / "photos", folder)
        np.save(self.work.path / _SPARSE, sparse)
        count = posed.model.num_reg_images()
        notes = []
        if count < 0.5 * len(prepared.photos):
            notes.append(
                f"Only {count} of {len(prepared.photos)} photos have a camera: the scene shows a part of what was "
                "filmed. Move slowly, so that neighbouring photos overlap by two thirds."
            )
        return {
            "posed": count,
            "mapper": posed.mapper,
            "reprojection_error_px": float(posed.model.compute_mean_reprojection_error()),
            "points": posed.model.num_points3D(),
            "left_out": [{"name": entry.name, "reason": entry.reason} for entry in posed.left_out],
            "notes": notes,
        }

    def _depth(self) -> dict[str, Any]:
        sparse = np.load(self.work.path / _SPARSE)
        with Capture(self.capture) as capture:
            told = "finding depth"
            xyz, rgb = dense_cloud(capture, sparse, self.threads, lambda done: self.tell(done, told))
        write_cloud(self.capture / CLOUD, xyz, rgb)
        return {"points": len(xyz)}

    def _scene(self) -> dict[str, Any]:
        def told(done: float, _: str) -> None:
            self.tell(done, "building the scene")

        fit_s = SPLAT_FIT_S if self.out.suffix in SPLATS else 0.0
        with Scene.build(self.capture, progress=told, threads=self.threads, splat_fit_s=fit_s) as scene:
            scene.save(self.out)
            return {"points": scene.point_count, "bytes": self.out.stat().st_size}

    def _preview(self) -> dict[str, Any]:
        with Scene.open(self.out) as scene, Capture(self.capture) as capture:
            told = "rendering the preview"
            compared = write_preview(
                scene, capture, self.preview, self.threads, lambda done: self.tell(done, told)
            )  # fmt: skip
        return {"compared": [view.__dict__ for view in compared]}

    # -- files -------------------------------------------------------------------------------------------------

    def _remove(self, name: str) -> None:
        path = self.work.path / name
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)

    def disk_is_full(self) -> str:
        needed = _MIN_FREE_BYTES // 1_000_000
        return (
            f"The disk of {self.out.parent.resolve()} is full: a scene needs some {needed} MB while it is made. Free "
            "some space and run the same command again; it goes on where it was."
        )


def _no_photos(folder: Path, foreign: list[LeftOut]) -> str:
    if foreign:
        return f"{folder} has {len(foreign)} photos, but none that can be read: {foreign[0].reason}."
    return f"{folder} has no photos (.jpg, .png, .webp, .bmp, .tif) in it; folders inside are not searched."
