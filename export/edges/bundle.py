"""The manifest of a bundle of the edge network (docs/reference/formats.md): `field.onnx`."""

from __future__ import annotations

from pathlib import Path

from export import data_sources as sources
from export.bundle import BundleInfo, signature_of
from export.bundle import write_manifest as write_bundle_manifest
from export.edges.config import EPS_R, FOLD, INPUT_PLANES, NetworkConfig

GRAPHS = ("field",)
TRAINING_DATA = (sources.RENDERED_SOLIDS.used_for("training, calibration"),)


def signature(config: NetworkConfig) -> dict[str, dict[str, list[int | str]]]:
    """Inputs and outputs of the graph. Height and width are open, half of the frame's."""
    sides = [1, "height", "width"]
    return {
        "inputs": {"slopes": [*sides, INPUT_PLANES * FOLD**2]},
        "outputs": {"planes": [*sides, config.planes * FOLD**2]},
    }


def reads_input_first(path: Path) -> bool:
    """Whether a graph has read its input before it writes its output, so that both may lie in the same memory: one node
    reads it, another one writes the output, and what others compute comes from the first."""
    import onnx  # only writers need it

    graph = onnx.load(path).graph
    (given,), (wanted,) = graph.input, graph.output
    readers = [node for node in graph.node if given.name in node.input]
    if len(readers) != 1 or wanted.name in readers[0].output:
        return False
    before, left = {wanted.name}, [wanted.name]
    makers = {name: node for node in graph.node for name in node.output}
    while left:  # all that the output is made of
        node = makers.get(left.pop())
        new = [name for name in (node.input if node else ()) if name not in before]
        before.update(new)
        left += new
    return bool(before & set(readers[0].output))


def write_manifest(folder: Path, info: BundleInfo, multiple: int) -> dict:
    """Describes the graph that lies in `folder`, of any precision, and writes `manifest.json`, which it returns.

    multiple: sides of the frames are multiples of it, pixels.
    """
    graphs = {name: signature_of(folder / f"{name}.onnx") for name in GRAPHS}
    field = {
        "eps_r": EPS_R,
        "multiple_px": multiple,
        "output_over_input": int(reads_input_first(folder / "field.onnx")),
    }
    task_keys = {"field": field}
    return write_bundle_manifest(folder, "edges", info, graphs, files=(), task_keys=task_keys)
