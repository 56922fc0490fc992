"""libmaquette: found, opened once, and called with errors as exceptions."""

from __future__ import annotations

import contextlib
import difflib
import functools
import importlib.util
import os
import re
import time
import weakref
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from maquette.declarations import enum_names, read_headers

if TYPE_CHECKING:
    from typing import Self

T = TypeVar("T")
_WAIT_NS = 50_000_000  # Ctrl-C ends a wait within this time

_FOLDER = Path(__file__).resolve().parent
_IN_WHEEL = next(_FOLDER.glob("lib/libmaquette.so*"), None)
_CHECKOUT = _FOLDER.parent.parent
_IN_CHECKOUT = _CHECKOUT / "build/release/stage/lib/libmaquette.so"


class MaquetteError(RuntimeError):
    """A call of the SDK failed. The text says what was wrong and what to do; `status` is the name of the C API's
    status, such as "MAQ_ERROR_NOT_FOUND"."""

    def __init__(self, text: str, status: str) -> None:
        super().__init__(f"{text} ({status})")
        self.text, self.status = text, status

    def __reduce__(self) -> tuple[type[MaquetteError], tuple[str, str]]:  # a pool of processes pickles exceptions
        return type(self), (self.text, self.status)


def library_path() -> Path:
    """The file that is opened: the environment's MAQ_LIBRARY, the one inside the wheel, or the checkout's build."""
    given = os.environ.get("MAQ_LIBRARY")
    if given:
        return Path(given).resolve()
    return _IN_WHEEL or _IN_CHECKOUT


def sample(name: str) -> Path:
    """A file to try things with: "photo.jpg", a person; "box_depth.png", depth in millimetres of a camera whose focal
    length is 600 pixels."""
    places = (_FOLDER / "share/maquette/samples", _CHECKOUT / "tests/media")
    found = next((place / name for place in places if (place / name).is_file()), None)
    if found is None:
        raise MaquetteError(
            f"There is no sample {name!r}; there are photo.jpg and box_depth.png.", "MAQ_ERROR_NOT_FOUND"
        )
    return found


def path_to_write(path: str | os.PathLike[str]) -> bytes:
    """The path for the C API, with its folder made. The library says why a folder cannot be made."""
    with contextlib.suppress(OSError):
        os.makedirs(os.path.dirname(os.path.abspath(os.fsdecode(path))), exist_ok=True)
    return os.fsencode(path)


def as_python(problem: str) -> str:
    """The library's sentence about a problem, with the advice for Python where it differs."""
    missing = re.search(r"bundle_path is NULL, but .*/models/(\w+)\S* does not exist", problem)
    if missing is None or library_path() != _IN_WHEEL:
        return problem
    return f"The networks of {missing[1]} are not installed: pip install 'maquette[{missing[1]}]'"


def name_ffmpeg() -> None:
    """Lets the library read clips by the ffmpeg of the extra `clips`, unless MAQ_FFMPEG names another."""
    if "MAQ_FFMPEG" in os.environ or importlib.util.find_spec("imageio_ffmpeg") is None:
        return
    import imageio_ffmpeg  # type: ignore[import-not-found,import-untyped,unused-ignore]

    with contextlib.suppress(RuntimeError):  # installed without its program
        os.environ["MAQ_FFMPEG"] = imageio_ffmpeg.get_ffmpeg_exe()


