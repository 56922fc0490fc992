"""Sources: cameras, files, recordings and simulated scenes that deliver frames; recordings and clips that keep them."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from maquette.frames import Frame, ImageLike, Intrinsics, acquired_frame, as_frame
from maquette.native import NativeObject, native, path_to_write

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from maquette.settings import RecorderSettings, SourceControl, SourceSettings


@dataclass(frozen=True)
class Control:
    """A control of a camera. `step` is between values, which are rounded to it; units are in `Source.control`."""

    value: float
    default: float
    min: float
    max: float
    step: float


class Source(NativeObject):
    """A camera, file, recording or simulated scene, opened by a URI; iterate over it.

    `Source("camera:")`, `Source("clip.mp4")`, `Source("stub:people?count=2")`: docs/guide/cameras.md has all of them.
    settings: fields of maq_source_config by their names (queue_length, real_time, loop, ...). Raises MaquetteError.
    """

    def __init__(self, uri: str | os.PathLike[str], **settings: Unpack[SourceSettings]) -> None:
        n = native()
        name = uri_of(uri)
        config = n.config("maq_source_config", settings)
        self._uri = os.fspath(uri)
        super().__init__(n.create("maq_source", n.context, name, config))

    @property
    def info(self) -> dict[str, Any]:
        """Size, rate, number of frames and what was dropped: the fields of maq_source_info."""
        return native().stats("maq_source_info", "maq_source_get_info", self.handle)

    @property
    def intrinsics(self) -> Intrinsics:
        """Raises MaquetteError where they are unknown."""
        n = native()
        struct = n.ffi.new("maq_intrinsics *")
        n.call("maq_source_get_intrinsics", self.handle, struct)
        return Intrinsics.of_struct(struct)

    def read(self, timeout_s: float | None = None) -> Frame | None:
        """The next frame, or None after the last one and after `stop`. timeout_s: of live sources (None: no limit;
        Ctrl-C ends the wait). Raises MaquetteError, TimeoutError."""
        return acquired_frame("maq_source_acquire_frame", self.handle, timeout_s)

    def __iter__(self) -> Iterator[Frame]:
        while (frame := self.read()) is not None:
            yield frame

    def seek(self, time_s: float) -> None:
        """Moves to the first frame at or after this time since the source's first frame. Raises MaquetteError for a
        source that is not a clip, a recording or simulated."""
        native().call("maq_source_seek", self.handle, round(time_s * 1e9))

    def stop(self) -> None:
        """Ends the source for good: a `read` that waits in another thread returns None. Any thread may call it."""
        native().call("maq_source_stop", self.handle)

    def fileno(self) -> int:
        """A file descriptor for select, poll and asyncio, which is readable when `read` would not wait. Do not read,
        write or close it. Raises MaquetteError for a source that is not live."""
        n = native()
        descriptor = n.ffi.new("int32_t *")
        n.call("maq_source_get_event_fd", self.handle, descriptor)
        return descriptor[0]

    def control(self, name: SourceControl) -> Control:
        """Value and range of a camera's control: auto_exposure (0 or 1), exposure (microseconds), gain, auto_focus,
        focus, auto_white_balance, white_balance (kelvin), brightness; the others are in units of the device. Raises
        MaquetteError, with the status MAQ_ERROR_UNSUPPORTED if the device does not have it."""
        n = native()
        info = n.sized("maq_source_control_info")
        n.call("maq_source_get_control", self.handle, n.value_of("maq_source_control", name, "control"), info)
        return Control(info.value, info.default_value, info.min, info.max, info.step)

    def set_control(self, name: SourceControl, value: float) -> None:
        """Sets a control by its name. A manual value switches the automatic mode off. Raises MaquetteError."""
        n = native()
        n.call("maq_source_set_control", self.handle, n.value_of("maq_source_control", name, "control"), float(value))

    def _about(self) -> str:
        info = self.info
        live = ", live" if info["is_live"] else ""
        return f"{self._uri}, {info['width_px']} x {info['height_px']}, {info['fps']:g} frames a second{live}"


def uri_of(uri: str | os.PathLike[str]) -> bytes:
    """A URI or a path for the C API. Raises TypeError, with advice for numbers as OpenCV takes them."""
    if not isinstance(uri, (str, os.PathLike)):
        raise TypeError(
            f'A source is a URI or a path, not {uri!r:.60}: "camera:" is the first camera, "v4l2:/dev/video0" a '
            "certain one. maquette.list_cameras() and the command `maquette sources` list them."
        )
    return os.fsencode(uri)


@dataclass(frozen=True)
class CameraMode:
    """A format ("YUYV", "MJPG"), size and rate of a camera. is_usable: this build supports the format. fps: the highest
    rate, 0 if unknown."""

    format: str
    width_px: int
    height_px: int
    fps: float
    is_usable: bool


@dataclass(frozen=True)
class Camera:
    """A connected camera. problem: why it cannot be opened now and what to do, "" if it can."""

    uri: str
    name: str
    problem: str
    modes: list[CameraMode] = field(default_factory=list, repr=False)


def list_cameras() -> list[Camera]:
    n = native()
    cameras = n.create("maq_camera_list", n.context)
    count = n.lib.maq_camera_list_get_count(cameras)
    found = n.indexed("maq_camera_list_get_camera", cameras, "maq_camera_info", count)
    return [
        Camera(n.text(c.uri), n.text(c.name), n.text(c.problem) if c.status else "", _modes(cameras, k, c.mode_count))
        for k, c in enumerate(found)
    ]


def _modes(cameras: Any, index: int, count: int) -> list[CameraMode]:
    n, modes = native(), []
    for k in range(count):
        mode = n.sized("maq_camera_mode")
        n.call("maq_camera_list_get_mode", cameras, index, k, mode)
        size = mode.width_px, mode.height_px
        modes.append(CameraMode(n.text(mode.format), *size, mode.fps, bool(mode.is_usable)))
    return modes


@dataclass(frozen=True)
class SourceScheme:
    """A kind of source. example: a URI; summary: its frames and options."""

    name: str
    example: str
    summary: str
    is_camera: bool


def list_source_schemes() -> list[SourceScheme]:
    """The kinds of sources in this build."""
    n, schemes = native(), []
    for index in range(n.lib.maq_source_get_scheme_count()):
        scheme = n.sized("maq_source_scheme")
        n.call("maq_source_get_scheme", index, scheme)
        texts = n.text(scheme.name), n.text(scheme.example), n.text(scheme.summary)
        schemes.append(SourceScheme(*texts, bool(scheme.is_camera)))
    return schemes


class _Writer(NativeObject):
    """A file that is written frame by frame, and complete after `finish`, which the end of a `with` statement calls."""

    _add_frame = _finish = ""

    def add(self, image: ImageLike) -> None:
        """Adds a frame, and does not keep it. Raises MaquetteError."""
        native().call(self._add_frame, self.handle, as_frame(image).handle)

    def finish(self) -> None:
        """Completes the file. Raises MaquetteError, as when the disk is full."""
        native().call(self._finish, self.handle)

    def __exit__(self, *error: object) -> None:
        try:
            if error[0] is None:
                self.finish()
        finally:
            self.close()


class Recorder(_Writer):
    """A recording (.maqrec) that keeps frames exactly, with times, depth and intrinsics. `Source("take.maqrec")` plays
    it.

        with maquette.Recorder("take.maqrec", camera) as recorder:
            for frame in camera:
                recorder.add(frame)

    path: a file that does not exist. source: where the frames come from: its rate and intrinsics are recorded.
    settings: fields of maq_recorder_config by their names, such as jpeg_quality. Raises MaquetteError.
    """

    _add_frame, _finish = "maq_recorder_add_frame", "maq_recorder_finish"

    def __init__(
        self, path: str | os.PathLike[str], source: Source | None = None, **settings: Unpack[RecorderSettings]
    ) -> None:  # fmt: skip
        n = native()
        handle = n.ffi.NULL if source is None else source.handle
        config = n.config("maq_recorder_config", settings)
        super().__init__(n.create("maq_recorder", n.context, path_to_write(path), handle, config))

    def add(self, image: ImageLike, time_s: float | None = None) -> None:
        """Adds a frame, and does not keep it. time_s: the time of an array (not of a path). Raises MaquetteError, also
        for a frame that is not later than the one before."""
        if time_s is not None:
            image = Frame(image, timestamp_ns=round(time_s * 1e9))  # type: ignore[arg-type]
        super().add(image)

    @property
    def info(self) -> dict[str, Any]:
        """Frames and bytes so far: the fields of maq_recorder_info."""
        return native().stats("maq_recorder_info", "maq_recorder_get_info", self.handle)


class ClipWriter(_Writer):
    """A video file for any player, such as "clip.mp4", with `fps` images a second. The format is chosen by the
    extension (docs/reference/formats.md). All images have the size of the first one. Raises MaquetteError.

        with maquette.ClipWriter("clip.mp4", fps=30) as clip:
            clip.add(rgb)
    """

    _add_frame, _finish = "maq_clip_add_frame", "maq_clip_finish"

    def __init__(self, path: str | os.PathLike[str], fps: float) -> None:
        n = native()
        super().__init__(n.create("maq_clip", n.context, path_to_write(path), float(fps)))
