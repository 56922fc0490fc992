"""The C API of the SDK through ctypes: fusion of edges over views (edges_fusion.h), as an app gets it."""

from __future__ import annotations

import ctypes
import time
from ctypes import POINTER, byref, c_double, c_float, c_int32, c_size_t, c_uint32, c_uint64
from ctypes import c_void_p as Handle

import numpy as np

from export.camera import Camera
from export.evaluation.edges_api import Curves, Edges, EdgesResult, Intrinsics, Pinhole, curves_of
from export.evaluation.maquette_api import Signatures

# maq_edges_fusion_point
POINT = np.dtype([("point_m", "<f8", 3), ("normal", "<f4", 3), ("distance_m", "<f4"), ("r_m", "<f4"),
                  ("view_count", "<u4")])  # fmt: skip


class _Config(ctypes.Structure):
    c_name = "maq_edges_fusion_config"
    _fields_ = (
        ("struct_size", c_uint32),
        ("threads", c_int32),
        ("cell_m", c_double),
        ("max_pixels", c_uint64),
        ("max_points", c_uint64),
        ("min_views", c_int32),
        ("progress_callback", Handle),
        ("progress_user_data", Handle),
    )


class FusionInfo(ctypes.Structure):
    """maq_edges_fusion_info of edges_fusion.h."""

    _fields_ = (
        ("struct_size", c_uint32),
        ("view_count", c_uint32),
        ("blind_view_count", c_uint32),
        ("point_count", c_uint64),
        ("outside_pixel_count", c_uint64),
        ("mixed_point_count", c_uint64),
        ("cell_m", c_double),
        ("eps_r", c_float),
        ("fusion_ms", c_float),
    )


class _PinholeCamera(ctypes.Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("intrinsics", Intrinsics),
        ("rotation", c_double * 9),
        ("centre", c_double * 3),
    )


_FUSION: Signatures = {
    "maq_edges_fusion_config_init": (POINTER(_Config), c_uint32),
    "maq_edges_fusion_create": (Handle, POINTER(_Config), POINTER(Handle)),
    "maq_edges_fusion_add_view": (Handle, Handle, POINTER(_PinholeCamera)),
    "maq_edges_fusion_finish": (Handle,),
    "maq_edges_fusion_get_info": (Handle, POINTER(FusionInfo)),
    "maq_edges_fusion_copy_points": (Handle, Handle, c_size_t),
    "maq_edges_fusion_find_curves": (Handle, POINTER(Handle)),
}


class Fusion:
    """Views of one thing, found by `edges`, which must outlive it. Use it in a `with` statement, or call close().

    settings: fields of maq_edges_fusion_config by their names. seconds: what add_view, finish and find_curves of the
    library have taken, wall-clock, without the network; cpu_seconds: of all threads of the process in that time. Raises
    MaquetteError, as all methods do.
    """

    def __init__(self, edges: Edges, **settings: float) -> None:
        self._edges, self._library, self._fusion = edges, edges.library, Handle()
        self.seconds = self.cpu_seconds = 0.0
        self._library.declare(_FUSION, ("maq_edges_fusion_destroy",))
        config = self._library.filled(_Config, settings)
        self._library.call("maq_edges_fusion_create", self._library.context, byref(config), byref(self._fusion))

    def __enter__(self) -> Fusion:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        self._library.free("maq_edges_fusion_destroy", self._fusion)
        self._fusion = Handle()

    def add_view(self, depth: np.ndarray, camera: Camera) -> EdgesResult:
        """Runs the network on depth, float32 [H, W] in metres, of square pixels, and adds the view; its result."""
        lens = Intrinsics(camera.width_px, camera.height_px, camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px)
        posed = _PinholeCamera(ctypes.sizeof(_PinholeCamera), lens)
        posed.rotation[:], posed.centre[:] = camera.rotation.ravel(), camera.centre
        with self._edges.result_of(depth, Pinhole(camera.fx_px, camera.cx_px, camera.cy_px)) as result:
            self._timed("maq_edges_fusion_add_view", result, byref(posed))
            return self._edges.copied(result, depth.shape)

    def finish(self) -> Curves:
        """Makes points and curves of the views; the curves, in the world."""
        found = Handle()
        self._timed("maq_edges_fusion_finish")
        self._timed("maq_edges_fusion_find_curves", byref(found))
        return curves_of(self._library, found)

    @property
    def info(self) -> FusionInfo:
        filled = FusionInfo(struct_size=ctypes.sizeof(FusionInfo))
        self._library.call("maq_edges_fusion_get_info", self._fusion, byref(filled))
        return filled

    def points(self) -> np.ndarray:
        """POINT [N] of the latest `finish`."""
        copied = np.empty(self.info.point_count, POINT)
        self._library.call("maq_edges_fusion_copy_points", self._fusion, copied.ctypes.data, len(copied))
        return copied

    def _timed(self, function: str, *arguments: object) -> None:
        start, cpu_start = time.perf_counter(), time.process_time()
        self._library.call(function, self._fusion, *arguments)
        self.seconds += time.perf_counter() - start
        self.cpu_seconds += time.process_time() - cpu_start
