"""The file of a trained edge network."""

from __future__ import annotations

from pathlib import Path

import torch

from export.edges.config import NetworkConfig
from export.edges.network import EdgeNetwork
from export.training import save_atomically


def save_network(network: EdgeNetwork, config: NetworkConfig, path: Path) -> None:
    """Widths, bins, blocks and weights."""
    shape = {"widths": list(config.widths), "bins": config.bins, "blocks": list(config.blocks)}
    save_atomically({**shape, "state": network.state_dict()}, path)


def load_network(path: Path) -> tuple[EdgeNetwork, NetworkConfig]:
    """In evaluation mode. Raises FileNotFoundError, and what torch raises for other files."""
    saved = torch.load(path, map_location="cpu", weights_only=True)
    config = NetworkConfig(tuple(saved["widths"]), saved["bins"], tuple(saved.get("blocks", ())))
    network = EdgeNetwork(config)
    network.load_state_dict(saved["state"])
    return network.eval(), config


@torch.no_grad()
def start_from(path: Path, network: EdgeNetwork) -> None:
    """Gives a network the weights of a trained one that is as wide or narrower, with the same residual blocks or none:
    it then computes the same field.

    New channels begin at random and are read with weights of 0 by the channels that are there already (as Net2Net,
    arXiv 1511.05641, widens, but without copies). Raises ValueError where the trained one is wider or has other planes.
    """
    trained, _ = load_network(path)
    narrow, wide = trained.state_dict(), network.state_dict()
    if len(narrow["head.bias"]) != len(wide["head.bias"]):
        raise ValueError(f"{path} has other planes (--loss, --bins) than the network to train.")
    for name, old in narrow.items():
        new = wide.get(name)
        if new is None or any(a > b for a, b in zip(old.shape, new.shape, strict=True)):
            raise ValueError(f"{path} has layers that the network to train lacks: choose a larger --size.")
        if old.ndim == 4:
            new[: old.shape[0], old.shape[1] :] = 0
        new[tuple(slice(side) for side in old.shape)] = old
    network.load_state_dict(wide)
