"""Frames: images on their way into the SDK and out of it."""

from __future__ import annotations

import enum
import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, Union

import numpy as np

from maquette.native import MaquetteError, NativeObject, native, path_to_write

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


class PixelFormat(enum.IntEnum):
    """How an array's pixels are meant; maq_pixel_format in frame.h. Names work, too: "bgr8"."""

    RGB8 = 1
    BGR8 = 2
    RGBA8 = 3
    GREY8 = 4
    DEPTH16 = 7  # uint16, millimetres; 0 and 65535 are unknown
    DEPTH32F = 8  # float32, metres; 0, negative, infinite and NaN are unknown


class HasArrayInterface(Protocol):
    """An image of Pillow, or another object that numpy reads."""

    @property
    def __array_interface__(self) -> dict[str, Any]: ...


# An array, or what numpy can read as one (Pillow, torch, ...).
ArrayImage = Union["ArrayLike", HasArrayInterface]
# An image: a Frame, such an array, or the path of an image file.
ImageLike = Union["Frame", ArrayImage, "os.PathLike[str]"]

_MODES = ("RGB", "RGBA", "L", "I;16", "F")  # of Pillow: read as they are; all others are converted
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

    def __repr__(self) -> str:
        lens = ", with distortion" if any(self.distortion) else ""
        focal = f"{self.fx_px:.1f}, {self.fy_px:.1f} px"
        return f"<Intrinsics {self.width_px} x {self.height_px}, focal length {focal}{lens}>"

    @staticmethod
    def centred(
        width_px: int, height_px: int, fov_deg: float | None = None, focal_px: float | None = None
    ) -> Intrinsics:
        """Square pixels, the principal point in the middle. Give the horizontal angle of view, fov_deg, or the focal
        length, focal_px. Raises ValueError for none or both."""
        if (fov_deg is None) == (focal_px is None):
            raise ValueError(
                "Give either fov_deg, the horizontal angle of view, or focal_px, the focal length in pixels."
            )
        if fov_deg is not None:
            focal_px = width_px / 2 / math.tan(math.radians(fov_deg) / 2)
        assert focal_px is not None
        return Intrinsics(width_px, height_px, focal_px, focal_px, (width_px - 1) / 2, (height_px - 1) / 2)

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
    """One image with its format and time. `numpy.asarray(frame)` gives its pixels or its depth.

    `Frame(pixels)` wraps an array without a copy: uint8 [H, W, 3] (RGB unless `format` says otherwise), [H, W, 4]
    (RGBA) or [H, W] (grey), uint16 [H, W] (depth in millimetres) or float32 [H, W] (depth in metres). Images of Pillow,
    tensors on the CPU, and other objects that numpy reads work, too. Don't write to the array while a model reads it.
    intrinsics: of the camera, for the array's size; edges need them. sequence: from 0 for the frames of a stream, whose
    earlier frames then count (ids of people, steady surface). Frames of a `Source` have the time, the number
    and, if they are known, the intrinsics of the camera. Raises ValueError for an array that is no such image.
    """

    def __init__(
        self,
        pixels: ArrayImage,
        format: PixelFormat | str | None = None,
        timestamp_ns: int = 0,
        intrinsics: Intrinsics | None = None,
        sequence: int = 0,
    ) -> None:
        array = _array_of(pixels)
        format = _format_of(array, pixels) if format is None else _pixel_format(format)
        kind, channels = _KINDS[format]
        shape = array.shape[:2] if channels == 1 and array.ndim == 2 else (*array.shape[:2], channels)
        if array.dtype != kind or array.shape != shape or array.ndim < 2:
            wanted = f"{np.dtype(kind)} [H, W{'' if channels == 1 else f', {channels}'}]"
            raise ValueError(f"{format.name} is {wanted}, not {array.dtype} {list(array.shape)}")
        n = native()
        self._pixels: np.ndarray | None = np.ascontiguousarray(array)
        description = n.sized("maq_frame_desc")
        n.call("maq_frame_desc_init", description, description.struct_size)
        description.format, description.timestamp_ns, description.sequence = int(format), timestamp_ns, sequence
        description.height_px, description.width_px = array.shape[:2]
        if intrinsics is not None:
            if not isinstance(intrinsics, Intrinsics):
                wanted = "a maquette.Intrinsics, such as Intrinsics.centred(640, 480, fov_deg=60)"
                raise TypeError(f"intrinsics is {intrinsics!r}; it is {wanted}.")
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
    def open(
        path: str | os.PathLike[str], depth_unit_m: float | None = None, intrinsics: Intrinsics | None = None
    ) -> Frame:
        """Reads an image file, upright by its EXIF orientation. depth_unit_m: the file is a depth image in this unit,
        0.001 for millimetres; `intrinsics` are of its camera. Raises MaquetteError, and OSError for a file that cannot
        be read."""
        if depth_unit_m is None:
            try:
                return Frame.decode(Path(path).read_bytes())
            except MaquetteError as error:
                raise MaquetteError(error.text.replace("The image in memory", str(path)), error.status) from None
        with open(path, "rb"):  # a missing file is Python's FileNotFoundError
            n, escaped = native(), os.fspath(path).replace("%", "%25").replace("?", "%3F")
        uri = f"image:{escaped}?depth_unit={depth_unit_m:g}".encode()
        source = n.create("maq_source", n.context, uri, n.ffi.NULL)
        depth = n.wait("maq_source_acquire_frame", source, "maq_frame", "maq_frame_release", None)
        return Frame(Frame.of_handle(depth).depth(), intrinsics=intrinsics)

    @staticmethod
    def decode(data: bytes) -> Frame:
        """Decodes a whole JPEG, PNG, WebP, BMP or TIFF file in memory. Raises MaquetteError."""
        n, decode = native(), "maq_frame_decode"
        data_and_size = n.ffi.from_buffer(data), len(data)
        handle = n.create("maq_frame", n.context, *data_and_size, function=decode, release="maq_frame_release")
        return Frame.of_handle(handle)

    @staticmethod
    def of_yuv(
        y: np.ndarray,
        u: np.ndarray,
        v: np.ndarray,
        is_video_range: bool = False,
        rotation_deg: int = 0,
        timestamp_ns: int = 0,
    ) -> Frame:
        """Copies an image in three planes (YUV 4:2:0), and rotates it clockwise. y: uint8 [H, W]; u, v: uint8
        [ceil(H / 2), ceil(W / 2)]. is_video_range: Y from 16 to 235, as in clips; otherwise 0 to 255. Raises
        MaquetteError."""
        n = native()
        planes = [np.ascontiguousarray(plane, np.uint8) for plane in (y, u, v)]
        half = tuple((side + 1) // 2 for side in planes[0].shape)
        if planes[0].ndim != 2 or planes[1].shape != half or planes[2].shape != half:
            shapes = ", ".join(str(list(plane.shape)) for plane in planes)
            raise ValueError(f"The planes are {shapes}; u and v have half the height and width of y, rounded up.")
        image = n.config("maq_yuv_image", {"rotation_deg": rotation_deg, "timestamp_ns": timestamp_ns})
        image.height_px, image.width_px = planes[0].shape
        image.is_video_range = is_video_range
        for k, plane in enumerate(planes):
            image.planes[k] = n.ffi.cast("const uint8_t *", n.ffi.from_buffer(plane))
            image.size_bytes[k], image.stride_bytes[k], image.pixel_stride_bytes[k] = plane.nbytes, plane.shape[1], 1
        convert, release = "maq_frame_convert_yuv", "maq_frame_release"
        return Frame.of_handle(n.create("maq_frame", n.context, image, function=convert, release=release))

    def resized(self, width_px: int, height_px: int) -> Frame:
        """Copies a colour frame to another size, with intrinsics that fit. Raises MaquetteError."""
        n, resize = native(), "maq_frame_resize"
        size = int(width_px), int(height_px)
        return Frame.of_handle(
            n.create("maq_frame", self.handle, *size, function=resize, release="maq_frame_release")
        )  # fmt: skip

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        if copy is False:
            raise ValueError("The pixels of a Frame are copied; ask numpy with copy=None.")
        format = self._description().format
        if format in (PixelFormat.DEPTH16, PixelFormat.DEPTH32F):
            array = self.depth()
        else:
            array = self.pixels(PixelFormat.GREY8 if format == PixelFormat.GREY8 else PixelFormat.RGB8)
        return array if dtype is None else array.astype(dtype)

    def _about(self) -> str:
        about = self._description()
        format = native().name_of("maq_pixel_format", about.format).upper()
        marks = ", predicted" if self.origin else ""
        return f"{about.width_px} x {about.height_px} {format}, {about.timestamp_ns / 1e9:.3f} s{marks}"

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

    def pixels(self, format: PixelFormat | str = PixelFormat.RGB8) -> np.ndarray:
        """A copy in RGB8, BGR8, RGBA8 or GREY8: uint8 [H, W, C], grey [H, W]. Raises MaquetteError for depth images."""
        format = _pixel_format(format)
        _, channels = _KINDS[format]
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

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes .png or .jpg; depth as .png in millimetres or .tif in metres. Raises MaquetteError."""
        native().call("maq_frame_save", self.handle, path_to_write(path))


def _pixel_format(format: PixelFormat | str) -> PixelFormat:
    if not isinstance(format, str):
        return PixelFormat(format)
    names = {known.name.lower(): known for known in PixelFormat}
    if format.lower() not in names:
        raise ValueError(f'format is "{format}"; it is one of {", ".join(names)}')
    return names[format.lower()]


def _array_of(pixels: Any) -> np.ndarray:
    mode = getattr(pixels, "mode", None)
    if isinstance(mode, str) and mode not in _MODES and hasattr(pixels, "convert"):  # palettes, CMYK, ... of Pillow
        pixels = pixels.convert("RGB")
    array = np.asarray(pixels)
    if array.ndim == 2 and array.dtype in (np.float64, np.float16):
        return array.astype(np.float32)
    return array


def _format_of(array: np.ndarray, given: Any) -> PixelFormat:
    """The format of an array that is an image. Raises ValueError, with a hint."""
    formats = {
        (np.dtype(np.uint8), 3, 3): PixelFormat.RGB8, (np.dtype(np.uint8), 3, 4): PixelFormat.RGBA8,
        (np.dtype(np.uint8), 2, 1): PixelFormat.GREY8, (np.dtype(np.uint16), 2, 1): PixelFormat.DEPTH16,
        (np.dtype(np.float32), 2, 1): PixelFormat.DEPTH32F,
    }  # fmt: skip
    found = formats.get((array.dtype, array.ndim, array.shape[2] if array.ndim == 3 else 1))
    if found is not None:
        return found
    hint = ""
    if array.ndim == 3 and array.shape[0] in (3, 4) and array.shape[2] not in (3, 4):
        hint = "; the channels come last: numpy.moveaxis(image, 0, -1)"
    elif array.ndim == 3 and array.dtype.kind == "f":
        hint = "; colours from 0 to 1 become bytes by (image * 255).round().astype(numpy.uint8)"
    elif array.ndim == 2 and array.dtype.kind in "iu":
        hint = "; depth in millimetres becomes image.astype(numpy.uint16)"
    elif array.ndim == 4:
        hint = "; pass one image at a time"
    shape = f"{array.dtype} {list(array.shape)}" if array.ndim else f"{given!r:.60}"
    raise ValueError(
        "An image is uint8 [H, W, 3], [H, W, 4] or [H, W], or depth: uint16 [H, W] in millimetres or float32 [H, W] in "
        f"metres, but this {type(given).__name__} is {shape}{hint}."
    )


def as_frame(image: ImageLike) -> Frame:
    if isinstance(image, Frame):
        return image
    return Frame.open(image) if isinstance(image, (str, os.PathLike)) else Frame(image)


def as_depth(image: ImageLike, intrinsics: Intrinsics | None = None) -> Frame:
    """A path is the path of a depth image in millimetres."""
    if isinstance(image, Frame):
        return image
    if isinstance(image, (str, os.PathLike)):
        return Frame.open(image, depth_unit_m=0.001, intrinsics=intrinsics)
    return Frame(image, intrinsics=intrinsics)


def acquired_frame(function: str, handle: Any, timeout_s: float | None) -> Frame | None:
    """The frame that `function`, one of maq_…_acquire_frame, waits for; None after the last one. Raises MaquetteError,
    TimeoutError."""
    frame = native().wait(function, handle, "maq_frame", "maq_frame_release", timeout_s)
    return None if frame is None else Frame.of_handle(frame)
