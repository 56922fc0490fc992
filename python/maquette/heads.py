"""Heads: a 3D head, closed, coloured and in metres, from one photo of a person or several.

A face is biometric data: ask the person, and keep heads as you would keep passwords (docs/heads.md). Points of a head
are in metres: x to the person's left, y to the back of the head, z up, the origin in its middle.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from maquette.frames import Frame, as_frame
from maquette.native import NativeObject, ProgressCallback, native
from maquette.scenes import PinholeCamera

SCALES = ("prior", "given", "depth")
SHADINGS = ("colour", "shape", "normals", "template", "depth")
TOPOLOGIES = ("field", "template")
_ALL_TRIANGLES = 0xFFFFFFFF  # MAQ_HEAD_ALL_TRIANGLES


@dataclass(frozen=True)
class HeadPhoto:
    """What was found of a photo. box_px: in which the head was seen, given or found: left, top, right, bottom, the
    latter two exclusive. head_fraction: how much of the box's surroundings the network sees as head, 0 to 1. The rest
    is of the latest fit, and 0 before. is_used: whether the head was fitted to it; a photo without a head, or with
    another one than the other photos, is left out. focal_px: of the camera, given or estimated. rms_px: root mean
    square distance of points of the head from where the network saw them."""

    box_px: tuple[float, float, float, float]
    head_fraction: float
    is_used: bool
    focal_px: float
    rms_px: float


@dataclass(frozen=True)
class HeadInfo:
    """photo_count: photos that the head was fitted to. scale: where its size is from: "prior" (heads are that large on
    average: photos alone do not tell), "given" (a known distance) or "depth" (a depth camera). scale_sigma: standard
    deviation of its size, as a fraction of it; 0: not known. texture_px: pixels a side; 0: it has no texture."""

    photo_count: int
    scale: str
    scale_sigma: float
    texture_px: int


@dataclass(frozen=True, eq=False)
class HeadLandmark:
    """A place that has a name. point_m: float64 [3]. sigma_m: standard deviation of each coordinate that the shape
    model and the photos leave: more where they do not show it, or along their lines of sight; that of the size comes
    on top."""

    point_m: np.ndarray
    sigma_m: float


@dataclass(frozen=True, eq=False)
class MorphTarget:
    """How vertices move in a facial action at its strongest: to position + weight * move, with weights of 0 to 1.

    name: one of ARKit's 52, such as jawOpen or eyeBlinkLeft; left is the person's. vertices: uint32 [N], increasing;
    all others stay. moves_m: float32 [N, 3].
    """

    name: str
    vertices: np.ndarray
    moves_m: np.ndarray


@dataclass(frozen=True, eq=False)
class HeadMesh:
    """A mesh of V vertices and F triangles, cut off below the chin, and closed but for the template's topology.

    positions_m: float32 [V, 3]. normals: float32 [V, 3], outwards, of length 1. colours: uint8 [V, 3], sRGB.
    template_points_m: float32 [V, 3], where each vertex lies on the template head, which is the same place (the tip of
    the nose, say) on every head. triangles: uint32 [F, 3], counter-clockwise seen from outside. simplification_error_m:
    the largest distance of a vertex of the full mesh from this one. texture_coordinates: float32 [V, 2], u to the
    right and v down, 0 to 1. texture_jpeg: a JPEG file, square; `Frame.decode` reads it. Both are None where the head
    has no texture; where it has one, vertices around the cut are there twice. With the template's topology there are
    coordinates without a texture, and morph_targets; vertices at seams of the texture are there twice.
    """

    positions_m: np.ndarray
    normals: np.ndarray
    colours: np.ndarray
    template_points_m: np.ndarray
    triangles: np.ndarray
    simplification_error_m: float = 0.0
    texture_coordinates: np.ndarray | None = None
    texture_jpeg: bytes | None = None
    morph_targets: tuple[MorphTarget, ...] = ()


class Head(NativeObject):
    """One head, of `HeadBuilder.fit` or `Head.open("head.maqh")`. It holds no photo; a texture has the face's
    pixels."""

    @staticmethod
    def open(file: str | Path | bytes) -> Head:
        """Reads a file that `save` wrote, by its path or its bytes; no network is needed. Raises MaquetteError."""
        n = native()
        if isinstance(file, bytes):
            data = n.ffi.from_buffer(file)
            return Head(n.create("maq_head", n.context, data, len(file), function="maq_head_open_memory"))
        return Head(n.create("maq_head", n.context, str(file).encode(), function="maq_head_open"))

    def scaled_by_distance(self, start: str, end: str, distance_m: float) -> Head:
        """The same head, of the size at which the two places (see `landmark`) are `distance_m` apart (0.001 to 10),
        such as pupil_left and pupil_right by what an optician measured. Raises MaquetteError."""
        names = start.encode(), end.encode()
        arguments = ("maq_head", self.handle, *names, float(distance_m))
        return Head(native().create(*arguments, function="maq_head_scale_by_distance"))

    def scaled_by_depth(self, depth: Frame | np.ndarray, camera: int = 0) -> Head:
        """The same head, of the size at which it lies where a depth camera saw it.

        depth: of the same view as the photo with this camera, in any size: a Frame that is depth or has depth, float32
        [H, W] in metres or uint16 [H, W] in millimetres. The photo should have been given its focal_px: an estimated
        one that is 10 % too long makes the head as much too small. Raises MaquetteError, with the status
        MAQ_ERROR_NOT_FOUND where half of the head has no depth that agrees with it.
        """
        frame = as_frame(depth)
        arguments = ("maq_head", self.handle, camera, frame.handle)
        return Head(native().create(*arguments, function="maq_head_scale_by_depth"))

    def save(self, path: str | Path) -> None:
        """Writes a head file (.maqh), some 64 KB and the texture, atomically. Raises MaquetteError."""
        native().call("maq_head_save", self.handle, str(path).encode())

    def export(self, path: str | Path, triangle_count: int | str = 0, cell_m: float = 0, topology: str = "field",
               bundle: str | Path | None = None) -> None:  # fmt: skip
        """Writes its mesh for other programs: .glb, .obj with a .mtl beside it, or .ply; the first two have the
        texture, the first has morph targets. In files x is to the person's left, y up, z to the front. Options: as of
        `mesh`. Raises MaquetteError."""
        options = _mesh_options(triangle_count, cell_m, topology, bundle)
        native().call("maq_head_export", self.handle, str(path).encode(), options)

    @property
    def info(self) -> HeadInfo:
        info = native().sized("maq_head_info")
        native().call("maq_head_get_info", self.handle, info)
        return HeadInfo(info.photo_count, SCALES[info.scale], info.scale_sigma, info.texture_px)

    def mesh(self, triangle_count: int | str = 0, cell_m: float = 0, topology: str = "field",
             bundle: str | Path | None = None) -> HeadMesh:  # fmt: skip
        """The surface, made in a second or less; the same again costs nothing.

        triangle_count: about as many, 100 or more, or "all"; 0: 60,000, or all where there is a cell_m. cell_m:
        distance of neighbouring vertices of the full mesh, about, 0.0005 to 0.02; 0: 0.0016, or 0.0021 where no more
        than 60,000 triangles are to be left. topology: "field", the surface as it is, or "template": vertices,
        triangles and texture coordinates are the same for every head, with facial actions; triangle_count and cell_m
        are 0 then. bundle: folder of the bundle whose template it is, for a
        head from a file; default: the installed one. Raises MaquetteError.
        """
        n = native()
        mesh = n.sized("maq_head_mesh")
        n.call("maq_head_get_mesh", self.handle, _mesh_options(triangle_count, cell_m, topology, bundle), mesh)

        def copied(pointer: Any, shape: tuple[int, ...], kind: type) -> np.ndarray:
            size = int(np.prod(shape)) * np.dtype(kind).itemsize
            return np.frombuffer(n.ffi.buffer(pointer, size), kind).reshape(shape).copy()

        def morph_target(index: int) -> MorphTarget:
            target = n.sized("maq_head_morph_target")
            n.call("maq_head_get_morph_target", self.handle, index, target)
            return MorphTarget(
                n.ffi.string(target.name).decode(),
                copied(target.vertices, (target.vertex_count,), np.uint32),
                copied(target.moves_m, (target.vertex_count, 3), np.float32),
            )

        vertices = mesh.vertex_count
        has_texture, has_coordinates = mesh.texture_bytes > 0, mesh.texture_coordinates != n.ffi.NULL
        return HeadMesh(
            copied(mesh.positions_m, (vertices, 3), np.float32),
            copied(mesh.normals, (vertices, 3), np.float32),
            copied(mesh.colours_rgb, (vertices, 3), np.uint8),
            copied(mesh.template_points_m, (vertices, 3), np.float32),
            copied(mesh.triangles, (mesh.triangle_count, 3), np.uint32),
            mesh.simplification_error_m,
            copied(mesh.texture_coordinates, (vertices, 2), np.float32) if has_coordinates else None,
            bytes(n.ffi.buffer(mesh.texture_jpeg, mesh.texture_bytes)) if has_texture else None,
            tuple(morph_target(index) for index in range(mesh.morph_target_count)),
        )

    def landmark(self, name: str) -> HeadLandmark:
        """A place by its name: nose_tip, nose_bridge, chin, crown, pupil_left, pupil_right, temple_left, temple_right,
        ear_top_left, ear_top_right, ear_bottom_left, ear_bottom_right; left is the person's. Raises MaquetteError."""
        n = native()
        found = n.sized("maq_head_landmark")
        n.call("maq_head_get_landmark", self.handle, name.encode(), found)
        return HeadLandmark(np.array(list(found.point_m)), found.sigma_m)

    def landmarks(self) -> dict[str, HeadLandmark]:
        """All places that this head has, by their names."""
        n, handle, names = native(), self.handle, []
        while name := n.lib.maq_head_get_landmark_name(handle, len(names)):
            names.append(n.ffi.string(name).decode())
        return {name: self.landmark(name) for name in names}

    def camera(self, index: int = 0) -> PinholeCamera:
        """Of a photo that the head was fitted to (`HeadPhoto.is_used`), in the order they were added: what
        `HeadRenderer.run` draws with it lies on the head in the photo. Raises MaquetteError."""
        n = native()
        camera = n.sized("maq_pinhole_camera")
        n.call("maq_head_get_camera", self.handle, index, camera)
        return PinholeCamera.of_struct(camera)


