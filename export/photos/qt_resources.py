"""Files out of a Qt resource file (.rcc), in which programs of the Qt family keep their images and their credits.

Layout (big-endian): "qres", version, then where tree, data and names begin. An entry of the tree is 14 bytes (22 from
version 2 on, with a time behind): where its name begins and its flags, then for a folder how many children it has and
which entry is the first, for a file its locale and where its data begin.
"""

from __future__ import annotations

import struct
import zlib

_MAGIC = b"qres"
_ENTRY = {1: 14, 2: 22, 3: 22}
_COMPRESSED, _FOLDER, _ZSTD = 1, 2, 4


class ResourceError(ValueError):
    """Not a Qt resource file of a known version, or packed in a way that is not read."""


def read_resource(content: bytes, path: str) -> bytes:
    """content: a whole .rcc file. path: "folder/name" inside it. Raises KeyError if there is none, ResourceError."""
    version, tree, data, names = _header(content)

    def entry(index: int) -> tuple[str, int, int, int]:
        start = tree + index * _ENTRY[version]
        name, flags, first, second = struct.unpack_from(">IHII", content, start)
        (length,) = struct.unpack_from(">H", content, names + name)
        text = content[names + name + 6 : names + name + 6 + 2 * length].decode("utf-16-be")
        return text, flags, first, second

    _, flags, count, child = entry(0)  # the root has no name
    for part in path.split("/"):
        if not flags & _FOLDER:
            raise KeyError(path)
        children = (entry(k) for k in range(child, child + count))
        found = next((one for one in children if one[0] == part), None)
        if found is None:
            raise KeyError(path)
        _, flags, count, child = found
    if flags & _FOLDER:
        raise KeyError(path)
    if flags & _ZSTD:
        raise ResourceError(f"{path} is packed with zstd, which is not read.")
    start = data + child
    (size,) = struct.unpack_from(">I", content, start)
    packed = content[start + 4 : start + 4 + size]
    return zlib.decompress(packed[4:]) if flags & _COMPRESSED else packed  # in front: the size unpacked


def _header(content: bytes) -> tuple[int, int, int, int]:
    if content[:4] != _MAGIC:
        raise ResourceError("this is not a Qt resource file.")
    version, tree, data, names = struct.unpack_from(">4I", content, 4)
    if version not in _ENTRY:
        raise ResourceError(f"version {version} of Qt resource files is not known.")
    return version, tree, data, names
