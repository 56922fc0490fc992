"""Training targets of the network: RPN and box head samples, dense labels on the RoI grid."""

from __future__ import annotations

from dataclasses import dataclass, fields

import torch
from torch import Tensor
from torchvision.ops import batched_nms, box_iou

from export.densepose import boxes as bx
from export.densepose.config import NetworkConfig
from export.densepose.network import PersonEvidence
from export.shards import BOX_ALONE, UNSURE


@dataclass(frozen=True)
class Truth:
    """One image's people: box [G, 4], instance number [G], ignore [G], label uint8 [H, W, 4]; NaN where nobody knows:
    axis [G, 2] (`export.shards.LabelledImage`), keypoint [G, 33, 3] (`export.shards.Record`)."""

    box: Tensor
    instance: Tensor
    ignore: Tensor
    label: Tensor
    axis: Tensor
    keypoint: Tensor

    def to(self, device: torch.device) -> Truth:
        return Truth(*(getattr(self, field.name).to(device) for field in fields(self)))


def _draw(mask: Tensor, count: int) -> Tensor:
    """At most `count` random indices where mask is true."""
    index = mask.nonzero()[:, 0]
    return index[torch.randperm(len(index), device=mask.device)[:count]]


def rpn_samples(anchors: Tensor, truth: Truth, count: int) -> tuple[Tensor, Tensor, Tensor]:
    """Anchors to learn from: (index of positives, their target boxes [P, 4], index of negatives).

    IoU >= 0.7 is positive, and so is the best anchor of each person; < 0.3 is negative. Anchors that lie on
    ignored people are left out.
    """
    if not len(truth.box):
        return (
            anchors.new_zeros(0, dtype=torch.long),
            anchors.new_zeros(0, 4),
            _draw(anchors.new_ones(len(anchors), dtype=torch.bool), count),
        )
    iou = box_iou(anchors, truth.box)
    best, match = iou.max(1)
    positive = best >= 0.7
    # The best anchor of each person counts, however poor: tall people match no anchor at 0.7.
    top = iou.max(0).values
    positive |= ((iou == top) & (top > 0.1)).any(1)
    ties = (iou == top) & (top > 0.1)
    match = torch.where(ties.any(1), ties.float().argmax(1), match)
    positive &= ~truth.ignore[match]
    near_ignored = (iou[:, truth.ignore] > 0.3).any(1)
    negative = (best < 0.3) & ~near_ignored & ~positive
    chosen = _draw(positive, count // 2)
    return chosen, truth.box[match[chosen]], _draw(negative, count - len(chosen))


@torch.no_grad()
def proposals(
    logits: list[Tensor],
    deltas: list[Tensor],
    anchors: list[Tensor],
    size: tuple[int, int],
    pre: int,
    post: int,
    iou: float = 0.7,
) -> Tensor:
    """RPN boxes of one image [K, 4]: the `pre` best of a level, NMS within each level, the `post` best."""
    found, scores, levels = [], [], []
    for k, (logit, delta, anchor) in enumerate(zip(logits, deltas, anchors, strict=True)):
        score, index = logit.topk(min(pre, len(logit)))
        found.append(bx.clip(bx.decode(delta[index], anchor[index]), *size))
        scores.append(score)
        levels.append(torch.full_like(index, k))
    box, score, level = torch.cat(found), torch.cat(scores), torch.cat(levels)
    valid = ((box[:, 2:] - box[:, :2]) > 0).all(1) & torch.isfinite(score)
    box, score, level = box[valid], score[valid], level[valid]
    return box[batched_nms(box, score, level, iou)[:post]]


def box_samples(proposed: Tensor, truth: Truth, count: int) -> tuple[Tensor, Tensor, Tensor]:
    """RoIs for the box head: (boxes [R, 4], is person [R], matched person [R]).

    A quarter is positive (IoU >= 0.5); none lies on an ignored person.
    """
    if not len(truth.box):
        return (
            proposed[:count],
            proposed.new_zeros(len(proposed[:count]), dtype=torch.bool),
            proposed.new_zeros(len(proposed[:count]), dtype=torch.long),
        )
    candidates = torch.cat([proposed, truth.box])
    best, match = box_iou(candidates, truth.box).max(1)
    positive = (best >= 0.5) & ~truth.ignore[match]
    chosen = _draw(positive, count // 4)
    other = _draw((best < 0.5), count - len(chosen))
    index = torch.cat([chosen, other])
    return candidates[index], positive[index], match[index]


def dense_samples(proposed: Tensor, truth: Truth, count: int) -> tuple[Tensor, Tensor]:
    """RoIs for the dense head: (boxes [P, 4], person [P]); shaken true boxes and proposals with IoU > 0.7."""
    wanted = (~truth.ignore & (truth.instance < BOX_ALONE)).nonzero()[:, 0]
    wanted = wanted[torch.randperm(len(wanted), device=wanted.device)[:count]]
    if not len(wanted):
        return proposed.new_zeros(0, 4), wanted
    true = truth.box[wanted]
    size = (true[:, 2:] - true[:, :2]).repeat(1, 2)
    shaken = true + size * torch.empty_like(true).uniform_(-0.06, 0.06)
    if len(proposed):
        iou, best = box_iou(true, proposed).max(1)
        use = (iou > 0.7) & (torch.rand(len(wanted), device=wanted.device) < 0.5)
        shaken = torch.where(use[:, None], proposed[best], shaken)
    return shaken, wanted


def dense_labels(boxes: Tensor, person: Tensor, truth: Truth, grid: int) -> Tensor:
    """Labels at the centres of a grid x grid lattice over each box: uint8 [P, grid, grid, 3].

    Channels are I, U*255, V*255. Other people's pixels and what lies outside the image are background; what is
    `UNSURE` stays so, whosever it may be.
    """
    height, width = truth.label.shape[:2]
    at = (torch.arange(grid, device=boxes.device) + 0.5) / grid
    x = (boxes[:, :1] + at * (boxes[:, 2:3] - boxes[:, :1])).floor().long()
    y = (boxes[:, 1:2] + at * (boxes[:, 3:] - boxes[:, 1:2])).floor().long()
    inside = ((y >= 0) & (y < height))[:, :, None] & ((x >= 0) & (x < width))[:, None]
    picked = truth.label[y.clamp(0, height - 1)[:, :, None], x.clamp(0, width - 1)[:, None]]
    own = (picked[..., 3] == truth.instance[person][:, None, None]) | (picked[..., 0] == UNSURE)
    own &= inside
    return picked[..., :3] * own[..., None]


KEYPOINT_SIGMA = 1.0  # of a keypoint's target, cells
SHOWN, HIDDEN = 0.5, 0.2  # from this probability on a keypoint is shown, below that one it is not


def keypoint_targets(boxes: Tensor, person: Tensor, truth: Truth, grid: int) -> tuple[Tensor, Tensor]:
    """Where the grid x grid lattice over each box shows the keypoints of its person: probabilities
    [P, 33, grid * grid], and which of them are known, bool [P, 33].

    A keypoint that is shown is a Gaussian around it. A keypoint outside of the box, behind another person, or hidden is
    everywhere equally likely.
    """
    keypoint = truth.keypoint[person]
    at, visible = keypoint[..., :2], keypoint[..., 2]
    known = keypoint.isfinite().all(-1)
    height, width = truth.label.shape[:2]
    x, y = (at[..., k].nan_to_num(-1).floor().long() for k in (0, 1))
    inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
    owner = truth.label[y.clamp(0, height - 1), x.clamp(0, width - 1), 3]
    others = (owner > 0) & (owner != truth.instance[person][:, None])
    size = (boxes[:, 2:] - boxes[:, :2]).clamp(min=1e-3)
    cell = (at - boxes[:, None, :2]) / size[:, None] * grid  # continuous: cell k covers [k, k + 1)
    inside &= ((cell >= 0) & (cell < grid)).all(-1)
    shown = known & inside & ~others & (visible >= SHOWN)
    hidden = known & (~inside | others | (visible < HIDDEN))
    middles = torch.arange(grid, device=boxes.device) + 0.5
    along = (-0.5 * ((middles - cell.nan_to_num(0)[..., None]) / KEYPOINT_SIGMA) ** 2).exp()  # [P, 33, 2, grid]
    spread = (along[..., 1, :, None] * along[..., 0, None, :]).flatten(-2)
    spread = spread / spread.sum(-1, keepdim=True).clamp(min=1e-12)
    return torch.where(shown[..., None], spread, 1 / grid**2), shown | hidden


def pooled(
    features: list[Tensor], boxes: list[Tensor], config: NetworkConfig, pool: int, level: int | None = None
) -> Tensor:
    """RoIAlign (aligned, adaptive sampling) of each image's boxes: [sum of R, C, pool, pool].

    `level` 0 reads everything from P2 (dense head); None picks P2..P5 by box size.
    """
    pieces, order, before = [features[0].new_zeros(0, features[0].shape[1], pool, pool)], [], 0
    images = [f.unbind() for f in features]  # at once: the gradient of features[k][n] is a whole batch's, mostly zeros
    for n, box in enumerate(boxes):
        which = bx.levels_of(box, config) if level is None else torch.full_like(box[:, 0], level)
        for k in range(len(config.tap_strides)):
            own = (which == k).nonzero()[:, 0]
            if len(own):
                pieces.append(align_rois(images[k][n], box[own].to(features[k]) / config.tap_strides[k], pool))
                order.append(before + own)
        before += len(box)
    return torch.cat(pieces)[torch.cat(order).argsort()] if order else pieces[0]


def mean_evidence(evidence: Tensor, boxes: Tensor) -> Tensor:
    """Means of one image's person-logit map (`PersonEvidence`, [1, 1, h, w]) over each box, [R]."""
    return align_rois(evidence[0], boxes / PersonEvidence.STRIDE, 1).flatten()


def align_rois(features: Tensor, boxes: Tensor, pool: int) -> Tensor:
    """RoIAlign of one image by two matrix products; equals torchvision's roi_align (aligned, sampling_ratio 0).

    features: [C, h, w]; boxes: [R, 4] in cells. Returns [R, C, pool, pool]. A mean of bilinear samples on a
    lattice is linear along each axis apart; torchvision takes two to eight times as long backwards, where it
    scatters sample by sample.
    """
    (rois, (channels, height, width)) = (len(boxes), features.shape)
    start, length = boxes[:, :2] - 0.5, boxes[:, 2:] - boxes[:, :2]
    along_x = _lattice_weights(start[:, 0], length[:, 0], pool, width).view(rois * pool, width)
    along_y = _lattice_weights(start[:, 1], length[:, 1], pool, height)
    narrow = features.transpose(0, 1).reshape(height * channels, width) @ along_x.T
    rows = narrow.view(height, channels, rois, pool).permute(2, 0, 1, 3).reshape(rois, height, channels * pool)
    return torch.bmm(along_y, rows).view(rois, pool, channels, pool).transpose(1, 2)


@torch.no_grad()
def _lattice_weights(start: Tensor, length: Tensor, pool: int, cells: int) -> Tensor:
    """[R, pool, cells]: how much each cell counts in each bin's mean, along one axis."""
    count = (length / pool).ceil().clamp(min=1)[:, None, None]  # samples of a bin
    k = torch.arange(int(count.max()) if len(count) else 1, device=start.device)
    bins = torch.arange(pool, device=start.device)[:, None]
    at = start[:, None, None] + (bins + (k + 0.5) / count) * (length / pool)[:, None, None]
    share = ((k < count) & (at >= -1) & (at <= cells)) / count
    at = at.clamp(0, cells - 1)
    low = at.floor().long()
    weights = start.new_zeros(len(start), pool, cells)
    weights.scatter_add_(2, low, share * (1 - (at - low)))
    weights.scatter_add_(2, (low + 1).clamp(max=cells - 1), share * (at - low))
    return weights
