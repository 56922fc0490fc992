"""Mobile Parsing R-CNN: a MobileNet, BiFPN, RPN, box head without FC layers, dense head with ASPP."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable

import torch
from torch import Tensor, nn
from torch.nn import functional as F
from torchvision.models import mobilenet_v3_large

from export.densepose.config import NetworkConfig


class _DepthwiseStride2(torch.autograd.Function):
    """Depthwise 3x3 of stride 2 and padding 1, [N, C, H, W] and [C, 1, 3, 3] -> [N, C, ceil(H/2), ceil(W/2)].

    The gradient of the input is a convolution of stride 1 over the gradient with zeros between. What oneDNN takes for
    it in bfloat16 goes through the groups one by one, ten times as long, and so decides the time of a whole step.
    """

    @staticmethod
    def forward(ctx: torch.autograd.function.FunctionCtx, x: Tensor, weight: Tensor, bias: Tensor | None) -> Tensor:
        ctx.save_for_backward(x, weight)
        ctx.biased = bias is not None
        return F.conv2d(x, weight, bias, 2, 1, groups=len(weight))

    @staticmethod
    def backward(ctx: torch.autograd.function.FunctionCtx, gradient: Tensor) -> tuple[Tensor, Tensor, Tensor | None]:
        x, weight = ctx.saved_tensors
        channels = len(weight)
        spread = torch.zeros_like(x)
        spread[:, :, ::2, ::2] = gradient
        of_input = F.conv2d(spread, weight.flip(2, 3), None, 1, 1, groups=channels)
        _, of_weight, of_bias = torch.ops.aten.convolution_backward(
            gradient, x, weight, [channels], [2, 2], [1, 1], [1, 1], False, [0, 0], channels, [False, True, ctx.biased]
        )
        return of_input, of_weight, of_bias


def _depthwise(x: Tensor, weight: Tensor, bias: Tensor | None, stride: int) -> Tensor:
    """Depthwise 3x3 with padding 1."""
    if stride == 2 and x.device.type == "cpu" and torch.is_autocast_enabled("cpu") and torch.is_grad_enabled():
        kind = torch.get_autocast_dtype("cpu")
        return _DepthwiseStride2.apply(x.to(kind), weight.to(kind), None if bias is None else bias.to(kind))
    return F.conv2d(x, weight, bias, stride, 1, groups=len(weight))


class DepthwiseConv(nn.Conv2d):
    """Depthwise 3x3 with padding 1, without bias."""

    def __init__(self, channels: int, stride: int = 1) -> None:
        super().__init__(channels, channels, 3, stride, 1, groups=channels, bias=False)

    def forward(self, x: Tensor) -> Tensor:
        return _depthwise(x, self.weight, None, self.stride[0])


class ConvBn(nn.Sequential):
    """Convolution, BN and, if asked, ReLU6.

    Where BN stands still (`MobileNetV2.freeze`), it is folded into the convolution before it is applied, which
    saves two passes over the largest maps while training.
    """

    def __init__(
        self, inputs: int, outputs: int, kernel: int, stride: int = 1, groups: int = 1, activation: bool = True
    ) -> None:
        conv = nn.Conv2d(inputs, outputs, kernel, stride, kernel // 2, groups=groups, bias=False)
        super().__init__(OrderedDict(conv=conv, bn=nn.BatchNorm2d(outputs, eps=1e-3)))
        self.activation = activation

    def forward(self, x: Tensor) -> Tensor:
        conv, bn = self.conv, self.bn
        if bn.training or not self.training:  # an exporter folds by itself
            x = bn(conv(x))
        else:
            scale = bn.weight * (bn.running_var + bn.eps).rsqrt()
            weight, bias = conv.weight * scale[:, None, None, None], bn.bias - bn.running_mean * scale
            if conv.groups > 1:
                x = _depthwise(x, weight, bias, conv.stride[0])
            else:
                x = F.conv2d(x, weight, bias, conv.stride, conv.padding)
        return F.relu6(x, inplace=True) if self.activation else x


class InvertedResidual(nn.Module):
    """1x1 to `expansion` times the channels, depthwise 3x3, 1x1 back; added to the input where shapes agree."""

    def __init__(self, inputs: int, outputs: int, stride: int, expansion: int) -> None:
        super().__init__()
        hidden = inputs * expansion
        self.expand = ConvBn(inputs, hidden, 1) if expansion > 1 else nn.Identity()
        self.depthwise = ConvBn(hidden, hidden, 3, stride, groups=hidden)
        self.project = ConvBn(hidden, outputs, 1, activation=False)
        self.residual = stride == 1 and inputs == outputs

    def forward(self, x: Tensor) -> Tensor:
        y = self.project(self.depthwise(self.expand(x)))
        return x + y if self.residual else y


class MobileNetV3Large(nn.Module):
    """MobileNetV3-Large up to its last bottleneck: 24, 40, 112, 160 channels at strides 4, 8, 16, 32.

    The 1x1 expansion to 960 channels of the classifier is left out: nothing reads it.
    """

    _TAPS = (3, 6, 12, 15)  # indices of the last block of each resolution

    def __init__(self) -> None:
        super().__init__()
        self.blocks = mobilenet_v3_large(weights=None).features[:16]

    def forward(self, image: Tensor) -> list[Tensor]:
        taps, x = [], image
        for k, block in enumerate(self.blocks):
            x = block(x)
            if k in self._TAPS:
                taps.append(x)
        return taps


class MobileNetV2(nn.Module):
    """MobileNetV2 (width 1.0) up to its last 160-channel block ("MobileNetV2: Inverted Residuals and Linear
    Bottlenecks", 2018, table 2; the 320-channel block and the classifier are left out).

    [N, 3, H, W] -> features at strides 4, 8, 16, 32 with 24, 32, 96, 160 channels.
    """

    # expansion, channels, blocks, stride of the first
    _STAGES = ((1, 16, 1, 1), (6, 24, 2, 2), (6, 32, 3, 2), (6, 64, 4, 2), (6, 96, 3, 1), (6, 160, 3, 2))
    _TAPS = (2, 5, 12, 15)  # indices of the last block of each resolution
    _FROZEN_BLOCKS = 2  # stem and these keep their weights when frozen, as in the paper

    def __init__(self) -> None:
        super().__init__()
        self.stem = ConvBn(3, 32, 3, 2)
        self.blocks, inputs = nn.ModuleList(), 32
        for expansion, outputs, count, stride in self._STAGES:
            for k in range(count):
                self.blocks.append(InvertedResidual(inputs, outputs, stride if k == 0 else 1, expansion))
                inputs = outputs
        self.frozen = False
        for module in self.modules():
            if isinstance(module, nn.Conv2d):
                nn.init.kaiming_normal_(module.weight, mode="fan_out")

    def freeze(self) -> None:
        """From now on BN stands still in training too, and stem and first blocks keep their weights.

        For pretrained weights: batches are too small for BN, and what the first layers see is no different.
        """
        self.frozen = True
        for module in (self.stem, *self.blocks[: self._FROZEN_BLOCKS]):
            module.requires_grad_(False)
        self.train(self.training)

    def train(self, mode: bool = True) -> MobileNetV2:
        super().train(mode)
        if self.frozen:
            for module in self.modules():
                if isinstance(module, nn.BatchNorm2d):
                    module.eval()
        return self

    def forward(self, image: Tensor) -> list[Tensor]:
        taps, x = [], self.stem(image)
        for k, block in enumerate(self.blocks):
            x = block(x)
            if k in self._TAPS:
                taps.append(x)
        return taps


_BACKBONES = {"mobilenet_v2": MobileNetV2, "mobilenet_v3_large": MobileNetV3Large}


class SeparableConv(nn.Sequential):
    """Depthwise 3x3, pointwise 1x1, BN, ReLU; stride 2 halves the size."""

    def __init__(self, width: int, stride: int = 1) -> None:
        super().__init__(
            DepthwiseConv(width, stride),
            nn.Conv2d(width, width, 1, bias=False),
            nn.BatchNorm2d(width, momentum=0.03),
            nn.ReLU(inplace=True),
        )


class Fusion(nn.Module):
    """Weighted mean of maps with learnt non-negative weights (fast normalised fusion)."""

    def __init__(self, inputs: int) -> None:
        super().__init__()
        self.weight = nn.Parameter(torch.ones(inputs))

    def forward(self, *maps: Tensor) -> Tensor:
        weight = F.relu(self.weight)
        weight = weight / (weight.sum() + 1e-4)
        return sum(weight[k] * x for k, x in enumerate(maps))


def _up(x: Tensor, like: Tensor) -> Tensor:
    """x as large as `like`, which is twice as large."""
    return F.interpolate(x, size=like.shape[2:], mode="nearest")


class BiFPN(nn.Module):
    """One bidirectional pass over four levels. Returns P2..P6, all `width` channels, strides 4..64.

    up: makes a map twice as large, as large as a second one; exported graphs do it another way.
    """

    up: Callable[[Tensor, Tensor], Tensor] = staticmethod(_up)

    def __init__(self, tap_channels: tuple[int, ...], width: int) -> None:
        super().__init__()
        self.lateral = nn.ModuleList(nn.Conv2d(c, width, 1) for c in tap_channels)
        self.fuse = nn.ModuleDict(
            {n: Fusion(3 if n in ("o3", "o4") else 2) for n in ("t4", "t3", "o2", "o3", "o4", "o5")}
        )
        self.conv = nn.ModuleDict({n: SeparableConv(width) for n in ("t4", "t3", "o2", "o3", "o4", "o5")})
        self.down = nn.ModuleDict({n: SeparableConv(width, stride=2) for n in ("o3", "o4", "o5")})

    def _node(self, name: str, *maps: Tensor) -> Tensor:
        return self.conv[name](self.fuse[name](*maps))

    def _top_down(self, taps: list[Tensor]) -> tuple[Tensor, ...]:
        p2, p3, p4, p5 = (conv(x) for conv, x in zip(self.lateral, taps, strict=True))
        t4 = self._node("t4", p4, self.up(p5, p4))
        t3 = self._node("t3", p3, self.up(t4, p3))
        return self._node("o2", p2, self.up(t3, p2)), p3, p4, p5, t3, t4

    def finest(self, taps: list[Tensor]) -> Tensor:
        """P2 alone, which needs no coarser output."""
        return self._top_down(taps)[0]

    def coarser_parameters(self) -> list[nn.Parameter]:
        """Modules that P2 does not depend on."""
        names = ("o3", "o4", "o5")
        return [p for n in names for part in (self.fuse, self.conv, self.down) for p in part[n].parameters()]

    def forward(self, taps: list[Tensor]) -> list[Tensor]:
        o2, p3, p4, p5, t3, t4 = self._top_down(taps)
        o3 = self._node("o3", p3, t3, self.down["o3"](o2))
        o4 = self._node("o4", p4, t4, self.down["o4"](o3))
        o5 = self._node("o5", p5, self.down["o5"](o4))
        return [o2, o3, o4, o5, F.max_pool2d(o5, 1, 2)]


class PersonEvidence(nn.Module):
    """How much each cell of the backbone's maps of strides 16 and 32 speaks for a person: [N, 1, h / 16, w / 16].

    Its mean over a box is added to the box head's logit of a person. These maps, which began as a detector of 80 kinds
    of things, tell people from animals; the neck forgets it.
    up: as in `BiFPN`.
    """

    STRIDE = 16
    up: Callable[[Tensor, Tensor], Tensor] = staticmethod(_up)

    def __init__(self, tap_channels: tuple[int, ...], channels: int) -> None:
        super().__init__()
        self.fine = nn.Conv2d(tap_channels[2], channels, 1)
        self.coarse = nn.Conv2d(tap_channels[3], channels, 1, bias=False)
        self.out = nn.Conv2d(channels, 1, 1)
        nn.init.zeros_(self.out.weight)
        nn.init.zeros_(self.out.bias)

    def forward(self, fine: Tensor, coarse: Tensor) -> Tensor:
        seen = self.fine(fine)
        return self.out(F.relu(seen + self.up(self.coarse(coarse), seen)))


class RpnHead(nn.Module):
    """Shared over levels: objectness logits [N, A, h, w] and box deltas [N, 4A, h, w], anchor-major."""

    def __init__(self, width: int, anchors: int) -> None:
        super().__init__()
        self.conv = nn.Conv2d(width, width, 3, padding=1)
        self.objectness = nn.Conv2d(width, anchors, 1)
        self.deltas = nn.Conv2d(width, anchors * 4, 1)
        for layer in (self.conv, self.objectness, self.deltas):
            nn.init.normal_(layer.weight, std=0.01)
            nn.init.zeros_(layer.bias)

    def forward(self, features: list[Tensor]) -> tuple[list[Tensor], list[Tensor]]:
        hidden = [F.relu(self.conv(x)) for x in features]
        return [self.objectness(x) for x in hidden], [self.deltas(x) for x in hidden]


class BoxHead(nn.Module):
    """[R, C, 7, 7] -> class logits [R, 2] (person, background) and box deltas [R, 4].

    axis: whether `with_axis` is there, which also gives the direction from hips to head in the image, [R, 2]: (1, 0)
    is to the right, (0, 1) down; near (0, 0) where it cannot be told.
    """

    def __init__(self, width: int, pool: int, axis: bool = False) -> None:
        super().__init__()
        self.convs = nn.Sequential(
            nn.Conv2d(width, width, 3, padding=1), nn.ReLU(inplace=True),
            nn.Conv2d(width, width, 3, padding=1), nn.ReLU(inplace=True),
        )  # fmt: skip
        self.logits = nn.Linear(width * pool * pool, 2)
        self.deltas = nn.Linear(width * pool * pool, 4)
        nn.init.normal_(self.logits.weight, std=0.01)
        nn.init.normal_(self.deltas.weight, std=0.001)
        nn.init.zeros_(self.logits.bias)
        nn.init.zeros_(self.deltas.bias)
        if axis:
            self.axis = nn.Linear(width * pool * pool, 2)
            nn.init.normal_(self.axis.weight, std=0.001)
            nn.init.zeros_(self.axis.bias)

    def forward(self, rois: Tensor) -> tuple[Tensor, Tensor]:
        flat = self.convs(rois).flatten(1)
        return self.logits(flat), self.deltas(flat)

    def with_axis(self, rois: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        flat = self.convs(rois).flatten(1)
        return self.logits(flat), self.deltas(flat), self.axis(flat)


class ConvBnRelu(nn.Sequential):
    """Convolution without bias, BN (folded into it at export), ReLU."""

    def __init__(self, inputs: int, outputs: int, kernel: int, dilation: int = 1) -> None:
        super().__init__(
            nn.Conv2d(inputs, outputs, kernel, padding=dilation * (kernel // 2), dilation=dilation, bias=False),
            nn.BatchNorm2d(outputs, momentum=0.03),
            nn.ReLU(inplace=True),
        )


class Aspp(nn.Module):
    """Five branches (1x1, three dilated 3x3, global mean) and their 1x1 mixture.

    The mean's branch has one value a channel and RoI, too few for BN.
    """

    def __init__(self, width: int, dilations: tuple[int, ...]) -> None:
        super().__init__()
        self.branches = nn.ModuleList([ConvBnRelu(width, width, 1)])
        self.branches.extend(ConvBnRelu(width, width, 3, d) for d in dilations)
        self.context = nn.Conv2d(width, width, 1)
        self.mix = ConvBnRelu(width * (len(self.branches) + 1), width, 1)

    def forward(self, x: Tensor) -> Tensor:
        maps = [branch(x) for branch in self.branches]
        context = F.relu(self.context(x.mean((2, 3), keepdim=True)))
        return self.mix(torch.cat([*maps, context.expand_as(maps[0])], 1))


class DenseHead(nn.Module):
    """[P, C, 32, 32] -> coarse [P, 15, 64, 64], index, u and v [P, 25, 64, 64]; all raw logits or values.

    With `config.keypoints` also the logits of where each keypoint of the person is, [P, 33, 64, 64]: their softmax over
    the lattice is its distribution, which is flat for what the box does not show.
    """

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        width = config.width
        self.aspp = Aspp(width, config.aspp_dilations)
        self.body = nn.Sequential(*(ConvBnRelu(width, width, 3) for _ in range(4)))
        sizes = {
            "coarse": config.coarse_classes,
            "index": config.index_classes,
            "u": config.index_classes,
            "v": config.index_classes,
        }
        if config.keypoints:
            sizes["keypoints"] = config.keypoints
        self.out = nn.ModuleDict({name: nn.ConvTranspose2d(width, n, 4, 2, 1) for name, n in sizes.items()})
        for module in self.modules():
            if isinstance(module, nn.Conv2d | nn.ConvTranspose2d):
                nn.init.kaiming_normal_(module.weight, mode="fan_out", nonlinearity="relu")
                if module.bias is not None:
                    nn.init.zeros_(module.bias)

    def surface(self, rois: Tensor) -> Tensor:
        """Input of the four predictors, [P, C, 32, 32]."""
        return self.body(self.aspp(rois))

    def forward(self, rois: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        return self.with_keypoints(rois)[:4]

    def with_keypoints(self, rois: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor, Tensor | None]:
        x = self.surface(rois)
        surface = (self.out["coarse"](x), self.out["index"](x), self.out["u"](x), self.out["v"](x))
        return (*surface, self.out["keypoints"](x) if "keypoints" in self.out else None)


class MobileParsingRCNN(nn.Module):
    """The whole network; `detector` alone is what runs once an image, the heads run on RoI features."""

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        self.config = config
        self.backbone = _BACKBONES[config.backbone]()
        self.neck = BiFPN(config.tap_channels, config.width)
        self.rpn = RpnHead(config.width, len(config.aspect_ratios))
        self.box_head = BoxHead(config.width, config.box_pool, config.axis)
        self.dense_head = DenseHead(config)
        self.evidence = PersonEvidence(config.tap_channels, config.evidence) if config.evidence else None

    def detector(self, image: Tensor) -> tuple[list[Tensor], list[Tensor], list[Tensor]]:
        """Normalised image [N, 3, H, W], H and W multiples of 32 -> P2..P6, objectness, deltas (5 levels)."""
        features = self.neck(self.backbone(image))
        return (features, *self.rpn(features))

    def trunk(self, image: Tensor) -> tuple[list[Tensor], Tensor | None]:
        """P2..P6, and the evidence of people where the network has it."""
        taps = self.backbone(image)
        return self.neck(taps), None if self.evidence is None else self.evidence(*taps[2:])

    def finest(self, image: Tensor) -> Tensor:
        """P2 [N, C, H / 4, W / 4] alone: what the dense head needs."""
        return self.neck.finest(self.backbone(image))

    def box_parameters(self) -> list[nn.Parameter]:
        """Modules that only box detection uses."""
        return [*self.neck.coarser_parameters(), *self.rpn.parameters(), *self.box_head.parameters()]
