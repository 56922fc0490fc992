"""Scenes: built from posed photos and a point cloud, rendered from new viewpoints."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from maquette.frames import Intrinsics
from maquette.images import Image, rendered
from maquette.native import NativeObject, ProgressCallback, native


@dataclass(frozen=True, eq=False)
class PinholeCamera:
    """A camera and its pose, in the convention of OpenCV (x right, y down, z forward): a point X of the world has the
    camera coordinates rotation @ (X - centre). rotation: [3, 3]; centre: [3], in units of the scene."""

    intrinsics: Intrinsics
    rotation: np.ndarray
    centre: np.ndarray

    @staticmethod
    def looking_at(intrinsics: Intrinsics, eye: np.ndarray, target: np.ndarray, up: np.ndarray) -> PinholeCamera:
        """A camera at `eye` that looks at `target`, upright for `up`; all [3]."""
        eye, target = np.asarray(eye, np.float64), np.asarray(target, np.float64)
        forward = (target - eye) / np.linalg.norm(target - eye)
        right = np.cross(forward, np.asarray(up, np.float64))
        right /= np.linalg.norm(right)
        return PinholeCamera(intrinsics, np.stack([right, np.cross(forward, right), forward]), eye)

    def to_struct(self) -> Any:
        """A maq_pinhole_camera."""
        struct = native().sized("maq_pinhole_camera")
        self.intrinsics.write_to(struct.intrinsics)
        struct.rotation = [float(v) for v in np.asarray(self.rotation).reshape(9)]
        struct.centre = [float(v) for v in np.asarray(self.centre).reshape(3)]
        return struct

    @staticmethod
    def of_struct(struct: Any) -> PinholeCamera:
        rotation = np.array(list(struct.rotation)).reshape(3, 3)
        return PinholeCamera(Intrinsics.of_struct(struct.intrinsics), rotation, np.array(list(struct.centre)))


@dataclass(frozen=True, eq=False)
class View:
    """A photo of a capture. held_out: for comparison; scenes are not built from it by default."""

    name: str
    camera: PinholeCamera
    held_out: bool


class Capture(NativeObject):
    """A folder with posed photos and a point cloud: COLMAP, or transforms.json as nerfstudio and Instant-NGP write it
    (docs/reference/formats.md). drops: unusable parts, with reasons. Raises MaquetteError."""

    def __init__(self, folder: str | Path) -> None:
        n = native()
        super().__init__(n.create("maq_capture", n.context, str(folder).encode(), function="maq_capture_open"))
        info = n.sized("maq_capture_info")
        n.call("maq_capture_get_info", self.handle, info)
        self.up = np.array(list(info.up))
        views = n.indexed("maq_capture_get_view", self.handle, "maq_capture_view", info.view_count)
        self.views = [
            View(n.ffi.string(v.name).decode(), PinholeCamera.of_struct(v.camera), bool(v.is_held_out)) for v in views
        ]
        drops = n.indexed("maq_capture_get_drop", self.handle, "maq_capture_drop", info.drop_count)
        self.drops = [f"{d.count} {n.ffi.string(d.reason).decode()}" for d in drops]


class Scene(NativeObject):
    """Points with descriptors, ready to be rendered: `Scene.build(folder)` or `Scene.open("room.maqs")`."""

    @staticmethod
    def build(
        capture: Capture | str | Path, progress: Callable[[float, str], bool | None] | None = None, **settings: Any
    ) -> Scene:
        """Builds a scene.

        progress: called with the fraction done and the stage, a sentence; returns False to cancel. settings: fields of
        maq_scene_build_config by their names: long_side_px, max_views, max_points, threads, bundle_path, ... Raises
        MaquetteError, and the errors of `progress`."""
        n = native()
        capture = capture if isinstance(capture, Capture) else Capture(capture)
        callback = ProgressCallback(progress)
        config = n.config("maq_scene_build_config", {**settings, "progress_callback": callback.pointer})
        build = ("maq_scene", n.context, config, capture.handle)
        return Scene(callback.run(lambda: n.create(*build, function="maq_scene_build")))

    @staticmethod
    def open(path: str | Path) -> Scene:
        """Raises MaquetteError."""
        n = native()
        return Scene(n.create("maq_scene", n.context, str(path).encode(), function="maq_scene_open"))

    def save(self, path: str | Path) -> None:
        """Writes a scene file (.maqs), atomically. Raises MaquetteError."""
        native().call("maq_scene_save", self.handle, str(path).encode())

    def save_ply(self, path: str | Path) -> None:
        """Writes positions and mean colours for other programs. Raises MaquetteError."""
        native().call("maq_scene_save_ply", self.handle, str(path).encode())

    def _info(self) -> Any:
        info = native().sized("maq_scene_info")
        native().call("maq_scene_get_info", self.handle, info)
        return info

    @property
    def build_stats(self) -> dict[str, float]:
        """Counts and times of the build: the fields of maq_scene_build_stats. Raises MaquetteError for an opened
        scene."""
        return native().stats("maq_scene_build_stats", "maq_scene_get_build_stats", self.handle)

    @property
    def point_count(self) -> int:
        return self._info().point_count

    @property
    def bounds(self) -> np.ndarray:
        """float64 [2, 3]: the corners of the box around all points."""
        info = self._info()
        return np.array([list(info.bounds_min), list(info.bounds_max)])

    @property
    def up(self) -> np.ndarray:
        """float64 [3], of length 1."""
        return np.array(list(self._info().up))


class SceneRenderer(NativeObject):
    """settings: fields of maq_scene_renderer_config by their names. Raises MaquetteError."""

    def __init__(self, scene: Scene, **settings: Any) -> None:
        n = native()
        config = n.config("maq_scene_renderer_config", settings)
        super().__init__(n.create("maq_scene_renderer", n.context, config, scene.handle))

    def run(self, camera: PinholeCamera) -> Image:
        """Renders the view of a camera. One call at a time. Raises MaquetteError."""
        return rendered(native(), self.handle, camera.to_struct(), "maq_scene_renderer_run", of_head=False)
