"""What the graphs of a bundle see on real images: for calibration and for measuring errors."""

from __future__ import annotations

import numpy as np
from tqdm import tqdm

from export.densepose import targets as tg
from export.densepose.bundle import GRAPHS
from export.densepose.decode import detect
from export.densepose.graphs import Bundle
from export.shards import Record

# Proposals are many and mostly background; so many of each image are enough to see what the box head sees.
PROPOSALS = 32


# What a graph is given, by the names of its inputs.
Sample = dict[str, np.ndarray]


def collect(bundle: Bundle, records: list[Record], people: int) -> dict[str, list[Sample]]:
    """Inputs of each graph, one sample an image; images without people give none to the dense head.

    The heads see the RoI features of the bundle's own proposals and detections, at most `people` an image.
    """
    samples: dict[str, list[Sample]] = {name: [] for name in GRAPHS}
    network = bundle.network
    for record in tqdm(records, desc="running the fp32 bundle", unit="image", leave=False):
        image = np.ascontiguousarray(record.decoded()[0][..., ::-1])
        found = detect(bundle.graphs, image, network, bundle.decode)
        given = {"trunk": [found.tensor], "rpn_fine": found.features[:1], "rpn_coarse": found.features[1:]}
        given["box_head"] = [tg.pooled(found.features, [found.proposed[:PROPOSALS]], network, network.box_pool)]
        if len(found.boxes):
            rois = tg.pooled(found.features, [found.boxes[:people]], network, network.dense_pool, level=0)
            given["dense_head"] = [rois]
        for name, tensors in given.items():
            if name != "trunk":
                tensors = [tensor.permute(0, 2, 3, 1) for tensor in tensors]
            inputs = [value["name"] for value in bundle.manifest["graphs"][name]["inputs"]]
            samples[name].append(
                {x: np.ascontiguousarray(tensor.numpy()) for x, tensor in zip(inputs, tensors, strict=True)}
            )
    return samples
