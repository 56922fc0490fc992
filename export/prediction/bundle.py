"""A bundle for prediction (docs/formats.md): the graphs that make a frame codes and codes a frame, and what codes stand
for and how likely they are."""

from __future__ import annotations

from pathlib import Path

from export.bundle import LICENCE, BundleInfo, Signature, signature_of
from export.bundle import write_manifest as write_bundle_manifest
from export.prediction.code_file import read_code_file

GRAPHS = ("encoder", "decoder")
CODES = "codes.maqc"
CELL_PX = 4  # pixels of a place, both ways
TRAINING_DATA = (
    {"name": "Maquette clips: shapes, pushing (export.clips)", "licence": LICENCE, "used_for": "training, calibration"},
    {"name": "Franka Panda arm and objects of pybullet_data", "licence": "Apache-2.0, zlib", "used_for": "rendering"},
    {"name": "KUKA iiwa arm of pybullet_data", "licence": "BSD-2-Clause", "used_for": "rendering"},
)


def frame_side(graphs: dict[str, Signature], slices: int, width: int, side: int) -> int:
    """Side of a frame in pixels. Raises ValueError where graphs and codes do not belong together."""
    shapes = {
        name: [list(s) for way in ("inputs", "outputs") for s in graph[way].values()] for name, graph in graphs.items()
    }
    frame, features = [1, side * CELL_PX, side * CELL_PX, 3], [1, side, side, slices * width]
    if shapes != {"encoder": [frame, features], "decoder": [features, frame]}:
        raise ValueError(
            f"The graphs have {shapes}; codes of {slices} x {width} numbers at {side} x {side} places ask for frames "
            f"{frame} and features {features}."
        )
    return frame[1]


def write_manifest(folder: Path, info: BundleInfo) -> dict:
    """Describes the graphs and `codes.maqc` that lie in `folder`, and writes `manifest.json`, which it returns. Raises
    ValueError where they do not belong together."""
    codes = read_code_file(folder / CODES)
    graphs = {name: signature_of(folder / f"{name}.onnx") for name in GRAPHS}
    slices, _, width = codes.entries.shape
    keys = {"frame_px": frame_side(graphs, slices, width, codes.side), "codes": {"file": CODES}}
    return write_bundle_manifest(folder, "prediction", info, graphs, files=(CODES,), task_keys=keys)
