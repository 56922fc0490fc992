"""Exports trained weights as a fp32 model bundle, and compares the graphs with the torch network.

    python -m export.densepose.export_onnx --checkpoint RUN/checkpoint.pt --out .data/bundles/densepose-b-fp32
    python -m export.densepose.export_onnx --checkpoint RUN/checkpoint.pt --crops CROPS/weights.pt \
        --out .data/bundles/densepose-full-fp32
    python -m export.densepose.export_onnx --random --out .data/bundles/random-fp32

The graphs compute the same as the network, written more simply (export.densepose.simplified). Sizes of images and the
number of people stay open.

`--crops` adds networks for the crop pass alone (`--recipe crops` of export.densepose.train): a trunk up to P2 and a
dense head.
"""

from __future__ import annotations

import argparse
import copy
import functools
import shutil
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional as F

from export import data_sources
from export.bundle import BundleInfo, bytes_of
from export.densepose import bundle
from export.densepose import targets as tg
from export.densepose.config import DecodeConfig, NetworkConfig
from export.densepose.decode import Graphs, detect
from export.densepose.graphs import chart_maps, read_charts, session
from export.densepose.network import DenseHead, MobileParsingRCNN
from export.densepose.simplified import simplified
from export.onnx_graphs import channels_first, channels_last, joined, write_graph
from export.shards import load_records

TOLERANCE = 1e-4  # largest |ONNX - torch|, relative to the tensor's largest value


class Trunk(nn.Module):
    """Backbone and neck: image -> P2..P6, and the evidence of people where the network has it."""

    def __init__(self, net: MobileParsingRCNN) -> None:
        super().__init__()
        self.backbone, self.neck, self.evidence = net.backbone, net.neck, net.evidence

    def forward(self, image: Tensor) -> tuple[Tensor, ...]:
        # As MobileParsingRCNN.trunk; but parameters keep the names that the quantization settings know.
        taps = self.backbone(image)
        evidence = [] if self.evidence is None else [self.evidence(*taps[2:])]
        return tuple(channels_last(x) for x in (*self.neck(taps), *evidence))


class CropTrunk(nn.Module):
    """Backbone and neck: a person crop -> P2."""

    def __init__(self, net: MobileParsingRCNN) -> None:
        super().__init__()
        self.backbone, self.neck = net.backbone, net.neck

    def forward(self, image: Tensor) -> Tensor:
        return channels_last(self.neck.finest(self.backbone(image)))


class Rpn(nn.Module):
    """The RPN on some levels, objectness and deltas by one convolution. The finest level, which is as expensive as all
    the others and more, has a graph of its own, so that it can be left out where no person is small."""

    def __init__(self, net: MobileParsingRCNN) -> None:
        super().__init__()
        self.conv = net.rpn.conv
        # A matrix product needs no other layout than the output's.
        self.predict = joined(net.rpn.objectness, net.rpn.deltas)

    def forward(self, *features: Tensor) -> tuple[Tensor, ...]:
        return tuple(self.predict(channels_last(F.relu(self.conv(channels_first(x))))) for x in features)


class BoxHeadGraph(nn.Module):
    """The box head, logits and deltas by one matrix, whose rows are in channels-last order."""

    def __init__(self, net: MobileParsingRCNN) -> None:
        super().__init__()
        self.convs = net.box_head.convs
        self.predict = joined(net.box_head.logits, net.box_head.deltas)
        width, pool = net.config.width, net.config.box_pool
        weight = self.predict.weight.data.unflatten(1, (width, pool, pool))
        self.predict.weight.data = weight.permute(0, 2, 3, 1).flatten(1).contiguous()

    def forward(self, rois: Tensor) -> Tensor:
        return self.predict(self.convs(channels_first(rois)).permute(0, 2, 3, 1).flatten(1))


