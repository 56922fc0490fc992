"""Heads: an animatable, textured 3D head in metres, from one photo of a person or from several.

A face is biometric data: ask the person, and protect heads like passwords (docs/guide/head.md). Points of a head
are in metres: x to the person's left, y up, z to the front, as in glTF, the origin in the middle of the head.
"""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from maquette.frames import ImageLike, as_depth, as_frame
from maquette.images import Image, rendered
from maquette.native import Lender, NativeObject, ProgressCallback, native, path_to_write
from maquette.scenes import PinholeCamera, Progress

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from maquette.settings import HeadBuilderSettings, HeadRendererSettings, HeadShading

_ALL_TRIANGLES = 0xFFFFFFFF  # MAQ_HEAD_ALL_TRIANGLES


@dataclass(frozen=True)
class HeadPhoto:
    """Result for a photo. box_px: box of the head, given or detected: left, top, right, bottom; right and bottom are
    exclusive. head_coverage: fraction of the encoder's crop that shows the head, 0 to 1. The other fields describe the
    latest fit, and are 0 before. is_used: whether the head was fitted to the photo; photos without a head or of a
    different person are rejected. focal_px: focal length, given or estimated. rms_px: root mean square distance
    between projected head points and the network's estimates."""

    box_px: tuple[float, float, float, float]
    head_coverage: float
    is_used: bool
    focal_px: float
    rms_px: float


@dataclass(frozen=True)
class HeadInfo:
    """photo_count: photos that the head was fitted to. scale: where its size comes from: "prior" (the average of heads:
    photos alone do not tell), "given" (a known distance) or "depth" (a depth camera). scale_sigma: standard deviation
    of the size, as a fraction of it; 0: unknown. texture_px: pixels a side; 0: no texture."""

    photo_count: int
    scale: str
    scale_sigma: float
    texture_px: int


@dataclass(frozen=True, eq=False)
class HeadLandmark:
    """A named point. point_m: float64 [3]. sigma_m: standard deviation of each coordinate, by shape model and photos.
    It is larger where no photo shows the point, and along the lines of sight. The deviation of the size is extra."""

    point_m: np.ndarray
    sigma_m: float


@dataclass(frozen=True, eq=False)
class MorphTarget:
    """A facial action or a viseme at its strongest: vertices go to position + weight * delta, with a weight of 0 to 1.

    name: one of ARKit's 52 actions, such as jawOpen or eyeBlinkLeft; left is the person's left. Or one of 15 visemes
    for speech, such as viseme_aa. vertices: uint32 [N],
    increasing; all others stay. deltas_m: float32 [N, 3].
    """

    name: str
    vertices: np.ndarray
    deltas_m: np.ndarray

    def __repr__(self) -> str:
        return f"<MorphTarget {self.name}, {len(self.vertices)} vertices>"


