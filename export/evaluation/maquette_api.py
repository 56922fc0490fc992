"""The C API of the SDK through ctypes: dense pose as an app gets it (sdk/include/maquette)."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from ctypes import POINTER, byref, c_char_p, c_float, c_int32, c_int64, c_size_t, c_uint8, c_uint32, c_uint64
from ctypes import c_void_p as Handle
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TypeVar

import numpy as np

HEADER_VERSION = 200  # MAQ_HEADER_VERSION of 0.2.0
LIBRARY = Path("build/release/stage/lib/libmaquette.so")
PIXEL_RGB8 = 1
PLANE_PART, PLANE_U, PLANE_V, PLANE_PERSON = 1, 2, 3, 4


class MaquetteError(RuntimeError):
    """A call of the C API failed; the text is the library's own sentence."""


class _DenseposeConfig(ctypes.Structure):
    c_name = "maq_densepose_config"
    _fields_ = (
        ("struct_size", c_uint32),
        ("threads", c_int32),
        ("bundle_path", c_char_p),
        ("bundle_files", Handle),
        ("bundle_file_count", c_uint32),
        ("long_side_px", c_int32),
        ("score_threshold", c_float),
        ("max_people", c_int32),
        ("result_pool_size", c_uint32),
        ("max_proposals", c_int32),
        ("key_frame_interval", c_int32),
        ("min_person_height_px", c_int32),
        ("detail", c_int32),
        ("allow_spinning", c_int32),
        ("person_crops", c_int32),
        ("person_crop_px", c_int32),
        ("provider", c_int32),
    )


class FrameDesc(ctypes.Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("format", c_int32),
        ("width_px", c_int32),
        ("height_px", c_int32),
        ("planes", Handle * 2),
        ("stride_bytes", c_size_t * 2),
        ("timestamp_ns", c_int64),
        ("clock", c_int32),
        ("sequence", c_uint64),
    )


class _Person(ctypes.Structure):
    _fields_ = (("struct_size", c_uint32), ("score", c_float), ("box_px", c_float * 4), ("id", c_int64))


class _Stats(ctypes.Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("preprocess_ms", c_float),
        ("trunk_ms", c_float),
        ("proposals_ms", c_float),
        ("box_head_ms", c_float),
        ("dense_head_ms", c_float),
        ("crops_ms", c_float),
        ("decode_ms", c_float),
        ("total_ms", c_float),
        ("network_width_px", c_int32),
        ("network_height_px", c_int32),
        ("proposal_count", c_int32),
        ("person_count", c_int32),
        ("crop_count", c_int32),
        ("dropped_box_count", c_int32),
        ("body_pixel_count", c_int64),
        ("clamped_pixel_count", c_int64),
        ("is_key_frame", c_int32),
        ("provider", c_int32),
        ("threads", c_int32),
        ("is_threads_measured", c_int32),
    )


@dataclass(frozen=True)
class Stats:
    """What one run did; see maq_densepose_stats in densepose.h for the meanings. Times in milliseconds."""

    preprocess_ms: float
    trunk_ms: float
    proposals_ms: float
    box_head_ms: float
    dense_head_ms: float
    crops_ms: float
    decode_ms: float
    total_ms: float
    network_width_px: int
    network_height_px: int
    proposal_count: int
    person_count: int
    crop_count: int
    dropped_box_count: int
    body_pixel_count: int
    clamped_pixel_count: int
    is_key_frame: int
    provider: int
    threads: int
    is_threads_measured: int


@dataclass(frozen=True)
class DensePoseResult:
    """box: float32 [n, 4] x0, y0, x1, y1 in pixels; score: float32 [n], best first; planes: uint8 [H, W, 4]
    holding I, U*255, V*255 and the person's number in `box`, counted from 1.
    """

    box: np.ndarray
    score: np.ndarray
    planes: np.ndarray
    stats: Stats


Config = TypeVar("Config", bound=ctypes.Structure)
Values = TypeVar("Values")
Signatures = Mapping[str, tuple[type, ...]]

