"""The manifest of a bundle of scene networks (docs/formats.md): `extractor.onnx`, `refiner.onnx` and `basis.bin`."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import onnx

from export.densepose.bundle import LICENCE, BundleInfo, signed

OPSET = 17
GRAPHS = ("extractor", "refiner")
BASIS = "basis.bin"


def _tensor(value: onnx.ValueInfoProto) -> dict[str, object]:
    sizes = [dimension.dim_param or dimension.dim_value for dimension in value.type.tensor_type.shape.dim]
    return {"name": value.name, "type": "float32", "shape": sizes}


def identity(manifest: dict) -> str:
    """Of the networks in a bundle, in hexadecimal: what scenes made with them keep (docs/formats.md)."""
    names = (*(manifest["graphs"][graph]["file"] for graph in GRAPHS), manifest["basis"]["file"])
    digests = "".join(manifest["files"][name]["sha256"] for name in names)
    return hashlib.sha256(digests.encode()).hexdigest()


def write_manifest(folder: Path, info: BundleInfo) -> dict:
    """Describes the graphs that lie in `folder`, of any precision, and writes `manifest.json`, which it returns."""
    graphs = {}
    for name in GRAPHS:
        graph = onnx.load(folder / f"{name}.onnx").graph
        graphs[name] = {
            "file": f"{name}.onnx",
            "opset": OPSET,
            "inputs": [_tensor(value) for value in graph.input],
            "outputs": [_tensor(value) for value in graph.output],
        }
    manifest = {
        "format": "maquette-bundle",
        "format_version": 3,
        "name": info.name,
        "version": info.version,
        "task": "scenes",
        "precision": info.precision,
        "files": {name: signed(folder / name) for name in (*(f"{graph}.onnx" for graph in GRAPHS), BASIS)},
        "graphs": graphs,
        "basis": {"file": BASIS},
        "licence": LICENCE,
        "training_data": list(info.training_data),
        "measured": info.measured,
    }
    (folder / "manifest.json").write_text(json.dumps(manifest, indent=2, ensure_ascii=False) + "\n")
    return manifest
