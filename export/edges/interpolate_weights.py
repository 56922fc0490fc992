"""Interpolates the weights of two trained networks, the second of which began as the first (`--init`).

    python -m export.edges.interpolate_weights export/weights/edges.pt RUN/weights.pt --at 0.3 \\
        --crops .data/solids/train --out w.pt

A long training may overfit its crops; a network between its start and its end may be better than both (model soups,
arXiv 2203.05482). Means and variances of the normalisations are measured again on crops. Residual blocks that only the
second network has keep their weights; their output, which began at zero, is scaled.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import torch
from torch import nn

from export.edges.data import Batches, RecordError
from export.edges.depth_input import folded, slopes
from export.edges.network import EdgeNetwork, Residual
from export.edges.weights import load_network, save_network, start_from

CROP_PX, BATCH = 112, 32


@torch.no_grad()
def interpolated(first: Path, second: Path, at: float) -> EdgeNetwork:
    """The network at `at` between the first (0) and the second (1), with the size and the normalisation statistics of
    the second. Raises ValueError where the second cannot have begun as the first."""
    network, config = load_network(second)
    start = EdgeNetwork(config)
    start_from(first, start)
    trained, _ = load_network(first)
    own = {
        f"{name}.{inner}"
        for name, module in network.named_modules()
        if isinstance(module, Residual)
        for inner, _ in module.named_parameters()
        if f"{name}.{inner}" not in trained.state_dict() and not inner.startswith("second.1.")
    }
    begin = dict(start.named_parameters())
    for name, weight in network.named_parameters():
        if name not in own:
            weight.copy_(begin[name].lerp(weight, at))
    return network


@torch.no_grad()
def measure_statistics(network: EdgeNetwork, batches: Batches, count: int) -> None:
    """Replaces means and variances of all normalisations by their values over `count` batches."""
    norms = [module for module in network.modules() if isinstance(module, nn.BatchNorm2d)]
    for norm in norms:
        norm.reset_running_stats()
        norm.momentum = None  # the mean of all batches
        norm.train()
    for step in range(count):
        depth, focal_px, _ = batches.draw(step, torch.device("cpu"))
        network(folded(slopes(depth, focal_px), 2))
    network.eval()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("first", type=Path)
    parser.add_argument("second", type=Path)
    parser.add_argument("--at", type=float, required=True, help="0: the first network, 1: the second")
    parser.add_argument("--crops", type=Path, required=True, help="shards, or a file of export.solids.compact")
    parser.add_argument("--batches", type=int, default=50, help=f"batches of {BATCH} crops (default %(default)s)")
    parser.add_argument("--seed", type=int, default=5)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    try:
        network = interpolated(options.first, options.second, options.at)
        batches = Batches(options.crops, CROP_PX, BATCH, options.seed)
    except (RecordError, FileNotFoundError, ValueError) as error:
        raise SystemExit(str(error)) from None
    measure_statistics(network, batches, options.batches)
    save_network(network, load_network(options.second)[1], options.out)


if __name__ == "__main__":
    main()
