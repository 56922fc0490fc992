"""Makes the bundle of a refiner that was tuned to one scene (`export.scenes.finetune` runs this).

    python -m quantization.tuned_bundle --refiner refiner.onnx --samples SAMPLES --shipped BUNDLE --out FOLDER

Extractor and basis are those of the shipped bundle, and so is the precision: an int8 refiner is calibrated on the
samples, `*.npz` files of what its graph is given. What FOLDER held before is replaced file by file.
"""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path

import numpy as np

from export.bundle import BundleInfo, read_manifest
from export.scenes.bundle import BASIS, write_manifest
from quantization.quantize import quantize_graph
from quantization.settings import SCENES, SceneSettings, read_settings


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--refiner", type=Path, required=True, help="fp32 graph")
    parser.add_argument("--samples", type=Path, required=True, metavar="DIR", help="what the graph is given")
    parser.add_argument("--shipped", type=Path, required=True, metavar="DIR", help="bundle that was tuned")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR")
    options = parser.parse_args()
    manifest = read_manifest(options.shipped)
    options.out.mkdir(parents=True, exist_ok=True)
    for name in ("extractor.onnx", BASIS):
        shutil.copyfile(options.shipped / name, options.out / name)
    target = options.out / "refiner.onnx"
    if manifest["precision"] == "int8":
        samples = []
        for path in sorted(options.samples.glob("*.npz")):
            with np.load(path) as sample:
                samples.append(dict(sample))
        settings = read_settings(SCENES, SceneSettings).graphs["refiner"]
        quantize_graph(options.refiner, target, samples, settings)
    else:
        shutil.copyfile(options.refiner, target)
    info = BundleInfo(
        f"{manifest['name']}-tuned",
        manifest["precision"],
        version=manifest["version"],
        training_data=(*manifest["training_data"], {"name": "the photos of one capture", "used_for": "the refiner"}),
    )
    write_manifest(options.out, info)


if __name__ == "__main__":
    main()
