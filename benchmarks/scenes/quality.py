"""Compares images with held-out photos of the same cameras: error of each method, and time to the first image.

A row is one method. The time begins with the capture on disk, with given cameras and cloud, and includes reading,
choosing or fitting, and the first image. For our scenes it covers two processes, `scene build` and `scene render` of
one view, with their start, networks and written files. Baselines run in a Python process that has started already.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from collections.abc import Callable, Sequence
from itertools import groupby
from pathlib import Path

import cv2
import numpy as np
import torch
from tqdm import tqdm

from benchmarks.scenes import command as scene_command
from benchmarks.scenes.baselines import cloud_of, nearest_photo
from benchmarks.scenes.command import SceneCommandError
from benchmarks.scenes.settings import SHIPPED, Setting, Sources
from export.camera import Camera
from export.point_cloud import PointCloudError
from export.scenes.captures import Capture, CaptureError, read_capture
from export.scenes.image_quality import psnr_db, ssim
from export.scenes.perceptual import Perceptual

BASELINES = ("nearest photo", "plain points", "points as squares of 3 pixels", "pyramid of points")
SHOWN = ("as shipped", *BASELINES[:2], BASELINES[3])  # captures in the contact sheet
ERRORS = ("psnr_db", "ssim", "distance")


class Photos:
    """Returns at most `count` held-out photos of a capture, their sides divided by `shrink`.

    Raises CaptureError where there is none.
    """

    def __init__(self, capture: Capture, shrink: int, count: int | None) -> None:
        frames = sorted(capture.held_out)
        if not frames:
            raise CaptureError(f"{capture.name} holds no photo out; name some in test_filenames.")
        if count:
            frames = [frames[k] for k in np.linspace(0, len(frames) - 1, min(count, len(frames))).round().astype(int)]
        self.names = [capture.names[k] for k in frames]
        self.cameras: list[Camera] = []
        self.images: list[np.ndarray] = []
        for k in frames:
            view = capture.view(k)
            width, height = (max(1, side // shrink) for side in (view.camera.width_px, view.camera.height_px))
            self.cameras.append(view.camera.resized(width, height))
            self.images.append(cv2.resize(view.image, (width, height), interpolation=cv2.INTER_AREA))

    @property
    def size(self) -> str:
        return f"{self.cameras[0].width_px}x{self.cameras[0].height_px}"


@torch.no_grad()
def errors_of(pictures: Sequence[np.ndarray], photos: Photos, perceptual: Perceptual | None) -> dict[str, float]:
    """Means over the photos. distance: by `export.scenes.perceptual`, if its network exists."""
    for picture, photo in zip(pictures, photos.images, strict=True):
        if picture.shape != photo.shape:
            raise SceneCommandError(f"an image has {picture.shape[1]} x {picture.shape[0]} pixels, not {photos.size}")
    pairs = list(zip(pictures, photos.images, strict=True))
    found = {"psnr_db": statistics.fmean(psnr_db(a, b) for a, b in pairs),
             "ssim": statistics.fmean(ssim(a, b) for a, b in pairs)}  # fmt: skip
    if perceptual:
        tensors = [[torch.from_numpy(x).permute(2, 0, 1)[None] for x in pair] for pair in pairs]
        found["distance"] = statistics.fmean(float(perceptual(a, b, torch.ones_like(a[:, :1]))) for a, b in tensors)
    return found


Row = dict  # setting, axis, kind, places (metrics by place), missing (why, by place)


def rows_of(settings: Sequence[Setting]) -> list[Row]:
    """Returns empty rows, the baselines first."""
    made = [{"setting": name, "axis": "baseline", "kind": "baseline"} for name in BASELINES]
    made += [{"setting": s.name, "axis": s.axis, "kind": "ours"} for s in settings]
    return [row | {"places": {}, "missing": {}} for row in made]


def measure(
    sources: Sources, settings: Sequence[Setting], perceptual: Perceptual | None, quick: bool
) -> tuple[list[Row], list[dict], list[dict]]:
    """Returns the rows; the captures (name, real, photos, points, size, or why it is `missing`); and for each capture
    one photo with its images by method, for the contact sheet."""
    rows, places, shown = rows_of(settings), [], []
    folders = [(folder, False) for folder in sources.places] + [(folder, True) for folder in sources.real]
    with tqdm(total=len(folders) * (1 + len(settings)), desc="scenes", unit="setting", disable=None) as progress:
        for folder, real in folders:
            try:
                place = Place(folder, perceptual, quick)
            except (CaptureError, PointCloudError) as error:
                places.append({"name": folder.name, "real": real, "missing": str(error)})
                progress.update(1 + len(settings))
                continue
            places.append(place.described() | {"real": real})
            place.run_baselines()
            progress.update()
            place.run_settings(sources, settings, progress.update)
            for row in rows:
                for kind, found in (("places", place.found), ("missing", place.missing)):
                    if row["setting"] in found:
                        row[kind][place.name] = found[row["setting"]]
            shown.append({"name": place.name, "photo": place.photos[1].images[place.middle], "pictures": place.shown})
    for row in rows:
        for key, real in (("rendered", False), ("real", True)):
            row[key] = mean_figures(row, [p["name"] for p in places if p["real"] == real and "missing" not in p])
    return rows, places, shown


def mean_figures(row: Row, names: Sequence[str]) -> dict[str, float] | None:
    """Returns means over these captures; None if one of them is missing, because means over different captures are not
    comparable."""
    if not names or not set(names) <= set(row["places"]):
        return None
    found = [row["places"][name] for name in names]
    keys = [key for key, value in found[0].items() if isinstance(value, int | float)]
    return {key: statistics.fmean(metrics[key] for metrics in found) for key in keys}


class Place:
    """Measures one capture: metrics, or why there are none, by setting. The middle held-out photo is in the contact
    sheet."""

    def __init__(self, folder: Path, perceptual: Perceptual | None, quick: bool) -> None:
        self.folder, self.name, self.quick, self._perceptual = folder, folder.resolve().name, quick, perceptual
        begin_s = time.monotonic()
        self.capture = read_capture(folder)
        self.read_s = time.monotonic() - begin_s
        count = 2 if quick else None
        self.photos = {shrink: Photos(self.capture, shrink, count) for shrink in (1, 2)}
        self.middle = len(self.photos[1].images) // 2
        self.found: dict[str, dict] = {}
        self.missing: dict[str, str] = {}
        self.shown: dict[str, np.ndarray] = {}

    def described(self) -> dict:
        camera = self.photos[1].cameras[0]
        return {"name": self.name, "photos": len(self.capture.sources()), "held_out": len(self.photos[1].names),
                "points": len(self.capture.cloud.positions),
                "size_px": [camera.width_px, camera.height_px]}  # fmt: skip

    def run_baselines(self) -> None:
        begin_s = time.monotonic()
        cloud = cloud_of(self.capture)
        cloud_s = time.monotonic() - begin_s
        for name, make, before_s in (
            (BASELINES[0], lambda camera: nearest_photo(self.capture, camera), 0.0),
            (BASELINES[1], cloud.points, cloud_s),
            (BASELINES[2], cloud.squares, cloud_s),
            (BASELINES[3], cloud.pyramid, cloud_s),
        ):
            pictures, times_s = self._timed(make)
            frame_s = statistics.median(times_s)
            self._keep(name, pictures, {"first_image_s": self.read_s + before_s + frame_s, "frame_ms": 1000 * frame_s})

    def _timed(self, make: Callable[[Camera], np.ndarray]) -> tuple[list[np.ndarray], list[float]]:
        pictures, times_s = [], []
        for camera in self.photos[1].cameras:
            begin_s = time.monotonic()
            pictures.append(make(camera))
            times_s.append(time.monotonic() - begin_s)
        return pictures, times_s

    def _keep(self, name: str, pictures: list[np.ndarray], metrics: dict, shrink: int = 1) -> None:
        errors = errors_of(pictures, self.photos[shrink], self._perceptual)
        self.found[name] = metrics | errors
        if name in SHOWN:
            photo, picture = self.photos[shrink].images[self.middle], pictures[self.middle]
            self.shown[name] = picture
            self.found[name]["shown_psnr_db"] = psnr_db(picture, photo)

    def run_settings(self, sources: Sources, settings: Sequence[Setting], step: Callable[[], object]) -> None:
        """Sorts settings so that those with the same file follow each other and share it."""
        ordered = sorted(settings, key=_file_of)
        with tempfile.TemporaryDirectory() as name:
            for _, group in groupby(ordered, key=_file_of):
                self._run_file(sources, list(group), Path(name), step)

    def _run_file(self, sources: Sources, group: list[Setting], work: Path, step: Callable[[], object]) -> None:
        first, scene, built, why = group[0], work / "scene.maqs", {}, ""
        networks = sources.bundles.get(first.networks)
        try:
            if first.tuned:
                scene, networks, built = self._tuned(sources, first)
            elif networks is None or not networks.is_dir():
                raise SceneCommandError(f"no networks in {networks}")
            else:
                said = scene_command.build(self.folder, scene, networks, *first.build)
                built = {"build_s": said.wall_s, "cloud_points": said.cloud_points, "points": said.points,
                         "view_dependent_points": said.view_dependent_points, "bytes": said.bytes,
                         "bytes_a_point": said.bytes / said.points, "modelling_mb": said.peak_memory_mb}  # fmt: skip
        except SceneCommandError as error:
            why = str(error)
        for setting in group:
            if why:
                self.missing[setting.name] = why
            else:
                try:
                    self._run_setting(setting, scene, networks, built, work)
                except SceneCommandError as error:
                    self.missing[setting.name] = str(error)
            step()
        (work / "scene.maqs").unlink(missing_ok=True)

    def _tuned(self, sources: Sources, setting: Setting) -> tuple[Path, Path, dict]:
        if sources.tuned is None:
            raise SceneCommandError("no folder of fine-tuned scenes was given, --fine-tuned")
        folder = sources.tuned / self.name
        scene, networks = folder / f"{setting.tuned}.maqs", folder / f"{setting.tuned}-networks"
        if not scene.exists():
            raise SceneCommandError(f"no fine-tuned scene {scene}")
        said = scene_command.info(scene)
        points = said.get("points")
        if not isinstance(points, int) or points < 1:
            raise SceneCommandError(f"{scene} says that it has {points!r} points")
        size = scene.stat().st_size
        metrics = {"points": points, "bytes": size, "bytes_a_point": size / points}
        # the first part is the setting as shipped
        if "as shipped" in self.found:
            metrics["build_s"] = self.found["as shipped"]["build_s"] + float(setting.tuned.removesuffix("s"))
        return scene, networks if networks.is_dir() else sources.bundles[SHIPPED], metrics

    def _run_setting(self, setting: Setting, scene: Path, networks: Path, built: dict, work: Path) -> None:
        photos = self.photos[setting.shrink]
        options = ("--size", photos.size, *setting.render)
        repeat = "1" if self.quick else "3"
        made = scene_command.render(scene, networks, self.folder, work / "pictures", photos.names, "--repeat", repeat,
                                    *options)  # fmt: skip
        lost = sorted(set(photos.names) - set(made.pictures))
        if lost:
            raise SceneCommandError(f"maquette scene render left out {', '.join(lost)}")
        once = scene_command.render(scene, networks, self.folder, work / "first", photos.names[:1], "--repeat", "1",
                                    *options)  # fmt: skip
        metrics = built | {"frame_ms": made.ms["total"], "stages_ms": made.ms}
        if "build_s" in built:
            metrics["first_image_s"] = built["build_s"] + once.wall_s
        self._keep(setting.name, [made.pictures[name] for name in photos.names], metrics, setting.shrink)


def _file_of(setting: Setting) -> tuple[bool, str, str, tuple[str, ...]]:
    """Returns the options that decide the scene file; fine-tuned files come last."""
    return bool(setting.tuned), setting.tuned, setting.networks, setting.build
