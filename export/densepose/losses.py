"""The training loss of one batch; each term is a mean, so that batch and grid size do not matter.

The terms are those of Mobile Parsing R-CNN; the weights are chosen for short trainings from scratch.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional as F

from export import surface
from export.densepose import boxes as bx
from export.densepose import targets as tg
from export.densepose.config import NetworkConfig
from export.densepose.network import MobileParsingRCNN
from export.shards import POSSIBLE_PARTS, UNSURE

RPN_ANCHORS, BOX_ROIS, DENSE_ROIS, GRID = 256, 24, 2, 64
WEIGHTS = {
    "rpn_class": 1.0,
    "rpn_box": 1.0,
    "box_class": 1.0,
    "box_box": 1.0,
    "axis": 1.0,
    "coarse": 0.5,
    "index": 1.0,
    "u": 3.0,
    "v": 3.0,
    "keypoint": 0.3,
    "pixel_index": 1.0,
    "pixel_u": 1.5,
    "pixel_v": 1.5,
}
# Share of person pixels by part, counted on 500 training images of people-0, left and right averaged. Rare parts
# weigh more, by the square root; background (PixelHead alone is asked for it) as the most frequent part.
_SHARE = np.array([.092, .253, .0165, .0165, .010, .010, .0135, .0135, .053, .053, .0105, .0105, .015, .015,
                   .046, .046, .0245, .0245, .021, .021, .0145, .0145, .104, .104])  # fmt: skip
INDEX_WEIGHTS = torch.tensor([0.5, *np.clip(np.sqrt(0.04 / _SHARE), 0.5, 2.5)], dtype=torch.float32)

# By value of I (export.surface): the classes that it leaves possible, [256, 25] and [256, 15], and how much it weighs.
_PARTS = torch.from_numpy(POSSIBLE_PARTS)
_REGIONS = torch.stack([_PARTS[:, k == surface.PART_TO_COARSE].any(1) for k in range(surface.COARSE_COUNT + 1)], 1)
_WEIGHT = (_PARTS * INDEX_WEIGHTS).sum(1) / _PARTS.sum(1).clamp(min=1)
_WEIGHT[UNSURE] = 0


def possible_classes_loss(logits: Tensor, value: Tensor, possible: Tensor, weight: Tensor) -> Tensor:
    """-log of the probability of all classes that a label leaves possible, as a weighted mean.

    logits: [K, C]; value: [K] in 0..255; possible: bool [256, C]; weight: [256]. Where only one class is possible
    this is the cross entropy. Without any weight: 0.
    """
    possible, weight = possible.to(logits.device), weight.to(logits.device)[value]
    among = logits.gather(1, possible.byte().argmax(1)[value][:, None])[:, 0]
    # Rendered labels leave one class, so that this is short beside all the rest.
    several = (possible.sum(1) > 1)[value].nonzero()[:, 0]
    if len(several):
        masked = logits[several].masked_fill(~possible[value[several]], -torch.inf)
        among = among.index_copy(0, several, masked.logsumexp(1))
    return (weight * (logits.logsumexp(1) - among)).sum() / weight.sum().clamp(min=1e-6)


class PixelHead(nn.Conv2d):
    """Part index, U and V of every cell of P2, for training alone: [N, C, h, w] -> [N, 75, h, w].

    RoIs teach the trunk slowly from scratch, since few pixels of a batch lie in them; this asks every pixel.
    """

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__(config.width, 3 * config.index_classes, 1)

    def index(self, features: Tensor) -> Tensor:
        """Part logits [N, 25, h, w]."""
        return self(features).chunk(3, 1)[0]

    @staticmethod
    def cells(label):
        """Label [N, 4h, 4w, C] at the middle of each cell of P2: [N, h, w, C]."""
        return label[:, 2::4, 2::4]


def surface_loss(
    net: MobileParsingRCNN,
    image: Tensor,
    truths: list[tg.Truth],
    autocast: torch.autocast,
    pixel_head: PixelHead,
) -> dict[str, Tensor]:
    """`pixel_head`'s weighted terms alone: backbone and neck learn the surface without boxes and RoIs."""
    with autocast:
        output = pixel_head(net.neck(net.backbone(image))[0])
    terms = _pixel_terms(output.float(), torch.stack([t.label for t in truths]))
    return {name: WEIGHTS[name] * value for name, value in terms.items()}


