"""libmaquette: found, opened once, and called with errors as exceptions."""

from __future__ import annotations

import ctypes
import functools
import os
import weakref
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Self, TypeVar

import numpy as np

T = TypeVar("T")

_FOLDER = Path(__file__).resolve().parent
_IN_WHEEL = _FOLDER / "lib" / "libmaquette.so"
_CHECKOUT = _FOLDER.parent.parent
_IN_CHECKOUT = _CHECKOUT / "build/release/stage/lib/libmaquette.so"


class MaquetteError(RuntimeError):
    """A call of the SDK failed. The text says what was wrong and what to do; `status` is the name of the C API's
    status, such as "MAQ_ERROR_NOT_FOUND"."""

    def __init__(self, text: str, status: str) -> None:
        super().__init__(f"{text} ({status})")
        self.status = status


def library_path() -> Path:
    """The file that is opened: the environment's MAQ_LIBRARY, the one inside the wheel, or the checkout's build."""
    given = os.environ.get("MAQ_LIBRARY")
    if given:
        return Path(given).resolve()
    return _IN_WHEEL if _IN_WHEEL.exists() else _IN_CHECKOUT


class Native:
    """The opened library. ffi, lib: cffi's. context: the one context of this process."""

    def __init__(self, path: Path) -> None:
        if not path.exists():
            problem = f"{path} is not there. Build the SDK (make build), or set MAQ_LIBRARY."
            raise MaquetteError(problem, "MAQ_ERROR_NOT_FOUND")
        try:
            from maquette._generated import ffi
        except ImportError:
            from maquette.declarations import read_headers

            ffi = read_headers(_CHECKOUT / "sdk/include/maquette")
        for other in sorted(path.parent.glob("libturbojpeg.so*")):  # the wheel brings its own; found by its name then
            ctypes.CDLL(str(other), mode=ctypes.RTLD_GLOBAL)
        # C does not keep a struct's texts alive: they live as long as the struct.
        self._texts: weakref.WeakKeyDictionary[Any, list[Any]] = weakref.WeakKeyDictionary()
        self.ffi: Any = ffi
        self.lib: Any = ffi.dlopen(str(path))
        version = sum(v * f for v, f in zip(self._version(), (10000, 100, 1), strict=True))
        self.context = self.create("maq_context", version, ffi.NULL)

    def _version(self) -> tuple[int, int, int]:
        return self.lib.MAQ_VERSION_MAJOR, self.lib.MAQ_VERSION_MINOR, self.lib.MAQ_VERSION_PATCH

    def status_name(self, status: int) -> str:
        return self.ffi.string(self.lib.maq_status_get_name(status)).decode()

    def call(self, function: str, *arguments: Any) -> None:
        """Calls a function that returns a maq_status. Raises MaquetteError with the library's own sentence."""
        status = self.ask(function, *arguments)
        if status:
            self.fail(function, status)

    def ask(self, function: str, *arguments: Any) -> int:
        """The same, but returns the status."""
        try:
            called = getattr(self.lib, function)
        except AttributeError:
            text = f"This build of libmaquette has no {function}; build it with every MAQ_WITH_… switch on."
            raise MaquetteError(text, "MAQ_ERROR_UNSUPPORTED") from None
        return called(*arguments)

    def fail(self, function: str, status: int) -> None:
        text = self.lib.maq_last_error(self.ffi.NULL)
        name = self.status_name(status)
        raise MaquetteError(self.ffi.string(text).decode() if text else f"{function} failed", name)

    def create(self, kind: str, *arguments: Any, function: str = "", release: str = "") -> Any:
        """A handle `kind *` written by `function` (KIND_create) to its last argument; freed with the object that is
        returned, by `release` (KIND_destroy)."""
        out = self.ffi.new(f"{kind} **")
        self.call(function or f"{kind}_create", *arguments, out)
        return self.ffi.gc(out[0], getattr(self.lib, release or f"{kind}_destroy"))

    def config(self, kind: str, settings: Mapping[str, Any]) -> Any:
        """A struct of the C API with its defaults and the settings, by the names of its fields. The fields of its
        maq_model_options, if it has them, are settings too: threads, bundle_path, ..."""
        struct = self.ffi.new(f"{kind} *")
        self.call(f"{kind}_init", struct, self.ffi.sizeof(kind))
        fields = {name: struct for name, _ in self.ffi.typeof(kind).fields}
        if fields.pop("model", None) is not None:
            fields |= {name: struct.model for name, _ in self.ffi.typeof("maq_model_options").fields}
        fields.pop("struct_size", None)
        kept = []
        for name, value in settings.items():
            if name not in fields:
                raise TypeError(f"{kind} has no field {name}; it has {', '.join(sorted(fields))}")
            if isinstance(value, (str, os.PathLike)):
                value = self.ffi.new("char[]", os.fsencode(value))
                kept.append(value)
            setattr(fields[name], name, value)
        self._texts[struct] = kept
        return struct

    def sized(self, kind: str) -> Any:
        """An empty struct with its struct_size, for the library to fill."""
        struct = self.ffi.new(f"{kind} *")
        struct.struct_size = self.ffi.sizeof(kind)
        return struct

    def stats(self, kind: str, function: str, handle: Any) -> dict[str, float]:
        """The fields of a stats struct by their names."""
        struct = self.sized(kind)
        self.call(function, handle, struct)
        return {name: getattr(struct, name) for name, _ in self.ffi.typeof(kind).fields if name != "struct_size"}

    def plane(self, function: str, handle: Any, plane: int, shape: tuple[int, ...], kind: type) -> np.ndarray:
        """A copy of a plane of a result, of the shape [H, W] or [H, W, C]."""
        pointer = self.ffi.typeof(getattr(self.lib, function)).args[2]  # bytes of one system, void of another
        values, stride = self.ffi.new(pointer), self.ffi.new("size_t *")
        self.call(function, handle, plane, values, stride)
        size = np.dtype(kind).itemsize
        row = int(np.prod(shape[1:])) * size
        data = self.ffi.buffer(values[0], (shape[0] - 1) * stride[0] + row)
        inner = [int(np.prod(shape[k + 1 :])) * size for k in range(1, len(shape))]
        return np.ndarray(shape, kind, data, strides=(stride[0], *inner)).copy()

    def indexed(self, function: str, handle: Any, kind: str, count: int) -> Iterator[Any]:
        """The structs that a `…_get_…(handle, index, struct)` fills, one after the other in the same memory."""
        struct = self.sized(kind)
        for index in range(count):
            self.call(function, handle, index, struct)
            yield struct


