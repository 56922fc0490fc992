"""Prediction: the next frames of a stream, the health of its camera, and live sources with short gaps filled."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from maquette.frames import ArrayImage, Frame, acquired_frame
from maquette.native import NativeObject, native
from maquette.sources import Source

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from maquette.settings import ConcealerSettings, PredictorMethod, PredictorSettings


class Predictor(NativeObject):
    """Takes the frames of a stream and predicts later ones.

    method: "auto" blends the last frame and its motion per cell, weighted by their past errors; it hides 30 to 100 ms
    of latency. "last" repeats the last frame. "motion" moves everything on at its speed. "sampled" samples possible
    futures by a transformer (for research). shared_with: another predictor that samples, whose networks this one
    shares. settings: fields of maq_predictor_config by their names. Predicted frames are guesses: never steer anything
    by them.
    """

    def __init__(
        self,
        method: PredictorMethod = "auto",
        shared_with: Predictor | None = None,
        **settings: Unpack[PredictorSettings],
    ) -> None:
        n = native()
        shared = {} if shared_with is None else {"shared_with": shared_with.handle}
        config = n.config("maq_predictor_config", {"method": method, **shared, **settings})
        super().__init__(n.create("maq_predictor", n.context, config))

    def push(self, image: Frame | ArrayImage, time_s: float | None = None) -> None:
        """Adds the stream's next frame: a frame of a Source, or uint8 [H, W, 3] (RGB) or [H, W] with its time in
        seconds, counted from any moment. Earlier frames are forgotten at a cut, another size or a pause of a second.
        Raises MaquetteError."""
        native().call("maq_predictor_push", self.handle, _timed_frame(image, time_s).handle)

    def predict(self, ahead_s: float) -> Frame:
        """Returns the frame `ahead_s` seconds (0 to 10) after the newest one, in the same size and format, marked as
        predicted by its `origin`. Hold at most four at once (frame_pool_size). Raises MaquetteError, also before the
        first frame."""
        n = native()
        frame = n.create(
            "maq_frame", self.handle, ahead_s, function="maq_predictor_predict", release="maq_frame_release"
        )
        return Frame.of_handle(frame)

    def sample(self, sample_count: int, frame_count: int, step_s: float) -> None:
        """Samples `sample_count` (1 to 16) possible futures of `frame_count` (1 to 64) frames, `step_s` (at most 0.125)
        seconds apart. The method is "sampled"; temperature and seed apply. Results depend only on the seed and
        the pushed frames. They are valid until the next push, predict or sample. Raises MaquetteError."""
        native().call("maq_predictor_sample", self.handle, sample_count, frame_count, step_s)

    def acquire_sample(self, sample_index: int, frame_index: int) -> Frame:
        """Decodes frame `frame_index` (1-based) of sample `sample_index` (0-based). Hold at most four at once
        (frame_pool_size). Raises MaquetteError for a frame that was not sampled."""
        frame = native().create(
            "maq_frame", self.handle, sample_index, frame_index,
            function="maq_predictor_acquire_sample", release="maq_frame_release",
        )  # fmt: skip
        return Frame.of_handle(frame)

    def entropy_map(self, sample_index: int, frame_index: int) -> np.ndarray:
        """Returns the mean entropy of a code in bits per cell of that frame: float32 [16, 16]. Raises MaquetteError for
        a frame that was not sampled."""
        n = native()
        bits = np.zeros(int(self.stats["cell_count"]), np.float32)
        into = n.ffi.from_buffer("float[]", bits)
        n.call("maq_predictor_copy_entropy_map", self.handle, sample_index, frame_index, into, bits.size)
        side = math.isqrt(bits.size)
        return bits.reshape(side, side)

    def cancel(self) -> None:
        """Cancels the sampling that runs on another thread, or else the next one: it raises MaquetteError."""
        native().call("maq_predictor_cancel", self.handle)

    def reset(self) -> None:
        """Forgets the frames so far, to begin another stream."""
        native().call("maq_predictor_reset", self.handle)

    @property
    def stats(self) -> dict[str, Any]:
        """Milliseconds of the latest push and prediction, and counts: the fields of maq_predictor_stats. `method`
        made the latest prediction."""
        return native().stats("maq_predictor_stats", "maq_predictor_get_stats", self.handle)


@dataclass(frozen=True, eq=False)
class CameraHealthResult:
    """The result for one frame.

    event: "ok", "cut", "freeze", "black", "covered", "moved" or "object". state: what lasts: "freeze", "black" or
    "covered", or "ok". began_s: time of the event's first frame. x_px, y_px: the middle of an object, or how far a
    moved picture moved. unexplained: fraction of the frame that no motion from the frame before explains.
    is_stream_start: the frame continues no stream: the first one, another size or format, a pause. map: float32 [rows,
    columns], how far motion leaves each cell unexplained, 0 to 1; None in results of a pipeline.
    """

    event: str
    state: str
    began_s: float
    x_px: float
    y_px: float
    unexplained: float
    is_stream_start: bool
    map: np.ndarray | None

    def __repr__(self) -> str:
        return f"<CameraHealthResult {self.event}, state {self.state}, {self.unexplained:.0%} unexplained>"


def camera_health_result(result: Any, cells: np.ndarray | None) -> CameraHealthResult:
    """Copies a maq_camera_health_result."""
    n = native()
    event, state = (n.text(n.lib.maq_camera_event_get_name(value)) for value in (result.event, result.state))
    return CameraHealthResult(
        event, state, result.began_ns / 1e9, result.x_px, result.y_px, result.unexplained,
        bool(result.is_stream_start), cells,
    )  # fmt: skip


class CameraHealth(NativeObject):
    """Tells whether the camera of a stream is all right: cuts, freezes, black or covered pictures, knocks, objects
    that are there at once. Needs no networks. Raises MaquetteError."""

    def __init__(self) -> None:
        n = native()
        super().__init__(n.create("maq_camera_health", n.context))

    def push(self, image: Frame | ArrayImage, time_s: float | None = None) -> CameraHealthResult:
        """Checks the stream's next frame: a frame of a Source, or uint8 [H, W, 3] (RGB) or [H, W] with its time in
        seconds. Raises MaquetteError."""
        n = native()
        result = n.sized("maq_camera_health_result")
        n.call("maq_camera_health_push", self.handle, _timed_frame(image, time_s).handle, result)
        cells = np.empty((result.rows, result.columns), np.float32)
        n.call("maq_camera_health_copy_map", self.handle, n.ffi.from_buffer("float[]", cells), cells.size)
        return camera_health_result(result, cells)

    def reset(self) -> None:
        """Forgets the frames so far, to begin another stream."""
        native().call("maq_camera_health_reset", self.handle)

    @property
    def stats(self) -> dict[str, Any]:
        """Milliseconds of the latest frame, and counts: the fields of maq_camera_health_stats."""
        return native().stats("maq_camera_health_stats", "maq_camera_health_get_stats", self.handle)


class Concealer(NativeObject):
    """A live source whose short gaps are filled with predicted frames; iterate over it.

    `Frame.origin` tells predicted frames from captured ones. A program that acts on frames, such as a robot's, must
    check it. Until the concealer is closed it takes the source's frames, and `Source.read` fails. max_gap_s: the
    longest gap that is filled; then reading continues as from the source. settings: fields of maq_concealer_config by
    their names. Raises MaquetteError for a source that is not live.
    """

    def __init__(
        self,
        source: Source,
        max_gap_s: float = 0.3,
        method: PredictorMethod = "auto",
        **settings: Unpack[ConcealerSettings],
    ) -> None:
        n = native()
        own = {"max_gap_ms": round(max_gap_s * 1000), "method": method}
        config = n.config("maq_concealer_config", {**own, **settings})
        super().__init__(n.create("maq_concealer", n.context, source.handle, config))
        self._source = source  # keeps it open

    def read(self, timeout_s: float | None = None) -> Frame | None:
        """Returns the next frame, or None after the source's last one. Raises MaquetteError, TimeoutError."""
        return acquired_frame("maq_concealer_acquire_frame", self.handle, timeout_s)

    def __iter__(self) -> Iterator[Frame]:
        while (frame := self.read()) is not None:
            yield frame

    @property
    def stats(self) -> dict[str, Any]:
        """Counts of captured, predicted, late and dropped frames, and waiting times: the fields of
        maq_concealer_stats."""
        return native().stats("maq_concealer_stats", "maq_concealer_get_stats", self.handle)


def _timed_frame(image: Frame | ArrayImage, time_s: float | None) -> Frame:
    if isinstance(image, Frame) == (time_s is not None):
        raise ValueError("time_s is the time of an array, and needed; frames have their own")
    return image if isinstance(image, Frame) else Frame(image, timestamp_ns=round((time_s or 0) * 1e9))