class HeadMesh(NativeObject):
    """The surface of a head as a mesh of V vertices and F triangles: `Head.mesh`. It ends below the chin. The
    animatable head is open there, the dense surface closed. Arrays are copied at the first use and stay valid
    after `close`."""

    @property
    def _data(self) -> Any:
        """Its pointers are valid until `close`. Raises MaquetteError afterwards."""
        data = native().sized("maq_head_mesh_data")
        native().call("maq_head_mesh_get_data", self.handle, data)
        return data

    def _copied(self, pointer: Any, shape: tuple[int, ...], kind: type) -> np.ndarray:
        size = int(np.prod(shape)) * np.dtype(kind).itemsize
        return np.frombuffer(native().ffi.buffer(pointer, size), kind).reshape(shape).copy()

    @functools.cached_property
    def positions_m(self) -> np.ndarray:
        """float32 [V, 3]."""
        return self._copied(self._data.positions_m, (self._data.vertex_count, 3), np.float32)

    @functools.cached_property
    def normals(self) -> np.ndarray:
        """float32 [V, 3], outwards, of length 1."""
        return self._copied(self._data.normals, (self._data.vertex_count, 3), np.float32)

    @functools.cached_property
    def colours(self) -> np.ndarray:
        """uint8 [V, 3], sRGB."""
        return self._copied(self._data.colours_rgb, (self._data.vertex_count, 3), np.uint8)

    @functools.cached_property
    def template_points_m(self) -> np.ndarray:
        """float32 [V, 3]: the point of the template head. Equal points mean the same part of every head, such as the
        tip of the nose."""
        return self._copied(self._data.template_points_m, (self._data.vertex_count, 3), np.float32)

    @functools.cached_property
    def triangles(self) -> np.ndarray:
        """uint32 [F, 3], counter-clockwise seen from outside."""
        return self._copied(self._data.triangles, (self._data.triangle_count, 3), np.uint32)

    @functools.cached_property
    def texture_coordinates(self) -> np.ndarray | None:
        """float32 [V, 2], u to the right and v down, 0 to 1. None of the dense surface of a head without a texture.
        Vertices at seams appear twice."""
        if self._data.texture_coordinates == native().ffi.NULL:
            return None
        return self._copied(self._data.texture_coordinates, (self._data.vertex_count, 2), np.float32)

    @functools.cached_property
    def texture_jpeg(self) -> bytes | None:
        """A square JPEG file, which `Frame.decode` reads. None without a texture."""
        if self._data.texture_bytes == 0:
            return None
        return bytes(native().ffi.buffer(self._data.texture_jpeg, self._data.texture_bytes))

    @functools.cached_property
    def morph_targets(self) -> tuple[MorphTarget, ...]:
        """Facial actions and visemes of the animatable head; none of the dense surface."""
        n, count = native(), self._data.morph_target_count
        return tuple(
            MorphTarget(
                n.ffi.string(target.name).decode(),
                self._copied(target.vertices, (target.vertex_count,), np.uint32),
                self._copied(target.deltas_m, (target.vertex_count, 3), np.float32),
            )
            for target in n.indexed("maq_head_mesh_get_morph_target", self.handle, "maq_head_morph_target", count)
        )

    @property
    def simplification_error_m(self) -> float:
        """The largest distance of a vertex of the full mesh from this mesh."""
        return self._data.simplification_error_m

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the mesh for other programs: .glb, .obj with a .mtl beside it, or .ply. GLB and OBJ have the texture,
        GLB also the morph targets, and joints of neck, head, jaw and eyes. Raises MaquetteError."""
        native().call("maq_head_mesh_save", self.handle, path_to_write(path))

    def _about(self) -> str:
        return f"{self._data.vertex_count} vertices, {self._data.triangle_count} triangles"


class Head(NativeObject):
    """One head, from `HeadBuilder.fit` or `Head.open("head.maqh")`. It holds no photo, but a texture has the face's
    pixels."""

    @staticmethod
    def open(file: str | os.PathLike[str] | bytes) -> Head:
        """Reads a file that `save` wrote, by its path or its bytes; no network is needed. Raises MaquetteError."""
        n = native()
        if isinstance(file, bytes):
            data = n.ffi.from_buffer(file)
            return Head(n.create("maq_head", n.context, data, len(file), function="maq_head_open_memory"))
        return Head(n.create("maq_head", n.context, os.fsencode(file), function="maq_head_open"))

    def scaled_by_distance(self, start: str, end: str, distance_m: float) -> Head:
        """Copies the head with the size at which two landmarks are `distance_m` apart (0.001 to 10), such as pupil_left
        and pupil_right as an optician measured them. Raises MaquetteError."""
        names = start.encode(), end.encode()
        arguments = ("maq_head", self.handle, *names, float(distance_m))
        return Head(native().create(*arguments, function="maq_head_scale_by_distance"))

    def scaled_by_depth(self, depth: ImageLike, camera: int = 0) -> Head:
        """Copies the head with the size at which it fits a depth image.

        depth: of the same view as the photo with this camera, in any size: a Frame that is depth or has depth, float32
        [H, W] in metres, uint16 [H, W] in millimetres, or the path of a depth image in millimetres. Give that photo its
        focal_px: an estimate that is 10 % too long makes the head 10 % too small. Raises MaquetteError, with the status
        MAQ_ERROR_NOT_FOUND if half of the head has no depth that agrees with it.
        """
        frame = as_depth(depth)
        arguments = ("maq_head", self.handle, camera, frame.handle)
        return Head(native().create(*arguments, function="maq_head_scale_by_depth"))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes a head file (.maqh), some 64 KB and the texture, atomically. Raises MaquetteError."""
        native().call("maq_head_save", self.handle, path_to_write(path))

    @property
    def info(self) -> HeadInfo:
        info = native().sized("maq_head_info")
        native().call("maq_head_get_info", self.handle, info)
        scale = native().name_of("maq_head_scale", info.scale)
        return HeadInfo(info.photo_count, scale, info.scale_sigma, info.texture_px)

    def _about(self) -> str:
        info = self.info
        return f"of {info.photo_count} photo{'' if info.photo_count == 1 else 's'}, size: {info.scale}"

    def mesh(self, triangle_count: int | str = 0, cell_m: float = 0,
             bundle: str | os.PathLike[str] | None = None) -> HeadMesh:  # fmt: skip
        """Makes a mesh, in a second or less: the animatable head, or the dense surface.

        The animatable head has the same vertices, triangles and texture coordinates for every head, eyeballs, teeth and
        tongue, facial actions and visemes, and joints in .glb files. triangle_count: the dense, closed surface instead,
        with about this many triangles, 100 or more, or "all". cell_m: also the dense surface, with this distance
        between neighbouring vertices before triangles are removed, 0.0005 to 0.02; 0: 0.0021, or 0.0016 for more than
        60,000 triangles. bundle: folder of the bundle with the template head, for the animatable head of a file;
        default: the installed one. Raises MaquetteError.
        """
        if isinstance(triangle_count, str):
            if triangle_count != "all":
                raise ValueError(f'triangle_count is "{triangle_count}"; it is a number or "all"')
            triangle_count = _ALL_TRIANGLES
        settings: dict[str, Any] = {"triangle_count": triangle_count, "cell_m": cell_m}
        if bundle is not None:
            settings["bundle_path"] = bundle
        n = native()
        return HeadMesh(n.create("maq_head_mesh", self.handle, n.config("maq_head_mesh_config", settings)))

    def landmark(self, name: str) -> HeadLandmark:
        """A landmark by its name: nose_tip, nose_bridge, chin, crown, pupil_left, pupil_right, temple_left,
        temple_right, ear_top_left, ear_top_right, ear_bottom_left, ear_bottom_right; left is the person's. Raises
        MaquetteError."""
        n = native()
        found = n.sized("maq_head_landmark")
        n.call("maq_head_get_landmark", self.handle, name.encode(), found)
        return HeadLandmark(np.array(list(found.point_m)), found.sigma_m)

    def landmarks(self) -> dict[str, HeadLandmark]:
        """All landmarks of this head, by their names."""
        n, handle = native(), self.handle
        names: list[str] = []
        while name := n.lib.maq_head_get_landmark_name(handle, len(names)):
            names.append(n.ffi.string(name).decode())
        return {name: self.landmark(name) for name in names}

    def camera(self, index: int = 0) -> PinholeCamera:
        """The camera of a photo that the head was fitted to (`HeadPhoto.is_used`), in the order of `add_photo`. An
        image of `HeadRenderer.run` with it lies on the head in the photo. Raises MaquetteError."""
        n = native()
        camera = n.sized("maq_pinhole_camera")
        n.call("maq_head_get_camera", self.handle, index, camera)
        return PinholeCamera.of_struct(camera)


