"""Makes an int8 bundle of scene networks from weights of export.scenes.train, calibrated on rendered places.

    python -m quantization.scenes --fp32 .data/bundles/scenes-fp32 --out sdk/models/scenes-int8

What stays float is in `quantization/scenes.toml`. The refiner is calibrated on rasters that the fp32 extractor makes.
Prints sizes, each output's signal to noise ratio, and what int8 costs of PSNR on held-out photos of validation places:
no training and no calibration saw those.
"""

from __future__ import annotations

import argparse
import json
import shutil
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import onnxruntime
import torch
from torch import Tensor, nn
from tqdm import tqdm

from export.densepose.bundle import BundleInfo
from export.scenes.basis import Basis
from export.scenes.bundle import BASIS, GRAPHS, write_manifest
from export.scenes.cameras import upright
from export.scenes.captures import Capture, read_captures
from export.scenes.config import MULTIPLE, RASTER
from export.scenes.light_refiner import folded, unfolded
from export.scenes.modelling import Options, gathered, modelled, render
from export.scenes.picture_quality import psnr_db
from export.scenes.source_views import scores
from quantization.errors import float_nodes_left, output_sqnr
from quantization.quantize import quantize_graph
from quantization.samples import Sample
from quantization.settings import GraphSettings, graph_settings

SOURCES = 8  # photos that a picture is made from while calibrating and comparing


@dataclass(frozen=True)
class Settings:
    """graphs: by name. views, held_out_views: how many pictures calibrate, and measure the error."""

    graphs: dict[str, GraphSettings]
    views: int
    held_out_views: int


def read_settings(path: Path) -> Settings:
    """Raises ValueError for unknown keys or methods."""
    values = tomllib.loads(path.read_text())
    graphs = {name: graph_settings(values.pop(name, {}), f"{path}, [{name}]") for name in GRAPHS}
    try:
        return Settings(graphs, **values)
    except TypeError as error:
        raise ValueError(f"{path}: {error}") from error


class _Graph(nn.Module):
    """A graph of a bundle, as a part of `export.scenes.system.Networks`."""

    def __init__(self, path: Path, threads: int) -> None:
        super().__init__()
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = threads
        options.log_severity_level = 3
        self.session = onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])
        self.seen: list[Sample] | None = None  # what it is given, if somebody wants to know

    def run(self, tensors: Sequence[Tensor]) -> Tensor:
        """Channels first at both ends."""
        names = [value.name for value in self.session.get_inputs()]
        given = {n: t.permute(0, 2, 3, 1).contiguous().numpy() for n, t in zip(names, tensors, strict=True)}
        if self.seen is not None:
            self.seen.append(given)
        (found,) = self.session.run(None, given)
        return torch.from_numpy(found).permute(0, 3, 1, 2)


class _Extractor(_Graph):
    def forward(self, image: Tensor) -> Tensor:
        return self.run([image])


class _Refiner(_Graph):
    def forward(self, rasters: list[Tensor]) -> Tensor:
        inputs = self.session.get_inputs()
        used = rasters[: len(inputs)]
        if inputs[0].shape[-1] == RASTER:
            return self.run(used)
        return unfolded(self.run([folded(used[0]), *used[1:]]))


class BundleNetworks(nn.Module):
    """The networks of a bundle of any precision, for export.scenes.modelling. Raises ValueError for a basis that is
    none."""

    def __init__(self, folder: Path, threads: int = 1) -> None:
        super().__init__()
        self.extractor = _Extractor(folder / "extractor.onnx", threads)
        self.refiner = _Refiner(folder / "refiner.onnx", threads)
        self.basis = Basis()
        values = torch.from_numpy(np.fromfile(folder / BASIS, "<f4"))
        if len(values) != sum(p.numel() for p in self.basis.parameters()):
            raise ValueError(f"{folder / BASIS} has {len(values)} numbers")
        nn.utils.vector_to_parameters(values, self.basis.parameters())


@dataclass(frozen=True, eq=False)
class Shot:
    """A photo of a capture, and those that its picture is made from."""

    capture: Capture
    target: int
    sources: list[int]


