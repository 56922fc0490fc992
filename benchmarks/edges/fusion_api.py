"""Fuses edges over views through the Python package, and times it without the network."""

from __future__ import annotations

import time
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import maquette
import numpy as np

from benchmarks.edges.edges_api import Curves, Edges, EdgesResult
from export.camera import Camera


class Fusion:
    """Views of one object, whose edges come from `edges`; for a `with` statement.

    settings: fields of maq_edges_fusion_config by their names. seconds: what add_view, finish and curves of the
    library have taken, wall-clock, without the network; cpu_seconds: of all threads of the process in that time. Raises
    MaquetteError, as all methods do.
    """

    def __init__(self, edges: Edges, **settings: float) -> None:
        self._edges, self._fusion = edges.model, maquette.EdgesFusion(edges.model, **settings)
        self.seconds = self.cpu_seconds = 0.0

    def __enter__(self) -> Fusion:
        return self

    def __exit__(self, *_: object) -> None:
        self._fusion.close()

    def add_view(self, depth: np.ndarray, camera: Camera) -> EdgesResult:
        """Runs the network on depth, float32 [H, W] in metres, adds the view and returns its result."""
        size = camera.width_px, camera.height_px
        lens = maquette.Intrinsics(*size, camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px)
        result = self._edges.run_native(depth, lens)
        posed = maquette.PinholeCamera(lens, camera.rotation, camera.centre)
        self._timed(lambda: self._fusion.add_native(result, posed))
        return EdgesResult.of(self._edges.copied(result))

    def finish(self) -> Curves:
        """Fuses the views into points and curves; returns the curves in the world."""
        self._timed(self._fusion.finish)
        return Curves.of(self._timed(self._fusion.curves))

    @property
    def info(self) -> Any:
        """Returns the fields of maq_edges_fusion_info."""
        return SimpleNamespace(**self._fusion.info)

    def points(self) -> np.ndarray:
        """Returns maquette.fusion.POINT [N] of the latest `finish`."""
        return self._fusion.points()

    def _timed(self, call: Callable[[], Any]) -> Any:
        start, cpu_start = time.perf_counter(), time.process_time()
        result = call()
        self.seconds += time.perf_counter() - start
        self.cpu_seconds += time.process_time() - cpu_start
        return result
