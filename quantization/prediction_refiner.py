"""Quantizes the refiner to int8 and writes it into an int8 bundle of prediction, in place of the one there.

    python -m export.prediction.refiner.auto_predictions --split train      # and --split val, first
    python -m quantization.prediction_refiner --weights .data/runs/prediction-refiner/weights.pt \\
        --bundle sdk/models/prediction-int8

Calibration and validation use predictions of clips by `auto`. The command prints sizes, signal-to-noise ratios, and the
PSNR of refined images in float and int8 beside the PSNR of `auto`. The rest of the bundle stays as it is.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch

from export.bundle import BundleInfo, bytes_of, read_manifest
from export.densepose.graphs import session
from export.prediction.bundle import write_manifest
from export.prediction.motion_images import HORIZONS
from export.prediction.refiner.auto_predictions import read_predictions
from export.prediction.refiner.convolutional import times_ahead
from export.prediction.refiner.image_error import psnr_db
from export.prediction.refiner.refiner_graph import REFINED, export_refined
from export.prediction.refiner.train_convolutional import load_convolutional
from quantization.quantize import as_measured, quantize_graphs
from quantization.samples import Sample
from quantization.settings import PREDICTION, PredictionSettings, read_settings


def refined_samples(
    folder: Path, sets: Sequence[str], split: str, count: int, before: int
) -> tuple[list[Sample], np.ndarray]:
    """Inputs of the graph, evenly over clips and times ahead, and what came then, uint8 [count, 64, 64, 3]. folder:
    what `export.prediction.refiner.auto_predictions` wrote. Raises SystemExit where there is nothing."""
    known = read_predictions([folder], list(sets), split)
    clips = known.clips
    total = clips.frames.shape[1]
    samples: list[Sample] = []
    truth = []
    for k in range(count):
        clip, h = k * len(clips) // count, k % len(HORIZONS)
        frames, fps = clips.frames[clip], clips.fps[clip]
        now = before - 1 + (7 * k) % (total - before - HORIZONS[h])
        shown = torch.cat([*frames[now + 1 - before : now + 1], known.pictures[clip, now, h]], -1)[None].float()
        times = times_ahead(fps[None], torch.tensor([HORIZONS[h]]))
        samples.append({"pictures": shown.numpy(), "times": times.numpy()})
        truth.append(frames[now + HORIZONS[h]].numpy())
    return samples, np.stack(truth)


def refined_cost(graphs: dict[str, Path], samples: Sequence[Sample], truth: np.ndarray) -> dict[str, float]:
    """PSNR of what each graph gives, as mended_db_NAME, and of its input, foreseen_db."""
    wanted = torch.from_numpy(truth)
    predictions = torch.from_numpy(np.concatenate([sample["pictures"][..., -3:] for sample in samples]))
    found = {"foreseen_db": round(float(psnr_db(predictions, wanted).mean()), 2)}
    for name, path in graphs.items():
        graph = session(path)
        made = torch.from_numpy(np.concatenate([graph.run(None, sample)[0] for sample in samples]))
        found[f"mended_db_{name}"] = round(float(psnr_db(made, wanted).mean()), 2)
    return found


def put_refined(
    weights: Path, bundle: Path, predictions: Path, sets: Sequence[str], settings: PredictionSettings
) -> dict:
    """Returns the new manifest. Raises ValueError for weights of a network that is not shown the prediction."""
    net = load_convolutional(weights)
    counts = {"train": settings.frames, "val": settings.held_out_frames}
    given = {split: refined_samples(predictions, sets, split, n, net.shape.frames) for split, n in counts.items()}
    graph = f"{REFINED}.onnx"
    with tempfile.TemporaryDirectory() as folder:
        fp32, int8 = Path(folder) / "fp32", Path(folder) / "int8"
        fp32.mkdir()
        int8.mkdir()
        export_refined(net, fp32)
        calibrating, held_out = ({REFINED: samples} for samples, _ in given.values())
        quality = quantize_graphs(fp32, int8, {REFINED: settings.graphs[REFINED]}, calibrating, held_out)
        cost = refined_cost({"fp32": fp32 / graph, "int8": int8 / graph}, *given["val"])
        shutil.copyfile(int8 / graph, bundle / graph)
    print(", ".join(f"{name} {value}" for name, value in cost.items()))
    known = read_manifest(bundle)
    measured = {part: dict(values) for part, values in known["measured"].items()}
    measured.setdefault("sqnr_db", {}).update(as_measured(quality))
    measured.setdefault("int8_cost", {}).update(cost)
    about = {key: known[key] for key in ("name", "precision", "version", "training_data")}
    return write_manifest(bundle, BundleInfo(**about, measured=measured))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--weights", type=Path, default=Path(".data/runs/prediction-refiner/weights.pt"))
    parser.add_argument("--bundle", type=Path, default=Path(".data/bundles/prediction-int8"))
    parser.add_argument("--predictions", type=Path, default=Path(".data/prediction/auto"))
    parser.add_argument("--sets", nargs="+", default=["pushing", "collages"], help="default %(default)s")
    parser.add_argument("--settings", type=Path, default=PREDICTION)
    options = parser.parse_args()
    settings = read_settings(options.settings, PredictionSettings)
    put_refined(options.weights, options.bundle, options.predictions, options.sets, settings)
    print(f"{options.bundle}: {bytes_of(options.bundle) / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
