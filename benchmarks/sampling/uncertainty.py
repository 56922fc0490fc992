"""Compares the uncertainty of a sampled frame with its error."""

from __future__ import annotations

import numpy as np

CELLS = 16  # cells a side


def cell_errors(images: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Returns the root mean squared error of each cell in grey levels: [..., H, W, 3] -> [..., 16, 16]. Rows and
    columns that do not fill a cell are left out."""
    square = (images.astype(np.float32) - truth.astype(np.float32)) ** 2
    high, wide = square.shape[-3] // CELLS, square.shape[-2] // CELLS
    square = square[..., : CELLS * high, : CELLS * wide, :]
    parts = square.reshape(*square.shape[:-3], CELLS, high, CELLS, wide, 3)
    return np.sqrt(parts.mean((-4, -2, -1)))


def ranks(values: np.ndarray) -> np.ndarray:
    """Returns ranks along the last axis, from 0; equal values share their mean rank."""
    ordered = np.sort(values, -1)
    found = np.empty(values.shape)
    for at in np.ndindex(values.shape[:-1]):
        first = np.searchsorted(ordered[at], values[at], "left")
        found[at] = (first + np.searchsorted(ordered[at], values[at], "right") - 1) / 2
    return found


def rank_correlation(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Returns Spearman's rank correlation along the last axis; 0 if all values of a row are equal."""
    a, b = (ranks(values) - (values.shape[-1] - 1) / 2 for values in (one, other))
    scale = np.sqrt((a**2).sum(-1) * (b**2).sum(-1))
    return np.divide((a * b).sum(-1), scale, out=np.zeros(scale.shape), where=scale > 0)


def by_frame(bits: np.ndarray, errors: np.ndarray) -> np.ndarray:
    """Returns the rank correlation of the cells of each frame: [..., 16, 16] twice -> [...]."""
    return rank_correlation(*(values.reshape(*values.shape[:-2], -1) for values in (bits, errors)))


def reliability(bits: np.ndarray, errors: np.ndarray, bins: int = 5) -> list[tuple[float, float]]:
    """Returns mean bits and root mean squared error of equally large groups of cells, the most certain group first."""
    order = np.argsort(bits, axis=None, kind="stable")
    parts = np.array_split(order, bins)
    return [(float(bits.flat[part].mean()), float(np.sqrt((errors.flat[part] ** 2).mean()))) for part in parts]
