"""Exports extractor and refiner as fp32 ONNX graphs, and compares them with torch.

    python -m export.scenes.export_onnx --checkpoint RUN/weights.pt --places .data/places/train \\
        --out .data/bundles/scenes-fp32
    python -m export.scenes.export_onnx --random small --out .data/bundles/random-scenes-fp32

All tensors have channels last, as int8 kernels want them and as the SDK, which writes and reads a whole pixel at a
time, does. `extractor`: image [1, H, W, 3], RGB in 0..1, H and W multiples of 32 -> features [1, H, W, 8]. `refiner`:
raster0, raster1, ... [1, H/2^k, W/2^k, 9] -> rgb [1, H, W, 3], not clamped; raster0 is rearranged to [1, H/2, W/2,
4 * 9] and rgb to [1, H/2, W/2, 4 * 3], pixels (0, 0), (0, 1), (1, 0), (1, 1) of each 2x2. H and W are open: photos and
windows have any size, and a runtime that knows its size fixes the axes named `height` and `width` when it loads a
graph, which is then as fast as one exported for that size.
Beside them lies `manifest.json` (export.scenes.bundle).
The basis network has no graph: it is 678 numbers, in `basis.bin`, little-endian float32: for each of its three layers
the weights [outputs, inputs], then the biases.
"""

from __future__ import annotations

import argparse
import copy
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn.utils.fusion import fuse_conv_bn_eval

from export.bundle import BundleInfo
from export.densepose.graphs import session
from export.densepose.network import ConvBn
from export.onnx_graphs import Doubled, channels_first, channels_last, largest_difference, write_graph
from export.scenes.bundle import training_data, with_earlier, write_manifest
from export.scenes.captures import Capture, read_captures
from export.scenes.config import FEATURES, RASTER, SIZES
from export.scenes.geometry.cameras import upright, warped
from export.scenes.networks.basis import Basis
from export.scenes.networks.extractor import STRIDE, Extractor
from export.scenes.networks.feature_scale import measured, scaled
from export.scenes.networks.light_refiner import LightRefiner
from export.scenes.networks.system import Networks, load_networks

TOLERANCE = 1e-5  # largest |ONNX - torch|, relative to the output's largest value


class DoubledBeside(Doubled):
    """As `Doubled`, for an x whose channels are not those of `like`."""

    @staticmethod
    def symbolic(g: object, x: object, like: object) -> object:
        cells = g.op("Transpose", x, perm_i=[0, 2, 3, 1])
        rows = g.op("Reshape", g.op("Concat", cells, cells, axis_i=3), _constant(g, 0, 0, 1, -1))
        size = g.op("Shape", g.op("Transpose", like, perm_i=[0, 2, 3, 1]), start_i=0, end_i=3)
        shape = g.op("Concat", size, _constant(g, -1), axis_i=0)
        twice = g.op("Reshape", g.op("Concat", rows, rows, axis_i=2), shape)
        return g.op("Transpose", twice, perm_i=[0, 3, 1, 2])


def _constant(g: object, *values: int) -> object:
    return g.op("Constant", value_t=torch.tensor(values))


def doubled(x: Tensor, like: Tensor) -> Tensor:
    """Nearest upsampling of x by two, to the height and width of `like`."""
    return DoubledBeside.apply(x, like) if torch.onnx.is_in_onnx_export() else Doubled.forward(None, x, like)


class ExtractorGraph(nn.Module):
    """Channels last at both ends, batch normalisation folded."""

    def __init__(self, extractor: Extractor) -> None:
        super().__init__()
        self.extractor = copy.deepcopy(extractor).eval().requires_grad_(False)
        for module in self.extractor.modules():
            if isinstance(module, ConvBn):
                module.conv, module.bn = fuse_conv_bn_eval(module.conv, module.bn), nn.Identity()
        self.extractor.double = doubled

    def forward(self, image: Tensor) -> Tensor:
        return channels_last(self.extractor(channels_first(image)))


class RefinerGraph(nn.Module):
    """Channels last at both ends; the first raster and the image are rearranged by space_to_depth."""

    def __init__(self, refiner: LightRefiner) -> None:
        super().__init__()
        self.refiner = copy.deepcopy(refiner).eval().requires_grad_(False)
        self.refiner.double = doubled

    def forward(self, *rasters: Tensor) -> Tensor:
        return channels_last(self.refiner.of_rearranged([channels_first(raster) for raster in rasters]))


