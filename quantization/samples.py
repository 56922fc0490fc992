"""What the graphs of a bundle see on real images: for calibration and for measuring errors."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from tqdm import tqdm

from export.densepose import targets as tg
from export.densepose.bundle import decode_config
from export.densepose.config import DecodeConfig, NetworkConfig
from export.densepose.data import Record
from export.densepose.decode import Graphs, detect
from export.densepose.export_onnx import session

# Proposals are many and mostly background; so many of each image are enough to see what the box head sees.
PROPOSALS = 32


@dataclass(frozen=True)
class Bundle:
    """A bundle's three graphs as callables, and the settings that its manifest names."""

    folder: Path
    manifest: dict
    network: NetworkConfig
    decode: DecodeConfig
    graphs: Graphs


def open_bundle(folder: Path, threads: int = 1) -> Bundle:
    """Opens the graphs in ONNX Runtime."""
    manifest = json.loads((folder / "manifest.json").read_text())
    width = manifest["graphs"]["box_head"]["inputs"][0]["shape"][1]
    sessions = {name: session(folder / entry["file"], threads) for name, entry in manifest["graphs"].items()}

    def run(name: str, given: Tensor) -> list[Tensor]:
        (value,) = sessions[name].get_inputs()
        names = [output["name"] for output in manifest["graphs"][name]["outputs"]]
        found = sessions[name].run(names, {value.name: np.ascontiguousarray(given.numpy())})
        return [torch.from_numpy(x) for x in found]

    def detector(image: Tensor) -> tuple[list[Tensor], list[Tensor], list[Tensor]]:
        found = run("detector", image)
        return found[:4], found[4:9], found[9:]

    graphs = Graphs(detector, lambda x: tuple(run("box_head", x)), lambda x: tuple(run("dense_head", x)))
    return Bundle(folder, manifest, NetworkConfig(width=width), decode_config(manifest), graphs)


def collect(bundle: Bundle, records: list[Record], people: int) -> dict[str, list[np.ndarray]]:
    """Inputs of each graph, one array an image; images without people give none to the dense head.

    The heads see the RoI features of the bundle's own proposals and detections, at most `people` an image.
    """
    inputs: dict[str, list[np.ndarray]] = {"detector": [], "box_head": [], "dense_head": []}
    network = bundle.network
    for record in tqdm(records, desc="running the fp32 bundle", unit="image", leave=False):
        image = np.ascontiguousarray(record.decoded()[0][..., ::-1])
        found = detect(bundle.graphs, image, network, bundle.decode)
        inputs["detector"].append(found.tensor.numpy())
        rois = tg.pooled(found.features, [found.proposed[:PROPOSALS]], network, network.box_pool)
        inputs["box_head"].append(rois.numpy())
        if len(found.boxes):
            rois = tg.pooled(found.features, [found.boxes[:people]], network, network.dense_pool, level=0)
            inputs["dense_head"].append(rois.numpy())
    return inputs