class _FitProgress:
    """The progress function of the fit that runs, for the callback that a builder has from its creation on."""

    current: Callable[[float, str], bool | None] | None = None

    def __call__(self, done: float, stage: str) -> bool | None:
        return None if self.current is None else self.current(done, stage)


class HeadBuilder(NativeObject):
    """Fits heads to photos of one person at a time. The network is loaded once.

        builder = maquette.HeadBuilder()
        builder.add_photo(rgb)
        head = builder.fit(seconds=3)
        head.mesh().save("head.glb")

    bundle: a folder with manifest.json (default: the one in the package). texture: whether heads get a texture with
    the photos' pixels; None: the SDK's choice, which is a texture in this version. settings: fields of
    maq_head_builder_config by their names: threads, provider, texture_px (256 to 2048; default 1024),
    delight_texture, ... The part of each photo around the head stays in memory until `clear` or `close`. Raises
    MaquetteError.
    """

    def __init__(
        self,
        bundle: str | os.PathLike[str] | None = None,
        texture: bool | None = None,
        **settings: Unpack[HeadBuilderSettings],
    ) -> None:
        n = native()
        self._progress = _FitProgress()
        self._callback = ProgressCallback(self._progress)  # as long as the builder, which has its address
        own: dict[str, Any] = {"progress_callback": self._callback.pointer}
        if bundle is not None:
            own["bundle_path"] = bundle
        if texture is not None:
            own["texture"] = "on" if texture else "off"
        config = n.config("maq_head_builder_config", {**settings, **own})
        super().__init__(n.create("maq_head_builder", n.context, config))

    def add_photo(
        self,
        image: ImageLike,
        box_px: Sequence[float] | None = None,
        roll_rad: float = 0,
        focal_px: float | None = None,
    ) -> None:
        """Encodes a photo. Several photos must show one person; each may have its own camera. See `photos`.

        image: a Frame, uint8 [H, W, 3] RGB or [H, W] grey, an image of Pillow, or the path of an image file. box_px: of
        the head with its hair: left, top, right, bottom (`Person.head_box_px` of dense pose works); None: it is
        detected, reliably only for one large head per photo. roll_rad: rotation of the head in the photo's plane,
        clockwise from upright; exact to some 30 degrees is enough. focal_px: focal length in pixels of this photo;
        None: it is estimated. Raises MaquetteError, with the status MAQ_ERROR_NOT_FOUND if there is no head; the
        builder stays as it was.
        """
        n = native()
        settings: dict[str, Any] = {"roll_rad": roll_rad}
        if box_px is not None:
            settings["box_px"] = _numbers("box_px", box_px, "left, top, right, bottom")
            if not any(settings["box_px"]):  # to the C API it would mean that there is none
                raise ValueError("box_px is 0, 0, 0, 0, which is empty; give the head's box, or None to detect it")
        if focal_px is not None:
            if focal_px == 0:
                raise ValueError("focal_px is 0; give the focal length, or None to have it estimated")
            settings["focal_px"] = focal_px
        frame = as_frame(image)
        n.call("maq_head_builder_add_photo", self.handle, frame.handle, n.config("maq_head_photo", settings))

    def add_head(self, head: Head) -> None:
        """Uses `head` as prior for later fits, so that its photos are not needed again. head: of the same person,
        fitted with the same bundle, such as a head from a file; another call replaces it. Its cameras come first in the
        fitted head, and a known size stays. Raises MaquetteError, with the status MAQ_ERROR_UNSUPPORTED for a head of
        another bundle, or from a file of version 1."""
        native().call("maq_head_builder_add_head", self.handle, head.handle)

    def clear(self) -> None:
        """Forgets the photos and the prior head, so that another person's head can be fitted."""
        native().call("maq_head_builder_clear", self.handle)

    def fit(
        self,
        seconds: float = 3.0,
        progress: Progress | None = None,
        preview: Callable[[Head], None] | None = None,
        preview_interval_s: float = 1.0,
    ) -> Head:
        """Fits one head to the photos so far. The first stage finds cameras and a shape in milliseconds; with `seconds`
        0 that is the result. The second stage fits shape and colours to the pixels, for up to `seconds` or until it
        converges. More photos may be added afterwards and all be fitted again.

        progress: called with the fraction done and the stage, a sentence; returns False to cancel. preview: called with
        the head as far as it is fitted, first with the network's head, then every preview_interval_s seconds; the fit
        waits. Neither may call the builder, except `cancel`. Raises MaquetteError, with the status MAQ_CANCELLED if it
        was cancelled, and the errors of the callbacks; Ctrl-C ends it.
        """
        n, handle, callback = native(), self.handle, self._callback
        fit = functools.partial(n.create, "maq_head", handle, float(seconds), function="maq_head_builder_fit")
        self._progress.current = progress
        try:
            if preview is None:
                return Head(callback.run(fit))

            def show(_: Any, head: Any) -> None:
                preview(Head(n.ffi.gc(head, n.lib.maq_head_destroy)))

            shown = n.ffi.callback("maq_head_preview_callback", show, onerror=callback.keep)
            n.call("maq_head_builder_set_preview", handle, float(preview_interval_s), shown, n.ffi.NULL)
            try:
                return Head(callback.run(fit))
            finally:
                n.call("maq_head_builder_set_preview", handle, 0, n.ffi.NULL, n.ffi.NULL)
        finally:
            self._progress.current = None

    def cancel(self) -> None:
        """Ends the running `add_photo` or `fit`, or else the next one, with MAQ_CANCELLED. Any thread may call it."""
        native().call("maq_head_builder_cancel", self.handle)

    @property
    def photos(self) -> list[HeadPhoto]:
        """Results for the photos, in the order of `add_photo`."""
        count = self.stats["photo_count"]
        found = native().indexed("maq_head_builder_get_photo", self.handle, "maq_head_photo_info", count)
        return [HeadPhoto(tuple(p.box_px), p.head_coverage, bool(p.is_used), p.focal_px, p.rms_px) for p in found]

    @property
    def stats(self) -> dict[str, Any]:
        """Times and counts, of the photos so far and of the latest fit: the fields of maq_head_build_stats."""
        return native().stats("maq_head_build_stats", "maq_head_builder_get_stats", self.handle)


