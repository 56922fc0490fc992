"""The three networks together, and their weights on disk."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import torch
from torch import nn

from export.scenes.config import ExtractorConfig, RefinerConfig, SceneConfig
from export.scenes.networks.basis import Basis
from export.scenes.networks.extractor import Extractor
from export.scenes.networks.light_refiner import LightRefiner

_PARTS = {"extractor": ExtractorConfig, "refiner": RefinerConfig}


class Networks(nn.Module):
    """Extractor, basis and refiner, with random weights."""

    def __init__(self, config: SceneConfig) -> None:
        super().__init__()
        self.config = config
        self.extractor = Extractor(config.extractor)
        self.basis = Basis()
        self.refiner = LightRefiner(config.refiner)


def config_of(saved: dict[str, Any]) -> SceneConfig:
    """Restores a SceneConfig from the dict of `asdict` that a file stored."""
    return SceneConfig(*(kind(tuple(saved[name]["widths"])) for name, kind in _PARTS.items()))


def save_networks(networks: Networks, path: Path) -> None:
    """Weights in half precision, what is shipped."""
    half = {k: v.half() if v.is_floating_point() else v for k, v in networks.state_dict().items()}
    torch.save({"networks": half, "config": asdict(networks.config)}, path)


def load_networks(path: Path) -> Networks:
    """Raises ValueError where the file holds something else."""
    saved = torch.load(path, map_location="cpu", weights_only=True)
    if not isinstance(saved, dict) or not {"networks", "config"} <= saved.keys():
        raise ValueError(f"{path} holds no networks of export.scenes.train; it wants weights.pt of a run.")
    networks = Networks(config_of(saved["config"]))
    networks.load_state_dict({k: v.float() if v.is_floating_point() else v for k, v in saved["networks"].items()})
    return networks