class HeadBuilder(NativeObject):
    """The network, loaded once, and photos of one person at a time.

        builder = maquette.HeadBuilder()
        builder.add_photo(rgb)
        head = builder.fit(seconds=3)
        head.export("head.glb")

    bundle: a folder with manifest.json (default: the one that comes with the package). settings: fields of
    maq_head_config by their names: threads, provider, texture_px (256 to 2048; 0, the default, makes no texture),
    texture_mirrored (what no photo sees of one side looks like the other), texture_unlit (the photos' light from one
    side is taken out of the texture), ... The part of each photo around the head stays in memory until `clear` or
    `close`. Raises MaquetteError.
    """

    def __init__(self, bundle: str | Path | None = None, **settings: Any) -> None:
        n = native()
        if bundle is not None:
            settings["bundle_path"] = Path(bundle)
        super().__init__(n.create("maq_head_builder", n.context, n.config("maq_head_config", settings)))

    def add_photo(
        self,
        image: Frame | np.ndarray,
        box_px: Sequence[float] | None = None,
        roll_rad: float = 0,
        focal_px: float | None = None,
    ) -> None:
        """Looks at a photo; several must be of one person, each may have its own camera. `photos` has what was found.

        image: a Frame, or uint8 [H, W, 3] RGB or [H, W] grey. box_px: of the head with its hair: left, top, right,
        bottom (`Person.head_box_px` of dense pose will do); None: it is looked for, which finds it where it is alone
        in the photo and not small. roll_rad: how far the head is turned in the photo's plane, clockwise from upright;
        it need be right to some 30 degrees. focal_px: of the camera, in pixels of this photo; None: it is estimated.
        Raises MaquetteError, with the status MAQ_ERROR_NOT_FOUND where there is no head; the builder stays as it was.
        """
        n = native()
        settings: dict[str, Any] = {"roll_rad": roll_rad}
        if box_px is not None:
            settings["box_px"] = _numbers("box_px", box_px, "left, top, right, bottom")
            if not any(settings["box_px"]):  # to the C API it would mean that there is none
                raise ValueError("box_px is 0, 0, 0, 0, which is empty; give the head's box, or None to look for it")
        if focal_px is not None:
            if focal_px == 0:
                raise ValueError("focal_px is 0; give the focal length, or None to have it estimated")
            settings["focal_px"] = focal_px
        frame = as_frame(image)
        n.call("maq_head_builder_add_photo", self.handle, frame.handle, n.config("maq_head_photo", settings))

    def add_head(self, head: Head) -> None:
        """Adds the photos of this builder to those that `head` was fitted to, which are not needed: later fits go on
        from what they said. head: of the same person, fitted with the same bundle, such as one from a file; another
        takes its place. Its cameras come first in the head that is fitted, and a size that was known stays. Raises
        MaquetteError, with the status MAQ_ERROR_UNSUPPORTED for a head of another bundle, or from a file of
        version 1."""
        native().call("maq_head_builder_add_head", self.handle, head.handle)

    def clear(self) -> None:
        """Forgets the photos, and the head that they would be added to, for a head of another person."""
        native().call("maq_head_builder_clear", self.handle)

    def fit(
        self,
        seconds: float = 3.0,
        progress: Callable[[float], bool | None] | None = None,
        preview: Callable[[Head], None] | None = None,
        preview_interval_s: float = 1.0,
    ) -> Head:
        """Fits one head to the photos so far: cameras and a first shape in milliseconds, which is the head where
        `seconds` is 0, then shape and colours to the pixels for up to `seconds`, or until that gains no more. More
        photos may be added afterwards and all be fitted again.

        progress: called with the fraction done; returns False to cancel. preview: called with the head as far as it is
        fitted, at first with what the network saw, then every preview_interval_s seconds; the fit waits. Neither may
        call the builder. Raises MaquetteError, with the status MAQ_CANCELLED where it was cancelled, and what the
        callbacks raise; Ctrl-C ends it.
        """
        n, handle = native(), self.handle
        callback = ProgressCallback(progress, "maq_head_progress_callback")
        arguments = ("maq_head", handle, float(seconds), callback.pointer, n.ffi.NULL)
        if preview is None:
            return Head(callback.run(lambda: n.create(*arguments, function="maq_head_builder_fit")))

        def show(_: Any, head: Any) -> None:
            preview(Head(n.ffi.gc(head, n.lib.maq_head_destroy)))

        shown = n.ffi.callback("maq_head_preview_callback", show, onerror=callback.keep)
        n.call("maq_head_builder_set_preview", handle, float(preview_interval_s), shown, n.ffi.NULL)
        try:
            return Head(callback.run(lambda: n.create(*arguments, function="maq_head_builder_fit")))
        finally:
            n.call("maq_head_builder_set_preview", handle, 0, n.ffi.NULL, n.ffi.NULL)

    def cancel(self) -> None:
        """Ends the `add_photo` or `fit` that runs, or else the next, with MAQ_CANCELLED. May be called by another
        thread."""
        native().call("maq_head_builder_cancel", self.handle)

    @property
    def photos(self) -> list[HeadPhoto]:
        """What was found of each photo, in the order they were added."""
        count = self.stats["photo_count"]
        found = native().indexed("maq_head_builder_get_photo", self.handle, "maq_head_photo_info", count)
        return [HeadPhoto(tuple(p.box_px), p.head_fraction, bool(p.is_used), p.focal_px, p.rms_px) for p in found]

    @property
    def stats(self) -> dict[str, float]:
        """Times and counts, of the photos so far and of the latest fit: the fields of maq_head_stats."""
        return native().stats("maq_head_stats", "maq_head_builder_get_stats", self.handle)