def batch_loss(
    net: MobileParsingRCNN,
    image: Tensor,
    truths: list[tg.Truth],
    autocast: torch.autocast,
    pixel_head: PixelHead | None = None,
    boxes: bool = True,
) -> dict[str, Tensor]:
    """image: normalised [N, 3, H, W]. Returns the weighted terms; their sum is what is minimised.

    boxes: without them RPN, proposals and box head are left out, which cost a third of a step and need it less often.
    """
    if boxes:
        features, found, terms = _detection(net, image, truths, autocast)
    else:
        with autocast:
            features = [net.finest(image)]
        features, terms = [features[0].float()], {}
        found = [image.new_zeros(0, 4)] * len(truths)
    dense = [tg.dense_samples(f, truth, DENSE_ROIS) for f, truth in zip(found, truths, strict=True)]
    terms |= _surface_terms(net, features, dense, truths, autocast, pixel_head)
    return {name: WEIGHTS[name] * value for name, value in terms.items()}


def crop_loss(
    net: MobileParsingRCNN,
    image: Tensor,
    truths: list[tg.Truth],
    autocast: torch.autocast,
    pixel_head: PixelHead | None = None,
) -> dict[str, Tensor]:
    """The terms of the dense head on crops, each with the box of one person (`data.PersonCropping`): "crop_" and the
    term's name. Only backbone, the neck up to P2 and the dense head learn from them."""
    with autocast:
        finest = net.finest(image)
    first = torch.zeros(1, dtype=torch.long, device=image.device)
    dense = [(truth.box, first) for truth in truths]
    terms = _surface_terms(net, [finest.float()], dense, truths, autocast, pixel_head)
    return {f"crop_{name}": WEIGHTS[name] * value for name, value in terms.items()}


def _surface_terms(
    net: MobileParsingRCNN, features: list[Tensor], dense: list[tuple[Tensor, Tensor]], truths: list[tg.Truth],
    autocast: torch.autocast, pixel_head: PixelHead | None,
) -> dict[str, Tensor]:  # fmt: skip
    """dense: of each image the boxes for the dense head and the numbers of their people; features: from P2 on."""
    config, terms = net.config, {}
    if any(len(d[0]) for d in dense):
        pooled = tg.pooled(features, [d[0] for d in dense], config, config.dense_pool, level=0)
        with autocast:
            *outputs, keypoints = net.dense_head.with_keypoints(pooled)
        label = torch.cat([tg.dense_labels(*d, t, GRID) for d, t in zip(dense, truths, strict=True)])
        terms |= _dense_terms([o.float() for o in outputs], label)
        if keypoints is not None:
            terms["keypoint"] = _keypoint_loss(keypoints.float(), dense, truths)
    if pixel_head is not None:
        with autocast:
            output = pixel_head(features[0])
        terms |= _pixel_terms(output.float(), torch.stack([t.label for t in truths]))
    return terms


def _detection(
    net: MobileParsingRCNN, image: Tensor, truths: list[tg.Truth], autocast: torch.autocast
) -> tuple[list[Tensor], list[Tensor], dict[str, Tensor]]:
    """Features P2.., each image's proposals [K, 4], and the terms of RPN and box head."""
    config, size = net.config, image.shape[-2:]
    with autocast:
        features, objectness, deltas = net.detector(image)
    features = [f.float() for f in features]
    levels = [bx.flat_outputs(o.float(), d.float()) for o, d in zip(objectness, deltas, strict=True)]
    per_level = [a.to(image.device) for a in bx.anchors(config, [o.shape[-2:] for o in objectness])]
    every = torch.cat(per_level)
    logits, offsets = (torch.cat([level[k] for level in levels], 1) for k in (0, 1))
    terms = _rpn_terms(logits, offsets, every, truths)
    found = [
        tg.proposals(*([level[k][n].detach() for level in levels] for k in (0, 1)), per_level, size, 300, 100)
        for n in range(len(truths))
    ]
    rois = [tg.box_samples(f, truth, BOX_ROIS) for f, truth in zip(found, truths, strict=True)]
    pooled = tg.pooled(features, [r[0] for r in rois], config, config.box_pool)
    with autocast:
        class_logits, box_deltas, *axis = (net.box_head.with_axis if config.axis else net.box_head)(pooled)
    terms |= _box_terms(class_logits.float(), box_deltas.float(), rois, truths, config.delta_weights)
    if axis:
        terms["axis"] = _axis_loss(axis[0].float(), rois, truths)
    return features, found, terms


def _rpn_terms(logits: Tensor, offsets: Tensor, anchors: Tensor, truths: list[tg.Truth]) -> dict[str, Tensor]:
    class_loss, box_loss, count = logits.new_zeros(()), logits.new_zeros(()), 0
    for n, truth in enumerate(truths):
        positive, target, negative = tg.rpn_samples(anchors, truth, RPN_ANCHORS)
        index = torch.cat([positive, negative])
        wanted = torch.zeros(len(index), device=logits.device)
        wanted[: len(positive)] = 1
        class_loss = class_loss + F.binary_cross_entropy_with_logits(logits[n, index], wanted, reduction="sum")
        box_loss = box_loss + F.l1_loss(offsets[n, positive], bx.encode(target, anchors[positive]), reduction="sum")
        count += len(index)
    return {"rpn_class": class_loss / count, "rpn_box": box_loss / count}