def shots(captures: Sequence[Capture], count: int, held_out: bool) -> list[Shot]:
    """`count` photos, evenly over the captures; held-out ones or the others."""
    chosen = []
    for k in range(count):
        capture = captures[k % len(captures)]
        candidates = sorted(capture.held_out) if held_out and capture.held_out else capture.sources()
        rounds = -(-count // len(captures))
        target = candidates[(2 * (k // len(captures)) + 1) * len(candidates) // (2 * rounds)]
        others = [j for j in capture.sources() if j != target]
        score = scores(capture.cameras[target], [capture.cameras[j] for j in others], capture.cloud.places[::37])
        chosen.append(Shot(capture, target, [others[j] for j in np.argsort(-score, kind="stable")[:SOURCES]]))
    return chosen


@torch.no_grad()
def pictures(networks: nn.Module, wanted: Sequence[Shot], what: str) -> list[float]:
    """Renders all; the PSNR of each in dB."""
    figures = []
    for shot in tqdm(wanted, desc=what, unit="picture", leave=False):
        options = Options(up=shot.capture.up)
        views = [shot.capture.view(k) for k in shot.sources]
        model = modelled(torch.from_numpy(shot.capture.cloud.places), views, networks, options)
        photo = shot.capture.view(shot.target)
        figures.append(psnr_db(render(model, photo.camera, networks, options), photo.image))
    return figures


@torch.no_grad()
def collect(networks: BundleNetworks, wanted: Sequence[Shot]) -> dict[str, list[Sample]]:
    """What each graph is given: a photo, and a picture's rasters, for each shot."""
    samples: dict[str, list[Sample]] = {name: [] for name in GRAPHS}
    for shot in tqdm(wanted, desc="running the fp32 bundle", unit="picture", leave=False):
        options = Options(up=shot.capture.up)
        views = [shot.capture.view(k) for k in shot.sources]
        points = torch.from_numpy(shot.capture.cloud.places)
        model = modelled(points, views, networks, options)
        camera = upright(shot.capture.view(shot.target).camera, np.asarray(options.up), MULTIPLE)
        networks.refiner.seen = samples["refiner"]
        networks.refiner([raster[None] for raster in model.rasters(camera, networks, options)])
        networks.refiner.seen = None
        (image,) = gathered(points, views[:1], options).images
        samples["extractor"].append({"image": image[None].permute(0, 2, 3, 1).contiguous().numpy()})
    return samples


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fp32", type=Path, default=Path(".data/bundles/scenes-fp32"))
    parser.add_argument("--out", type=Path, default=Path("sdk/models/scenes-int8"))
    parser.add_argument("--name", help="default: the folder's name")
    parser.add_argument("--data", type=Path, default=Path(".data/places"), help="with folders train and val")
    parser.add_argument("--settings", type=Path, default=Path(__file__).with_name("scenes.toml"))
    options = parser.parse_args()
    settings = read_settings(options.settings)
    fp32 = BundleNetworks(options.fp32)
    held_out = shots(read_captures(options.data / "val"), settings.held_out_views, held_out=True)
    calibration = collect(fp32, shots(read_captures(options.data / "train"), settings.views, held_out=False))
    test = collect(fp32, held_out)
    options.out.mkdir(parents=True, exist_ok=True)
    shutil.copy(options.fp32 / BASIS, options.out)
    quality = {}
    for name in GRAPHS:
        paths = options.fp32 / f"{name}.onnx", options.out / f"{name}.onnx"
        quantize_graph(*paths, calibration[name], settings.graphs[name])
        quality[name] = output_sqnr(*paths, test[name])
        sizes = [path.stat().st_size / 1e6 for path in paths]
        print(f"{name}: {sizes[0]:.2f} -> {sizes[1]:.2f} MB, {len(calibration[name])} samples")
        print("  dB: " + ", ".join(f"{output} {value:.1f}" for output, value in quality[name].items()))
        print("  float: " + (", ".join(float_nodes_left(paths[1])) or "nothing"))
    before = float(np.mean(pictures(fp32, held_out, "fp32")))
    after = float(np.mean(pictures(BundleNetworks(options.out), held_out, "int8")))
    print(f"PSNR of {len(held_out)} held-out photos: fp32 {before:.2f} dB, int8 {after:.2f} dB")
    manifest = json.loads((options.fp32 / "manifest.json").read_text())
    info = BundleInfo(
        name=options.name or options.out.name,
        precision="int8",
        version=manifest["version"],
        training_data=tuple(manifest["training_data"]),
        measured={
            "sqnr_db": {g: {o: round(v, 1) for o, v in outputs.items()} for g, outputs in quality.items()},
            "psnr_db": {"fp32": round(before, 2), "int8": round(after, 2), "pictures": len(held_out)},
        },
    )
    write_manifest(options.out, info)


if __name__ == "__main__":
    main()