@dataclass(frozen=True, eq=False)
class HeadImage:
    """A picture of a head, H x W pixels. rgb: uint8 [H, W, 3], what the renderer's shading says. alpha: uint8 [H, W],
    coverage by the head. depth_m: float32 [H, W], along the optical axis. normals: float32 [H, W, 3], outwards, in the
    camera (x right, y down, z forward), of length 1. template_points_m: float32 [H, W, 3], on the template head.
    All are 0 where there is no head."""

    rgb: np.ndarray
    alpha: np.ndarray
    depth_m: np.ndarray
    normals: np.ndarray
    template_points_m: np.ndarray


class HeadRenderer(NativeObject):
    """Draws the mesh of a head, which it needs no longer afterwards, from any camera.

        renderer = maquette.HeadRenderer(head)
        rgb = renderer.run(renderer.camera(yaw_rad=0.5)).rgb

    shading: what colours show: "colour", "shape" (grey), "normals", "template" (template points) or "depth".
    background: red, green, blue, 0 to 255, over which pictures are composed; None: they are not. triangle_count,
    cell_m, topology, bundle: of the mesh, as `Head.mesh` has them. settings: fields of maq_head_renderer_config by
    their names: threads, light, smooth_edges, near_m, ... Raises MaquetteError.
    """

    def __init__(
        self,
        head: Head,
        shading: str = "colour",
        background: Sequence[int] | None = None,
        triangle_count: int | str = 0,
        cell_m: float = 0,
        topology: str = "field",
        bundle: str | Path | None = None,
        **settings: Any,
    ) -> None:
        n = native()
        if background is not None:
            settings |= {"use_background": 1, "background": _numbers("background", background, "red, green, blue")}
        mesh = _mesh_options(triangle_count, cell_m, topology, bundle)
        config = n.config("maq_head_renderer_config", {"shading": _shading(shading), "mesh": mesh, **settings})
        super().__init__(n.create("maq_head_renderer", n.context, config, head.handle))

    def camera(
        self, yaw_rad: float = 0, pitch_rad: float = 0, width_px: int = 640, height_px: int = 480
    ) -> PinholeCamera:
        """One that sees the whole head, whichever way it is turned. yaw_rad: how far it stands to the person's left of
        the front; pitch_rad: how far above. Raises MaquetteError."""
        n = native()
        camera = n.sized("maq_pinhole_camera")
        n.call("maq_head_renderer_get_camera", self.handle, yaw_rad, pitch_rad, width_px, height_px, camera)
        return PinholeCamera.of_struct(camera)

    def set_shading(self, shading: str) -> None:
        """Has later pictures show something else."""
        native().call("maq_head_renderer_set_shading", self.handle, _shading(shading))

    def run(self, camera: PinholeCamera) -> HeadImage:
        """The head as a camera sees it, one without distortion and outside of the head: `camera`, `Head.camera`, or
        any other in the head's coordinates. One call at a time. Raises MaquetteError."""
        n = native()
        image = n.create("maq_head_image", self.handle, camera.to_struct(), function="maq_head_renderer_run",
                         release="maq_head_image_release")  # fmt: skip
        shape = camera.intrinsics.height_px, camera.intrinsics.width_px

        def plane(which: int, channels: tuple[int, ...], kind: type) -> np.ndarray:
            return n.plane("maq_head_image_get_plane", image, which, (*shape, *channels), kind)

        bgr = plane(n.lib.MAQ_HEAD_PLANE_BGR, (3,), np.uint8)
        made = HeadImage(
            np.ascontiguousarray(bgr[..., ::-1]),
            plane(n.lib.MAQ_HEAD_PLANE_ALPHA, (), np.uint8),
            plane(n.lib.MAQ_HEAD_PLANE_DEPTH, (), np.float32),
            plane(n.lib.MAQ_HEAD_PLANE_NORMALS, (3,), np.float32),
            plane(n.lib.MAQ_HEAD_PLANE_TEMPLATE_POINTS, (3,), np.float32),
        )
        n.ffi.release(image)
        return made


def _mesh_options(triangle_count: int | str, cell_m: float, topology: str, bundle: str | Path | None) -> Any:
    if isinstance(triangle_count, str):
        if triangle_count != "all":
            raise ValueError(f'triangle_count is "{triangle_count}"; it is a number or "all"')
        triangle_count = _ALL_TRIANGLES
    if topology not in TOPOLOGIES:
        raise ValueError(f'topology is "{topology}"; it is one of {", ".join(TOPOLOGIES)}')
    settings = {"triangle_count": triangle_count, "cell_m": cell_m, "topology": TOPOLOGIES.index(topology)}
    if bundle is not None:
        settings["bundle_path"] = bundle
    return native().config("maq_head_mesh_options", settings)


def _shading(name: str) -> int:
    if name not in SHADINGS:
        raise ValueError(f'shading is "{name}"; it is one of {", ".join(SHADINGS)}')
    return SHADINGS.index(name) + 1


def _numbers(name: str, values: Sequence[float], meaning: str) -> list:
    """As many as `meaning` names: C would fill up what is missing with 0."""
    given, count = np.asarray(values).tolist(), meaning.count(",") + 1
    if np.shape(values) != (count,):
        raise ValueError(f"{name} is {given}; it is {count} numbers: {meaning}")
    return given
