"""Makes an int8 bundle of heads from a fp32 one of export.heads, calibrated on images of made heads.

    python -m quantization.heads --fp32 .data/bundles/heads-fp32 --out sdk/models/heads-int8
    python -m quantization.heads --keep sdk/models/heads-int8         a new encoder for the shipped prior
    python -m quantization.heads --fp32 .data/bundles/heads-fp32 --blocks

What stays float and how the prior's bases are stored is in `quantization/heads.toml`. Prints sizes, the signal to noise
ratio of each output, what int8 costs on crops of validation heads (template points, matte, normals) and what stored
bases lose on their surfaces. `--blocks` writes no bundle: it prints what each block of layers gains that is left float
besides those in the settings, and loses of those that is not, all without the corrections of rounded weights, which
would take an hour.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import onnx
import torch
from rich.console import Console
from rich.table import Table
from torch import Tensor
from tqdm import tqdm

from export.bundle import bytes_of, read_manifest
from export.densepose.graphs import session
from export.heads.bundle import PRIOR, TEMPLATE, write_manifest
from export.heads.encoder import LOG_SIGMA, MATTE, NORMAL, POINT, cell_metrics
from export.heads.encoder_data import (
    Backgrounds,
    Crop,
    batched,
    crop_of,
    held_out_crops,
    held_out_face_crops,
    read_heads,
)
from export.heads.export_onnx import ENCODER
from export.heads.field import bases_of, geometry
from export.heads.head_shards import read_points
from export.heads.prior import Prior, PriorError
from export.heads.prior_file import FORMATS, HEAD, prior_bytes, prior_from_bytes, write_prior
from export.heads.train_prior import HeadTensors, fitted_codes
from quantization.analysis.errors import sqnr_db
from quantization.blocks import Workpiece, blocks
from quantization.graphs.prepare import prepare
from quantization.quantize import calibrate, int8_info, quantize_graphs
from quantization.samples import Sample
from quantization.settings import HEADS, GraphSettings, HeadSettings, read_settings

PARTS = {"template_point": POINT, "log_sigma": LOG_SIGMA, "matte": MATTE, "normal": NORMAL}
# Metrics of `cell_metrics` that are shown, in this order, with digits: template points in mm, matte, degrees.
FIGURES = {"median_mm": 3, "point_mm": 3, "within_2_sigma": 4, "matte_iou": 4, "normal_deg": 2}


def training_crops(folder: Path, backgrounds: Path, count: int) -> list[Crop]:
    """Crops as the encoder was trained on, every second of a face, of as many heads as there are crops."""
    heads, photos = read_heads(folder, "train", count), Backgrounds(backgrounds / "train")
    rng = np.random.default_rng(0)
    return [
        crop_of(
            heads[k % len(heads)], int(rng.integers(len(heads[k % len(heads)].rgb))), photos, rng, of_face=k % 2 == 1
        )
        for k in range(count)
    ]


def spread(crops: Sequence[Crop], count: int) -> list[Crop]:
    """At most `count`, evenly over all of them."""
    return [crops[k] for k in np.linspace(0, len(crops) - 1, min(count, len(crops))).astype(int)]


def samples(crops: Sequence[Crop]) -> list[Sample]:
    """Inputs of the graph for each crop."""
    return [{"image": crop.image[None].astype(np.float32)} for crop in crops]


def cells_of(encoder: Path, given: Sequence[Sample]) -> Tensor:
    """Outputs of an encoder's graph, [N, 48, 48, 8]."""
    run = session(encoder)
    return torch.from_numpy(np.concatenate([run.run(["cells"], sample)[0] for sample in given]))


def metrics_of(cells: Tensor, crops: Sequence[Crop]) -> dict[str, float]:
    """FIGURES on crops whose truth is known."""
    found = cell_metrics(cells, *batched(list(crops))[1:])
    return {name: round(found[name], digits) for name, digits in FIGURES.items()}


def parts_sqnr(expected: Tensor, found: Tensor) -> dict[str, float]:
    """Signal to quantization noise of each part of the cells, dB: logits would hide what template points lose."""
    first, second = expected.double(), found.double()
    return {
        name: sqnr_db(float(first[..., at].square().sum()), float((first[..., at] - second[..., at]).square().sum()))
        for name, at in PARTS.items()
    }


@torch.no_grad()
def bases_cost(prior: Prior, bases: str, heads: HeadTensors, steps: int = 250) -> dict[str, dict[str, float]]:
    """Error of stored bases on held-out heads, whose codes are fitted to their true points with exact bases.

    By "head" and "face", in mm: mean |distance| of true surface points to the fitted surface with bases in float16 and
    as `bases` says, and the mean difference of both fields there.
    """
    with torch.enable_grad():
        torch.manual_seed(0)
        codes = fitted_codes(bases_of(prior), heads, steps)
    distances = {}
    for form in ("float16", bases):
        field = bases_of(prior_from_bytes(prior_bytes(prior, form)))
        distances[form] = geometry(prior.shape, field.combine(*codes), heads.surface)[..., 0] * 100
    difference = (distances[bases] - distances["float16"]).abs()
    out = {}
    for name, at in (("head", torch.ones_like(difference, dtype=torch.bool)), ("face", heads.is_face)):
        out[name] = {f"{form}_mm": round(float(mm[at].abs().mean()), 3) for form, mm in distances.items()}
        out[name]["difference_mm"] = round(float(difference[at].mean()), 4)
    return out


def float_prior(path: Path) -> Prior:
    """Raises PriorError for one whose bases are int8 already."""
    data = path.read_bytes()
    prior = prior_from_bytes(data, str(path))
    if np.frombuffer(data, HEAD, 1)[0]["bases_format"] == FORMATS["int8"]:
        raise PriorError(f"The bases in {path} are int8 already: write it with bases in float32.")
    return prior