def _box_terms(
    logits: Tensor, deltas: Tensor, rois: list, truths: list[tg.Truth], weights: tuple[float, ...]
) -> dict[str, Tensor]:
    boxes, person = torch.cat([r[0] for r in rois]), torch.cat([r[1] for r in rois])
    target = torch.cat([t.box[r[2]] if len(t.box) else r[0] for r, t in zip(rois, truths, strict=True)])
    class_loss = F.cross_entropy(logits, (~person).long())  # class 0 is person, 1 background
    wanted = bx.encode(target[person], boxes[person], weights)
    return {
        "box_class": class_loss,
        "box_box": F.l1_loss(deltas[person], wanted, reduction="sum") / max(len(boxes), 1),
    }


def _axis_loss(output: Tensor, rois: list, truths: list[tg.Truth]) -> Tensor:
    """output [R, 2]: the direction of the body axis; people whose axis is seen from its end weigh less."""
    person = torch.cat([r[1] for r in rois])
    wanted = torch.cat([t.axis[r[2]] if len(t.box) else r[0][:, :2] for r, t in zip(rois, truths, strict=True)])[person]
    length = wanted.norm(dim=1)
    known = length > 0  # not where it is NaN
    if not known.any():
        return output.sum() * 0
    length, unit = length[known], (wanted / length[:, None])[known]
    off = F.smooth_l1_loss(output[person][known], unit, beta=0.2, reduction="none").sum(1)
    return (length * off).sum() / length.sum()


def _dense_terms(outputs: list[Tensor], label: Tensor) -> dict[str, Tensor]:
    coarse, index, u, v = outputs
    value = label[..., 0].long()
    told = (value > 0) & (value < UNSURE)
    # Decoding takes background from `coarse` alone, so the index is asked about body pixels only, as in DensePose.
    of_body = index[:, 1:].permute(0, 2, 3, 1)[told]
    every, sure = coarse.permute(0, 2, 3, 1).flatten(0, 2), (torch.arange(256) != UNSURE).float()
    return {
        "coarse": possible_classes_loss(every, value.flatten(), _REGIONS, sure),
        "index": possible_classes_loss(of_body, value[told], _PARTS[:, 1:], _WEIGHT),
        "u": _coordinate_loss(u, value, label[..., 1]),
        "v": _coordinate_loss(v, value, label[..., 2]),
    }


def _keypoint_loss(output: Tensor, dense: list[tuple[Tensor, Tensor]], truths: list[tg.Truth]) -> Tensor:
    """output [P, 33, s, s]: the divergence of the distribution over the lattice from the target's, as a mean over known
    keypoints (Mask R-CNN, 2017, section 5, with a Gaussian instead of one cell)."""
    targets = [tg.keypoint_targets(*d, t, GRID) for d, t in zip(dense, truths, strict=True)]
    wanted, known = (torch.cat(each) for each in zip(*targets, strict=True))
    if not known.any():
        return output.sum() * 0
    log_probability = output.flatten(2).log_softmax(-1)[known]
    return F.kl_div(log_probability, wanted[known], reduction="batchmean")


def _coordinate_loss(output: Tensor, value: Tensor, wanted: Tensor) -> Tensor:
    """output [N, 25, h, w] of U or V, read in the channel of the labelled part; wanted: uint8 [N, h, w]."""
    known = (value > 0) & (value <= surface.PART_COUNT)
    if not known.any():
        return output.sum() * 0
    own = output.gather(1, torch.where(known, value, 0)[:, None])[:, 0][known]
    return F.smooth_l1_loss(own, wanted[known] / 255, beta=0.05)


def _pixel_terms(output: Tensor, label: Tensor) -> dict[str, Tensor]:
    """output [N, 75, h, w] of P2; label uint8 [N, 4h, 4w, 4], read at the middle of each cell."""
    label = PixelHead.cells(label)
    value = label[..., 0].long()
    index, u, v = output.chunk(3, 1)
    every = index.permute(0, 2, 3, 1).flatten(0, 2)
    return {
        "pixel_index": possible_classes_loss(every, value.flatten(), _PARTS, _WEIGHT),
        "pixel_u": _coordinate_loss(u, value, label[..., 1]),
        "pixel_v": _coordinate_loss(v, value, label[..., 2]),
    }
