"""The refiner that a config asks for."""

from __future__ import annotations

from export.scenes.config import RefinerConfig
from export.scenes.networks.gated_refiner import GatedRefiner
from export.scenes.networks.light_refiner import LightRefiner

Refiner = GatedRefiner | LightRefiner


def make_refiner(config: RefinerConfig) -> Refiner:
    """With random weights."""
    return GatedRefiner() if config.kind == "gated" else LightRefiner(config)
