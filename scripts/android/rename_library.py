"""Gives a shared library another SONAME of the same length: that of the file that is written.

    python3 scripts/android/rename_library.py libonnxruntime.so out/libmaquetteort.so

Android's linker takes a library that is loaded already for any that needs one of its SONAME. Under a name of its own,
ONNX Runtime of this SDK and ONNX Runtime of the app do not get into each other's way. The bytes of the name in the
string table are overwritten, and nothing moves: no segment, no alignment. (ELF: System V ABI, chapters 4 and 5.)
"""

import argparse
import struct
import sys
from pathlib import Path

PT_LOAD, PT_DYNAMIC = 1, 2
DT_NULL, DT_NEEDED, DT_STRTAB, DT_SONAME = 0, 1, 5, 14


def program_headers(data: bytes) -> list[tuple[int, int, int, int]]:
    """Type, offset, address and size in the file of each segment of a little-endian ELF file."""
    if data[:4] != b"\x7fELF" or data[5] != 1:
        raise ValueError("not a little-endian ELF file")
    is_64 = data[4] == 2
    (table,) = struct.unpack_from("<Q" if is_64 else "<I", data, 32 if is_64 else 28)
    size, count = struct.unpack_from("<HH", data, 54 if is_64 else 42)
    headers = []
    for k in range(count):
        at = table + k * size
        if is_64:
            kind, _, offset, address, _, in_file = struct.unpack_from("<IIQQQQ", data, at)
        else:
            kind, offset, address, _, in_file = struct.unpack_from("<IIIII", data, at)
        headers.append((kind, offset, address, in_file))
    return headers


def dynamic_entries(data: bytes, headers: list[tuple[int, int, int, int]]) -> list[tuple[int, int]]:
    """Tag and value of each entry of the dynamic section."""
    pair = struct.Struct("<qQ" if data[4] == 2 else "<iI")
    offset, size = next((offset, size) for kind, offset, _, size in headers if kind == PT_DYNAMIC)
    entries = []
    for tag, value in pair.iter_unpack(data[offset : offset + size]):
        if tag == DT_NULL:
            break
        entries.append((tag, value))
    return entries


def renamed(data: bytes, name: str) -> bytes:
    """The library with the SONAME `name`. Raises ValueError where that cannot be done in place."""
    headers = program_headers(data)
    entries = dynamic_entries(data, headers)
    values = dict(entries)
    if DT_SONAME not in values or DT_STRTAB not in values:
        raise ValueError("a library without a SONAME")
    segment = next(h for h in headers if h[0] == PT_LOAD and h[2] <= values[DT_STRTAB] < h[2] + h[3])
    strings = segment[1] + values[DT_STRTAB] - segment[2]
    begin = strings + values[DT_SONAME]
    end = data.index(b"\0", begin)
    old, new = data[begin:end], name.encode()
    if len(new) != len(old):
        raise ValueError(f"'{name}' is not as long as '{old.decode()}'")
    if any(tag == DT_NEEDED and begin <= strings + value < end for tag, value in entries):
        raise ValueError("the string of the SONAME is also that of a library that is needed")
    return data[:begin] + new + data[end:]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("library", type=Path)
    parser.add_argument("out", type=Path, help="the file to write; its name is the new SONAME")
    arguments = parser.parse_args()
    try:
        result = renamed(arguments.library.read_bytes(), arguments.out.name)
    except (OSError, ValueError, StopIteration, struct.error) as error:
        sys.exit(f"{arguments.library}: {error}")
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    arguments.out.write_bytes(result)


if __name__ == "__main__":
    main()
