"""Edges of one object or room from several views: fields of posed depth images fused into points and curves."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from maquette.edges import Curves, Edges, EdgesResult
from maquette.frames import Frame, ImageLike
from maquette.native import NativeObject, ProgressCallback, native
from maquette.scenes import PinholeCamera

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from maquette.settings import EdgesFusionSettings

# maq_edges_fusion_point
POINT = np.dtype([("point_m", "<f8", 3), ("normal", "<f4", 3), ("distance_m", "<f4"), ("r_m", "<f4"),
                  ("view_count", "<u4")])  # fmt: skip


class EdgesFusion(NativeObject):
    """Add views, finish, then ask for points and curves, in the world of the cameras.

    edges: the network. progress: called by `finish` with the fraction done; return False to cancel. `finish` raises its
    exceptions. settings: fields of maq_edges_fusion_config by their names: cell_m, min_views, max_points, ... All
    methods raise MaquetteError.
    """

    def __init__(
        self,
        edges: Edges,
        progress: Callable[[float], bool | None] | None = None,
        **settings: Unpack[EdgesFusionSettings],
    ) -> None:
        n = native()
        self._edges = edges
        self._progress = ProgressCallback(progress, "int32_t(void *, double)")
        config = n.config("maq_edges_fusion_config", {**settings, "progress_callback": self._progress.pointer})
        super().__init__(n.create("maq_edges_fusion", n.context, config))

    def add_view(self, depth: ImageLike, camera: PinholeCamera) -> EdgesResult:
        """Runs the network on a depth image and adds its field. Returns the field."""
        has_intrinsics = isinstance(depth, Frame) and depth.intrinsics is not None
        result = self._edges.run_native(depth, None if has_intrinsics else camera.intrinsics)
        self.add_native(result, camera)
        return self._edges.copied(result)

    def add_native(self, result: Any, camera: PinholeCamera) -> None:
        """Adds a result of `Edges.run_native`."""
        native().call("maq_edges_fusion_add_view", self.handle, result, camera.to_struct())

    def finish(self) -> None:
        """Computes points and curves of the views so far; more can be added afterwards."""
        self._progress.run(lambda: native().call("maq_edges_fusion_finish", self.handle))

    def cancel(self) -> None:
        """Ends the running `finish`, or else the next one, with MAQ_CANCELLED. Any thread may call it."""
        native().call("maq_edges_fusion_cancel", self.handle)

    def curves(self) -> Curves:
        """Returns the curves of the latest `finish`, without boxes and snapping. Hold no more than 4 at once."""
        n = native()
        return Curves(
            n.create("maq_edges_curves", self.handle, function="maq_edges_fusion_find_curves",
                     release="maq_edges_curves_release")
        )  # fmt: skip

    @property
    def info(self) -> dict[str, Any]:
        """Counts and times: the fields of maq_edges_fusion_info."""
        return native().stats("maq_edges_fusion_info", "maq_edges_fusion_get_info", self.handle)

    def points(self) -> np.ndarray:
        """Returns POINT [N] of the latest `finish`: position, normal, distance to the nearest edge, footprint, number
        of views."""
        n = native()
        out = np.empty(int(self.info["point_count"]), POINT)
        if len(out):
            points = n.ffi.cast("maq_edges_fusion_point *", n.ffi.from_buffer(out))
            n.call("maq_edges_fusion_copy_points", self.handle, points, len(out))
        return out
