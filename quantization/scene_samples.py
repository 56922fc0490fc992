"""Images that scene networks are calibrated on and compared by: photos of captures, made from the best others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import nn
from tqdm import tqdm

from export.scenes.bundle import GRAPHS
from export.scenes.captures import Capture
from export.scenes.config import MULTIPLE
from export.scenes.fitting import Options, fitted_to_views, gathered, render
from export.scenes.geometry.cameras import upright
from export.scenes.geometry.source_views import scores
from export.scenes.image_quality import psnr_db
from quantization.bundle_networks import BundleNetworks
from quantization.samples import Sample

SOURCES = 8  # photos that an image is made from while calibrating and comparing


@dataclass(frozen=True, eq=False)
class Shot:
    """A photo of a capture, and those that its image is made from."""

    capture: Capture
    target: int
    sources: list[int]


def shots(captures: Sequence[Capture], count: int, held_out: bool) -> list[Shot]:
    """`count` photos, evenly over the captures; held-out ones or the others."""
    chosen = []
    for k in range(count):
        capture = captures[k % len(captures)]
        candidates = sorted(capture.held_out) if held_out and capture.held_out else capture.sources()
        rounds = -(-count // len(captures))
        target = candidates[(2 * (k // len(captures)) + 1) * len(candidates) // (2 * rounds)]
        others = [j for j in capture.sources() if j != target]
        score = scores(capture.cameras[target], [capture.cameras[j] for j in others], capture.cloud.positions[::37])
        chosen.append(Shot(capture, target, [others[j] for j in np.argsort(-score, kind="stable")[:SOURCES]]))
    return chosen


@torch.no_grad()
def psnrs_db(networks: nn.Module, wanted: Sequence[Shot], what: str) -> list[float]:
    """The PSNR of each image, rendered with these networks, against its photo."""
    metrics = []
    for shot in tqdm(wanted, desc=what, unit="picture", leave=False):
        options = Options(up=shot.capture.up)
        views = [shot.capture.view(k) for k in shot.sources]
        model = fitted_to_views(torch.from_numpy(shot.capture.cloud.positions), views, networks, options)
        photo = shot.capture.view(shot.target)
        metrics.append(psnr_db(render(model, photo.camera, networks, options), photo.image))
    return metrics


@torch.no_grad()
def collect(networks: BundleNetworks, wanted: Sequence[Shot]) -> dict[str, list[Sample]]:
    """Inputs of each graph for each shot: a photo, and the rasters of an image."""
    samples: dict[str, list[Sample]] = {name: [] for name in GRAPHS}
    for shot in tqdm(wanted, desc="running the fp32 bundle", unit="picture", leave=False):
        options = Options(up=shot.capture.up)
        views = [shot.capture.view(k) for k in shot.sources]
        points = torch.from_numpy(shot.capture.cloud.positions)
        model = fitted_to_views(points, views, networks, options)
        camera = upright(shot.capture.view(shot.target).camera, np.asarray(options.up), MULTIPLE)
        networks.refiner.seen = samples["refiner"]
        networks.refiner([raster[None] for raster in model.rasters(camera, networks, options)])
        networks.refiner.seen = None
        (image,) = gathered(points, views[:1], options).images
        samples["extractor"].append({"image": image[None].permute(0, 2, 3, 1).contiguous().numpy()})
    return samples
