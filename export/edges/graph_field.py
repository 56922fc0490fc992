"""A frame through an ONNX graph of the edge network: its input and its output as arrays."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch

from export.densepose.graphs import session
from export.edges.config import EPS_R, FOLD
from export.edges.depth_input import folded, mirrored, slopes
from export.edges.losses import LOG_SPREAD


def slopes_of(depth: np.ndarray, focal_px: float, multiple: int = FOLD) -> np.ndarray:
    """Depth [H, W] in metres -> `slopes` of the graph: [1, H' / 2, W' / 2, 12]; H' and W' are rounded up to multiples
    of `multiple`."""
    planes = mirrored(slopes(torch.from_numpy(depth)[None], torch.full((1, 2), focal_px)), multiple)
    return np.ascontiguousarray(folded(planes, FOLD).permute(0, 2, 3, 1).numpy())


def field_of_bundle(path: Path) -> Callable[[np.ndarray, float], np.ndarray]:
    """The field of `field.onnx` in a bundle of any precision: from depth [H, W] in metres, H and W multiples of 16, and
    the focal length in pixels to distance in r."""
    graph = session(path / "field.onnx")
    return lambda depth, focal_px: field_of_planes(graph.run(None, {"slopes": slopes_of(depth, focal_px)})[0])


def field_of_planes(planes: np.ndarray) -> np.ndarray:
    """`planes` of the graph [1, H / 2, W / 2, 16] -> distance [H, W] in r."""
    return np.clip(_unfolded(planes, 0) * EPS_R, 0, EPS_R)


def spread_of_planes(planes: np.ndarray) -> np.ndarray:
    """`planes` of the graph -> the mean absolute error that it expects of the distance, [H, W] in r."""
    return np.exp(np.clip(_unfolded(planes, 1), *LOG_SPREAD)) * EPS_R


def _unfolded(planes: np.ndarray, which: int) -> np.ndarray:
    _, height, width, _ = planes.shape
    own = planes[0, :, :, FOLD**2 * which : FOLD**2 * (which + 1)]
    own = own.reshape(height, width, FOLD, FOLD).transpose(0, 2, 1, 3)
    return own.reshape(height * FOLD, width * FOLD)
