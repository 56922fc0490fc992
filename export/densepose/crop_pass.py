"""The second pass over one person: a crop turned upright (`export.densepose.person_crop`), through the trunk up to P2
and the dense head, and its labels mapped back into the image.

The Python reference of what an application may run for people who are small or lean in the whole image.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional as F

from export.densepose import targets as tg
from export.densepose.config import DecodeConfig, NetworkConfig
from export.densepose.data import MEAN, normalised
from export.densepose.decode import DenseHead
from export.densepose.network import MobileParsingRCNN
from export.densepose.person_crop import UPRIGHT, PersonCrop, crop_around, cut, outline, turn_upright, turned_box

MIN_LEAN_DEGREES = 15  # people closer to upright are not turned
MIN_TORSO_PX, MIN_HEAD_PX = 30, 10
TORSO, HEAD = (1, 2), (23, 24)


def axis_of_surface(label: np.ndarray) -> np.ndarray | None:
    """The direction of the body axis in the image, from hips to head, of labels uint8 [H, W, 3] = (I, U*255, V*255).

    The sum of two unit vectors: against the slope of U, which falls towards the neck, and from torso to head. Returns
    its direction, float64 [2]; None where too little of the torso is labelled.
    """
    y, x = np.nonzero(np.isin(label[..., 0], TORSO))
    if len(x) < MIN_TORSO_PX:
        return None
    place = np.stack([x, y], 1).astype(np.float64)
    middle = place.mean(0)
    slope, *_ = np.linalg.lstsq(np.c_[place - middle, np.ones(len(x))], label[y, x, 1] / 255, rcond=None)
    directions = [-slope[:2]]
    y, x = np.nonzero(np.isin(label[..., 0], HEAD))
    if len(x) >= MIN_HEAD_PX:
        directions.append(np.array([x.mean(), y.mean()]) - middle)
    total = sum(w / max(np.linalg.norm(w), 1e-9) for w in directions)
    length = np.linalg.norm(total)
    return total / length if length > 0.1 else None


def crop_of(mask: np.ndarray, box: np.ndarray, axis: np.ndarray | None, side_px: int) -> PersonCrop:
    """The crop for a person with the outline `mask` bool [H, W] (`box` float [4], where it is empty), turned upright if
    `axis` [2] leans by more than `MIN_LEAN_DEGREES`."""
    leans = axis is not None and axis @ UPRIGHT < math.cos(math.radians(MIN_LEAN_DEGREES)) * np.linalg.norm(axis)
    turn = turn_upright(axis) if leans else np.eye(2)
    corners = np.array([[box[i], box[j]] for i in (0, 2) for j in (1, 3)], np.float64)
    return crop_around(turned_box(outline(mask) if mask.any() else corners, turn), turn, side_px)


@dataclass(frozen=True)
class CropGraphs:
    """The networks of the crop pass. finest: normalised crops [N, 3, s, s] -> P2 [N, C, s / 4, s / 4]."""

    finest: Callable[[Tensor], Tensor]
    dense_head: DenseHead

    @staticmethod
    def of_network(net: MobileParsingRCNN) -> CropGraphs:
        return CropGraphs(net.finest, net.dense_head)


@torch.no_grad()
def crop_maps(graphs: CropGraphs, network: NetworkConfig, image: np.ndarray, crops: list[PersonCrop]) -> list[Tensor]:
    """The dense head's coarse [P, 15, s, s], index, u and v [P, 25, s, s] of the crops of one image uint8 [H, W, 3]
    BGR."""
    pixels = torch.from_numpy(np.stack([normalised(cut(image, crop, tuple(MEAN[::-1].tolist()))) for crop in crops]))
    boxes = [torch.from_numpy(crop.box[None].astype(np.float32)) for crop in crops]
    return list(graphs.dense_head(tg.pooled([graphs.finest(pixels)], boxes, network, network.dense_pool, level=0)))


def painted(maps: list[Tensor], crop: PersonCrop, shape: tuple[int, int], config: DecodeConfig) -> np.ndarray:
    """One person's labels in the image, uint8 [H, W, 3] = (I, U*255, V*255), decoded as by
    `export.densepose.decode.paint`; 0 outside the person's box in the crop.

    maps: coarse [15, s, s], index, u, v [25, s, s]. From a pixel to them everything is affine: one bilinear reading.
    """
    coarse, index, u, v = maps
    out = np.zeros((*shape, 3), np.uint8)
    corners = np.array([[crop.box[i], crop.box[j]] for i in (0, 2) for j in (1, 3)]) @ crop.back[:, :2].T
    corners += crop.back[:, 2]
    x0, y0 = np.clip(np.floor(corners.min(0)).astype(int), 0, shape[::-1])
    x1, y1 = np.clip(np.ceil(corners.max(0)).astype(int), 0, shape[::-1])
    if x1 <= x0 or y1 <= y0:
        return out
    pixel = np.stack(np.meshgrid(np.arange(x0, x1) + 0.5, np.arange(y0, y1) + 0.5), -1)
    low, high = crop.box[:2], crop.box[2:]
    at = ((pixel @ crop.into[:, :2].T + crop.into[:, 2]) - low) / (high - low) * 2 - 1
    inside = (np.abs(at) <= 1).all(-1)
    grid = torch.from_numpy(at.astype(np.float32))[None]
    odds = coarse[1:].logsumexp(0, keepdim=True) - coarse[:1]

    def read(channels: Tensor) -> Tensor:
        return F.grid_sample(channels[None], grid, padding_mode="border", align_corners=False)[0]

    shown = read(torch.cat([odds, index[1:]]))
    part = torch.where(
        shown[0] > math.log(config.mask_threshold / (1 - config.mask_threshold)), shown[1:].argmax(0) + 1, 0
    )
    chart = [read(m).gather(0, part[None])[0].clamp(0, 1).mul(255).round() for m in (u, v)]
    label = torch.stack([part.float(), *chart], -1).byte().numpy()
    label[~inside | (label[..., 0] == 0)] = 0
    out[y0:y1, x0:x1] = label
    return out
