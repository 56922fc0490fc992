"""Pipelines: a source and a model on a thread of the library; the newest result wins."""

from __future__ import annotations

import functools
import os
import weakref
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from maquette.densepose import DensePoseResult, Person, densepose_config, densepose_result, surface_points
from maquette.edges import Curves, EdgesResult, curves_config, edges_config, edges_result
from maquette.frames import Frame
from maquette.native import LentResult, NativeObject, as_python, native, path_to_write
from maquette.prediction import CameraHealthResult, Predictor, camera_health_result
from maquette.sources import uri_of

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from maquette.settings import CurvesSettings, DensePoseSettings, EdgesSettings, PipelineSettings, SourceSettings


class Model(NativeObject):
    """A model of a `Pipeline`, which loads it: `DensePoseModel`, `EdgesModel` or `PredictionModel`."""


class DensePoseModel(Model):
    """Dense pose in a pipeline; the arguments of `DensePose`."""

    def __init__(self, bundle: str | os.PathLike[str] | None = None, **settings: Unpack[DensePoseSettings]) -> None:
        n = native()
        config = densepose_config(bundle, settings)
        super().__init__(n.create("maq_model", n.context, config, function="maq_densepose_model_create"))

    def set_roll(self, roll_rad: float) -> None:
        """Sets the roll of the camera for the next frames (`DensePose.set_roll`)."""
        native().call("maq_densepose_model_set_roll", self.handle, roll_rad)

    def set_frame_budget(self, budget_ms: float) -> None:
        """Limits the mean time of a frame, for devices that throttle: detects people less often, then lowers
        long_side_px. 0: no limit."""
        native().call("maq_densepose_model_set_frame_budget", self.handle, budget_ms)

    @property
    def stats(self) -> dict[str, Any]:
        """The quality in use: the fields of maq_densepose_model_stats."""
        return native().stats("maq_densepose_model_stats", "maq_densepose_model_get_stats", self.handle)

    def surface(self) -> np.ndarray:
        """`DensePose.surface`, once the model is loaded. Raises MaquetteError before."""
        return surface_points("maq_densepose_model_get_surface", self.handle)


class EdgesModel(Model):
    """Edges in a pipeline; the arguments of `Edges`, and of the curves."""

    def __init__(
        self,
        bundle: str | os.PathLike[str] | None = None,
        curves: bool = False,
        curve_settings: CurvesSettings | None = None,
        **settings: Unpack[EdgesSettings],
    ) -> None:
        n = native()
        config = edges_config(bundle, settings)
        with_curves = curves_config(curves, curve_settings or {}) or n.ffi.NULL
        super().__init__(n.create("maq_model", n.context, config, with_curves, function="maq_edges_model_create"))


class PredictionModel(Model):
    """Predicts the frame `ahead_s` seconds after each frame, and checks the camera on request. It has the settings of
    the predictor, and shares its networks."""

    def __init__(self, predictor: Predictor, ahead_s: float, checks_camera: bool = False) -> None:
        n = native()
        create = ("maq_model", n.context, predictor.handle, float(ahead_s), int(checks_camera))
        super().__init__(n.create(*create, function="maq_prediction_model_create"))


class PipelineResult(NativeObject):
    """A frame, and the output of the model for it. Hold at most 4 at once (result_pool_size), with their frames."""

    def _part(self, function: str) -> Any:
        """An object inside the result, which it keeps; None if another model ran."""
        n, whole = native(), self.handle
        part = getattr(n.lib, function)(whole)
        return n.ffi.gc(part, lambda _, whole=whole: None) if part else None

    def close(self) -> None:
        """Gives the result back, when its frames and other parts are gone, too."""
        self._handle = None

    @functools.cached_property
    def frame(self) -> Frame:
        return Frame.of_handle(self._part("maq_pipeline_result_get_frame"))

    @property
    def people(self) -> list[Person]:
        """The people, of a `DensePoseModel`; empty with another model."""
        return [] if self.densepose is None else self.densepose.people

    @functools.cached_property
    def densepose(self) -> DensePoseResult | None:
        """The people and the planes, of a `DensePoseModel`."""
        part = self._part("maq_pipeline_result_get_densepose")
        return None if part is None else densepose_result(part, LentResult(part))

    @functools.cached_property
    def edges(self) -> EdgesResult | None:
        """The edges, with curves if they were asked for, of an `EdgesModel`."""
        part = self._part("maq_pipeline_result_get_edges")
        if part is None:
            return None
        curves = self._part("maq_pipeline_result_get_curves")
        return edges_result(part, LentResult(part), None if curves is None else Curves(curves))

    @functools.cached_property
    def predicted(self) -> Frame | None:
        """The predicted frame, of a `PredictionModel`."""
        part = self._part("maq_pipeline_result_get_predicted_frame")
        return None if part is None else Frame.of_handle(part)

    @functools.cached_property
    def camera_health(self) -> CameraHealthResult | None:
        """The health of the camera, of a `PredictionModel` that checks it; without a map."""
        n = native()
        health = n.sized("maq_camera_health_result")
        status = n.ask("maq_pipeline_result_get_camera_health", self.handle, health)
        if status == n.lib.MAQ_ERROR_NOT_FOUND:
            return None
        if status:
            n.fail("maq_pipeline_result_get_camera_health", status)
        return camera_health_result(health, None)

    @property
    def stats(self) -> dict[str, Any]:
        """Number and times: the fields of maq_pipeline_result_stats. age_ms: from the capture of the frame to the
        result; -1 for a source that is not live, such as a file."""
        return native().stats("maq_pipeline_result_stats", "maq_pipeline_result_get_stats", self.handle)


