"""Quick metrics on validation images while training; `export.evaluation` has the full ones."""

from __future__ import annotations

import copy
import math

import numpy as np
import torch
from torch import Tensor
from torchvision.ops import box_iou

from export.densepose import data
from export.densepose import targets as tg
from export.densepose.config import DecodeConfig
from export.densepose.decode import Graphs, infer
from export.densepose.losses import GRID, PixelHead
from export.densepose.network import MobileParsingRCNN
from export.shards import Record
from export.surface import LIMB_SIDE


@torch.no_grad()
def validate(net: MobileParsingRCNN, records: list[Record]) -> dict[str, float]:
    """Quick metrics on validation images: box recall and precision at IoU 0.5, part accuracy, mask IoU."""
    device = next(net.parameters()).device
    net = copy.deepcopy(net).cpu().eval() if device.type != "cpu" else net.eval()
    people = found = boxes = pixels = right = both = either = 0
    for record in records:
        image, label = record.decoded()
        result = infer(
            Graphs.of_network(net),
            np.ascontiguousarray(image[..., ::-1]),
            net.config,
            DecodeConfig(score_threshold=0.3, max_people=6),
        )
        truth = data.truth_of(label)
        wanted = truth.box[~truth.ignore]
        people += len(wanted)
        boxes += len(result.boxes)
        if len(wanted) and len(result.boxes):
            found += int((box_iou(wanted, torch.from_numpy(result.boxes)).max(1).values > 0.5).sum())
        body, seen = label[..., 0] > 0, result.iuv[..., 0] > 0
        pixels += body.sum()
        right += (body & (result.iuv[..., 0] == label[..., 0])).sum()
        both += (body & seen).sum()
        either += (body | seen).sum()
    return {
        "recall": found / max(people, 1),
        "precision": found / max(boxes, 1),
        "part": float(right / max(pixels, 1)),
        "mask_iou": float(both / max(either, 1)),
    }


@torch.no_grad()
def validate_surface(
    net: MobileParsingRCNN, pixel_head: PixelHead, records: list[Record], size: int, cropping: data.Cropping
) -> dict[str, float]:
    """Part accuracy and mask IoU of PixelHead, on crops of `size` pixels, the same at each call."""
    device = next(net.parameters()).device
    rng = np.random.default_rng(0)
    right = body = both = either = 0
    for record in records:
        image, label, *_ = data.augmented(record, size, rng, cropping)
        tensor = torch.from_numpy(data.normalised(image))[None].to(device)
        found = pixel_head.index(net.detector(tensor)[0][0])[0].argmax(0).cpu().numpy()
        part = PixelHead.cells(label[None])[0, ..., 0]
        right += (found == part)[part > 0].sum()
        body += (part > 0).sum()
        both += ((part > 0) & (found > 0)).sum()
        either += ((part > 0) | (found > 0)).sum()
    return {"pixel_part": float(right / max(body, 1)), "pixel_mask_iou": float(both / max(either, 1))}


@torch.no_grad()
def validate_crops(net: MobileParsingRCNN, records: list[Record], size: int) -> dict[str, float]:
    """Part accuracy (of all body cells; what is taken for background is wrong), mask IoU and left/right of the dense
    head's cells, on person crops: two people a record, turned upright by the true axis, true boxes."""
    device = next(net.parameters()).device
    cropping = data.PersonCropping(tilt_degrees=0, box_shake=0, coarse=0)
    rng = np.random.default_rng(0)
    right = body = both = either = sided = limb = 0
    for record in records:
        drawn = cropping.draw(record, size, rng)
        image = torch.from_numpy(np.stack([data.normalised(image) for image, _ in drawn])).to(device)
        pooled = tg.pooled(
            [net.finest(image)], [t.box.to(device) for _, t in drawn], net.config, net.config.dense_pool, 0
        )
        coarse, index, *_ = net.dense_head(pooled)
        part = dense_parts(coarse, index, DecodeConfig().mask_threshold).cpu()
        first = torch.zeros(1, dtype=torch.long)
        true = torch.cat([tg.dense_labels(t.box, first, t, GRID) for _, t in drawn])[..., 0].long()
        body += (true > 0).sum()
        right += ((part == true) & (true > 0)).sum()
        both += ((part > 0) & (true > 0)).sum()
        either += ((part > 0) | (true > 0)).sum()
        side, found = (torch.from_numpy(LIMB_SIDE)[parts] for parts in (true, part))
        limb += ((side > 0) & (found > 0)).sum()
        sided += ((side == found) & (side > 0)).sum()
    return {
        "crop_part": float(right / max(body, 1)),
        "crop_mask_iou": float(both / max(either, 1)),
        "crop_side": float(sided / max(limb, 1)),
    }


def dense_parts(coarse: Tensor, index: Tensor, mask_threshold: float) -> Tensor:
    """Part [P, s, s], 0 for background, as `export.densepose.decode.paint` decodes the dense head's maps."""
    odds = coarse[:, 1:].logsumexp(1) - coarse[:, 0]
    least = math.log(mask_threshold / (1 - mask_threshold))
    return torch.where(odds > least, index[:, 1:].argmax(1) + 1, 0)
