"""Makes an int8 bundle of scene networks from weights of export.scenes.train, calibrated on rendered places.

    python -m quantization.scenes --fp32 .data/bundles/scenes-fp32 --out sdk/models/scenes-int8

What stays float is in `quantization/scenes.toml`. The refiner is calibrated on rasters that the fp32 extractor makes.
Prints sizes, each output's signal to noise ratio, and what int8 costs of PSNR on held-out photos of validation places:
no training and no calibration saw those.
"""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path

import numpy as np

from export.bundle import read_manifest
from export.scenes.bundle import BASIS, write_manifest
from export.scenes.captures import read_captures
from quantization.bundle_networks import BundleNetworks
from quantization.quantize import int8_info, quantize_graphs
from quantization.scene_samples import collect, psnrs_db, shots
from quantization.settings import SCENES, SceneSettings, read_settings


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fp32", type=Path, default=Path(".data/bundles/scenes-fp32"))
    parser.add_argument("--out", type=Path, default=Path("sdk/models/scenes-int8"))
    parser.add_argument("--name", help="default: the folder's name")
    parser.add_argument("--data", type=Path, default=Path(".data/places"), help="with folders train and val")
    parser.add_argument("--settings", type=Path, default=SCENES)
    options = parser.parse_args()
    settings = read_settings(options.settings, SceneSettings)
    fp32 = BundleNetworks(options.fp32)
    held_out = shots(read_captures(options.data / "val"), settings.held_out_views, held_out=True)
    calibration = collect(fp32, shots(read_captures(options.data / "train"), settings.views, held_out=False))
    test = collect(fp32, held_out)
    options.out.mkdir(parents=True, exist_ok=True)
    shutil.copy(options.fp32 / BASIS, options.out)
    quality = quantize_graphs(options.fp32, options.out, settings.graphs, calibration, test)
    before = float(np.mean(psnrs_db(fp32, held_out, "fp32")))
    after = float(np.mean(psnrs_db(BundleNetworks(options.out), held_out, "int8")))
    print(f"PSNR of {len(held_out)} held-out photos: fp32 {before:.2f} dB, int8 {after:.2f} dB")
    pictures = {"fp32": round(before, 2), "int8": round(after, 2), "pictures": len(held_out)}
    info = int8_info(options.name or options.out.name, read_manifest(options.fp32), quality, psnr_db=pictures)
    write_manifest(options.out, info)


if __name__ == "__main__":
    main()