class NativeObject:
    """An object of the library: freed by close(), at the end of a `with` statement, or with the Python object."""

    def __init__(self, handle: Any) -> None:
        self._handle = handle

    @property
    def handle(self) -> Any:
        """For calls of the C API. Raises MaquetteError when it is closed."""
        if self._handle is None:
            raise MaquetteError(f"This {type(self).__name__} is closed.", "MAQ_ERROR_INVALID_ARGUMENT")
        return self._handle

    def close(self) -> None:
        if self._handle is not None:
            native().ffi.release(self._handle)
            self._handle = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


@functools.cache
def native() -> Native:
    """The library, opened at the first call. Raises MaquetteError where it is not there."""
    return Native(library_path())


class ProgressCallback:
    """A callback of the C API, of the type `signature`, around a Python function of the fraction done and the stage (if
    the type has one). The function may be None, and may return False to cancel. What it raises cancels, too,
    and comes out of `run`; so does Ctrl-C, for which Python needs to be asked now and then. `pointer`: for the C API.
    """

    def __init__(self, progress: Callable[..., bool | None] | None, signature: str = "maq_progress_callback") -> None:
        ffi = native().ffi
        self._raised: BaseException | None = None

        def told(_: Any, done: float, *stage: Any) -> int:
            if self._raised is not None:
                return 0
            go_on = progress is None or progress(done, *(ffi.string(text).decode() for text in stage))
            return 0 if go_on is False else 1

        self.pointer = ffi.callback(signature, told, error=0, onerror=self.keep)

    def keep(self, _: Any, error: BaseException, __: Any) -> None:
        """The `onerror` of this callback, and of others of the same call."""
        self._raised = error

    def run(self, call: Callable[[], T]) -> T:
        """Returns the result of `call`, which calls back. Raises MaquetteError, and the exceptions of the callback."""
        self._raised, result = None, None
        try:
            result = call()
        except MaquetteError:
            if self._raised is None:
                raise
        raised, self._raised = self._raised, None
        if raised is not None:
            raise raised
        return result