class Native:
    """The opened library. ffi, lib: cffi's."""

    def __init__(self, path: Path) -> None:
        if not path.exists():
            problem = f"{path} is not there. Build the SDK (make build), or set MAQ_LIBRARY."
            raise MaquetteError(problem, "MAQ_ERROR_NOT_FOUND")
        try:
            from maquette._generated import ffi  # type: ignore[import-not-found]
        except ImportError:
            ffi = read_headers(_CHECKOUT / "sdk/include/maquette")
        name_ffmpeg()
        # C does not keep a struct's texts alive: they live as long as the struct.
        self._texts: weakref.WeakKeyDictionary[Any, list[Any]] = weakref.WeakKeyDictionary()
        self.ffi: Any = ffi
        self.lib: Any = ffi.dlopen(str(path))
        self._context: Any = None
        _ = self.context  # headers of another version are refused now
        if hasattr(os, "register_at_fork"):
            os.register_at_fork(after_in_child=self._forget_context)

    @property
    def context(self) -> Any:
        """The one context of this process. A child of fork() makes its own, because a parent's is of no use there."""
        if self._context is None:
            lib = self.lib
            version = lib.MAQ_VERSION_MAJOR * 10000 + lib.MAQ_VERSION_MINOR * 100 + lib.MAQ_VERSION_PATCH
            self._context = self.create("maq_context", version, self.ffi.NULL)
        return self._context

    def _forget_context(self) -> None:
        self._context = None

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
        raise MaquetteError(as_python(self.text(text)) or f"{function} failed", name)

    def create(self, kind: str, *arguments: Any, function: str = "", release: str = "") -> Any:
        """A handle `kind *` written by `function` (KIND_create) to its last argument; freed with the object that is
        returned, by `release` (KIND_destroy)."""
        out = self.ffi.new(f"{kind} **")
        self.call(function or f"{kind}_create", *arguments, out)
        return self.ffi.gc(out[0], getattr(self.lib, release or f"{kind}_destroy"))

    def config(self, kind: str, settings: Mapping[str, Any], arguments: Sequence[str] = ()) -> Any:
        """A struct of the C API with its defaults and the settings, by the names of its fields. The fields of its
        maq_model_options, if it has them, are settings too: threads, bundle_path, ... arguments: other names of the
        function in Python, for the advice about wrong ones."""
        struct = self.ffi.new(f"{kind} *")
        self.call(f"{kind}_init", struct, self.ffi.sizeof(kind))
        fields = {name: (struct, field.type) for name, field in self.ffi.typeof(kind).fields}
        if fields.pop("model", None) is not None:
            options = self.ffi.typeof("maq_model_options").fields
            fields |= {name: (struct.model, field.type) for name, field in options}
        fields.pop("struct_size", None)
        kept = []
        for name, value in settings.items():
            if name not in fields:
                raise TypeError(_advice(kind, name, [*arguments, *fields]))
            owner, of_type = fields[name]
            if of_type.kind == "enum" and isinstance(value, (str, bool)):
                value = self.value_of(of_type.cname, value, name)
            elif of_type.kind == "pointer" and isinstance(value, (str, os.PathLike)):
                value = self.ffi.new("char[]", os.fsencode(value))
                kept.append(value)
            try:
                setattr(owner, name, value)
            except (TypeError, OverflowError):
                raise TypeError(f"{name} is {value!r}; in {kind} it is of type {of_type.cname}") from None
        self._texts[struct] = kept
        return struct

    def names_of(self, kind: str) -> dict[str, int]:
        """Values of an enum by short names: "off", "auto" and "all" of maq_densepose_crops."""
        return enum_names(self.ffi.typeof(kind))

    def value_of(self, kind: str, name: str | bool, argument: str) -> int:
        """The value of an enum by its short name. Raises ValueError with all names."""
        names = self.names_of(kind)
        if not isinstance(name, str) or name not in names:
            given = f'"{name}"' if isinstance(name, str) else repr(name)
            raise ValueError(f"{argument} is {given}; it is one of {', '.join(names)}")
        return names[name]

    def name_of(self, kind: str, value: int) -> str:
        """The short name of a value of an enum."""
        return next(name for name, known in self.names_of(kind).items() if known == value)

    def sized(self, kind: str) -> Any:
        """An empty struct with its struct_size, for the library to fill."""
        struct = self.ffi.new(f"{kind} *")
        struct.struct_size = self.ffi.sizeof(kind)
        return struct

    def wait(self, function: str, handle: Any, kind: str, release: str, timeout_s: float | None) -> Any:
        """The object that `function`, a maq_…_acquire_…, waits for; None when no more will come. It waits in slices,
        between which Python sees Ctrl-C. Raises MaquetteError, TimeoutError."""
        out = self.ffi.new(f"{kind} **")
        end = None if timeout_s is None else time.monotonic_ns() + round(timeout_s * 1e9)
        while True:
            left = _WAIT_NS if end is None else max(0, min(_WAIT_NS, end - time.monotonic_ns()))
            status = self.ask(function, handle, left, out)
            if status != self.lib.MAQ_TIMEOUT:
                break
            if end is not None and time.monotonic_ns() >= end:
                raise TimeoutError(f"nothing came within {timeout_s:g} s")
        if status in (self.lib.MAQ_END_OF_STREAM, self.lib.MAQ_CANCELLED):
            return None
        if status:
            self.fail(function, status)
        return self.ffi.gc(out[0], getattr(self.lib, release))

    def text(self, pointer: Any) -> str:
        """A text of C; "" for NULL."""
        return self.ffi.string(pointer).decode() if pointer else ""

    def stats(self, kind: str, function: str, handle: Any) -> dict[str, Any]:
        """The fields of a stats struct by their names; enums by the names of their values."""
        struct = self.sized(kind)
        self.call(function, handle, struct)
        return {
            name: self.name_of(field.type.cname, getattr(struct, name))
            if field.type.kind == "enum"
            else getattr(struct, name)
            for name, field in self.ffi.typeof(kind).fields
            if name != "struct_size"
        }

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


