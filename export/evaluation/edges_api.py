"""The C API of the SDK through ctypes: edges of depth frames, and depth sources, as an app gets them (edges.h)."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Iterator
from contextlib import contextmanager
from ctypes import POINTER, byref, c_char_p, c_double, c_float, c_int32, c_int64, c_size_t, c_uint32
from ctypes import c_void_p as Handle
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from export.evaluation.maquette_api import FrameDesc, Library, MaquetteError, Signatures, values_of

PIXEL_DEPTH32F = 8
PLANE_DISTANCE, PLANE_SPREAD, PLANE_KIND, PLANE_DEPTH = 1, 2, 3, 4
LINE, ARC, SPLINE = 0, 1, 2
_NO_WAIT_NS = 0


class _Config(ctypes.Structure):
    c_name = "maq_edges_config"
    _fields_ = (
        ("struct_size", c_uint32),
        ("threads", c_int32),
        ("bundle_path", c_char_p),
        ("bundle_files", Handle),
        ("bundle_file_count", c_uint32),
        ("result_pool_size", c_uint32),
        ("allow_spinning", c_int32),
        ("provider", c_int32),
        ("skip_planes", c_int32),
    )


class _Side(ctypes.Structure):
    _fields_ = (("is_known", c_int32), ("normal", c_double * 3), ("offset_m", c_double))


class _Curve(ctypes.Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("type", c_int32),
        ("kind", c_int32),
        ("bend", c_int32),
        ("is_closed", c_int32),
        ("corners", c_int32 * 2),
        ("length_m", c_double),
        ("rms_r", c_double),
        ("points_m", POINTER(c_double)),
        ("point_count", c_uint32),
        ("control_count", c_uint32),
        ("controls_m", POINTER(c_double)),
        ("centre_m", c_double * 3),
        ("x_axis_m", c_double * 3),
        ("y_axis_m", c_double * 3),
        ("sweep_rad", c_double),
        ("sides", _Side * 2),
    )


class _Box(ctypes.Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("corner_count", c_int32),
        ("size_m", c_double * 3),
        ("plus_minus_m", c_double * 3),
        ("axes", c_double * 9),
        ("centre_m", c_double * 3),
    )


class _CurvesStats(ctypes.Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("curves_ms", c_float),
        ("boxes_ms", c_float),
        ("bad_pixel_count", c_int32),
        ("voting_pixel_count", c_int32),
        ("chain_count", c_int32),
        ("short_chain_count", c_int32),
        ("without_depth_count", c_int32),
        ("not_fitted_count", c_int32),
        ("over_limit_count", c_int32),
    )


class Intrinsics(ctypes.Structure):
    _fields_ = (
        ("width_px", c_int32),
        ("height_px", c_int32),
        ("fx_px", c_double),
        ("fy_px", c_double),
        ("cx_px", c_double),
        ("cy_px", c_double),
        ("distortion", c_double * 8),
    )


class _Stats(ctypes.Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("depth_ms", c_float),
        ("skip_ms", c_float),
        ("slopes_ms", c_float),
        ("network_ms", c_float),
        ("decode_ms", c_float),
        ("total_ms", c_float),
        ("known_pixel_count", c_int64),
        ("network_pixel_count", c_int64),
        ("broken_pixel_count", c_int64),
        ("provider", c_int32),
        ("threads", c_int32),
        ("is_threads_measured", c_int32),
    )


@dataclass(frozen=True)
class EdgesStats:
    """What one run did; see maq_edges_stats in edges.h. Times in milliseconds."""

    depth_ms: float
    skip_ms: float
    slopes_ms: float
    network_ms: float
    decode_ms: float
    total_ms: float
    known_pixel_count: int
    network_pixel_count: int
    broken_pixel_count: int
    provider: int
    threads: int
    is_threads_measured: int


@dataclass(frozen=True, eq=False)
class EdgesResult:
    """Planes [H, W]: distance and spread float32 in r, kind uint8 (0 none, 1 crease, 2 boundary). curves: if asked
    for."""

    distance: np.ndarray
    spread: np.ndarray
    kind: np.ndarray
    stats: EdgesStats
    curves: Curves | None = None


@dataclass(frozen=True, eq=False)
class Curves:
    """types: LINE, ARC or SPLINE of each curve; kinds: 1 crease, 2 boundary; points: its polyline, float64 [n, 3] in
    metres. boxes_m: the three sides of each box, the longest first. Times in milliseconds."""

    types: list[int]
    kinds: list[int]
    points: list[np.ndarray]
    boxes_m: list[tuple[float, float, float]]
    curves_ms: float
    boxes_ms: float


@dataclass(frozen=True)
class Pinhole:
    """Focal length and principal point in pixels; pixels are square."""

    focal_px: float
    cx_px: float
    cy_px: float

    @staticmethod
    def centred(shape: tuple[int, int], focal_px: float) -> Pinhole:
        """Of a frame [H, W] whose principal point is its middle."""
        return Pinhole(focal_px, (shape[1] - 1) / 2, (shape[0] - 1) / 2)


_EDGES: Signatures = {
    "maq_edges_config_init": (POINTER(_Config), c_uint32),
    "maq_edges_create": (Handle, POINTER(_Config), POINTER(Handle)),
    "maq_edges_run": (Handle, Handle, POINTER(Intrinsics), POINTER(Handle)),
    "maq_edges_result_get_plane": (Handle, c_int32, POINTER(Handle), POINTER(c_size_t)),
    "maq_edges_result_get_stats": (Handle, POINTER(_Stats)),
    "maq_edges_result_find_curves": (Handle, Handle, POINTER(Handle)),
    "maq_edges_curves_get_curve": (Handle, c_uint32, POINTER(_Curve)),
    "maq_edges_curves_get_box": (Handle, c_uint32, POINTER(_Box)),
    "maq_edges_curves_get_stats": (Handle, POINTER(_CurvesStats)),
}
_SOURCES: Signatures = {
    "maq_source_create": (Handle, c_char_p, Handle, POINTER(Handle)),
    "maq_source_get_intrinsics": (Handle, POINTER(Intrinsics)),
    "maq_source_acquire_frame": (Handle, c_int64, POINTER(Handle)),
    "maq_frame_get_desc": (Handle, POINTER(FrameDesc)),
}


class Edges:
    """One bundle, loaded by libmaquette. Use it in a `with` statement, or call close().

    bundle: folder with manifest.json. threads: 0 lets the library choose. library: libmaquette.so (default: MAQ_LIBRARY
    or the release build). settings: further fields of maq_edges_config by their names. Raises MaquetteError.

    `library` and `result_of` are for wrappers of what the C API makes of results.
    """

    def __init__(self, bundle: Path, threads: int = 0, library: Path | None = None, **settings: int) -> None:
        released = ("maq_edges_destroy", "maq_edges_result_release", "maq_edges_curves_release")
        self.library = Library(library, _EDGES, released)
        for name in ("maq_edges_curves_get_curve_count", "maq_edges_curves_get_box_count"):
            count = getattr(self.library.functions, name)
            count.argtypes, count.restype = (Handle,), c_uint32
        self._edges = Handle()
        config = self.library.filled(_Config, {"bundle_path": os.fsencode(bundle), "threads": threads, **settings})
        self.library.call("maq_edges_create", self.library.context, byref(config), byref(self._edges))

    def __enter__(self) -> Edges:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        self.library.free("maq_edges_destroy", self._edges)
        self.library.close()
        self._edges = Handle()

    def run(self, depth: np.ndarray, camera: Pinhole, curves: bool = False) -> EdgesResult:
        """depth: float32 [H, W] in metres, 0 where unknown. curves: find them and boxes too. Raises MaquetteError."""
        with self.result_of(depth, camera) as result:
            return self.copied(result, depth.shape, self._find_curves(result) if curves else None)

    @contextmanager
    def result_of(self, depth: np.ndarray, camera: Pinhole) -> Iterator[Handle]:
        """The library's own result of a frame as that of `run`, which is released at the end. Raises MaquetteError."""
        if depth.dtype != np.float32 or depth.ndim != 2:
            raise ValueError(f"depth is float32 [H, W], not {depth.dtype} {depth.shape}")
        depth, result = np.ascontiguousarray(depth), Handle()
        height, width = depth.shape
        given = Intrinsics(width, height, camera.focal_px, camera.focal_px, camera.cx_px, camera.cy_px)
        with self.library.frame(depth, PIXEL_DEPTH32F) as frame:
            try:
                self.library.call("maq_edges_run", self._edges, frame, byref(given), byref(result))
                yield result
            finally:
                self.library.free("maq_edges_result_release", result)

    def _find_curves(self, result: Handle) -> Curves:
        found = Handle()
        self.library.call("maq_edges_result_find_curves", result, None, byref(found))
        return curves_of(self.library, found)

    def copied(self, result: Handle, shape: tuple[int, int], curves: Curves | None = None) -> EdgesResult:
        """What the library's result of a frame [H, W] holds."""
        planes = ((PLANE_DISTANCE, np.float32), (PLANE_SPREAD, np.float32), (PLANE_KIND, np.uint8))
        copied = [self.library.plane("maq_edges_result_get_plane", result, n, shape, kind) for n, kind in planes]
        stats = _Stats(struct_size=ctypes.sizeof(_Stats))
        self.library.call("maq_edges_result_get_stats", result, byref(stats))
        return EdgesResult(*copied, values_of(stats, EdgesStats), curves)


