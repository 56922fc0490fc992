"""The file of a trained edge network."""

from __future__ import annotations

from pathlib import Path

import torch

from export.edges.config import NetworkConfig
from export.edges.network import EdgeNetwork
from export.training import save_atomically


def save_network(network: EdgeNetwork, config: NetworkConfig, path: Path) -> None:
    """Widths, bins and weights."""
    save_atomically({"widths": list(config.widths), "bins": config.bins, "state": network.state_dict()}, path)


def load_network(path: Path) -> tuple[EdgeNetwork, NetworkConfig]:
    """In evaluation mode. Raises FileNotFoundError, and what torch raises for other files."""
    saved = torch.load(path, map_location="cpu", weights_only=True)
    config = NetworkConfig(tuple(saved["widths"]), saved["bins"])
    network = EdgeNetwork(config)
    network.load_state_dict(saved["state"])
    return network.eval(), config