def print_cost(cost: dict[str, dict[str, float]], what: str) -> None:
    for name, row in cost.items():
        print(f"{what}, {name}: " + ", ".join(f"{key} {value}" for key, value in row.items()))


def print_blocks(source: Path, settings: GraphSettings, calibration: list[Sample], crops: Sequence[Crop]) -> None:
    """A table of what each block gains that is left float (+), or loses that is not (-): sizes, decibels of each part,
    metrics on the crops."""
    given = samples(crops)
    expected = cells_of(source, given)
    table = Table(title="blocks left float, in the order of the graph", title_justify="left")
    table.add_column("stays float", no_wrap=True)
    for name in ("kB", *(f"{part}, dB" for part in PARTS), *FIGURES):
        table.add_column(name, justify="right")

    def add(name: str, path: Path) -> None:
        cells = cells_of(path, given)
        cells_text = [f"{path.stat().st_size / 1e3:.0f}", *(f"{v:.1f}" for v in parts_sqnr(expected, cells).values())]
        table.add_row(name, *cells_text, *(str(value) for value in metrics_of(cells, crops).values()))

    with tempfile.TemporaryDirectory() as folder:
        prepared, target = Path(folder) / "prepared.onnx", Path(folder) / "tried.onnx"
        prepare(source, prepared)
        plain = replace(settings, round_together=False, bias_correction=False)
        piece = Workpiece("encoder", prepared, calibrate(prepared, calibration, plain), plain, calibration, given)
        add("everything", prepared)
        piece.quantize(target)
        add("as the settings say", target)
        more = blocks(onnx.load(prepared).graph, plain.float_nodes)
        choices = {f"- {pattern}": tuple(p for p in plain.float_nodes if p != pattern) for pattern in plain.float_nodes}
        choices |= {f"+ {pattern}": (*plain.float_nodes, pattern) for pattern in more}
        for name, patterns in tqdm(choices.items(), desc="blocks of encoder", unit="block", leave=False, disable=None):
            piece.settings = replace(plain, float_nodes=patterns)
            piece.quantize(target)
            add(name, target)
    Console(width=None if sys.stdout.isatty() else 160).print(table)


def parsed() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fp32", type=Path, default=Path(".data/bundles/heads-fp32"))
    parser.add_argument("--out", type=Path, default=Path("sdk/models/heads-int8"))
    parser.add_argument("--keep", type=Path, metavar="DIR", help="int8 bundle whose prior and template are taken over")
    parser.add_argument("--name", help="default: the folder's name")
    parser.add_argument("--data", type=Path, default=Path(".data/heads"), help="with the folders views and points")
    parser.add_argument(
        "--backgrounds", type=Path, default=Path(".data/backgrounds"), help="with folders train and val"
    )
    parser.add_argument("--settings", type=Path, default=HEADS)
    parser.add_argument("--blocks", action="store_true", help="only show what each block gains that is left float")
    return parser.parse_args()


def run(options: argparse.Namespace) -> None:
    settings = read_settings(options.settings, HeadSettings)
    if settings.bases not in FORMATS:
        raise ValueError(f"{options.settings}: bases {settings.bases!r} is not one of {', '.join(FORMATS)}")
    manifest, source = read_manifest(options.fp32), options.fp32 / ENCODER
    kept = read_manifest(options.keep) if options.keep else None
    prior = None if kept else float_prior(options.fp32 / PRIOR)
    views = options.data / "views"
    calibration = samples(training_crops(views, options.backgrounds, settings.crops))
    backgrounds = Backgrounds(options.backgrounds / "val")
    both = [*held_out_crops(views, backgrounds), *held_out_face_crops(views, backgrounds)]
    crops = spread(both, settings.held_out_crops)
    if options.blocks:
        print_blocks(source, settings.graphs["encoder"], calibration, crops)
        return
    given = samples(crops)
    options.out.mkdir(parents=True, exist_ok=True)
    quality = quantize_graphs(options.fp32, options.out, settings.graphs, {"encoder": calibration}, {"encoder": given})
    cells = {"fp32": cells_of(source, given), "int8": cells_of(options.out / ENCODER, given)}
    quality["encoder"] |= parts_sqnr(*cells.values())
    print("  dB: " + ", ".join(f"{name} {quality['encoder'][name]:.1f}" for name in PARTS))
    encoder_cost = {name: metrics_of(found, crops) for name, found in cells.items()}
    print_cost(encoder_cost, f"encoder, {len(crops)} crops")
    if kept:
        of_bases = kept["measured"]["bases_cost"]
        for name in (PRIOR, TEMPLATE):
            if (options.keep / name).exists() and options.keep.resolve() != options.out.resolve():
                shutil.copyfile(options.keep / name, options.out / name)
    else:
        heads = HeadTensors(read_points(options.data / "points", "val")[: settings.fitted_heads])
        of_bases = bases_cost(prior, settings.bases, heads)
        print_cost(of_bases, f"bases, {len(heads)} heads")
        of_bases |= {"stored_as": settings.bases, "heads": len(heads)}
        write_prior(prior, options.out / PRIOR, settings.bases)
    info = int8_info(
        options.name or options.out.name, manifest, quality, int8_cost=encoder_cost | {"crops": len(crops)},
        bases_cost=of_bases,
    )  # fmt: skip
    write_manifest(options.out, info)
    print(f"{options.out}: {bytes_of(options.fp32) / 1e6:.2f} -> {bytes_of(options.out) / 1e6:.2f} MB")


def main() -> None:
    torch.set_num_threads(1)
    try:
        run(parsed())
    except (OSError, ValueError) as error:
        raise SystemExit(f"Nothing was made int8: {error}") from error


if __name__ == "__main__":
    main()
