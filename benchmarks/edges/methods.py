"""Runs every compared method: the network in the shipped library, in torch, and baselines without a network."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import numpy as np

from benchmarks.edges import baselines
from benchmarks.edges.edges_api import Edges, EdgesResult, Pinhole
from benchmarks.edges.views import View
from export.edges.config import EPS_R
from export.edges.losses import DECODINGS
from export.edges.validation import field_of
from export.edges.weights import load_network

SHIPPED, FLOAT, NOTHING = "int8, as shipped", "fp32, the same weights", "no edges anywhere"


class Method(Protocol):
    def run(self, depth: np.ndarray, camera: Pinhole) -> tuple[np.ndarray, float]:
        """Returns the distance [H, W] in r, and the run time in milliseconds."""


@dataclass
class LibraryField:
    """A bundle in the shipped C library. last: result of the latest frame."""

    edges: Edges
    last: EdgesResult | None = None

    def run(self, depth: np.ndarray, camera: Pinhole) -> tuple[np.ndarray, float]:
        self.last = self.edges.run(depth, camera)
        return self.last.distance, self.last.stats.total_ms


@dataclass(frozen=True)
class TorchField:
    """A network with the histogram loss, which a bundle cannot hold."""

    field: object

    def run(self, depth: np.ndarray, camera: Pinhole) -> tuple[np.ndarray, float]:
        start = time.perf_counter()
        distance = self.field(depth, camera.focal_px)
        return distance, 1000 * (time.perf_counter() - start)


@dataclass(frozen=True)
class NoEdges:
    """The field of a frame without edges, which each method must beat."""

    def run(self, depth: np.ndarray, camera: Pinhole) -> tuple[np.ndarray, float]:
        return np.full(depth.shape, EPS_R, np.float32), 0.0


@dataclass(frozen=True)
class BaselineField:
    tuned: baselines.TunedBaseline

    def run(self, depth: np.ndarray, camera: Pinhole) -> tuple[np.ndarray, float]:
        return self.tuned.run(depth, camera.focal_px)


@dataclass(frozen=True)
class Networks:
    """bundles: folders by the name of the method, SHIPPED first. histograms: weights of the histogram loss by name.
    missing: why others are not measured, by name."""

    bundles: Mapping[str, Path]
    histograms: Mapping[str, Path] = field(default_factory=dict)
    missing: Mapping[str, str] = field(default_factory=dict)


def opened(networks: Networks, threads: int, stack: ExitStack) -> dict[str, Method]:
    """Opens every network until the stack closes."""
    found: dict[str, Method] = {}
    for name, path in networks.bundles.items():
        found[name] = LibraryField(stack.enter_context(Edges(path, threads)))
    for name, path in networks.histograms.items():
        network, config = load_network(path)
        for decoding in DECODINGS:
            found[f"{name}, {decoding}"] = TorchField(field_of(network, config.bins, decoding))
    return found


def tuned_baselines(views: Sequence[View], seen: Sequence[np.ndarray]) -> tuple[dict[str, Method], dict[str, str]]:
    """Returns baselines with the best settings on these views, and why others are missing. seen: the sensor's report of
    each view."""
    found, missing = {}, {}
    counts = [view.frame.counts & (depth > 0) for view, depth in zip(views, seen, strict=True)]
    for name, baseline in baselines.BASELINES.items():
        why = baseline.missing()
        if why:
            missing[name] = why
            continue
        focal, truth = [view.camera.focal_px for view in views], [view.frame.distance for view in views]
        found[name] = BaselineField(baselines.tuned(baseline, seen, focal, truth, counts))
    return found, missing