def raster_shapes(refiner: LightRefiner, height: int, width: int) -> dict[str, list[int]]:
    """Input shapes of a refiner's graph for an image of that size."""
    shapes = {f"raster{k}": [1, height >> k, width >> k, RASTER] for k in range(refiner.config.levels)}
    return shapes | {"raster0": [1, height // 2, width // 2, 4 * RASTER]}


def export_extractor(extractor: Extractor, path: Path) -> None:
    """Writes the graph of the extractor."""
    axes = {name: {1: "height", 2: "width"} for name in ("image", "features")}
    given = torch.rand(1, 2 * STRIDE, 3 * STRIDE, 3)
    write_graph(ExtractorGraph(extractor), (given,), path, ["image"], ["features"], axes)


def export_refiner(refiner: LightRefiner, path: Path) -> None:
    """Writes the graph of a refiner."""
    height, width = 96, 160
    shapes = raster_shapes(refiner, height, width)
    names = {height >> k: f"height/{1 << k}" for k in range(5)} | {width >> k: f"width/{1 << k}" for k in range(5)}
    names[height], names[width] = "height", "width"
    axes = {name: {axis: names[shape[axis]] for axis in (1, 2)} for name, shape in shapes.items()}
    axes["rgb"] = axes["raster0"]
    write_graph(RefinerGraph(refiner), tuple(torch.rand(s) for s in shapes.values()), path, list(shapes), ["rgb"], axes)


def write_basis(basis: Basis, path: Path) -> None:
    """The 678 numbers of the basis network, as the head of this file says."""
    values = [p.detach().float().flatten() for p in basis.parameters()]
    torch.cat(values).numpy().astype("<f4").tofile(path)


@torch.no_grad()
def parity(module: nn.Module, path: Path, given: dict[str, np.ndarray]) -> float:
    """Largest |ONNX - torch| over the output, relative to its largest value. module: what the graph was made of."""
    expected = module.eval()(*(torch.from_numpy(x) for x in given.values())).numpy()
    (found,) = session(path).run(None, given)
    return largest_difference(expected, found)


def export(networks: Networks, folder: Path) -> dict[str, float]:
    """Writes `extractor.onnx`, `refiner.onnx` and `basis.bin`; returns each graph's parity. Raises ValueError where one
    is not what torch computes."""
    folder.mkdir(parents=True, exist_ok=True)
    export_extractor(networks.extractor, folder / "extractor.onnx")
    export_refiner(networks.refiner, folder / "refiner.onnx")
    write_basis(networks.basis, folder / "basis.bin")
    random = np.random.default_rng(0)
    image = {"image": random.random((1, 5 * STRIDE, 4 * STRIDE, 3), np.float32)}
    shapes = raster_shapes(networks.refiner, 112, 80)
    rasters = {name: random.standard_normal(shape, np.float32) for name, shape in shapes.items()}
    worst = {
        "extractor": parity(ExtractorGraph(networks.extractor), folder / "extractor.onnx", image),
        "refiner": parity(RefinerGraph(networks.refiner), folder / "refiner.onnx", rasters),
    }
    for name, error in worst.items():
        if not error <= TOLERANCE:
            raise ValueError(f"the graph {name} differs from torch by {error:.1e} of its largest value")
    return worst


def _photos(captures: list[Capture]) -> Iterator[Tensor]:
    """One of each capture, rotated upright."""
    for capture in captures:
        view = capture.view(capture.sources()[0])
        camera = upright(view.camera, np.asarray(capture.up), STRIDE)
        yield torch.from_numpy(warped(view.image, view.camera, camera)).permute(2, 0, 1)[None]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument("--checkpoint", type=Path, help="weights.pt of export.scenes.train")
    source.add_argument("--random", choices=SIZES, help="random weights of this size, for measuring time")
    parser.add_argument("--out", type=Path, default=Path(".data/bundles/scenes-fp32"))
    parser.add_argument("--name", help="default: the folder's name")
    parser.add_argument(
        "--places",
        type=Path,
        help="the rendered places it was trained on: named in the manifest, and features get the range of colours on "
        "their photos, for int8",
    )
    parser.add_argument(
        "--started-from", type=Path, metavar="BUNDLE",
        help="the bundle whose weights the training began with: its training data are named, too",
    )  # fmt: skip
    options = parser.parse_args()
    torch.manual_seed(0)
    networks = Networks(SIZES[options.random]) if options.random else load_networks(options.checkpoint)
    networks.eval()
    if options.places:
        factors = measured(networks, _photos(read_captures(options.places)))
        print("features scaled by " + ", ".join(f"{factor:.3f}" for factor in factors))
        networks = scaled(networks, factors)
    for name, error in export(networks, options.out).items():
        size = (options.out / f"{name}.onnx").stat().st_size / 1e6
        print(f"{name}: {size:.2f} MB, {error:.1e} from torch; {FEATURES} features")
    trained_on = training_data(options.places) if options.places else []
    if options.started_from:
        trained_on = with_earlier(trained_on, options.started_from)
    info = BundleInfo(options.name or options.out.name, "fp32", training_data=tuple(trained_on))
    write_manifest(options.out, info)


if __name__ == "__main__":
    main()