class PhasePredictor(nn.Module):
    """Predictors over one map. The transposed convolutions (kernel 4, stride 2, padding 1) are written as one plain
    convolution of kernel 2 for each phase of the output, which int8 kernels exist for, with the same multiply-adds.
    """

    def __init__(self, layers: list[nn.ConvTranspose2d]) -> None:
        super().__init__()
        weight = torch.cat([layer.weight.detach() for layer in layers], 1)
        self.bias = nn.Parameter(torch.cat([layer.bias.detach() for layer in layers]))
        self.phases = nn.ParameterList([phase_weights(weight, *divmod(k, 2)) for k in range(4)])

    def predicted(self, x: Tensor) -> Tensor:
        """[P, C, h, w] -> [P, 4 x outputs, h, w], a phase after the other."""
        conv = PhaseConv.apply if torch.onnx.is_in_onnx_export() else functools.partial(PhaseConv.forward, None)
        return torch.cat([conv(x, weight, self.bias, *divmod(k, 2)) for k, weight in enumerate(self.phases)], 1)


class DenseHeadGraph(PhasePredictor):
    """The dense head without U and V: these need few pixels of few parts, and are computed where they are needed
    from `surface` and the chart weights."""

    def __init__(self, net: MobileParsingRCNN) -> None:
        super().__init__([net.dense_head.out[name] for name in ("coarse", "index")])
        self.head = net.dense_head

    def forward(self, rois: Tensor) -> tuple[Tensor, Tensor]:
        surface = self.head.surface(channels_first(rois))
        return channels_last(self.predicted(surface)), channels_last(surface)


class KeypointGraph(PhasePredictor):
    """Logits of the keypoints from the dense head's `surface`: a graph of its own, for those who ask for them."""

    def __init__(self, net: MobileParsingRCNN) -> None:
        super().__init__([net.dense_head.out["keypoints"]])

    def forward(self, surface: Tensor) -> Tensor:
        return channels_last(self.predicted(channels_first(surface)))


class PhaseConv(torch.autograd.Function):
    """A convolution of kernel 2 with a line of zeros above (row 0) or below (row 1), and left or right (column)."""

    @staticmethod
    def forward(ctx: object, x: Tensor, weight: Tensor, bias: Tensor, row: int, column: int) -> Tensor:
        return F.conv2d(F.pad(x, (1 - column, column, 1 - row, row)), weight, bias)

    @staticmethod
    def symbolic(g: object, x: object, weight: object, bias: object, row: int, column: int) -> object:
        pads = [1 - row, 1 - column, row, column]  # top, left, bottom, right
        return g.op("Conv", x, weight, bias, kernel_shape_i=[2, 2], pads_i=pads)


# For output row 2y + phase a transposed convolution of kernel 4, stride 2, padding 1 reads these kernel rows, of input
# rows y - 1 and y (phase 0), or y and y + 1 (phase 1); the same holds for columns.
_TAPS = ((3, 1), (2, 0))


def phase_weights(weight: Tensor, row: int, column: int) -> Tensor:
    """The weights [out, in, 2, 2] of one output phase of a transposed convolution of kernel 4, stride 2, padding 1.

    weight: [in, out, 4, 4].
    """
    return weight[:, :, _TAPS[row]][..., _TAPS[column]].transpose(0, 1).contiguous()


def chart_weights(net: MobileParsingRCNN) -> np.ndarray:
    """U's and V's transposed convolutions, float32: weight [2, parts, 4, 4, C], then bias [2, parts]; no background."""
    layers = [net.dense_head.out[name] for name in ("u", "v")]
    weight = torch.stack([layer.weight.detach()[:, 1:].permute(1, 2, 3, 0) for layer in layers])
    bias = torch.stack([layer.bias.detach()[1:] for layer in layers])
    return torch.cat([weight.flatten(), bias.flatten()]).float().cpu().numpy()


def graph_modules(net: MobileParsingRCNN, crop_net: MobileParsingRCNN | None = None) -> dict[str, nn.Module]:
    """The parts that become graphs. crop_net: the network of the crop pass, where it has one of its own."""
    rpn = Rpn(net)
    modules = {
        "trunk": Trunk(net),
        "rpn_fine": rpn,
        "rpn_coarse": rpn,
        "box_head": BoxHeadGraph(net),
        "dense_head": DenseHeadGraph(net),
    }
    if net.config.keypoints:
        modules[bundle.KEYPOINTS] = KeypointGraph(net)
    if crop_net is not None:
        modules |= {"crop_trunk": CropTrunk(crop_net), "crop_dense_head": DenseHeadGraph(crop_net)}
    return modules