def _advice(kind: str, name: str, names: Sequence[str]) -> str:
    """A sentence about a wrong name of a setting, with the nearest right one."""
    known = sorted(
        name for name in names if not name.startswith("bundle_file") and not name.endswith(("_callback", "_data"))
    )
    near = difflib.get_close_matches(name, known, 1)
    guess = f"; did you mean {near[0]}?" if near else "."
    return f"There is no setting {name}{guess} The settings are {', '.join(known)} ({kind})."


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

    def __repr__(self) -> str:
        if self._handle is None:
            return f"<{type(self).__name__}, closed>"
        about = self._about()
        return f"<{type(self).__name__} {about}>" if about else f"<{type(self).__name__}>"

    def _about(self) -> str:
        """Some words for `repr` of an open object."""
        return ""

    def __reduce__(self) -> Any:
        raise TypeError(f"{type(self).__name__} is an object of the library, and cannot be pickled or copied.")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class LentResult(NativeObject):
    """The library's result behind one of Python, as long as the library can spare it."""

    @property
    def handle(self) -> Any:
        if self._handle is None:
            problem = (
                "This result has only its arrays left: it was copied, or the model has made many newer results since. "
                "Call the method sooner, or raise the number of results that the model lends."
            )
            raise MaquetteError(problem, "MAQ_ERROR_POOL_EMPTY")
        return self._handle

    def __reduce__(self) -> tuple[type[LentResult], tuple[None]]:  # a copy, or in another process, has arrays alone
        return LentResult, (None,)


class Lender:
    """Results that a model lends, at most `count`: before one more is made, the oldest goes back to the pool."""

    def __init__(self, count: int) -> None:
        self._count = count or 4  # 0: the library's default
        self._lent: deque[weakref.ref[LentResult]] = deque()

    def make_room(self) -> None:
        self._lent = deque(ref for ref in self._lent if (lent := ref()) is not None and lent._handle is not None)
        while len(self._lent) >= self._count:
            oldest = self._lent.popleft()()
            if oldest is not None:
                oldest.close()

    def lend(self, handle: Any) -> LentResult:
        lent = LentResult(handle)
        self._lent.append(weakref.ref(lent))
        return lent


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