def curves_of(library: Library, found: Handle) -> Curves:
    """What a handle of curves holds, which is released."""
    try:
        types, kinds, points, boxes = [], [], [], []
        curve, box = _Curve(struct_size=ctypes.sizeof(_Curve)), _Box(struct_size=ctypes.sizeof(_Box))
        for k in range(library.functions.maq_edges_curves_get_curve_count(found)):
            library.call("maq_edges_curves_get_curve", found, k, byref(curve))
            types.append(curve.type)
            kinds.append(curve.kind)
            points.append(np.ctypeslib.as_array(curve.points_m, (curve.point_count, 3)).copy())
        for k in range(library.functions.maq_edges_curves_get_box_count(found)):
            library.call("maq_edges_curves_get_box", found, k, byref(box))
            boxes.append(tuple(box.size_m))
        stats = _CurvesStats(struct_size=ctypes.sizeof(_CurvesStats))
        library.call("maq_edges_curves_get_stats", found, byref(stats))
        return Curves(types, kinds, points, boxes, stats.curves_ms, stats.boxes_ms)
    finally:
        library.free("maq_edges_curves_release", found)


def depth_frames(uri: str, count: int, library: Path | None = None) -> Iterator[tuple[np.ndarray, Pinhole]]:
    """The first frames of a source of MAQ_PIXEL_DEPTH32F, such as stub:solids: depth float32 [H, W] in metres, 0 where
    it is unknown, and the camera. Raises MaquetteError."""
    opened = Library(library, _SOURCES, ("maq_source_destroy",))
    source, frame, intrinsics = Handle(), Handle(), Intrinsics()
    try:
        opened.call("maq_source_create", opened.context, uri.encode(), None, byref(source))
        opened.call("maq_source_get_intrinsics", source, byref(intrinsics))
        camera = Pinhole(intrinsics.fx_px, intrinsics.cx_px, intrinsics.cy_px)
        for _ in range(count):
            opened.call("maq_source_acquire_frame", source, _NO_WAIT_NS, byref(frame))
            yield _depth_of(opened, frame, uri), camera
            opened.free("maq_frame_release", frame)
            frame = Handle()
    finally:
        opened.free("maq_frame_release", frame)
        opened.free("maq_source_destroy", source)
        opened.close()


def _depth_of(library: Library, frame: Handle, uri: str) -> np.ndarray:
    description = FrameDesc(struct_size=ctypes.sizeof(FrameDesc))
    library.call("maq_frame_get_desc", frame, byref(description))
    if description.format != PIXEL_DEPTH32F:
        raise MaquetteError(f"{uri} has frames of format {description.format}, not of depth (MAQ_PIXEL_DEPTH32F)")
    shape = description.height_px, description.width_px
    stride = description.stride_bytes[0] or 4 * shape[1]
    data = (ctypes.c_uint8 * ((shape[0] - 1) * stride + 4 * shape[1])).from_address(description.planes[0])
    depth = np.ndarray(shape, np.float32, data, strides=(stride, 4)).copy()
    return np.where(np.isfinite(depth) & (depth > 0), depth, 0).astype(np.float32)
