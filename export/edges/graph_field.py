"""A frame through an ONNX graph of the edge network: its input and its output as arrays."""

from __future__ import annotations

import numpy as np
import torch

from export.edges.config import EPS_R, FOLD
from export.edges.depth_input import folded, slopes


def slopes_of(depth: np.ndarray, focal_px: float) -> np.ndarray:
    """Depth [H, W] in metres -> `slopes` of the graph: [1, H / 2, W / 2, 12]."""
    planes = slopes(torch.from_numpy(depth)[None], torch.full((1, 2), focal_px))
    return np.ascontiguousarray(folded(planes, FOLD).permute(0, 2, 3, 1).numpy())


def field_of_planes(planes: np.ndarray) -> np.ndarray:
    """`planes` of the graph [1, H / 2, W / 2, 16] -> distance [H, W] in r."""
    _, height, width, _ = planes.shape
    distance = planes[0, :, :, : FOLD**2].reshape(height, width, FOLD, FOLD).transpose(0, 2, 1, 3)
    return np.clip(distance.reshape(height * FOLD, width * FOLD) * EPS_R, 0, EPS_R)
