"""The C API of the SDK through ctypes: edges of depth frames, and depth sources, as an app gets them (edges.h)."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Iterator
from ctypes import POINTER, byref, c_char_p, c_double, c_float, c_int32, c_int64, c_size_t, c_uint32
from ctypes import c_void_p as Handle
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from export.evaluation.maquette_api import FrameDesc, Library, MaquetteError, Signatures, values_of

PIXEL_DEPTH32F = 8
PLANE_DISTANCE, PLANE_SPREAD, PLANE_KIND, PLANE_DEPTH = 1, 2, 3, 4
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


class _Intrinsics(ctypes.Structure):
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


@dataclass(frozen=True, eq=False)
class EdgesResult:
    """Planes [H, W]: distance and spread float32 in r, kind uint8 (0 none, 1 crease, 2 boundary)."""

    distance: np.ndarray
    spread: np.ndarray
    kind: np.ndarray
    stats: EdgesStats


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
    "maq_edges_run": (Handle, Handle, POINTER(_Intrinsics), POINTER(Handle)),
    "maq_edges_result_get_plane": (Handle, c_int32, POINTER(Handle), POINTER(c_size_t)),
    "maq_edges_result_get_stats": (Handle, POINTER(_Stats)),
}
_SOURCES: Signatures = {
    "maq_source_create": (Handle, c_char_p, Handle, POINTER(Handle)),
    "maq_source_get_intrinsics": (Handle, POINTER(_Intrinsics)),
    "maq_source_acquire_frame": (Handle, c_int64, POINTER(Handle)),
    "maq_frame_get_desc": (Handle, POINTER(FrameDesc)),
}


class Edges:
    """One bundle, loaded by libmaquette. Use it in a `with` statement, or call close().

    bundle: folder with manifest.json. threads: 0 lets the library choose. library: libmaquette.so (default: MAQ_LIBRARY
    or the release build). settings: further fields of maq_edges_config by their names. Raises MaquetteError.
    """

    def __init__(self, bundle: Path, threads: int = 0, library: Path | None = None, **settings: int) -> None:
        self._library = Library(library, _EDGES, ("maq_edges_destroy", "maq_edges_result_release"))
        self._edges = Handle()
        config = self._library.filled(_Config, {"bundle_path": os.fsencode(bundle), "threads": threads, **settings})
        self._library.call("maq_edges_create", self._library.context, byref(config), byref(self._edges))

    def __enter__(self) -> Edges:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        self._library.free("maq_edges_destroy", self._edges)
        self._library.close()
        self._edges = Handle()

    def run(self, depth: np.ndarray, camera: Pinhole) -> EdgesResult:
        """depth: float32 [H, W] in metres, 0 where unknown. Raises MaquetteError."""
        if depth.dtype != np.float32 or depth.ndim != 2:
            raise ValueError(f"depth is float32 [H, W], not {depth.dtype} {depth.shape}")
        depth, result = np.ascontiguousarray(depth), Handle()
        height, width = depth.shape
        given = _Intrinsics(width, height, camera.focal_px, camera.focal_px, camera.cx_px, camera.cy_px)
        with self._library.frame(depth, PIXEL_DEPTH32F) as frame:
            try:
                self._library.call("maq_edges_run", self._edges, frame, byref(given), byref(result))
                return self._copy(result, depth.shape)
            finally:
                self._library.free("maq_edges_result_release", result)

    def _copy(self, result: Handle, shape: tuple[int, int]) -> EdgesResult:
        planes = ((PLANE_DISTANCE, np.float32), (PLANE_SPREAD, np.float32), (PLANE_KIND, np.uint8))
        copied = [self._library.plane("maq_edges_result_get_plane", result, n, shape, kind) for n, kind in planes]
        stats = _Stats(struct_size=ctypes.sizeof(_Stats))
        self._library.call("maq_edges_result_get_stats", result, byref(stats))
        return EdgesResult(*copied, values_of(stats, EdgesStats))


def depth_frames(uri: str, count: int, library: Path | None = None) -> Iterator[tuple[np.ndarray, Pinhole]]:
    """The first frames of a source of MAQ_PIXEL_DEPTH32F, such as stub:solids: depth float32 [H, W] in metres, 0 where
    it is unknown, and the camera. Raises MaquetteError."""
    opened = Library(library, _SOURCES, ("maq_source_destroy",))
    source, frame, intrinsics = Handle(), Handle(), _Intrinsics()
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
