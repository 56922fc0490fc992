"""The manifest of a model bundle (docs/reference/formats.md): the part that all tasks share, written and read.

What belongs to one task is added by the `bundle` of its package, such as `export.scenes.bundle`.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

FORMAT_VERSION = 4
MANIFEST = "manifest.json"
OPSET = 17
LICENCE = "Apache-2.0"

# Names and shapes of a graph's "inputs" and "outputs", in order. A text is a size known at run time.
Signature = Mapping[str, Mapping[str, Sequence[int | str]]]


@dataclass(frozen=True)
class BundleInfo:
    """Metadata of a bundle. measured: metrics with their conditions, such as the error."""

    name: str
    precision: str  # "fp32" or "int8"
    version: str = "0.1.0"
    training_data: Sequence[Mapping[str, str]] = ()
    measured: Mapping[str, object] = field(default_factory=dict)


def write_manifest(
    folder: Path,
    task: str,
    info: BundleInfo,
    graphs: Mapping[str, Signature],
    files: Sequence[str],
    task_keys: Mapping[str, object],
) -> dict:
    """Describes the bundle that lies in `folder` and writes its manifest, which it returns.

    graphs: of each `<name>.onnx`. files: beside the graphs. task_keys: what the manifest says for this task alone.
    Raises ValueError when a graph's inputs and outputs have other names.
    """
    entries = {}
    for name, signature in graphs.items():
        path = folder / f"{name}.onnx"
        for side, found in signature_of(path).items():
            if list(found) != list(signature[side]):
                raise ValueError(f"{path} has the {side} {list(found)}; the format asks for {list(signature[side])}")
        sides = {
            side: [{"name": n, "type": "float32", "shape": list(shape)} for n, shape in signature[side].items()]
            for side in ("inputs", "outputs")
        }
        entries[name] = {"file": path.name, "opset": OPSET, **sides}
    manifest = {
        "format": "maquette-bundle",
        "format_version": FORMAT_VERSION,
        "name": info.name,
        "version": info.version,
        "task": task,
        "precision": info.precision,
        "files": {name: signed(folder / name) for name in (*(e["file"] for e in entries.values()), *files)},
        "graphs": entries,
        **task_keys,
        "licence": LICENCE,
        "training_data": list(info.training_data),
        "measured": dict(info.measured),
    }
    (folder / MANIFEST).write_text(json.dumps(manifest, indent=2, ensure_ascii=False) + "\n")
    return manifest


def read_manifest(folder: Path) -> dict:
    """Raises FileNotFoundError where there is no manifest, ValueError for one of another format version."""
    path = folder / MANIFEST
    if not path.exists():
        raise FileNotFoundError(f"{folder} is not a model bundle: it has no {MANIFEST}.")
    manifest = json.loads(path.read_text())
    version = manifest.get("format_version")
    if version != FORMAT_VERSION:
        raise ValueError(
            f"{folder} has format version {version}, but these tools read version {FORMAT_VERSION}: export it again"
        )
    return manifest


def signature_of(path: Path) -> Signature:
    """Inputs and outputs of an ONNX file."""
    import onnx  # only writers need it

    graph = onnx.load(path).graph
    return {
        side: {v.name: [d.dim_param or d.dim_value for d in v.type.tensor_type.shape.dim] for v in values}
        for side, values in (("inputs", graph.input), ("outputs", graph.output))
    }


def signed(path: Path) -> dict[str, object]:
    """The entry of a file in a manifest."""
    data = path.read_bytes()
    return {"sha256": hashlib.sha256(data).hexdigest(), "bytes": len(data)}


def bytes_of(folder: Path) -> int:
    """Size of a bundle on disk in bytes."""
    return sum(path.stat().st_size for path in folder.iterdir())
