"""Exports the encoder of heads as a fp32 ONNX graph, compares it with torch, and writes the bundle of heads.

    python -m export.heads.export_onnx --encoder RUN/weights.pt --prior prior.maqp --out .data/bundles/heads-fp32
    python -m export.heads.export_onnx --random --prior prior.maqp --out .data/bundles/heads-random-fp32
    python -m export.heads.export_onnx --prior prior.maqp --field build/field.onnx

`encoder.onnx`: image [1, 192, 192, 3], RGB, 0..255 -> cells [1, 48, 48, 8], codes [1, 64, 2] (export.heads.encoder).

`--field` writes the field network of the prior as a graph, too, which is no part of the bundle: the SDK's own engine
and other runtimes are compared with it. points [N, 3] (dm), shape_codes [K], colour_codes [C] -> distance [N] (dm),
feature [N, F], colour_logits [N, 3] (red, green, blue), template_point [N, 3] (dm). N is open.
"""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional as F

from export.bundle import BundleInfo, bytes_of
from export.densepose.graphs import session
from export.densepose.simplified import simplified
from export.heads.bundle import PRIOR, TRAINING_DATA, write_manifest
from export.heads.encoder import CELLS, CROP_PX, OUTPUTS, POINT, WIDTH, HeadEncoder, load_encoder
from export.heads.field import FieldBases, bases_of, geometry, surface
from export.heads.prior import Prior, PriorError
from export.heads.prior_file import read_prior
from export.onnx_graphs import channels_last, joined, largest_difference, write_graph

ENCODER = "encoder.onnx"
ENCODER_TOLERANCE = 1e-4  # largest |ONNX - torch|, relative to the output's largest value
FIELD_TOLERANCE = 1e-5  # the same; where that is below 1 (dm), in dm
FIELD_OUTPUTS = ("distance", "feature", "colour_logits", "template_point")


class AffinePoints(nn.Module):
    """Adds to cells [1, 48, 48, 8] what the whole crop [1, 128] says of each: an affine function of its place for
    template points, 0 for the rest."""

    def __init__(self, affine: nn.Linear, place: Tensor) -> None:
        """affine: of [3, 3] outputs; place: [1, 2, 48, 48]."""
        super().__init__()
        self.linear = nn.Linear(affine.in_features, 3 * OUTPUTS)
        weight, bias = affine.weight.unflatten(0, (3, 3)), affine.bias.unflatten(0, (3, 3))
        padding = OUTPUTS - POINT.stop
        self.linear.weight.data = F.pad(weight.transpose(0, 1), (0, 0, 0, padding)).flatten(0, 1)
        self.linear.bias.data = F.pad(bias.T, (0, padding)).flatten()
        rows = place[0].flatten(1).T
        self.register_buffer("rows", torch.cat([rows, torch.ones(len(rows), 1)], 1))

    def forward(self, cells: Tensor, context: Tensor) -> Tensor:
        return cells + (self.rows @ self.linear(context).view(3, OUTPUTS)).view(1, CELLS, CELLS, OUTPUTS)


class EncoderGraph(nn.Module):
    """The encoder with fewer operations: the pixels' scale lies in the first convolution (their mean does not, since
    beyond the border is the mean), and the last one is a matrix product, which needs no other layout than the output's.
    """

    def __init__(self, encoder: HeadEncoder) -> None:
        super().__init__()
        net = simplified(encoder)
        self.backbone, self.neck = net.backbone, net.neck
        # Features and positions have convolutions of their own: in int8 they would share an unsigned scale.
        first = net.head[0].conv
        self.first, self.first_place = (nn.Conv2d(n, WIDTH, 3, padding=1, bias=n == WIDTH) for n in (WIDTH, 2))
        self.first.weight.data, self.first.bias.data = first.weight.data[:, :WIDTH], first.bias.data
        self.first_place.weight.data = first.weight.data[:, WIDTH:]
        self.second, self.predict = net.head[1], joined(net.head[2])
        self.deeper, self.refine = net.deeper, net.refine
        self.context, self.context_hidden, self.bias = net.context, net.context_hidden, net.bias
        self.points = AffinePoints(net.affine, net.place)
        self.register_buffer("mean", net.mean)
        self.register_buffer("place", net.place)
        self.backbone.stem.conv.weight.data *= net.scale[:, None, None]

    def forward(self, image: Tensor) -> Tensor:
        taps = self.backbone((image - self.mean).permute(0, 3, 1, 2))
        taps[-1] = self.deeper(taps[-1])
        context = F.relu(self.context_hidden(self.context(taps[-1]).flatten(1)))
        seen = F.relu6(self.first(self.neck.finest(taps)) + self.first_place(self.place))
        seen = seen + self.bias(context)[..., None, None]
        return self.points(self.predict(channels_last(self.second(self.refine(seen)))), context)


