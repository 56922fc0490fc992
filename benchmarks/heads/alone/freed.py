"""Whether heads gain by a stage 2: after the fit of codes all layers of the field are freed and go on with what the
pixels say, held near stage 1 and with an eikonal term.

    python -m benchmarks.heads.alone.freed --heads 6

In the torch reference, of made validation heads, one photo each. How much a layer may move is told in mm: the standard
deviation by which distances near the surface of stage 1 may differ from it, each point counting as one cell of the
encoder.
"""

from __future__ import annotations

import argparse
import hashlib
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
from maquette import Head
from torch import Tensor
from tqdm import tqdm

from benchmarks.heads.distances import measure
from benchmarks.heads.fitted import triangles_of
from benchmarks.heads.mean_head import read_mean_head
from benchmarks.heads.photos import PhotoBackgrounds, TrueHead, read_made_heads
from benchmarks.heads.quality import BUNDLE, DATA, photos_of
from benchmarks.heads.tables import table
from export.heads.bundle import PRIOR
from export.heads.field import bases_of, geometry
from export.heads.fit import stored_head
from export.heads.fitting.anchor_fit import fit_anchors, observations_of
from export.heads.fitting.photo import Encoder, look_at
from export.heads.fitting.ray_fit import RAY_WEIGHT, FitOptions, RayFit
from export.heads.head_file import StoredHead, write_head
from export.heads.made_heads import make_maker
from export.heads.prior import Layer
from export.heads.prior_file import prior_from_bytes

STEPS, RATE, POINTS = 60, 2e-4, 600
EIKONAL = 0.1  # of a cell's weight, each point
NEAR_DM = 0.05  # standard deviation of points around the surface


def freed(fit: RayFit, weights: list[Tensor], surface: Tensor, hold_mm: float) -> list[Tensor]:
    """The layers after stage 2, of which `weights` are those of stage 1; surface [N, 3] (dm): points of it."""
    torch.manual_seed(0)
    now = [w.clone().requires_grad_(True) for w in weights]
    adam = torch.optim.Adam(now, lr=RATE, betas=(0.9, 0.99))
    pose, level, shape = fit.best.pose, fit.last, fit.bases.shape
    grid = fit.ray_terms.grid(weights)
    for step in range(STEPS):
        rays = level.fitted[np.random.default_rng(step).permutation(len(level.fitted))[:256]]
        seen = fit.ray_terms.losses(now, pose, grid, rays).total() * fit._ray_weight(level, len(rays))
        at = surface[torch.randint(len(surface), (POINTS,))] + NEAR_DM * torch.randn(POINTS, 3)
        at = at.requires_grad_(True)
        distance = geometry(shape, now, at)[..., 0]
        moved = distance - geometry(shape, weights, at)[..., 0].detach()
        (slope,) = torch.autograd.grad(distance.sum(), at, create_graph=True)
        held = 0.5 * (moved / (hold_mm / 100)).square() + EIKONAL * (slope.norm(dim=1) - 1).square()
        adam.zero_grad()
        (seen + RAY_WEIGHT * held.sum()).backward()
        adam.step()
    return [w.detach() for w in now]


def measured(stored: StoredHead, truth: TrueHead) -> list[float]:
    """Face and whole head, mm."""
    with tempfile.TemporaryDirectory() as folder:
        write_head(stored, Path(folder) / "a.maqh")
        with Head.open(Path(folder) / "a.maqh") as head:
            found = measure(triangles_of(head.mesh("all")), truth.true)
    return [found.face_mm, found.head_mm]


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--heads", type=int, default=6)
    parser.add_argument("--hold-mm", type=float, nargs="+", default=(1.0, 4.0))
    parser.add_argument("--data", type=Path, default=DATA, help=f"default: {DATA}")
    parser.add_argument("--backgrounds", type=Path, default=Path(".data/backgrounds/val"))
    parser.add_argument("--bundle", type=Path, default=BUNDLE, help=f"default: {BUNDLE}")
    options = parser.parse_args(arguments)
    torch.set_num_threads(1)
    data = (options.bundle / PRIOR).read_bytes()
    prior, encoder = prior_from_bytes(data), Encoder(options.bundle)
    bases, backgrounds = bases_of(prior), PhotoBackgrounds(options.backgrounds)
    mean, sha = read_mean_head(options.bundle), hashlib.sha256(data).hexdigest()
    rows = []
    for truth in tqdm(read_made_heads(options.data, options.heads, make_maker(), "val"), unit="head", disable=None):
        number = truth.front()
        if number is None:
            continue
        photo = photos_of(truth, [number], backgrounds)[0]
        look = look_at(encoder, photo.rgb[..., ::-1], tuple(photo.box))
        start = fit_anchors(prior, observations_of(look))
        of_mean = measure(mean, truth.true)
        row = [of_mean.face_mm, of_mean.head_mm]
        fit = RayFit(prior, look, start, FitOptions())
        row += measured(stored_head(prior, sha, look, fit.now, start.covariance), truth)
        fit.run()
        stored = stored_head(prior, sha, look, fit.best, start.covariance)
        row += measured(stored, truth)
        weights = [w.detach() for w in bases.combine(fit.best.shape, fit.best.colour)]
        surface = torch.from_numpy(prior.anchor_mean + prior.anchor_linear @ fit.best.shape.numpy()).float()
        for hold_mm in options.hold_mm:
            layers = [Layer(w[:, :-1].numpy(), w[:, -1].numpy()) for w in freed(fit, weights, surface, hold_mm)]
            row += measured(replace(stored, layers=layers), truth)
        rows.append(row)
        tqdm.write(" ".join(f"{value:.2f}" for value in row))
    face, head = np.mean(rows, 0).reshape(-1, 2).T
    names = ("mean head", "encoder alone", "stage 1", *(f"stage 2, held within {mm:g} mm" for mm in options.hold_mm))
    print(table(
        (f"{len(rows)} heads", "face, mm", "by mean head", "head, mm", "by mean head"),
        [[name, f"{f:.3f}", f"{f / face[0]:.3f}", f"{h:.3f}", f"{h / head[0]:.3f}"]
         for name, f, h in zip(names, face, head, strict=True)],
    ))  # fmt: skip


if __name__ == "__main__":
    main()