_SHARED: Signatures = {
    "maq_context_create": (c_uint32, Handle, POINTER(Handle)),
    "maq_frame_desc_init": (POINTER(FrameDesc), c_uint32),
    "maq_frame_wrap": (Handle, POINTER(FrameDesc), Handle, Handle, POINTER(Handle)),
}
_DENSEPOSE: Signatures = {
    "maq_densepose_config_init": (POINTER(_DenseposeConfig), c_uint32),
    "maq_densepose_create": (Handle, POINTER(_DenseposeConfig), POINTER(Handle)),
    "maq_densepose_run": (Handle, Handle, POINTER(Handle)),
    "maq_densepose_result_get_person": (Handle, c_uint32, POINTER(_Person)),
    "maq_densepose_result_get_plane": (Handle, c_int32, POINTER(Handle), POINTER(c_size_t)),
    "maq_densepose_result_get_stats": (Handle, POINTER(_Stats)),
    "maq_densepose_reset": (Handle,),
}


class Library:
    """libmaquette with a context, for the wrappers of its models.

    path: libmaquette.so (None: MAQ_LIBRARY or the release build). functions: argument types of those used that return
    maq_status. released: those that free a handle and return nothing.
    """

    def __init__(self, path: Path | None, functions: Signatures, released: Sequence[str]) -> None:
        self.context = Handle()
        path = path or Path(os.environ.get("MAQ_LIBRARY", LIBRARY))
        if not path.exists():
            raise MaquetteError(f"{path} is not there. Build the SDK (make build), or set MAQ_LIBRARY.")
        self.functions = ctypes.CDLL(str(path.resolve()))
        self.declare({**_SHARED, **functions}, ("maq_context_destroy", "maq_frame_release", *released))
        self.functions.maq_last_error.argtypes, self.functions.maq_last_error.restype = (Handle,), c_char_p
        name_of = self.functions.maq_status_get_name
        name_of.argtypes, name_of.restype = (c_int32,), c_char_p
        self.call("maq_context_create", HEADER_VERSION, None, byref(self.context))

    def declare(self, functions: Signatures, released: Sequence[str]) -> None:
        """Further functions, as of the constructor."""
        for name, arguments in functions.items():
            function = getattr(self.functions, name)
            function.argtypes, function.restype = arguments, c_int32
        for name in released:
            function = getattr(self.functions, name)
            function.argtypes, function.restype = (Handle,), None

    def close(self) -> None:
        self.functions.maq_context_destroy(self.context)
        self.context = Handle()

    def call(self, function: str, *arguments: object) -> None:
        """Calls the library; a status other than MAQ_OK becomes MaquetteError with the library's text."""
        status = getattr(self.functions, function)(*arguments)
        if status:
            text = self.functions.maq_last_error(None)
            name = self.functions.maq_status_get_name(status).decode()
            raise MaquetteError(f"{function}: {(text or b'').decode() or name} ({name})")

    def free(self, function: str, handle: Handle) -> None:
        getattr(self.functions, function)(handle)

    def filled(self, config: type[Config], settings: Mapping[str, object]) -> Config:
        """A config struct `maq_NAME_config` with its defaults and the settings, by the names of its fields."""
        filled = config()
        self.call(f"{config.c_name}_init", byref(filled), ctypes.sizeof(filled))
        for name, value in settings.items():
            if name not in (field for field, _ in config._fields_):
                raise TypeError(f"{config.c_name} has no field {name}")
            setattr(filled, name, value)
        return filled

    @contextmanager
    def frame(self, pixels: np.ndarray, pixel_format: int) -> Iterator[Handle]:
        """A frame over contiguous pixels [H, W, ..], which must outlive it."""
        description = FrameDesc()
        self.call("maq_frame_desc_init", byref(description), ctypes.sizeof(description))
        description.format = pixel_format
        description.height_px, description.width_px = pixels.shape[:2]
        description.planes[0] = pixels.ctypes.data
        frame = Handle()
        self.call("maq_frame_wrap", self.context, byref(description), None, None, byref(frame))
        try:
            yield frame
        finally:
            self.free("maq_frame_release", frame)

    def plane(self, getter: str, result: Handle, plane: int, shape: tuple[int, int], kind: type) -> np.ndarray:
        """A copy of a result's plane [H, W]."""
        values, stride = Handle(), c_size_t()
        self.call(getter, result, plane, byref(values), byref(stride))
        size = np.dtype(kind).itemsize
        data = (c_uint8 * ((shape[0] - 1) * stride.value + shape[1] * size)).from_address(values.value)
        return np.ndarray(shape, kind, data, strides=(stride.value, size)).copy()


