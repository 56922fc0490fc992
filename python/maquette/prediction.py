"""Prediction: what a stream will show next, how surprising what it shows is, and live sources whose short gaps are
bridged."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from maquette.frames import Frame, Source, acquired_frame
from maquette.native import NativeObject, native

METHODS = ("auto", "last", "motion", "network")  # of maq_prediction_method
NETWORK_MODES = ("auto", "mended", "expected", "drawn")  # of maq_network_mode
SURPRISE_METHODS = ("auto", "table")  # of maq_surprise_method


class Predictor(NativeObject):
    """Gets the frames of a stream as they come, and makes pictures of what it will show a while later.

    method: "motion" (everything moves on as it moved), "last" (the last frame), "auto": both mixed, place by place, by
    how right each was about the frames that have come, or "network": that, changed by what networks foresee (not in
    every bundle). networks_of: another one of that method, whose networks this one uses as well. settings: fields of
    maq_predictor_config by their names. It sees pictures, not the world: never steer
    anything by what it made up.
    """

    def __init__(self, method: str = "auto", networks_of: Predictor | None = None, **settings: Any) -> None:
        n = native()
        shared = {} if networks_of is None else {"networks_of": networks_of.handle}
        config = n.config("maq_predictor_config", {"method": _method(method)} | shared | settings)
        super().__init__(n.create("maq_predictor", n.context, config))

    def push(self, image: Frame | np.ndarray, time_s: float | None = None) -> None:
        """The stream's next frame: one of a Source, or uint8 [H, W, 3] (RGB) or [H, W] with its time in seconds, from
        any moment on. What came before is forgotten at a cut, another size or a second's pause. Raises
        MaquetteError."""
        native().call("maq_predictor_push", self.handle, _timed_frame(image, time_s).handle)

    def predict(self, ahead_s: float) -> Frame:
        """The picture `ahead_s` seconds (0 to 10) after the latest frame, of that frame's size and format; its `origin`
        says that it is made up. Hold at most four at once (frame_pool_size). Raises MaquetteError, also before the
        first frame."""
        n = native()
        made = n.create(
            "maq_frame", self.handle, ahead_s, function="maq_predictor_predict", release="maq_frame_release"
        )
        return Frame.of_handle(made)

    def draw(self, samples: int, frames: int, step_s: float) -> None:
        """Draws `samples` (1 to 16) of what the stream may show, each `frames` (1 to 64) frames, `step_s` (to 0.125)
        apart: of method "network", network_mode=3 (MAQ_NETWORK_DRAWN), by its temperature, top_k, seed and passes. A
        sample is the same however many others are drawn. Until the next push, prediction or draw `drawn` and
        `uncertainty` give what was drawn. Raises MaquetteError."""
        native().call("maq_predictor_draw", self.handle, samples, frames, step_s)

    def drawn(self, sample: int, number: int) -> Frame:
        """The picture of frame `number`, from 1, of a sample, from 0. Hold at most four at once (frame_pool_size).
        Raises MaquetteError for one that was not drawn."""
        made = native().create(
            "maq_frame", self.handle, sample, number,
            function="maq_predictor_acquire_drawn", release="maq_frame_release",
        )  # fmt: skip
        return Frame.of_handle(made)

    def uncertainty(self, sample: int, number: int) -> np.ndarray:
        """How uncertain that frame was when it was drawn: the entropy of a code in bits, float32 [16, 16], a cell for
        each part of the frame. Raises MaquetteError for one that was not drawn."""
        n = native()
        bits = np.zeros(int(self.stats["cell_count"]), np.float32)
        into = n.ffi.from_buffer("float[]", bits)
        n.call("maq_predictor_copy_uncertainty", self.handle, sample, number, into, bits.size)
        side = math.isqrt(bits.size)
        return bits.reshape(side, side)

    def reset(self) -> None:
        """Forgets the frames so far, as before another stream."""
        native().call("maq_predictor_reset", self.handle)

    @property
    def stats(self) -> dict[str, float]:
        """Milliseconds of the latest push and prediction, and counts: the fields of maq_predictor_stats. `method`: an
        index into METHODS; `motion_fraction`: how much of the picture is motion's; `network_mode`: an index into
        NETWORK_MODES, whose networks ran (0: none); `step_count`, `pass_count`: how often."""
        return native().stats("maq_predictor_stats", "maq_predictor_get_stats", self.handle)


@dataclass(frozen=True, eq=False)
class SurpriseScore:
    """Of one frame. bits: a code, mean of the frame: hundredths where nothing changes, 1 to 3 where much moves. ratio:
    to the median of the 8 frames before, 1 where these are not known. map: float32 [16, 16], bits of a code by cell.
    is_event: whether it is a cut, or the ratio is event_ratio or more, or 1 / event_ratio or less. is_cut: whether
    nothing in it follows from the frame before, as at a cut or a black-out. is_start: whether the frame does not go on
    from the one before: the first, another size or format, a pause; its bits say how rare its codes are."""

    bits: float
    ratio: float
    is_event: bool
    is_cut: bool
    is_start: bool
    map: np.ndarray


class Surprise(NativeObject):
    """How surprising each frame of a stream is after the one before, and where, in bits.

    networks_of: another stream, whose networks this one uses as well. method: what says how likely codes are: "auto"
    (the transformer, where the bundle has it), or "table", which takes next to no time. settings: fields of
    maq_surprise_config by their names, as event_ratio=6. Raises MaquetteError.
    """

    def __init__(self, networks_of: Surprise | None = None, method: str = "auto", **settings: Any) -> None:
        n = native()
        own = {"method": _method(method, SURPRISE_METHODS)}
        shared = {} if networks_of is None else {"networks_of": networks_of.handle}
        config = n.config("maq_surprise_config", own | shared | settings)
        super().__init__(n.create("maq_surprise", n.context, config))

    def push(self, image: Frame | np.ndarray, time_s: float | None = None) -> SurpriseScore:
        """The stream's next frame: one of a Source, or uint8 [H, W, 3] (RGB) or [H, W] with its time in seconds. Raises
        MaquetteError."""
        n = native()
        score = n.sized("maq_surprise_score")
        n.call("maq_surprise_push", self.handle, _timed_frame(image, time_s).handle, score)
        cells = np.empty((score.rows, score.columns), np.float32)
        n.call("maq_surprise_copy_map", self.handle, n.ffi.from_buffer("float[]", cells), cells.size)
        flags = (bool(score.is_event), bool(score.is_cut), bool(score.is_start))
        return SurpriseScore(score.bits, score.ratio, *flags, cells)

    def reset(self) -> None:
        """Forgets the frames so far, as before another stream."""
        native().call("maq_surprise_reset", self.handle)

    def rebuilt(self) -> Frame:
        """What the network saw of the latest frame: a picture of 64 x 64; what is not in it cannot be surprising. Hold
        at most four at once. Raises MaquetteError."""
        n = native()
        made = n.create("maq_frame", self.handle, function="maq_surprise_acquire_rebuilt", release="maq_frame_release")
        return Frame.of_handle(made)

    @property
    def stats(self) -> dict[str, float]:
        """Milliseconds of the latest frame, and counts: the fields of maq_surprise_stats."""
        return native().stats("maq_surprise_stats", "maq_surprise_get_stats", self.handle)


class Concealer(NativeObject):
    """A live source without short gaps: where a frame is not there when it is due, one that was predicted before;
    iterate over it. `Frame.origin` of each says which; what acts on frames, such as a robot, must look at it.

    Until it is closed it takes the source's frames, and `Source.read` fails. max_gap_s: how long a camera that sends
    nothing is bridged; then reading goes on as of the source itself. settings: fields of maq_concealer_config by their
    names. Raises MaquetteError for a source that is not live.
    """

    def __init__(self, source: Source, max_gap_s: float = 0.3, method: str = "auto", **settings: Any) -> None:
        n = native()
        own = {"max_gap_ms": round(max_gap_s * 1000), "method": _method(method)}
        config = n.config("maq_concealer_config", own | settings)
        super().__init__(n.create("maq_concealer", n.context, source.handle, config))
        self._source = source  # forgotten by its owner, it would be stopped

    def read(self, timeout_s: float | None = None) -> Frame | None:
        """The next frame, or None after the source's last one. Raises MaquetteError, TimeoutError."""
        return acquired_frame("maq_concealer_acquire_frame", self.handle, timeout_s)

    def __iter__(self) -> Iterator[Frame]:
        while (frame := self.read()) is not None:
            yield frame

    @property
    def stats(self) -> dict[str, float]:
        """How many frames were captured in time, predicted, late and dropped, and how long was waited: the fields of
        maq_concealer_stats."""
        return native().stats("maq_concealer_stats", "maq_concealer_get_stats", self.handle)


def _method(name: str, methods: tuple[str, ...] = METHODS) -> int:
    if name not in methods:
        raise ValueError(f"no method {name!r}; there are {', '.join(methods)}")
    return methods.index(name)


def _timed_frame(image: Frame | np.ndarray, time_s: float | None) -> Frame:
    if isinstance(image, Frame) == (time_s is not None):
        raise ValueError("time_s is the time of an array, and needed; frames have their own")
    return image if isinstance(image, Frame) else Frame(image, timestamp_ns=round((time_s or 0) * 1e9))
