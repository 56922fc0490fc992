"""A bundle of scene networks whose refiner was tuned to one scene; extractor and basis are those of another bundle."""

from __future__ import annotations

import json
import shutil
import tempfile
from pathlib import Path

import torch

from export.densepose.bundle import BundleInfo
from export.scenes.bundle import BASIS, identity, write_manifest
from export.scenes.export_onnx import export_refiner
from export.scenes.light_refiner import LightRefiner, folded
from export.scenes.tuning import Shown, TunedScene
from quantization import scenes as quantization
from quantization.quantize import quantize_graph
from quantization.samples import Sample

SETTINGS = Path(quantization.__file__).with_name("scenes.toml")
MOST_VIEWS = 8  # of the scene that set the ranges of an int8 refiner


def write_tuned_bundle(scene: TunedScene, views: list[Shown], shipped: Path, folder: Path) -> str:
    """A bundle of the precision of the one in `shipped`, calibrated on views of the scene; returns its identity. What
    the folder held before is replaced file by file."""
    manifest = json.loads((shipped / "manifest.json").read_text())
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("extractor.onnx", BASIS):
        shutil.copyfile(shipped / name, folder / name)
    if manifest["precision"] == "int8":
        with tempfile.TemporaryDirectory() as work:
            export_refiner(scene.networks.refiner.cpu(), Path(work) / "refiner.onnx")
            scene.networks.refiner.to(scene.places.device)
            samples = [_sample(scene, view) for view in views[:: -(-len(views) // MOST_VIEWS)]]
            settings = quantization.read_settings(SETTINGS).graphs["refiner"]
            quantize_graph(Path(work) / "refiner.onnx", folder / "refiner.onnx", samples, settings)
    else:
        export_refiner(scene.networks.refiner.cpu(), folder / "refiner.onnx")
        scene.networks.refiner.to(scene.places.device)
    info = BundleInfo(
        f"{manifest['name']}-tuned",
        manifest["precision"],
        version=manifest["version"],
        training_data=(*manifest["training_data"], {"name": "the photos of one capture", "used_for": "the refiner"}),
    )
    return identity(write_manifest(folder, info))


@torch.no_grad()
def _sample(scene: TunedScene, view: Shown) -> Sample:
    """What the refiner's graph is given for one view."""
    rasters, refiner = scene.rasters(view), scene.networks.refiner
    if isinstance(refiner, LightRefiner):
        rasters = rasters[: refiner.config.levels]
        if refiner.config.folded:
            rasters = [folded(rasters[0]), *rasters[1:]]
    return {f"raster{k}": x.permute(0, 2, 3, 1).contiguous().cpu().numpy() for k, x in enumerate(rasters)}
