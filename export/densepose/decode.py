"""Inference outside the graphs: resize, proposals, NMS, RoIAlign, and composing the IUV image.

Written against three callables, so that the torch network and ONNX Runtime sessions run the same code. It is
the reference that the C++ runtime is compared with.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
import torch
from torch import Tensor
from torch.nn import functional as F
from torchvision.ops import nms

from export import keypoints
from export.densepose import boxes as bx
from export.densepose import targets as tg
from export.densepose.config import DecodeConfig, NetworkConfig
from export.densepose.data import MEAN, STD
from export.densepose.network import MobileParsingRCNN

# The dense head sees a box and this fraction of its width and height on each side, as in the C++ runtime.
REGION_MARGIN = (0.03, 0.05)
KEYPOINT_REACH = 2  # cells

Detector = Callable[[Tensor], tuple[list[Tensor], list[Tensor], list[Tensor], Tensor | None]]
BoxHead = Callable[[Tensor], tuple[Tensor, Tensor]]
DenseHead = Callable[[Tensor], tuple[Tensor, Tensor, Tensor, Tensor]]


@dataclass(frozen=True)
class Graphs:
    """The callables; shapes as in docs/reference/formats.md (the detector returns P2..P6, objectness, deltas, and the
    evidence of people, if any). keypoints: RoIs of the dense head -> logits [P, 33, s, s]; None without them."""

    detector: Detector
    box_head: BoxHead
    dense_head: DenseHead
    keypoints: Callable[[Tensor], Tensor] | None = None

    @staticmethod
    def of_network(net: MobileParsingRCNN) -> Graphs:
        def detector(image: Tensor) -> tuple[list[Tensor], list[Tensor], list[Tensor], Tensor | None]:
            features, evidence = net.trunk(image)
            return features, *net.rpn(features), evidence

        def keypoints(rois: Tensor) -> Tensor:
            return net.dense_head.with_keypoints(rois)[-1]

        return Graphs(detector, net.box_head, net.dense_head, keypoints if net.config.keypoints else None)


@dataclass(frozen=True)
class Result:
    """boxes float32 [K, 4] in source pixels, scores float32 [K] (falling), iuv uint8 [H, W, 3] = (I, U*255,
    V*255), instance uint8 [H, W] (k + 1 for person k, 0 for none). Each person has at least one pixel. keypoint float32
    [K, 33, 3]: x, y in source pixels and confidence; None where the network has none."""

    boxes: np.ndarray
    scores: np.ndarray
    iuv: np.ndarray
    instance: np.ndarray
    keypoint: np.ndarray | None = None


def network_input(image: np.ndarray, long_side: int) -> tuple[Tensor, float, float]:
    """RGB uint8 [H, W, 3] -> normalised [1, 3, h, w], zero-padded to multiples of 32, and the scales x, y
    from its pixels to the source's.
    """
    height, width = image.shape[:2]
    scale = long_side / max(height, width)
    shape = (max(round(width * scale), 1), max(round(height * scale), 1))
    if shape != (width, height):
        image = cv2.resize(image, shape, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR)
    tensor = torch.from_numpy(((image.astype(np.float32) - MEAN) / STD).transpose(2, 0, 1))[None]
    tensor = F.pad(tensor, (0, -shape[0] % 32, 0, -shape[1] % 32))
    return tensor.contiguous(), width / shape[0], height / shape[1]


@dataclass(frozen=True)
class Detection:
    """People found, before the dense head.

    tensor: the detector's input [1, 3, h, w]. features: P2..P6 (or P2..P5). proposed: [K, 4] boxes of the
    RPN, boxes: [P, 4] of the box head, both in pixels of `tensor`. scores: [P]. scale: x and y, from pixels
    of `tensor` to the source's.
    """

    tensor: Tensor
    features: list[Tensor]
    proposed: Tensor
    boxes: Tensor
    scores: Tensor
    scale: tuple[float, float]


@torch.no_grad()
def detect(graphs: Graphs, image: np.ndarray, network: NetworkConfig, config: DecodeConfig) -> Detection:
    """Detector, proposals, box head and NMS on an RGB image uint8 [H, W, 3]."""
    height, width = image.shape[:2]
    tensor, scale_x, scale_y = network_input(image, config.long_side)
    inner = (round(height / scale_y), round(width / scale_x))
    features, objectness, deltas, evidence = graphs.detector(tensor)
    flat = [bx.flat_outputs(o, d) for o, d in zip(objectness, deltas, strict=True)]
    anchors = bx.anchors(network, [tuple(o.shape[-2:]) for o in objectness])
    proposed = tg.proposals(
        [f[0][0] for f in flat], [f[1][0] for f in flat], anchors, inner,
        config.pre_nms_top_k, config.post_nms_top_k, config.rpn_nms_iou,
    )  # fmt: skip
    boxes, scores = _people(graphs, features, evidence, proposed, network, config, inner)
    return Detection(tensor, features, proposed, boxes, scores, (scale_x, scale_y))


@torch.no_grad()
def infer(
    graphs: Graphs,
    image: np.ndarray,
    network: NetworkConfig | None = None,
    config: DecodeConfig | None = None,
) -> Result:
    """People and their body surface in an RGB image uint8 [H, W, 3]."""
    network, config = network or NetworkConfig(), config or DecodeConfig()
    height, width = image.shape[:2]
    found = detect(graphs, image, network, config)
    canvas = Canvas.of_size(height, width)
    inner = (round(height / found.scale[1]), round(width / found.scale[0]))
    regions = regions_of(found.boxes, *inner)
    points = None
    if len(regions):
        rois = tg.pooled(found.features, [regions], network, network.dense_pool, level=0)
        maps = graphs.dense_head(rois)
        points = graphs.keypoints(rois) if graphs.keypoints else None
    to_image = found.boxes.new_tensor(found.scale * 2)
    boxes = found.boxes * to_image
    painted: list[int] = []
    for k, region in enumerate(regions * to_image):
        # A box without a body is a false alarm; one whose body is another person's already shows that person again.
        if paint([m[k] for m in maps], region.tolist(), len(painted) + 1, canvas, config):
            painted.append(k)
    keypoint = np.zeros((0, keypoints.COUNT, 3), np.float32) if graphs.keypoints else None
    if points is not None:
        keypoint = keypoints_of(points[painted], regions[painted] * to_image).numpy()
    return Result(boxes[painted].numpy(), found.scores[painted].numpy(), canvas.iuv, canvas.instance, keypoint)


def keypoints_of(logits: Tensor, regions: Tensor) -> Tensor:
    """Where the keypoints of each person are, [P, 33, 3]: x and y in the units of `regions` [P, 4], and confidence.

    logits: [P, 33, s, s] over the regions. A keypoint lies in the middle of the probability in a window of
    2 KEYPOINT_REACH + 1 cells each way around its likeliest cell (the first of several). Its confidence is the
    probability in the window.
    """
    side = logits.shape[-1]
    probability = logits.flatten(2).softmax(-1)
    best = probability.argmax(-1)
    row, column = best // side, best % side
    at = torch.arange(side)
    near = [(at - k[..., None]).abs() <= KEYPOINT_REACH for k in (row, column)]
    window = probability.unflatten(-1, (side, side)) * near[0][..., :, None] * near[1][..., None, :]
    mass = window.sum((-2, -1))
    y = (window.sum(-1) * (at + 0.5)).sum(-1) / mass
    x = (window.sum(-2) * (at + 0.5)).sum(-1) / mass
    low, size = regions[:, None, :2], regions[:, None, 2:] - regions[:, None, :2]
    return torch.cat([low + torch.stack([x, y], -1) / side * size, mass[..., None]], -1)


def regions_of(boxes: Tensor, height: int, width: int) -> Tensor:
    """Returns the regions for the dense head: boxes [K, 4] in pixels of the input, wider by REGION_MARGIN on each side,
    within the image."""
    size = boxes[:, 2:] - boxes[:, :2]
    margin = size * size.new_tensor(REGION_MARGIN)
    return bx.clip(torch.cat([boxes[:, :2] - margin, boxes[:, 2:] + margin], 1), height, width)


def _people(graphs: Graphs, features: list[Tensor], evidence: Tensor | None, proposed: Tensor, network: NetworkConfig,
            config: DecodeConfig, inner: tuple[int, int]) -> tuple[Tensor, Tensor]:  # fmt: skip
    """Box head, threshold and NMS, twice if the config asks for it: boxes [K, 4] in input pixels and scores [K], best
    first."""
    threshold = config.score_threshold
    if config.second_pass_threshold is not None:
        first_threshold = min(config.second_pass_threshold, threshold)
        proposed, _ = _box_pass(graphs, features, evidence, proposed, network, config, inner, first_threshold)
    return _box_pass(graphs, features, evidence, proposed, network, config, inner, threshold)


def _box_pass(graphs: Graphs, features: list[Tensor], evidence: Tensor | None, boxes: Tensor, network: NetworkConfig,
              config: DecodeConfig, inner: tuple[int, int], threshold: float) -> tuple[Tensor, Tensor]:  # fmt: skip
    if not len(boxes):
        return boxes, boxes.new_zeros(0)
    logits, deltas = graphs.box_head(tg.pooled(features, [boxes], network, network.box_pool))
    likely = logits[:, 0] - logits[:, 1]
    scores = (likely if evidence is None else likely + tg.mean_evidence(evidence, boxes)).sigmoid()
    boxes = bx.clip(bx.decode(deltas, boxes, network.delta_weights), *inner)
    valid = (scores > threshold) & ((boxes[:, 2:] - boxes[:, :2]) > 0).all(1)
    boxes, scores = boxes[valid], scores[valid]
    keep = nms(boxes, scores, config.box_nms_iou)[: config.max_people]
    return boxes[keep], scores[keep]


@dataclass
class Canvas:
    """The image that people are painted into. iuv: uint8 [H, W, 3]. instance: uint8 [H, W], the person from 1. odds:
    int8 [H, W], the log-odds of the painted person in eighths. painted: pixels of each person."""

    iuv: np.ndarray
    instance: np.ndarray
    odds: np.ndarray
    painted: dict[int, int]

    @classmethod
    def of_size(cls, height: int, width: int) -> Canvas:
        size = height, width
        return cls(np.zeros((*size, 3), np.uint8), np.zeros(size, np.uint8), np.zeros(size, np.int8), {})


def paint(maps: list[Tensor], box: list[float], number: int, canvas: Canvas, config: DecodeConfig) -> int:
    """Writes one person's labels into the pixels of its box; returns how many it wrote.

    maps: coarse [15, s, s], index, u, v [25, s, s]. The box becomes whole pixels (floor of its corner, size
    at least 1). A pixel is painted where the coarse classes other than background together have a probability above
    `config.mask_threshold`, with the best of the 24 parts. (The best single class against background, as DensePose
    decodes, loses pixels between parts: each part's share is small there, their sum is not.) Log-odds and logits
    are resized bilinearly with half-pixel centres.

    Where less than `config.min_visible_fraction` of the person's pixels is still empty, it writes none and returns 0.
    Otherwise a pixel of another person goes to the person with the higher log-odds there, unless the other person would
    keep less than that fraction of its pixels.
    """
    height, width = canvas.instance.shape
    x0, y0 = int(box[0]), int(box[1])
    w, h = max(int(box[2]) - x0, 1), max(int(box[3]) - y0, 1)
    x1, y1 = min(x0 + w, width), min(y0 + h, height)
    if x0 >= width or y0 >= height:
        return 0
    coarse, index, u, v = maps
    odds = coarse[1:].logsumexp(0, keepdim=True) - coarse[:1]
    resized = F.interpolate(torch.cat([odds, index[1:]])[None], (h, w), mode="bilinear", align_corners=False)[0]
    least = math.log(config.mask_threshold / (1 - config.mask_threshold))
    part = torch.where(resized[0] > least, resized[1:].argmax(0) + 1, 0)
    chart = [_sampled(m, part).clamp(0, 1).mul(255).round() for m in (u, v)]
    inside = np.s_[: y1 - y0, : x1 - x0]
    label = torch.stack([part.float(), *chart], -1).byte().numpy()[inside]
    eighths = (resized[0] * 8).nan_to_num().clamp(-127, 127).add(0.5).floor().to(torch.int8).numpy()[inside]
    window = np.s_[y0:y1, x0:x1]
    owner, body = canvas.instance[window].copy(), label[..., 0] > 0
    mine = (owner == 0) & body
    if mine.sum() < config.min_visible_fraction * body.sum():
        return 0
    for other, had in canvas.painted.items():
        lost = (owner == other) & body & (eighths > canvas.odds[window])
        if had - lost.sum() >= config.min_visible_fraction * had:
            canvas.painted[other] -= int(lost.sum())
            mine |= lost
    canvas.iuv[window][mine] = label[mine]
    canvas.instance[window][mine] = number
    canvas.odds[window][mine] = eighths[mine]
    canvas.painted[number] = int(mine.sum())
    return canvas.painted[number]


def _sampled(maps: Tensor, channel: Tensor) -> Tensor:
    """maps [C, s, s] resized bilinearly (half-pixel centres) to channel's [h, w], of each pixel only the
    channel asked for there.
    """
    side = maps.shape[-1]
    low, high, share = [], [], []
    for length in channel.shape:
        at = ((torch.arange(length) + 0.5) * (side / length) - 0.5).clamp(0, side - 1)
        low.append(at.floor().long())
        high.append((low[-1] + 1).clamp(max=side - 1))
        share.append(at - low[-1])
    (top, left), (bottom, right), (down, across) = low, high, share
    down, across = down[:, None], across[None]
    upper = maps[channel, top[:, None], left[None]] * (1 - across) + maps[channel, top[:, None], right[None]] * across
    lower = (
        maps[channel, bottom[:, None], left[None]] * (1 - across) + maps[channel, bottom[:, None], right[None]] * across
    )
    return upper * (1 - down) + lower * down
