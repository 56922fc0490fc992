"""64-bit XXH3, the check of the SDK's binary files (docs/reference/formats.md), by libxxhash. It comes with the header
that the SDK is built with (scripts/install-packages.sh)."""

from __future__ import annotations

import ctypes
from functools import cache


@cache
def _library() -> ctypes.CDLL:
    try:
        library = ctypes.CDLL("libxxhash.so.0")
    except OSError:
        raise RuntimeError("libxxhash.so.0 was not found; scripts/install-packages.sh installs it.") from None
    library.XXH3_64bits.argtypes, library.XXH3_64bits.restype = (ctypes.c_char_p, ctypes.c_size_t), ctypes.c_uint64
    return library


def xxh3(data: bytes) -> int:
    """Seed 0. Raises RuntimeError where the library is not installed."""
    return _library().XXH3_64bits(data, len(data))
