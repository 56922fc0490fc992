"""Frames: numpy arrays on their way into the SDK and out of it; sources that deliver them."""

from __future__ import annotations

import enum
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from maquette.native import NativeObject, native


class PixelFormat(enum.IntEnum):
    """How an array's pixels are meant; maq_pixel_format in frame.h."""

    RGB8 = 1
    BGR8 = 2
    RGBA8 = 3
    GREY8 = 4
    DEPTH16 = 7  # uint16, millimetres; 0 and 65535 are unknown
    DEPTH32F = 8  # float32, metres; 0, negative, infinite and NaN are unknown


_KINDS = {
    PixelFormat.RGB8: (np.uint8, 3), PixelFormat.BGR8: (np.uint8, 3), PixelFormat.RGBA8: (np.uint8, 4),
    PixelFormat.GREY8: (np.uint8, 1), PixelFormat.DEPTH16: (np.uint16, 1), PixelFormat.DEPTH32F: (np.float32, 1),
}  # fmt: skip


@dataclass(frozen=True)
class Intrinsics:
    """A pinhole camera in the convention of OpenCV: the centre of the top left pixel is (0, 0); lengths in pixels.

    distortion: k1, k2, p1, p2, k3, k4, k5, k6.
    """

    width_px: int
    height_px: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    distortion: tuple[float, ...] = (0.0,) * 8

    @staticmethod
    def centred(width_px: int, height_px: int, fov_deg: float) -> Intrinsics:
        """Square pixels, the principal point in the middle; fov_deg: horizontal angle of view."""
        focal = width_px / 2 / math.tan(math.radians(fov_deg) / 2)
        return Intrinsics(width_px, height_px, focal, focal, (width_px - 1) / 2, (height_px - 1) / 2)

    def write_to(self, struct: Any) -> None:
        """Fills a maq_intrinsics."""
        for name in ("width_px", "height_px", "fx_px", "fy_px", "cx_px", "cy_px"):
            setattr(struct, name, getattr(self, name))
        struct.distortion = list(self.distortion)

    @staticmethod
    def of_struct(struct: Any) -> Intrinsics:
        return Intrinsics(
            struct.width_px, struct.height_px, struct.fx_px, struct.fy_px, struct.cx_px, struct.cy_px,
            tuple(struct.distortion),
        )  # fmt: skip


@dataclass(frozen=True)
class Origin:
    """Origin of a predicted frame: the captured frame that it is based on. horizon_s: time from the captured frame to
    the predicted one. age_s: time since the captured frame, until now. captured_sequence: its sequence number."""

    horizon_s: float
    age_s: float
    captured_sequence: int