def export_graphs(net: MobileParsingRCNN, folder: Path, crop_net: MobileParsingRCNN | None = None) -> None:
    """Writes the graphs of `bundle.GRAPHS` (opset 17, batch normalisation folded), of keypoints where the network has
    them, and the chart weights; with the network of the crop pass those of `bundle.CROP_GRAPHS` and its chart weights.
    """
    folder.mkdir(parents=True, exist_ok=True)
    simple = simplified(net)
    chart_weights(simple).astype("<f4").tofile(folder / bundle.CHARTS)
    simple_crop_net = None
    if crop_net is not None:
        simple_crop_net = simplified(crop_net)
        chart_weights(simple_crop_net).astype("<f4").tofile(folder / bundle.CROP_CHARTS)
    modules = graph_modules(simple, simple_crop_net)
    # Odd sizes, so that no size of the example can be mistaken for a constant.
    example = {"height": 96, "width": 160, "people": 3, "height6": 2, "width6": 3}
    example |= {f"{side}/{2**k}": example[side] // 2**k for k in range(2, 6) for side in ("height", "width")}
    for name, tensors in bundle.signatures(net.config, crop_net is not None).items():
        given = [torch.randn([example.get(size, size) for size in shape]) for shape in tensors["inputs"].values()]
        axes = {
            tensor: {axis: size for axis, size in enumerate(sizes) if isinstance(size, str)}
            for side in tensors.values()
            for tensor, sizes in side.items()
        }
        write_graph(modules[name], given, folder / f"{name}.onnx", tensors["inputs"], tensors["outputs"], axes)


def tuple_of(outputs: Tensor | tuple[Tensor, ...]) -> tuple[Tensor, ...]:
    return outputs if isinstance(outputs, tuple) else (outputs,)


@torch.no_grad()
def parity(
    net: MobileParsingRCNN, folder: Path, images: list[np.ndarray], crop_net: MobileParsingRCNN | None = None
) -> dict[str, float]:
    """Largest |ONNX - torch| of each output over the images, relative to the output's largest value.

    images: RGB uint8 [H, W, 3]. Every graph gets the torch network's own features; the heads those of its proposals.
    `dense_head.u` and `.v` are what chart weights and `surface` give. The crop pass gets the images, too.
    """
    net, crop_net = (copy.deepcopy(x).cpu().eval() if x is not None else None for x in (net, crop_net))
    modules = graph_modules(net, crop_net)
    names = {name: list(s["outputs"]) for name, s in bundle.signatures(net.config, crop_net is not None).items()}
    sessions = {name: session(folder / f"{name}.onnx") for name in names}
    worst: dict[str, float] = {}

    def note(name: str, expected: Tensor, actual: Tensor) -> None:
        scale = max(float(expected.abs().max()), 1e-9)
        worst[name] = max(worst.get(name, 0.0), float((expected - actual).abs().max()) / scale)

    def compare(graph: str, *given: Tensor) -> list[Tensor]:
        feed = {x.name: tensor.numpy() for x, tensor in zip(sessions[graph].get_inputs(), given, strict=True)}
        found = [torch.from_numpy(x) for x in sessions[graph].run(names[graph], feed)]
        for name, expected, actual in zip(names[graph], tuple_of(modules[graph](*given)), found, strict=True):
            note(f"{graph}.{name}", expected, actual)
        return found

    def compare_dense_head(graph: str, head: DenseHead, rois: Tensor, charts: str) -> None:
        *_, surface = compare(graph, channels_last(rois))
        if graph == "dense_head" and net.config.keypoints:
            compare(bundle.KEYPOINTS, surface)
        found = chart_maps(surface, *read_charts(folder / charts, net.config.index_classes - 1))
        for name, maps, actual in zip("uv", head(rois)[2:], found, strict=True):
            note(f"{graph}.{name}", maps[:, 1:], actual[:, 1:])

    for image in images:
        found = detect(Graphs.of_network(net), image, net.config, DecodeConfig())
        compare("trunk", found.tensor)
        compare("rpn_fine", channels_last(found.features[0]))
        compare("rpn_coarse", *(channels_last(x) for x in found.features[1:]))
        rois = tg.pooled(found.features, [found.proposed], net.config, net.config.box_pool)
        compare("box_head", channels_last(rois))
        boxes, pool = [found.proposed[:4]], net.config.dense_pool
        rois = tg.pooled(found.features, boxes, net.config, pool, level=0)
        compare_dense_head("dense_head", net.dense_head, rois, bundle.CHARTS)
        if crop_net is not None:
            compare("crop_trunk", found.tensor)
            rois = tg.pooled([crop_net.finest(found.tensor)], boxes, net.config, pool, level=0)
            compare_dense_head("crop_dense_head", crop_net.dense_head, rois, bundle.CROP_CHARTS)
    return worst


def load_network(checkpoint: Path) -> MobileParsingRCNN:
    """The averaged weights of a training checkpoint."""
    saved = torch.load(checkpoint, map_location="cpu", weights_only=False)
    net = MobileParsingRCNN(NetworkConfig.of(saved))
    net.load_state_dict(saved["ema"])
    return net.eval()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument("--checkpoint", type=Path, help="checkpoint.pt of export.densepose.train")
    source.add_argument("--random", action="store_true", help="untrained weights, to try the runtime with")
    parser.add_argument("--crops", type=Path, metavar="FILE", help="weights of networks for the crop pass alone")
    parser.add_argument(
        "--credits", type=Path, metavar="FILE",
        help="credits.tsv of a pack of photographs that the weights were trained on (export.photos pack)",
    )  # fmt: skip
    parser.add_argument("--out", type=Path, required=True, help="the bundle's folder")
    parser.add_argument("--name", help="default: the folder's name")
    parser.add_argument("--width", type=int, default=64, help="channels, with --random")
    parser.add_argument("--data", type=Path, default=Path(".data/people/val"), help="shards for the comparison")
    parser.add_argument("--images", type=int, default=8, help="images for the comparison")
    options = parser.parse_args()
    torch.set_num_threads(1)
    torch.manual_seed(0)
    net = MobileParsingRCNN(NetworkConfig(width=options.width)) if options.random else load_network(options.checkpoint)
    crop_net = load_network(options.crops) if options.crops else None
    if crop_net is not None and crop_net.config.width != net.config.width:
        raise SystemExit(f"{options.crops} has width {crop_net.config.width}, but the network {net.config.width}")
    export_graphs(net.eval(), options.out, crop_net)
    records = load_records(options.data, options.images)
    images = [np.ascontiguousarray(record.decoded()[0][..., ::-1]) for record in records]
    credited = data_sources.credited_sources(options.credits) if options.credits else ()
    errors = parity(net, options.out, images, crop_net)
    for name, error in errors.items():
        print(f"{name:24} largest error {error:.1e}")
    info = BundleInfo(
        name=options.name or options.out.name,
        precision="fp32",
        training_data=() if options.random else (*bundle.TRAINING_DATA, *(s.used_for("training") for s in credited)),
        measured={
            "onnx_against_torch": {
                "largest_error": float(f"{max(errors.values()):.1e}"),
                "images": len(images),
            }
        },
    )
    if credited:
        shutil.copyfile(options.credits, options.out / data_sources.CREDITS)
    bundle.write_manifest(options.out, info, net.config, DecodeConfig(), crops=crop_net is not None)
    print(f"{options.out}: {bytes_of(options.out) / 1e6:.2f} MB")
    if max(errors.values()) > TOLERANCE:
        raise SystemExit(f"the graphs differ from the network by more than {TOLERANCE:g}")


if __name__ == "__main__":
    main()
