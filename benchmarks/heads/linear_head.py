"""Fits a linear head as a baseline: principal components of the vertices of the prior's training heads.

They are fitted to the same encoder output for a photo, with the same camera model and losses as the library's first
stage. The components are whitened, so they are normally distributed a priori.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.heads.distances import MM_PER_DM, Triangles
from benchmarks.heads.photos import Photo
from export.heads.fitting.anchor_fit import fit_anchors, observations_of
from export.heads.fitting.photo import Encoder, NoHead, look_at
from export.heads.prior_file import read_prior
from export.heads.surface import HeadMaker

COMPONENTS = 64
MIN_SIGMA_DM = 0.01


def read_visible(folder: Path) -> np.ndarray:
    """Reads vertices [H, V, 3] (dm) of the heads in a folder of `export.heads.points`, hair included."""
    paths = sorted(folder.glob("head-*[0-9].npz"))
    if len(paths) < 2:
        raise FileNotFoundError(f"{folder} holds no heads: run `python -m export.heads.points train` first")
    visible = []
    for path in paths:
        with np.load(path) as stored:
            visible.append(stored["visible"])
    return np.stack(visible)


def principal_components(vertices: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns the principal components of heads [H, V, 3]: mean [V, 3], the offset for a standard deviation of each
    component [V, 3, count], and sigma [V], the residual of each coordinate."""
    flat = vertices.reshape(len(vertices), -1).astype(np.float64)
    mean = flat.mean(0)
    flat = flat - mean
    # There are fewer heads than coordinates, so the eigenvectors come from products of heads.
    values, vectors = np.linalg.eigh(flat @ flat.T)
    best = np.argsort(values)[::-1][:count]
    linear = (vectors[:, best].T @ flat).T / np.sqrt(len(flat))
    left = flat - (vectors[:, best] @ (vectors[:, best].T @ flat))
    freedom = max(len(flat) - count, 1)
    sigma = np.sqrt((left**2).reshape(len(flat), -1, 3).sum((0, 2)) / 3 / freedom)
    return mean.reshape(-1, 3), linear.reshape(-1, 3, len(best)), sigma


class LinearHeads:
    """The linear head of `visible` [H, V, 3], fitted to photos through a bundle's encoder."""

    def __init__(self, bundle: Path, maker: HeadMaker, visible: np.ndarray, count: int = COMPONENTS) -> None:
        shapes = maker.shapes
        faces = np.concatenate([maker.faces, shapes.eye_faces])
        own = np.unique(faces)
        number = np.full(len(shapes.template), -1)
        number[own] = np.arange(len(own))
        self.faces = number[faces].astype(np.int64)
        self.template = shapes.template[own]
        self.mean, self.linear, sigma = principal_components(visible[:, own], min(count, len(visible) - 1))
        self._encoder = Encoder(bundle)
        single = np.float32
        self._model = replace(
            read_prior(bundle / "prior.maqp"),
            template_points=self.template.astype(single), anchor_mean=self.mean.astype(single),
            anchor_linear=self.linear.astype(single), anchor_sigma=np.maximum(sigma, MIN_SIGMA_DM).astype(single),
        )  # fmt: skip

    def mesh(self, photo: Photo, focal_px: float = 0) -> Triangles | None:
        """Returns the head of a photo, mm; None if the encoder finds none. focal_px: 0 if unknown."""
        try:
            seen = observations_of(look_at(self._encoder, photo.rgb[..., ::-1], tuple(photo.box), focal_px=focal_px))
            found = fit_anchors(self._model, seen)
        except NoHead:
            return None
        return Triangles((self.mean + self.linear @ found.codes) * MM_PER_DM, self.faces)
