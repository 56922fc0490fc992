"""Inputs of a bundle's graphs on real images, for calibration and for measuring errors."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from tqdm import tqdm

from export.densepose import bundle as bundle_format
from export.densepose import targets as tg
from export.densepose.data import PERSON_CROPPING, normalised
from export.densepose.decode import detect
from export.densepose.graphs import Bundle
from export.evaluation.backends import DEFAULT_PATHS
from export.shards import Record, load_records
from quantization.settings import DENSEPOSE, DensePoseSettings

# Proposals are many and mostly background; so many of each image are enough to see what the box head sees.
PROPOSALS = 32
CROP_SIDE = 192  # pixels of a person crop; the default of maq_densepose_config

# Inputs of a graph, by name.
Sample = dict[str, np.ndarray]


def collect(bundle: Bundle, records: list[Record], people: int) -> dict[str, list[Sample]]:
    """Inputs of each graph, one sample an image; images without people give none to the dense head.

    The heads see the RoI features of the bundle's own proposals and detections, at most `people` an image; the networks
    of the crop pass crops of labelled people as in training, one sample a crop.
    """
    samples: dict[str, list[Sample]] = {name: [] for name in bundle.manifest["graphs"]}
    network = bundle.network

    def add(name: str, tensors: list[Tensor]) -> None:
        inputs = [value["name"] for value in bundle.manifest["graphs"][name]["inputs"]]
        samples[name].append(
            {x: np.ascontiguousarray(tensor.numpy()) for x, tensor in zip(inputs, tensors, strict=True)}
        )

    rng = np.random.default_rng(0)
    for record in tqdm(records, desc="running the fp32 bundle", unit="image", leave=False):
        image = np.ascontiguousarray(record.decoded()[0][..., ::-1])
        found = detect(bundle.graphs, image, network, bundle.decode)
        given = {"trunk": [found.tensor], "rpn_fine": found.features[:1], "rpn_coarse": found.features[1:]}
        given["box_head"] = [tg.pooled(found.features, [found.proposed[:PROPOSALS]], network, network.box_pool)]
        if len(found.boxes):
            rois = tg.pooled(found.features, [found.boxes[:people]], network, network.dense_pool, level=0)
            given["dense_head"] = [rois]
            if bundle_format.KEYPOINTS in samples:
                add(bundle_format.KEYPOINTS, [bundle.surface(rois)])
        for name, tensors in given.items():
            add(name, tensors if name == "trunk" else [tensor.permute(0, 2, 3, 1) for tensor in tensors])
        if bundle.crop_graphs is not None:
            for crop, truth in PERSON_CROPPING.draw(record, CROP_SIDE, rng):
                pixels = torch.from_numpy(normalised(crop))[None]
                add("crop_trunk", [pixels])
                finest = [bundle.crop_graphs.finest(pixels)]
                rois = tg.pooled(finest, [truth.box], network, network.dense_pool, level=0)
                add("crop_dense_head", [rois.permute(0, 2, 3, 1)])
    return samples


def spread(records: list[Record], count: int) -> list[Record]:
    """At most `count` records, evenly over the shards (a shard holds one orientation)."""
    return records[:: max(1, len(records) // count)][:count]


def calibration_records(settings: DensePoseSettings, rendered: Path, photos: Path | None) -> list[Record]:
    """Calibration images: from the shards in `rendered`, and from `photos` where these are given."""
    records = spread(load_records(rendered), settings.calibration_images)
    if photos:
        records += spread(load_records(photos), settings.calibration_photos)
    return records


def options_of_calibration(photos: bool = True) -> argparse.ArgumentParser:
    """The options of all commands that calibrate a bundle, to be a parent of theirs."""
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("--bundle", type=Path, default=DEFAULT_PATHS["onnx"], metavar="DIR", help="fp32 bundle")
    parser.add_argument("--settings", type=Path, default=DENSEPOSE, metavar="TOML")
    parser.add_argument("--data", type=Path, default=Path(".data/people/train"), metavar="DIR", help="for calibration")
    if photos:
        parser.add_argument(
            "--photos", type=Path, metavar="DIR", help="calibrate on these shards too (export.teachers.shards)"
        )
    parser.add_argument("--held-out", type=Path, default=Path(".data/people/val"), metavar="DIR", help="to measure on")
    return parser
