"""Qt resource files are read by path, whether their files are packed or not, also inside an archive."""

import io
import struct
import tarfile
import zlib

import pytest

from export.photos.packages import PackageError, PackageReader
from export.photos.qt_resources import ResourceError, read_resource

PLAIN, PACKED = b"as it is", b"packed " * 9
COMPRESSED, FOLDER, ZSTD = 1, 2, 4


def resource_file(version=2, packed_flag=COMPRESSED):
    """A root with the folder `in`, in which `plain.txt` and `packed.txt` lie."""
    names, starts = b"", []
    for name in ("in", "plain.txt", "packed.txt"):
        starts.append(len(names))
        names += struct.pack(">HI", len(name), 0) + name.encode("utf-16-be")
    packed = struct.pack(">I", len(PACKED)) + zlib.compress(PACKED)
    data = struct.pack(">I", len(PLAIN)) + PLAIN
    second = len(data)
    data += struct.pack(">I", len(packed)) + packed
    entries = [
        struct.pack(">IHII", 0, FOLDER, 1, 1),
        struct.pack(">IHII", starts[0], FOLDER, 2, 2),
        struct.pack(">IHII", starts[1], 0, 0, 0),
        struct.pack(">IHII", starts[2], packed_flag, 0, second),
    ]
    tree = b"".join(entry + bytes(8 if version > 1 else 0) for entry in entries)
    begin = 20
    header = b"qres" + struct.pack(">4I", version, begin, begin + len(tree), begin + len(tree) + len(data))
    return header + tree + data + names


@pytest.mark.parametrize("version", [1, 2])
def test_plain_and_packed_files_are_read(version):
    content = resource_file(version)
    assert read_resource(content, "in/plain.txt") == PLAIN
    assert read_resource(content, "in/packed.txt") == PACKED


@pytest.mark.parametrize("path", ["in", "in/other.txt", "plain.txt", "in/plain.txt/deeper"])
def test_what_is_not_a_file_there_is_a_key_error(path):
    with pytest.raises(KeyError):
        read_resource(resource_file(), path)


@pytest.mark.parametrize(
    ("content", "says"),
    [(b"PNG" + bytes(30), "not a Qt resource"), (resource_file(version=4), "version 4"),
     (resource_file(packed_flag=ZSTD), "zstd")],
)  # fmt: skip
def test_other_files_and_packings_are_refused(content, says):
    with pytest.raises(ResourceError, match=says):
        read_resource(content, "in/packed.txt")


def test_a_member_may_lie_in_a_resource_file_of_an_archive(tmp_path):
    content = resource_file()
    with tarfile.open(tmp_path / "a.tgz", "w:gz") as file:
        entry = tarfile.TarInfo("share/a.rcc")
        entry.size = len(content)
        file.addfile(entry, io.BytesIO(content))
    with PackageReader(tmp_path / "a.tgz") as reader:
        assert reader.read("share/a.rcc!in/packed.txt") == PACKED
        with pytest.raises(PackageError, match=r"no file share/a\.rcc!in/other\.txt"):
            reader.read("share/a.rcc!in/other.txt")
