"""Prediction: the next frames of a stream, its novelty, and live sources with short gaps filled."""

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

    from maquette.settings import ConcealerSettings, NoveltyMethod, NoveltySettings, PredictorMethod, PredictorSettings


class Predictor(NativeObject):
    """Takes the frames of a stream and predicts later ones.

    method: "last" repeats the last frame. "motion" moves everything on at its speed. "auto" blends both per cell,
    weighted by their past errors. "refined" is "auto", refined by a network. "sampled" samples possible futures by a
    transformer. shared_with: a predictor of the same method, refined or sampled, whose networks this one shares.
    settings: fields of maq_predictor_config by their names. Predicted frames are guesses: never steer anything by
    them.
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
class NoveltyScore:
    """The score of one frame.

    bits: mean of all codes: about 0.03 when nothing changes, 1 to 3 when much moves. ratio: to the median of the 8
    frames before; 1 while they are unknown. is_event: a cut, or the ratio reached event_ratio or 1 / event_ratio.
    is_cut: the previous frame does not make this one more likely. is_stream_start: the frame continues no stream: the
    first one, another size or format, a pause. map: float32 [16, 16], bits of a code per cell.
    """

    bits: float
    ratio: float
    is_event: bool
    is_cut: bool
    is_stream_start: bool
    map: np.ndarray

    def __repr__(self) -> str:
        marks = "".join(f", {m}" for m in ("event", "cut", "stream_start") if getattr(self, f"is_{m}"))
        return f"<NoveltyScore {self.bits:.3f} bits, ratio {self.ratio:.2f}{marks}>"


def novelty_score(score: Any, cells: np.ndarray) -> NoveltyScore:
    """Copies a maq_novelty_score."""
    flags = bool(score.is_event), bool(score.is_cut), bool(score.is_stream_start)
    return NoveltyScore(score.bits, score.ratio, *flags, cells)


class Novelty(NativeObject):
    """Scores how unexpected each frame of a stream is after the frames before, and where, in bits.

    shared_with: another stream whose networks this one shares. method: the source of probabilities: "auto" (the
    bundle's transformer, if it has one) or "bigram", which takes about 0 ms. settings: fields of maq_novelty_config by
    their names, such as event_ratio=6. Raises MaquetteError.
    """

    def __init__(
        self, shared_with: Novelty | None = None, method: NoveltyMethod = "auto", **settings: Unpack[NoveltySettings]
    ) -> None:
        n = native()
        shared = {} if shared_with is None else {"shared_with": shared_with.handle}
        config = n.config("maq_novelty_config", {"method": method, **shared, **settings})
        super().__init__(n.create("maq_novelty", n.context, config))

    def push(self, image: Frame | ArrayImage, time_s: float | None = None) -> NoveltyScore:
        """Scores the stream's next frame: a frame of a Source, or uint8 [H, W, 3] (RGB) or [H, W] with its time in
        seconds. Raises MaquetteError."""
        n = native()
        score = n.sized("maq_novelty_score")
        n.call("maq_novelty_push", self.handle, _timed_frame(image, time_s).handle, score)
        cells = np.empty((score.rows, score.columns), np.float32)
        n.call("maq_novelty_copy_map", self.handle, n.ffi.from_buffer("float[]", cells), cells.size)
        return novelty_score(score, cells)

    def reset(self) -> None:
        """Forgets the frames so far, to begin another stream."""
        native().call("maq_novelty_reset", self.handle)

    def reconstruction(self) -> Frame:
        """Decodes the codes of the latest frame: an image of 64 x 64 pixels with the detail that the network kept.
        Hold at most four at once. Raises MaquetteError."""
        frame = native().create(
            "maq_frame", self.handle, function="maq_novelty_acquire_reconstruction", release="maq_frame_release"
        )
        return Frame.of_handle(frame)

    @property
    def stats(self) -> dict[str, Any]:
        """Milliseconds of the latest frame, and counts: the fields of maq_novelty_stats."""
        return native().stats("maq_novelty_stats", "maq_novelty_get_stats", self.handle)


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