class HeadRenderer(NativeObject):
    """Renders the mesh of a head from any camera. It does not need the mesh afterwards.

        renderer = maquette.HeadRenderer(head.mesh())
        rgb = renderer.run(renderer.camera(yaw_rad=0.5)).rgb

    shading: what colours show: "colour", "shape" (grey), "normals", "template" (template points) or "depth".
    background: red, green, blue, 0 to 255, over which images are composed; None: they are not. settings: fields of
    maq_head_renderer_config by their names: threads, shading_strength, disable_antialiasing, near_m, ... Raises
    MaquetteError.
    """

    def __init__(
        self,
        mesh: HeadMesh,
        shading: HeadShading = "colour",
        background: Sequence[int] | None = None,
        **settings: Unpack[HeadRendererSettings],
    ) -> None:
        n = native()
        own: dict[str, Any] = {"shading": shading, "image_pool_size": 4}
        if background is not None:
            own |= {"use_background": 1, "background": _numbers("background", background, "red, green, blue")}
        config = n.config("maq_head_renderer_config", {**own, **settings})
        self._lender = Lender(config.image_pool_size)
        super().__init__(n.create("maq_head_renderer", n.context, config, mesh.handle))

    def camera(
        self, yaw_rad: float = 0, pitch_rad: float = 0, width_px: int = 640, height_px: int = 480
    ) -> PinholeCamera:
        """A camera that sees the whole head from any side. yaw_rad: angle to the person's left of the front; pitch_rad:
        angle above. Raises MaquetteError."""
        n = native()
        camera = n.sized("maq_pinhole_camera")
        n.call("maq_head_renderer_get_camera", self.handle, yaw_rad, pitch_rad, width_px, height_px, camera)
        return PinholeCamera.of_struct(camera)

    def set_shading(self, shading: HeadShading) -> None:
        """Sets the shading of later images."""
        n = native()
        n.call("maq_head_renderer_set_shading", self.handle, n.value_of("maq_head_shading", shading, "shading"))

    def run(self, camera: PinholeCamera) -> Image:
        """Renders the view of a camera, without distortion and outside of the head: `camera`, `Head.camera`, or another
        in the head's frame. One call at a time. Raises MaquetteError."""
        return rendered(self._lender, self.handle, camera.to_struct(), "maq_head_renderer_run", of_head=True)


def _numbers(name: str, values: Sequence[float], meaning: str) -> list[Any]:
    """Checks the count of numbers by `meaning`: C would fill missing numbers with 0."""
    given, count = np.asarray(values).tolist(), meaning.count(",") + 1
    if np.shape(values) != (count,):
        raise ValueError(f"{name} is {given}; it is {count} numbers: {meaning}")
    return given
