"""Whole held-out frames through sensors and network: metrics, and a sheet to look at."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from zlib import crc32

import cv2
import matplotlib
import numpy as np
import torch

from export.edges.config import EPS_R
from export.edges.data import Frame, seen_by
from export.edges.depth_input import folded, slopes
from export.edges.losses import decoded
from export.edges.metrics import cuts, frame_metrics, summary
from export.edges.network import EdgeNetwork
from export.solids.sensors import LEVELS

Field = Callable[[np.ndarray, float], np.ndarray]  # depth [H, W] in metres, focal length in px -> distance in r


def frame_through(level: str, frame: Frame) -> np.ndarray:
    """A frame with the errors of a level's sensor; the same each time."""
    rng = np.random.default_rng([crc32(level.encode()), frame.number])
    return seen_by(LEVELS[level], frame.depth, frame.focal_px, rng)


@torch.no_grad()
def network_planes(network: EdgeNetwork, depth: np.ndarray, focal_px: float) -> torch.Tensor:
    """Planes [1, P, H, W] of one frame; H and W multiples of the network's."""
    device = next(network.parameters()).device
    batch = torch.from_numpy(depth)[None].to(device)
    return network(folded(slopes(batch, torch.full((1, 2), focal_px, device=device)), 2)).float()


def field_of(network: EdgeNetwork, bins: int, decoding: str = "expectation") -> Field:
    return lambda depth, focal_px: decoded(network_planes(network, depth, focal_px), bins, decoding)[0][0].cpu().numpy()


def metrics_of(field: Field, frames: Sequence[Frame], level: str) -> list[dict[str, object]]:
    """export.edges.metrics.frame_metrics of each frame, as a sensor sees it."""
    rows = []
    for frame in frames:
        seen = frame_through(level, frame)
        rows.append(frame_metrics(field(seen, frame.focal_px), frame.distance, frame.counts & (seen > 0)))
    return rows


def validate(
    network: EdgeNetwork, bins: int, frames: Sequence[Frame], levels: Sequence[str]
) -> dict[str, dict[str, float]]:
    """Metrics by level; distances are cut where the same frames say."""
    out = {}
    for level in levels:
        rows = metrics_of(field_of(network, bins), frames, level)
        out[level] = summary(rows, cuts(rows))
    return out


def field_image(distance: np.ndarray) -> np.ndarray:
    """[H, W] in r -> RGB, bright at edges."""
    return (matplotlib.colormaps["magma"](1 - np.clip(distance / EPS_R, 0, 1))[..., :3] * 255).astype(np.uint8)


def slope_image(depth: np.ndarray, focal_px: float) -> np.ndarray:
    """The network's input as colours; unknown pixels are black: uint8 [H, W, 3], RGB."""
    planes = slopes(torch.from_numpy(depth)[None], torch.full((1, 2), focal_px))[0].numpy()
    picture = np.stack([planes[0], planes[1], np.zeros_like(planes[0])], -1) * 127 + 128
    return (picture * planes[2][..., None]).astype(np.uint8)


def sheet(network: EdgeNetwork, bins: int, frames: Sequence[Frame], levels: Sequence[str]) -> np.ndarray:
    """RGB, uint8: a row a frame: the true field, then by level what the sensor sees and the network's field."""
    field, rows = field_of(network, bins), []
    for frame in frames:
        tiles = [np.where(frame.counts[..., None], field_image(frame.distance), 60).astype(np.uint8)]
        for level in levels:
            seen = frame_through(level, frame)
            made = np.where((seen > 0)[..., None], field_image(field(seen, frame.focal_px)), 0).astype(np.uint8)
            tiles += [slope_image(seen, frame.focal_px), made]
        rows.append(np.hstack([cv2.resize(t, (320, 240), interpolation=cv2.INTER_AREA) for t in tiles]))
    return np.vstack(rows)
