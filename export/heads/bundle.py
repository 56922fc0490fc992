"""A bundle for heads (docs/reference/formats.md): encoder, prior, template head if it has one, and manifest.

    python -m export.heads.bundle --encoder encoder.onnx --prior prior.maqp --out .data/bundles/heads-fp32
    python -m export.heads.bundle --template template.maqt --out sdk/models/heads-int8     adds it to a bundle

`encoder.onnx`: `image` float32 [1, crop, crop, 3], R, G, B in 0..255 -> `cells` float32 [1, crop / cell, crop / cell,
8]: template point x, y, z (dm), log of its sigma (dm), logit of the matte, normal x, y, z in the camera's axes. A cell
stands for the middle of its cell x cell pixels. And, where an encoder says them, `codes` float32 [1, shape codes, 2]:
what the whole crop tells of the head's shape codes, their means and log sigmas.
"""

from __future__ import annotations

import argparse
import shutil
from dataclasses import replace
from pathlib import Path

from export import data_sources as sources
from export.bundle import BundleInfo, Signature, read_manifest, signature_of
from export.bundle import write_manifest as write_bundle_manifest
from export.heads.head_shards import FACE_RADIUS_DM, FACE_SIDES, NOSE_TIP
from export.heads.prior import Prior
from export.heads.prior_file import bases_errors, prior_bytes, read_prior, write_prior
from export.heads.template_file import read_template

GRAPHS = ("encoder",)
PRIOR, TEMPLATE = "prior.maqp", "template.maqt"
CELL_CHANNELS = 8
CROP_SIDES = 1.6  # side of the crop by the longer side of the head's box, hair included
# The crop of the encoder's second pass.
FACE = {"center_dm": NOSE_TIP.tolist(), "radius_dm": FACE_RADIUS_DM, "crop_sides": FACE_SIDES}
TRAINING_DATA = (
    sources.SYNTHETIC_HEADS.used_for("training, calibration"),
    sources.BODIES_AND_SLIDERS.used_for("shapes"),
    sources.SKIN.used_for("rendering"),
    sources.BACKGROUNDS.used_for("rendering"),
    sources.PHOTOS_OF_PEOPLE.used_for("training of the encoder (--photos)"),
    sources.LABELS_OF_FACES.used_for("training of the encoder (--photos)"),
    sources.DETECTOR_WEIGHTS.used_for("first weights of the encoder"),
)
TEMPLATE_DATA = sources.FACE_UNITS.used_for("facial actions of the template head")


def crop_and_cell(graph: Signature, path: Path) -> tuple[int, int]:
    """Sides in pixels of the crop and of a cell. Raises ValueError for a graph that is no encoder of heads."""
    shapes = {name: list(shape) for side in ("inputs", "outputs") for name, shape in graph[side].items()}
    sizes = [size for shape in shapes.values() for size in shape]
    if list(shapes) == ["image", "cells"] and all(isinstance(n, int) and n > 0 for n in sizes):
        crop, side = shapes["image"][1], shapes["cells"][1]
        wanted = {"image": [1, crop, crop, 3], "cells": [1, side, side, CELL_CHANNELS]}
        if shapes == wanted and crop % side == 0:
            return crop, crop // side
    raise ValueError(
        f"{path} has {shapes}; the format asks for image [1, crop, crop, 3] and cells [1, crop / cell, crop / cell, "
        f"{CELL_CHANNELS}], in numbers."
    )


def write_manifest(folder: Path, info: BundleInfo, crop_sides: float = CROP_SIDES, face: dict | None = FACE) -> dict:
    """Describes `encoder.onnx`, `prior.maqp` and, if it is there, `template.maqt` that lie in `folder`, of any
    precision, and writes `manifest.json`, which it returns. face: None where the encoder must not look at it a second
    time. Raises ValueError for a graph of other shapes, PriorError for a file that is no prior or no template."""
    graphs = {name: signature_of(folder / f"{name}.onnx") for name in GRAPHS}
    read_prior(folder / PRIOR)
    crop, cell = crop_and_cell(graphs["encoder"], folder / "encoder.onnx")
    task_keys = {
        "encoder": {"crop_px": crop, "cell_px": cell, "crop_sides": crop_sides} | ({"face": face} if face else {}),
        "prior": {"file": PRIOR},
    }
    files = (PRIOR,)
    if (folder / TEMPLATE).exists():
        read_template(folder / TEMPLATE)
        files, task_keys["template"] = (PRIOR, TEMPLATE), {"file": TEMPLATE}
        if info.training_data and TEMPLATE_DATA not in info.training_data:
            info = replace(info, training_data=(*info.training_data, TEMPLATE_DATA))
    return write_bundle_manifest(folder, "heads", info, graphs, files=files, task_keys=task_keys)


def write_bundle(
    folder: Path,
    encoder: Path,
    prior: Prior,
    info: BundleInfo,
    bases: str = "int8",
    constant: str = "float16",
    crop_sides: float = CROP_SIDES,
    face: dict | None = FACE,
) -> dict:
    """The whole bundle. bases, constant: as prior_bytes() has them. Returns the manifest. Raises what write_manifest()
    and prior_bytes() raise."""
    prior_bytes(prior, bases, constant)  # raises before anything is written
    folder.mkdir(parents=True, exist_ok=True)
    target = folder / "encoder.onnx"
    if not (target.exists() and target.samefile(encoder)):
        shutil.copyfile(encoder, target)
    write_prior(prior, folder / PRIOR, bases, constant)
    return write_manifest(folder, info, crop_sides, face)


def add_template(folder: Path, template: Path) -> dict:
    """Adds the template head to a bundle. Returns the manifest. Raises what read_manifest() and write_manifest() raise,
    PriorError for a file that is no template."""
    manifest = read_manifest(folder)
    read_template(template)
    shutil.copyfile(template, folder / TEMPLATE)
    keys = ("name", "precision", "version", "training_data", "measured")
    info = BundleInfo(**{key: manifest[key] for key in keys})
    return write_manifest(folder, info, manifest["encoder"]["crop_sides"], manifest["encoder"].get("face"))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--encoder", type=Path, help="encoder.onnx")
    parser.add_argument("--prior", type=Path, help="prior.maqp, of any format")
    parser.add_argument("--template", type=Path, help="template.maqt; alone: --out has the rest")
    parser.add_argument("--out", type=Path, default=Path(".data/bundles/heads-fp32"))
    parser.add_argument("--name", help="default: the folder's name")
    parser.add_argument("--bases", default="int8", choices=("float32", "float16", "int8"))
    parser.add_argument("--random", action="store_true", help="the weights are random: no training data")
    options = parser.parse_args()
    if (options.encoder is None) != (options.prior is None) or (options.encoder or options.template) is None:
        parser.error("give --encoder and --prior for a bundle, or --template to add it to one")
    if options.encoder is not None:
        prior = read_prior(options.prior)
        for error in bases_errors(prior, options.bases):
            print(f"layer {error.layer}: {options.bases} bases are {100 * error.relative_rms:.2f} % off")
        training_data = () if options.random else TRAINING_DATA
        info = BundleInfo(options.name or options.out.name, "fp32", training_data=training_data)
        write_bundle(options.out, options.encoder, prior, info, options.bases)
    if options.template is not None:
        add_template(options.out, options.template)
    sizes = {path.name: path.stat().st_size for path in sorted(options.out.iterdir())}
    print(", ".join(f"{name} {size / 1e6:.2f} MB" for name, size in sizes.items()))


if __name__ == "__main__":
    main()
