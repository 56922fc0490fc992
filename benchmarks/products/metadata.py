"""Copies the metadata of one TFLite file into another. Runs in MediaPipe's environment, which has the schema.

stdin: two sizes in bytes on a line, then the network and the described one. stdout: the network with metadata.
"""

from __future__ import annotations

import sys

import flatbuffers
from mediapipe.tasks.metadata import schema_py_generated as schema

_NAME = b"TFLITE_METADATA"


def metadata_of(data: bytes) -> bytes:
    """Raises ValueError for a file without metadata."""
    model = schema.Model.GetRootAsModel(data, 0)
    for entry in map(model.Metadata, range(model.MetadataLength())):
        if entry.Name() == _NAME:
            return model.Buffers(entry.Buffer()).DataAsNumpy().tobytes()
    raise ValueError("the described network has no metadata")


def described(network: bytes, metadata: bytes) -> bytes:
    model = schema.ModelT.InitFromObj(schema.Model.GetRootAsModel(network, 0))
    buffer = schema.BufferT()
    buffer.data = list(metadata)
    model.buffers.append(buffer)
    entry = schema.MetadataT()
    entry.name, entry.buffer = _NAME.decode(), len(model.buffers) - 1
    model.metadata = [old for old in model.metadata or [] if old.name != _NAME] + [entry]
    builder = flatbuffers.Builder(0)
    builder.Finish(model.Pack(builder), b"TFL3")
    return bytes(builder.Output())


def main() -> None:
    first, second = map(int, sys.stdin.buffer.readline().split())
    network, other = sys.stdin.buffer.read(first), sys.stdin.buffer.read(second)
    sys.stdout.buffer.write(described(network, metadata_of(other)))


if __name__ == "__main__":
    main()