class Frame(NativeObject):
    """One image with its format and time.

    `Frame(pixels)` wraps an array without a copy: uint8 [H, W, 3] (RGB unless `format` says otherwise), uint8 [H, W]
    (grey), uint16 [H, W] (depth in millimetres) or float32 [H, W] (depth in metres). Don't write to the array while a
    model reads it. intrinsics: of the camera, for the array's size; edges need them. Frames of a `Source` have the
    time, the number and, if they are known, the intrinsics of the camera.
    """

    def __init__(
        self,
        pixels: np.ndarray,
        format: PixelFormat | None = None,
        timestamp_ns: int = 0,
        intrinsics: Intrinsics | None = None,
    ) -> None:
        format = _format_of(pixels) if format is None else PixelFormat(format)
        kind, channels = _KINDS[format]
        shape = pixels.shape[:2] if channels == 1 and pixels.ndim == 2 else (*pixels.shape[:2], channels)
        if pixels.dtype != kind or pixels.shape != shape or pixels.ndim < 2:
            wanted = f"{np.dtype(kind)} [H, W{'' if channels == 1 else f', {channels}'}]"
            raise ValueError(f"{format.name} is {wanted}, not {pixels.dtype} {list(pixels.shape)}")
        n = native()
        self._pixels = np.ascontiguousarray(pixels)
        description = n.sized("maq_frame_desc")
        n.call("maq_frame_desc_init", description, description.struct_size)
        description.format, description.timestamp_ns = int(format), timestamp_ns
        description.height_px, description.width_px = pixels.shape[:2]
        if intrinsics is not None:
            intrinsics.write_to(description.intrinsics)
        description.planes[0] = n.ffi.cast("const uint8_t *", n.ffi.from_buffer(self._pixels))
        wrap, release = "maq_frame_wrap", "maq_frame_release"
        null = n.ffi.NULL
        super().__init__(n.create("maq_frame", n.context, description, null, null, function=wrap, release=release))

    @staticmethod
    def of_handle(handle: Any) -> Frame:
        frame = Frame.__new__(Frame)
        frame._pixels, frame._handle = None, handle
        return frame

    @staticmethod
    def decode(data: bytes) -> Frame:
        """A whole JPEG, PNG, WebP, BMP or TIFF file in memory. Raises MaquetteError."""
        n = native()
        return Frame.of_handle(
            n.create(
                "maq_frame",
                n.context,
                n.ffi.from_buffer(data),
                len(data),
                function="maq_frame_decode",
                release="maq_frame_release",
            )
        )

    def _description(self) -> Any:
        n = native()
        description = n.sized("maq_frame_desc")
        n.call("maq_frame_get_desc", self.handle, description)
        return description

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width in pixels."""
        description = self._description()
        return description.height_px, description.width_px

    @property
    def timestamp_ns(self) -> int:
        return self._description().timestamp_ns

    @property
    def sequence(self) -> int:
        """The number of the frame in its source, from 0; gaps are frames that were dropped."""
        return self._description().sequence

    @property
    def intrinsics(self) -> Intrinsics | None:
        """The camera of the frame; None if it is unknown."""
        struct = self._description().intrinsics
        return Intrinsics.of_struct(struct) if struct.width_px else None

    @property
    def origin(self) -> Origin | None:
        """None of a captured frame; what a predicted one was made from."""
        n = native()
        origin = n.sized("maq_frame_origin")
        n.call("maq_frame_get_origin", self.handle, origin)
        if origin.kind != n.lib.MAQ_FRAME_PREDICTED:
            return None
        return Origin(origin.horizon_ns / 1e9, origin.age_ns / 1e9, origin.captured_sequence)

    def pixels(self, format: PixelFormat = PixelFormat.RGB8) -> np.ndarray:
        """A copy in RGB8, BGR8, RGBA8 or GREY8: uint8 [H, W, C], grey [H, W]. Raises MaquetteError for depth images."""
        _, channels = _KINDS[PixelFormat(format)]
        height, width = self.shape
        out = np.empty((height, width) if channels == 1 else (height, width, channels), np.uint8)
        n = native()
        n.call("maq_frame_copy_pixels", self.handle, int(format), n.ffi.from_buffer("uint8_t[]", out), 0, out.nbytes)
        return out

    def depth(self) -> np.ndarray:
        """float32 [H, W] in metres, 0 where it is unknown: of a depth image, or of what came with a picture. Raises
        MaquetteError."""
        n = native()
        description = n.sized("maq_frame_desc")
        n.call("maq_frame_get_depth", self.handle, description)
        is_float = description.format == PixelFormat.DEPTH32F
        kind, unit = (np.float32, 1.0) if is_float else (np.uint16, 0.001)
        height, width = description.height_px, description.width_px
        size = np.dtype(kind).itemsize
        stride = description.stride_bytes[0] or width * size
        data = n.ffi.buffer(description.planes[0], (height - 1) * stride + width * size)
        raw = np.ndarray((height, width), kind, data, strides=(stride, size))
        known = np.isfinite(raw) & (raw > 0) & (raw < (np.inf if is_float else 65535))
        return np.where(known, raw * np.float32(unit), 0).astype(np.float32)

    def save(self, path: str | Path) -> None:
        """Writes .png or .jpg. Raises MaquetteError."""
        native().call("maq_frame_save", self.handle, str(path).encode())


def _format_of(pixels: np.ndarray) -> PixelFormat:
    if pixels.dtype == np.uint16:
        return PixelFormat.DEPTH16
    if pixels.dtype == np.float32:
        return PixelFormat.DEPTH32F
    return PixelFormat.GREY8 if pixels.ndim == 2 else PixelFormat.RGBA8 if pixels.shape[-1] == 4 else PixelFormat.RGB8


def as_frame(image: Frame | np.ndarray) -> Frame:
    return image if isinstance(image, Frame) else Frame(image)


def acquired_frame(function: str, handle: Any, timeout_s: float | None) -> Frame | None:
    """The frame that `function`, one of maq_…_acquire_frame, waits for; None after the last one. Raises MaquetteError,
    TimeoutError."""
    n = native()
    out = n.ffi.new("maq_frame **")
    limit = n.lib.MAQ_WAIT_FOREVER if timeout_s is None else round(timeout_s * 1e9)
    status = n.ask(function, handle, limit, out)
    if status == n.lib.MAQ_END_OF_STREAM:
        return None
    if status == n.lib.MAQ_TIMEOUT:
        raise TimeoutError(f"no frame came within {timeout_s:g} s")
    if status:
        n.fail(function, status)
    return Frame.of_handle(n.ffi.gc(out[0], n.lib.maq_frame_release))


class Source(NativeObject):
    """A camera, file, recording or simulated scene, opened by a URI; iterate over it.

    `Source("camera:")`, `Source("clip.mp4")`, `Source("stub:people?count=2")`: docs/cameras.md has all of them.
    settings: fields of maq_source_config by their names (queue_length, real_time, loop, ...). Raises MaquetteError.
    """

    def __init__(self, uri: str | Path, **settings: Any) -> None:
        n = native()
        config = n.config("maq_source_config", settings)
        super().__init__(n.create("maq_source", n.context, str(uri).encode(), config))

    @property
    def info(self) -> dict[str, float]:
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
        """The next frame, or None after the last one. timeout_s: of live sources (None: no limit). Raises
        MaquetteError, TimeoutError."""
        return acquired_frame("maq_source_acquire_frame", self.handle, timeout_s)

    def __iter__(self) -> Iterator[Frame]:
        while (frame := self.read()) is not None:
            yield frame


@dataclass(frozen=True)
class Camera:
    """A connected camera. problem: why it cannot be opened now and what to do, "" if it can."""

    uri: str
    name: str
    problem: str


def list_cameras() -> list[Camera]:
    n = native()
    cameras = n.create("maq_camera_list", n.context)

    def text(value: Any) -> str:
        return n.ffi.string(value).decode() if value else ""

    count = n.lib.maq_camera_list_get_count(cameras)
    found = n.indexed("maq_camera_list_get_camera", cameras, "maq_camera_info", count)
    return [Camera(text(c.uri), text(c.name), text(c.problem) if c.status else "") for c in found]
