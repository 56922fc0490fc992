"""The C API as cffi reads it: the SDK's own headers without what is for compilers alone, so that no struct is written
twice.

A wheel holds what `write_module` made of them; in a checkout they are read when the package is imported.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from cffi import FFI  # type: ignore[import-untyped]

_COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
_FOR_CPLUSPLUS = re.compile(r"^#ifdef __cplusplus$.*?^#endif$", re.DOTALL | re.MULTILINE)
_DEFINE = re.compile(r"^#define (MAQ_(?!API\b|HEADER_VERSION\b)\w+) (.+)$", re.MULTILINE)
_DIRECTIVE = re.compile(r"^#.*$", re.MULTILINE)


def declarations(headers: Path) -> str:
    """Returns declarations for cffi's `cdef`, from the folder of maquette.h. Constants become enumerators, because
    `cdef` reads no expressions in a #define."""
    parts: list[str] = []
    features = (headers / "features.h").read_text()
    umbrella = (headers / "maquette.h").read_text()
    for feature in re.findall(r"^#define (MAQ_HAS_\w+) 0$", features, re.MULTILINE):  # its headers are not installed
        umbrella = re.sub(rf"^#if {feature}$.*?^#endif$", "", umbrella, flags=re.DOTALL | re.MULTILINE)
    for name in re.findall(r'^#include "maquette/(\w+\.h)"$', umbrella, re.MULTILINE):
        parts += _with_what_it_includes(headers, name, parts)
    return "\n".join(parts)


def read_headers(headers: Path) -> FFI:
    ffi = FFI()
    ffi.cdef(declarations(headers))
    return ffi


def write_module(headers: Path, path: Path) -> None:
    """Writes a Python module whose `ffi` has the declarations, and is imported without parsing them."""
    ffi = read_headers(headers)
    ffi.set_source(path.stem, None)
    ffi.emit_python_code(str(path))


def enum_names(kind: Any) -> dict[str, int]:
    """Values of an enum of cffi by short names: "off", "auto" and "all" of maq_densepose_crops."""
    values = dict(sorted((value, name) for name, value in kind.relements.items()))
    first, last = min(values.values()), max(values.values())
    common = next((k for k in range(len(first)) if first[k] != last[k : k + 1]), len(first))
    start = first.rfind("_", 0, common) + 1
    return {name[start:].lower(): value for value, name in values.items()}


def _with_what_it_includes(headers: Path, name: str, before: list[str]) -> list[str]:
    """The declarations of a header that are not in `before`, after those of the headers that it includes."""
    text = (headers / name).read_text()
    parts: list[str] = []
    for included in re.findall(r'^#include "maquette/(\w+\.h)"$', text, re.MULTILINE):
        parts += _with_what_it_includes(headers, included, before + parts)
    text = _FOR_CPLUSPLUS.sub("", _COMMENT.sub("", text))
    constants = "".join(f"enum {{ {constant} = {value} }};\n" for constant, value in _DEFINE.findall(text))
    body = constants + _DIRECTIVE.sub("", re.sub(r"\bMAQ_API\b", "", text)).strip()
    return parts if body in before + parts else parts + [body]