class FieldGraph(nn.Module):
    """The field of a head of given codes, at points."""

    def __init__(self, bases: FieldBases) -> None:
        super().__init__()
        self.bases = bases

    def forward(self, points: Tensor, shape_codes: Tensor, colour_codes: Tensor) -> tuple[Tensor, ...]:
        weights = [self._combined(layer, shape_codes, colour_codes) for layer in range(self.bases.shape.layers)]
        out = geometry(self.bases.shape, weights, points)
        logits, template = surface(self.bases.shape, weights, points, out)
        return out[:, 0], out[:, 1:], logits, template

    def _combined(self, layer: int, shape_codes: Tensor, colour_codes: Tensor) -> Tensor:
        """As `FieldBases.combine`, but one matrix product a layer: a tensordot becomes twenty nodes."""
        constant = self.bases.constant[layer]
        if str(layer) not in self.bases.bases:
            return constant
        codes = shape_codes if layer < self.bases.shape.first_surface_layer else colour_codes
        return constant + (codes @ self.bases.bases[str(layer)].flatten(1)).view(*constant.shape)


@torch.no_grad()
def export_encoder(encoder: HeadEncoder, path: Path) -> float:
    """Writes the graph; returns how far it is from torch. Raises ValueError where that is too far."""
    encoder = encoder.eval()
    shape = (1, CROP_PX, CROP_PX, 3)
    write_graph(EncoderGraph(encoder), [255 * torch.rand(shape)], path, ["image"], ["cells"])
    image = np.random.default_rng(0).uniform(0, 255, shape).astype(np.float32)
    (found,) = session(path).run(["cells"], {"image": image})
    error = largest_difference(encoder(torch.from_numpy(image)).numpy(), found)
    if not error <= ENCODER_TOLERANCE:
        raise ValueError(f"{path} differs from torch by {error:.1e} of its largest value.")
    return error


@torch.no_grad()
def export_field(prior: Prior, path: Path) -> float:
    """Writes the graph of a prior's field; returns how far it is from torch. Raises ValueError for too far."""
    graph = FieldGraph(bases_of(prior)).eval()
    rng = np.random.default_rng(0)
    points = rng.uniform(prior.bounds_min, prior.bounds_max, (256, 3))
    codes = [rng.normal(size=count) for count in (prior.shape_codes, prior.colour_codes)]
    given = dict(zip(("points", "shape_codes", "colour_codes"), (points, *codes), strict=True))
    given = {name: values.astype(np.float32) for name, values in given.items()}
    tensors = [torch.from_numpy(values) for values in given.values()]
    axes = {name: {0: "points"} for name in ("points", *FIELD_OUTPUTS)}
    write_graph(graph, [tensors[0][:5], *tensors[1:]], path, list(given), FIELD_OUTPUTS, axes)
    error = max(
        float(np.abs(one - tensor.numpy()).max(initial=0) / max(1, tensor.abs().max()))
        for one, tensor in zip(session(path).run(FIELD_OUTPUTS, given), graph(*tensors), strict=True)
        if tensor.numel()
    )
    if not error <= FIELD_TOLERANCE:
        raise ValueError(f"{path} differs from torch by {error:.1e}.")
    return error


def parsed() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    source = parser.add_mutually_exclusive_group()
    source.add_argument(
        "--encoder", type=Path, metavar="FILE", help="weights.pt of export.heads.encoder_training.train"
    )
    source.add_argument("--random", action="store_true", help="an untrained encoder, to try the runtime with")
    parser.add_argument("--prior", type=Path, required=True, metavar="FILE", help="prior.maqp")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="the bundle's folder; default: .data/bundles/heads-fp32"
    )
    parser.add_argument("--name", help="default: the folder's name")
    parser.add_argument("--field", type=Path, metavar="FILE", help="where the graph of the prior's field goes")
    options = parser.parse_args()
    if not (options.encoder or options.random or options.field):
        parser.error("give --encoder (or --random) for a bundle, or --field for the graph of the field")
    return options


def export(options: argparse.Namespace) -> None:
    prior = read_prior(options.prior)
    if options.field:
        options.field.parent.mkdir(parents=True, exist_ok=True)
        print(f"{options.field}: {export_field(prior, options.field):.1e} from torch")
    if not (options.encoder or options.random):
        return
    encoder = HeadEncoder() if options.random else load_encoder(options.encoder)
    folder = options.out or Path(".data/bundles/heads-fp32")
    folder.mkdir(parents=True, exist_ok=True)
    error = export_encoder(encoder, folder / ENCODER)
    print(f"encoder: {(folder / ENCODER).stat().st_size / 1e6:.2f} MB, {error:.1e} from torch")
    if not (folder / PRIOR).exists() or not options.prior.samefile(folder / PRIOR):
        shutil.copy(options.prior, folder / PRIOR)
    info = BundleInfo(
        name=options.name or folder.name,
        precision="fp32",
        training_data=() if options.random else TRAINING_DATA,
        measured={"onnx_against_torch": {"largest_error": float(f"{error:.1e}")}},
    )
    write_manifest(folder, info)
    print(f"{folder}: {bytes_of(folder) / 1e6:.2f} MB")


def main() -> None:
    torch.set_num_threads(1)
    torch.manual_seed(0)
    try:
        export(parsed())
    except (OSError, PriorError) as error:
        raise SystemExit(f"Nothing was exported: {error}") from error


if __name__ == "__main__":
    main()
