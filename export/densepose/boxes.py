"""Anchors, box coding, matching. Boxes are float [..., 4] = x0, y0, x1, y1 in input pixels."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from export.densepose.config import NetworkConfig

MAX_LOG_SCALE = math.log(1000.0 / 16)  # keeps exp() of a size delta finite


def anchors(config: NetworkConfig, shapes: list[tuple[int, int]]) -> list[Tensor]:
    """Anchors of each level, [h * w * A, 4] in the order row, column, ratio; offset 0 (docs/reference/formats.md)."""
    levels = []
    for (height, width), stride, size in zip(shapes, config.rpn_strides, config.anchor_sizes, strict=True):
        ratio = torch.tensor(config.aspect_ratios)
        half = torch.stack([size / ratio.sqrt(), size * ratio.sqrt()], 1) / 2
        y, x = torch.meshgrid(torch.arange(height) * stride, torch.arange(width) * stride, indexing="ij")
        centre = torch.stack([x, y], -1).float()[:, :, None]
        levels.append(torch.cat([centre - half, centre + half], -1).reshape(-1, 4))
    return levels


def flat_outputs(objectness: Tensor, deltas: Tensor) -> tuple[Tensor, Tensor]:
    """[N, A, h, w], [N, 4A, h, w] -> [N, h * w * A], [N, h * w * A, 4] in the anchors' order."""
    count, per_cell, height, width = objectness.shape
    logits = objectness.permute(0, 2, 3, 1).reshape(count, -1)
    deltas = deltas.view(count, per_cell, 4, height, width).permute(0, 3, 4, 1, 2).reshape(count, -1, 4)
    return logits, deltas


def encode(boxes: Tensor, reference: Tensor, weights: tuple[float, ...] = (1, 1, 1, 1)) -> Tensor:
    """Deltas that take `reference` to `boxes`; both [K, 4]."""
    size, centre = reference[:, 2:] - reference[:, :2], (reference[:, 2:] + reference[:, :2]) / 2
    to_size, to_centre = boxes[:, 2:] - boxes[:, :2], (boxes[:, 2:] + boxes[:, :2]) / 2
    return torch.cat([(to_centre - centre) / size, (to_size / size).log()], 1) * boxes.new_tensor(weights)


def decode(deltas: Tensor, reference: Tensor, weights: tuple[float, ...] = (1, 1, 1, 1)) -> Tensor:
    """Inverse of `encode`; size deltas are clamped at log(1000 / 16)."""
    deltas = deltas / deltas.new_tensor(weights)
    size, centre = reference[:, 2:] - reference[:, :2], (reference[:, 2:] + reference[:, :2]) / 2
    centre = centre + deltas[:, :2] * size
    half = size * deltas[:, 2:].clamp(max=MAX_LOG_SCALE).exp() / 2
    return torch.cat([centre - half, centre + half], 1)


def clip(boxes: Tensor, height: int, width: int) -> Tensor:
    """Boxes clipped at the image's border."""
    return torch.stack(
        [
            boxes[:, 0].clamp(0, width),
            boxes[:, 1].clamp(0, height),
            boxes[:, 2].clamp(0, width),
            boxes[:, 3].clamp(0, height),
        ],
        1,
    )


def levels_of(boxes: Tensor, config: NetworkConfig) -> Tensor:
    """Index 0..3 of the feature level (P2..P5) that a box is read from: floor(4 + log2(sqrt(area) / 224))."""
    area = (boxes[:, 2] - boxes[:, 0]).clamp(min=0) * (boxes[:, 3] - boxes[:, 1]).clamp(min=0)
    level = (config.canonical_level + torch.log2(area.sqrt() / config.canonical_size + 1e-8)).floor()
    return level.clamp(2, 5).long() - 2
