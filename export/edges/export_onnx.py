"""Exports the edge network as a fp32 ONNX graph, and compares it with torch.

    python -m export.edges.export_onnx --checkpoint RUN/weights.pt --out .data/bundles/edges-fp32
    python -m export.edges.export_onnx --random s --out .data/bundles/edges-random-fp32

`field.onnx`: slopes [1, H / 2, W / 2, 12] -> planes [1, H / 2, W / 2, 16], channels last; pixel (y, x) of each 2 x 2 is
channel 4 c + 2 y + x of plane c. H and W are open, multiples of `multiple_px` of the manifest (export.edges.bundle).
Planes: distance / eps_r, logarithm of its spread / eps_r, logits of crease and of boundary.
"""

from __future__ import annotations

import argparse
import copy
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

from export.bundle import BundleInfo
from export.densepose.graphs import session
from export.edges.bundle import TRAINING_DATA, write_manifest
from export.edges.config import FOLD, INPUT_PLANES, SIZES
from export.edges.losses import LOG_SPREAD
from export.edges.network import EdgeNetwork
from export.edges.weights import load_network
from export.onnx_graphs import (
    channels_first,
    channels_last,
    doubled,
    fold_batch_norm,
    largest_difference,
    write_graph,
)

TOLERANCE = 1e-4  # largest |ONNX - torch|, relative to the output's largest value


# The ranges of planes that matter: beyond them decoding cuts off, or a kind is sure. The last convolution answers in
# fractions of them, cut off at 0 and 1. In int8 all its channels have one scale: so a step of the distance is 1/16 r.
# Without it logits set the scale, and a step was 1.2 r.
PLANE_RANGES = ((0.0, 1.0), LOG_SPREAD, (-8.0, 8.0), (-8.0, 8.0))


class PlaneRanges(nn.Module):
    """Fractions of PLANE_RANGES, channels last -> planes. Stays float in int8 graphs."""

    def __init__(self) -> None:
        super().__init__()
        low, high = torch.tensor(PLANE_RANGES).repeat_interleave(FOLD**2, 0).T
        self.register_buffer("low", low.contiguous())
        self.register_buffer("size", (high - low).contiguous())

    def forward(self, fractions: Tensor) -> Tensor:
        return fractions * self.size + self.low


class FieldGraph(nn.Module):
    """Channels last at both ends, batch normalisation folded."""

    def __init__(self, network: EdgeNetwork) -> None:
        super().__init__()
        self.network = copy.deepcopy(network).eval().requires_grad_(False)
        fold_batch_norm(self.network)
        self.network.double = doubled
        self.ranges = PlaneRanges()
        head = self.network.head
        head.weight.div_(self.ranges.size[:, None, None, None])
        head.bias.sub_(self.ranges.low).div_(self.ranges.size)

    def forward(self, slopes: Tensor) -> Tensor:
        fractions = self.network.features(channels_first(slopes)).clamp(0, 1)
        return self.ranges(channels_last(fractions))


def export(network: EdgeNetwork, folder: Path, multiple: int) -> float:
    """Writes `field.onnx`; returns its parity. Raises ValueError where it is not what torch computes."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "field.onnx"
    graph = FieldGraph(network)
    given = torch.rand(1, 2 * multiple, 3 * multiple, INPUT_PLANES * FOLD**2)
    axes = {name: {1: "height", 2: "width"} for name in ("slopes", "planes")}
    write_graph(graph, (given,), path, ["slopes"], ["planes"], axes)
    shape = (1, 5 * multiple // 2, 4 * multiple // 2, INPUT_PLANES * FOLD**2)
    values = np.random.default_rng(0).uniform(-1, 1, shape).astype(np.float32)
    expected = graph(torch.from_numpy(values)).numpy()
    (found,) = session(path).run(None, {"slopes": values})
    error = largest_difference(expected, found)
    if not error <= TOLERANCE:
        raise ValueError(f"{path} differs from torch by {error:.1e} of its largest value")
    return error


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument("--checkpoint", type=Path, help="weights.pt of export.edges.train")
    source.add_argument("--random", choices=SIZES, help="random weights of this size, for measuring time")
    parser.add_argument("--out", type=Path, default=Path(".data/bundles/edges-fp32"))
    parser.add_argument("--name", help="default: the folder's name")
    options = parser.parse_args()
    torch.manual_seed(0)
    if options.random:
        config = SIZES[options.random]
        network = EdgeNetwork(config).eval()
    else:
        network, config = load_network(options.checkpoint)
    if config.bins:
        raise SystemExit("Networks of the histogram loss are compared in torch and not shipped: train with --loss l1.")
    error = export(network, options.out, config.multiple)
    size = (options.out / "field.onnx").stat().st_size / 1e6
    print(f"field: {size:.2f} MB, {error:.1e} from torch")
    info = BundleInfo(options.name or options.out.name, "fp32", training_data=() if options.random else TRAINING_DATA)
    write_manifest(options.out, info, config.multiple)


if __name__ == "__main__":
    main()