def values_of(struct: ctypes.Structure, dataclass_type: type[Values]) -> Values:
    return dataclass_type(**{field.name: getattr(struct, field.name) for field in fields(dataclass_type)})


class DensePose:
    """One bundle, loaded by libmaquette. Use it in a `with` statement, or call close().

    bundle: folder with manifest.json. score_threshold: people below it are dropped (None: the bundle's).
    threads: 0 lets the library choose, -1 lets it measure.
    library: libmaquette.so (default: MAQ_LIBRARY or the release build).
    settings: further fields of maq_densepose_config by their names.
    """

    def __init__(
        self,
        bundle: Path,
        score_threshold: float | None = None,
        threads: int = 0,
        library: Path | None = None,
        **settings: int,
    ) -> None:
        released = ("maq_densepose_destroy", "maq_densepose_result_release")
        self._library, self._densepose = Library(library, _DENSEPOSE, released), Handle()
        count = self._library.functions.maq_densepose_result_get_person_count
        count.argtypes, count.restype = (Handle,), c_uint32
        given: dict[str, object] = {"bundle_path": os.fsencode(bundle), "threads": threads, **settings}
        if score_threshold is not None:
            given["score_threshold"] = score_threshold
        config = self._library.filled(_DenseposeConfig, given)
        self._library.call("maq_densepose_create", self._library.context, byref(config), byref(self._densepose))

    def __enter__(self) -> DensePose:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        self._library.free("maq_densepose_destroy", self._densepose)
        self._library.close()
        self._densepose = Handle()

    def reset(self) -> None:
        """The next image starts a new stream (key_frame_interval above 1)."""
        self._library.call("maq_densepose_reset", self._densepose)

    def run(self, image: np.ndarray) -> DensePoseResult:
        """image: uint8 [H, W, 3] RGB. Raises MaquetteError."""
        if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] != 3:
            raise ValueError(f"an image is uint8 [H, W, 3], not {image.dtype} {image.shape}")
        image, result = np.ascontiguousarray(image), Handle()
        with self._library.frame(image, PIXEL_RGB8) as frame:
            try:
                self._library.call("maq_densepose_run", self._densepose, frame, byref(result))
                return self._copy(result, image.shape[0], image.shape[1])
            finally:
                self._library.free("maq_densepose_result_release", result)

    def _copy(self, result: Handle, height: int, width: int) -> DensePoseResult:
        count = self._library.functions.maq_densepose_result_get_person_count(result)
        found = np.empty((count, 5), np.float32)
        person = _Person(struct_size=ctypes.sizeof(_Person))
        for k, row in enumerate(found):
            self._library.call("maq_densepose_result_get_person", result, k, byref(person))
            row[:4], row[4] = person.box_px, person.score
        getter, numbers = "maq_densepose_result_get_plane", (PLANE_PART, PLANE_U, PLANE_V, PLANE_PERSON)
        planes = [self._library.plane(getter, result, number, (height, width), np.uint8) for number in numbers]
        stats = _Stats(struct_size=ctypes.sizeof(_Stats))
        self._library.call("maq_densepose_result_get_stats", result, byref(stats))
        return DensePoseResult(found[:, :4], found[:, 4], np.stack(planes, -1), values_of(stats, Stats))
