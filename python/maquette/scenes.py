"""Scenes: built from posed photos and a point cloud, rendered from new viewpoints."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from maquette.frames import Frame, ImageLike, Intrinsics, as_frame
from maquette.images import Image, rendered
from maquette.native import Lender, NativeObject, ProgressCallback, native, path_to_write

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from maquette.settings import SceneBuildSettings, SceneRendererSettings

Progress = Callable[[float, str], "bool | None"]


@dataclass(frozen=True, eq=False)
class PinholeCamera:
    """A camera and its pose, in the convention of OpenCV (x right, y down, z forward): a point X of the world has the
    camera coordinates rotation @ (X - centre). rotation: [3, 3]; centre: [3], in units of the scene."""

    intrinsics: Intrinsics
    rotation: np.ndarray
    centre: np.ndarray

    def __repr__(self) -> str:
        k = self.intrinsics
        return f"<PinholeCamera {k.width_px} x {k.height_px} at {np.round(np.asarray(self.centre), 3).tolist()}>"

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
    """A photo of a capture. held_out: for comparison; scenes are not built from it by default. has_depth: there is a
    depth image, too."""

    name: str
    camera: PinholeCamera
    held_out: bool
    has_depth: bool

    def __repr__(self) -> str:
        return f"<View {self.name}>"


class Capture(NativeObject):
    """A folder with posed photos and a point cloud: COLMAP, or transforms.json as nerfstudio and Instant-NGP write it
    (docs/reference/formats.md). drops: unusable parts, with reasons. Raises MaquetteError."""

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        n = native()
        super().__init__(n.create("maq_capture", n.context, os.fsencode(folder), function="maq_capture_open"))
        info = n.sized("maq_capture_info")
        n.call("maq_capture_get_info", self.handle, info)
        self.up = np.array(list(info.up))
        views = n.indexed("maq_capture_get_view", self.handle, "maq_capture_view", info.view_count)
        self.views = [
            View(n.text(v.name), PinholeCamera.of_struct(v.camera), bool(v.is_held_out), bool(v.has_depth))
            for v in views
        ]
        drops = n.indexed("maq_capture_get_drop", self.handle, "maq_capture_drop", info.drop_count)
        self.drops = [f"{d.count} {n.text(d.reason)}" for d in drops]

    def photo(self, index: int) -> Frame:
        """The photo of `views[index]`, undistorted, in the size of its camera. Raises MaquetteError."""
        load, release = "maq_capture_load_view", "maq_frame_release"
        return Frame.of_handle(native().create("maq_frame", self.handle, index, function=load, release=release))

    def depth(self, index: int) -> tuple[Frame, PinholeCamera]:
        """The depth image of `views[index]`, and its camera. Raises MaquetteError, also without one (`has_depth`)."""
        n = native()
        camera = n.sized("maq_pinhole_camera")
        load, release = "maq_capture_load_depth", "maq_frame_release"
        frame = n.create("maq_frame", self.handle, index, camera, function=load, release=release)
        return Frame.of_handle(frame), PinholeCamera.of_struct(camera)

    def _about(self) -> str:
        return f"{len(self.views)} photos"


class Scene(NativeObject):
    """Points with descriptors, ready to be rendered: `Scene.build(folder)` or `Scene.open("room.maqs")`."""

    @staticmethod
    def build(
        capture: Capture | str | os.PathLike[str],
        progress: Progress | None = None,
        points_from: Literal["default", "cloud", "depth"] = "default",
        **settings: Unpack[SceneBuildSettings],
    ) -> Scene:
        """Builds a scene. `SceneBuilder` builds one photo by photo.

        points_from: "cloud": the capture's points; "depth": points computed from the photos, as `DenseCloud` does;
        "default": "depth" if the capture has only the sparse points of COLMAP or nerfstudio.
        progress: called with the fraction done and the stage, a sentence; returns False to cancel. settings: fields of
        maq_scene_build_config by their names: long_side_px, max_views, max_points, threads, bundle_path, ... Raises
        MaquetteError, and the errors of `progress`."""
        n = native()
        capture = capture if isinstance(capture, Capture) else Capture(capture)
        callback = ProgressCallback(progress)
        given = {**settings, "points": points_from, "progress_callback": callback.pointer}
        config = n.config("maq_scene_build_config", given)
        build = ("maq_scene", n.context, config, capture.handle)
        return Scene(callback.run(lambda: n.create(*build, function="maq_scene_build")))

    @staticmethod
    def open(file: str | os.PathLike[str] | bytes) -> Scene:
        """Reads a file that `save` wrote, by its path or its bytes. Also reads splats (.ply, .spz), by their path.

        Raises MaquetteError."""
        n = native()
        if isinstance(file, bytes):
            data = n.ffi.from_buffer(file)
            return Scene(n.create("maq_scene", n.context, data, len(file), function="maq_scene_open_memory"))
        return Scene(n.create("maq_scene", n.context, os.fsencode(file), function="maq_scene_open"))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes a scene file (.maqs), or splats for other programs (.ply, .spz, .glb), atomically.

        Raises MaquetteError."""
        native().call("maq_scene_save", self.handle, path_to_write(path))

    def save_ply(self, path: str | os.PathLike[str]) -> None:
        """Writes positions and mean colours for other programs. Raises MaquetteError."""
        native().call("maq_scene_save_ply", self.handle, path_to_write(path))

    def _info(self) -> Any:
        info = native().sized("maq_scene_info")
        native().call("maq_scene_get_info", self.handle, info)
        return info

    @property
    def build_stats(self) -> dict[str, Any]:
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

    def _about(self) -> str:
        return f"{self.point_count} points"