@dataclass(frozen=True)
class PipelineInfo:
    """state: "stopped", "opening", "loading", "running", "paused", "stalled", "reconnecting", "ended" or "failed".
    status: "MAQ_OK", or why there are no results; problem: the same as a sentence."""

    state: str
    status: str
    problem: str
    source_uri: str


class Pipeline(NativeObject):
    """Runs a model on the newest frame of a source; frames that come meanwhile are dropped. Iterate over it.

        for result in maquette.Pipeline("camera:", maquette.DensePoseModel()):
            print(len(result.people))

    on_result: called with each `PipelineResult` on the library's thread, instead of `read`. on_state: called with the
    state and a sentence about a problem. What they raise is printed. source_settings: fields of maq_source_config.
    settings: fields of maq_pipeline_config. Source, model and recording can be changed while it runs. Raises
    MaquetteError.
    """

    def __init__(
        self,
        source: str | os.PathLike[str] | None = None,
        model: Model | None = None,
        on_result: Callable[[PipelineResult], object] | None = None,
        on_state: Callable[[str, str], object] | None = None,
        source_settings: SourceSettings | None = None,
        **settings: Unpack[PipelineSettings],
    ) -> None:
        n = native()
        own: dict[str, Any] = {"source": n.config("maq_source_config", source_settings or {})}
        if on_result is not None:

            def result_came(_: Any, result: Any) -> None:
                on_result(PipelineResult(n.ffi.gc(result, n.lib.maq_pipeline_result_release)))

            own["result_callback"] = n.ffi.callback("maq_pipeline_result_callback", result_came)
        if on_state is not None:

            def state_changed(_: Any, state: int, __: int, problem: Any) -> None:
                on_state(n.name_of("maq_pipeline_state", state), as_python(n.text(problem)))

            own["state_callback"] = n.ffi.callback("maq_pipeline_state_callback", state_changed)
        self._callbacks = own  # as long as the pipeline, which has their addresses
        config = n.config("maq_pipeline_config", {**settings, **own})
        super().__init__(n.create("maq_pipeline", n.context, config))
        # Also at the end of the program: no callback may come when Python is gone. Keeps the callbacks until then.
        weakref.finalize(self, _release, self._handle, own)
        if model is not None:
            self.set_model(model)
        if source is not None:
            self.set_source(source)

    def set_source(self, uri: str | os.PathLike[str]) -> None:
        """Opens a source and replaces the current one; `info` tells of errors."""
        native().call("maq_pipeline_set_source", self.handle, uri_of(uri))

    def set_model(self, model: Model | None) -> None:
        """Loads a model and replaces the current one; None: results have only frames. Raises TypeError for an object
        that is no model."""
        if model is not None and not isinstance(model, Model):
            raise TypeError(_not_a_model(model))
        n = native()
        n.call("maq_pipeline_set_model", self.handle, n.ffi.NULL if model is None else model.handle)

    def pause(self) -> None:
        """Takes no more frames; the source stays open."""
        native().call("maq_pipeline_set_paused", self.handle, 1)

    def resume(self) -> None:
        native().call("maq_pipeline_set_paused", self.handle, 0)

    def record(self, path: str | os.PathLike[str] | None) -> None:
        """Records the frames from now on to a file (.maqrec) that does not exist; None finishes the recording."""
        n = native()
        name = n.ffi.NULL if path is None else path_to_write(path)
        n.call("maq_pipeline_set_recording", self.handle, name)

    def stop(self) -> None:
        """Closes the source: a `read` that waits returns None. Any thread may call it."""
        native().call("maq_pipeline_stop", self.handle)

    def read(self, timeout_s: float | None = None) -> PipelineResult | None:
        """The newest result that was not read, or the next one; None after the end of the source and after `stop`. Any
        thread may call it; Ctrl-C ends the wait. Raises MaquetteError, TimeoutError."""
        acquire, release = "maq_pipeline_acquire_result", "maq_pipeline_result_release"
        result = native().wait(acquire, self.handle, "maq_pipeline_result", release, timeout_s)
        return None if result is None else PipelineResult(result)

    def __iter__(self) -> Iterator[PipelineResult]:
        while (result := self.read()) is not None:
            yield result

    @property
    def info(self) -> PipelineInfo:
        n = native()
        info = n.sized("maq_pipeline_info")
        n.call("maq_pipeline_get_info", self.handle, info)
        state, status = n.name_of("maq_pipeline_state", info.state), n.status_name(info.status)
        return PipelineInfo(state, status, as_python(n.text(info.problem)), n.text(info.source_uri))

    @property
    def stats(self) -> dict[str, Any]:
        """Counts and times: the fields of maq_pipeline_stats."""
        return native().stats("maq_pipeline_stats", "maq_pipeline_get_stats", self.handle)

    def _about(self) -> str:
        return self.info.state


def _not_a_model(given: Any) -> str:
    """A sentence with the model that the caller wants: DensePoseModel for a DensePose, or for a class."""
    arguments = {"DensePoseModel": "", "EdgesModel": "", "PredictionModel": "predictor, ahead_s=0.1"}
    name = given.__name__ if isinstance(given, type) else type(given).__name__
    model = {"Predictor": "PredictionModel", "CameraHealth": "PredictionModel"}.get(
        name, name.replace("Model", "") + "Model"
    )
    wanted = (
        [f"maquette.{model}({arguments[model]})"] if model in arguments else [f"maquette.{m}(…)" for m in arguments]
    )
    what = f"the class {name}" if isinstance(given, type) else f"{given!r:.60}"
    return f"A pipeline has a model of its own, not {what}: pass {' or '.join(wanted)}."


def _release(handle: Any, _: Any) -> None:
    native().ffi.release(handle)
