"""The manifest of a bundle of the edge network (docs/formats.md): `field.onnx`."""

from __future__ import annotations

from pathlib import Path

from export.bundle import LICENCE, BundleInfo, signature_of
from export.bundle import write_manifest as write_bundle_manifest
from export.edges.config import EPS_R, FOLD, INPUT_PLANES, NetworkConfig

GRAPHS = ("field",)
TRAINING_DATA = (
    {"name": "Maquette rendered solids (export.solids)", "licence": LICENCE, "used_for": "training, calibration"},
)


def signature(config: NetworkConfig) -> dict[str, dict[str, list[int | str]]]:
    """Of the graph: height and width are open, halves of the frame's."""
    sides = [1, "height", "width"]
    return {
        "inputs": {"slopes": [*sides, INPUT_PLANES * FOLD**2]},
        "outputs": {"planes": [*sides, config.planes * FOLD**2]},
    }


def write_manifest(folder: Path, info: BundleInfo, multiple: int) -> dict:
    """Describes the graph that lies in `folder`, of any precision, and writes `manifest.json`, which it returns.

    multiple: sides of the frames are multiples of it, pixels.
    """
    graphs = {name: signature_of(folder / f"{name}.onnx") for name in GRAPHS}
    task_keys = {"field": {"eps_r": EPS_R, "multiple_px": multiple}}
    return write_bundle_manifest(folder, "edges", info, graphs, files=(), task_keys=task_keys)