class SceneBuilder(NativeObject):
    """Builds a scene from photos of the app, one after the other; photos are not kept.

        builder = maquette.SceneBuilder(points)
        for rgb, camera in views:
            builder.add_view(rgb, camera)
        scene = builder.finish()

    points: float32 [N, 3], the cloud in the world, relative to `origin`. up: the world's up. origin: near the cloud,
    because float32 has 7 digits. progress: called by `add_view` with the fraction done and the stage; returns False to
    cancel. settings: fields of maq_scene_build_config by their names. All methods raise MaquetteError.
    """

    def __init__(
        self,
        points: np.ndarray,
        up: np.ndarray | tuple[float, float, float] = (0, 0, 1),
        origin: np.ndarray | tuple[float, float, float] = (0, 0, 0),
        progress: Progress | None = None,
        **settings: Unpack[SceneBuildSettings],
    ) -> None:
        n = native()
        xyz = np.ascontiguousarray(points, np.float32)
        if xyz.ndim != 2 or xyz.shape[1] != 3:
            raise ValueError(f"points are [N, 3], not {list(xyz.shape)}")
        cloud = n.sized("maq_point_cloud")
        cloud.point_count, cloud.xyz = len(xyz), n.ffi.cast("const float *", n.ffi.from_buffer(xyz))
        cloud.up, cloud.origin = [float(v) for v in up], [float(v) for v in origin]
        self._progress = ProgressCallback(progress)
        config = n.config("maq_scene_build_config", {**settings, "progress_callback": self._progress.pointer})
        super().__init__(n.create("maq_scene_builder", n.context, config, cloud))

    def add_view(self, photo: ImageLike, camera: PinholeCamera) -> int:
        """Adds a photo. Returns the number of points that it sees."""
        n = native()
        frame, seen = as_frame(photo), n.ffi.new("uint64_t *")
        arguments = self.handle, frame.handle, camera.to_struct(), seen
        self._progress.run(lambda: n.call("maq_scene_builder_add_view", *arguments))
        return seen[0]

    def cancel(self) -> None:
        """Ends the running `add_view`, or else the next one, with MAQ_CANCELLED. Any thread may call it."""
        native().call("maq_scene_builder_cancel", self.handle)

    @property
    def stats(self) -> dict[str, Any]:
        """Counts and times so far: the fields of maq_scene_build_stats."""
        return native().stats("maq_scene_build_stats", "maq_scene_builder_get_stats", self.handle)

    def finish(self) -> Scene:
        """Builds a scene from the photos so far. More can be added afterwards, for another scene."""
        return Scene(native().create("maq_scene", self.handle, function="maq_scene_builder_finish"))


class SceneRenderer(NativeObject):
    """settings: fields of maq_scene_renderer_config by their names. Raises MaquetteError."""

    def __init__(self, scene: Scene, **settings: Unpack[SceneRendererSettings]) -> None:
        n = native()
        config = n.config("maq_scene_renderer_config", {"image_pool_size": 4, **settings})
        self._lender = Lender(config.image_pool_size)
        super().__init__(n.create("maq_scene_renderer", n.context, config, scene.handle))

    def run(self, camera: PinholeCamera) -> Image:
        """Renders the view of a camera. One call at a time. Raises MaquetteError."""
        return rendered(self._lender, self.handle, camera.to_struct(), "maq_scene_renderer_run", of_head=False)
