"""Quantizes a fp32 bundle of export.prediction to int8, calibrated on frames of rendered clips.

    python -m quantization.prediction --fp32 .data/bundles/prediction-fp32 --out .data/bundles/prediction-int8

`quantization/prediction.toml` lists layers that stay float; `quantization/transformer.py` quantizes the transformer.
The command prints sizes, the signal-to-noise ratio of each output, and the cost of int8 on frames of validation clips:
the fraction of equal codes, the PSNR of reconstructed frames, and the transformer's bits a code.
"""

from __future__ import annotations

import argparse
import shutil
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch
from tqdm import tqdm

from export.bundle import bytes_of, read_manifest
from export.densepose.graphs import session
from export.prediction.bundle import CODES, GRAPHS, TRANSFORMER, write_manifest
from export.prediction.code_file import FrameCodes, read_code_file
from export.prediction.codes import read_codes
from export.prediction.data import read_clips
from export.prediction.image_error import psnr_db
from quantization.quantize import int8_info, quantize_graphs
from quantization.samples import Sample
from quantization.settings import PREDICTION, PredictionSettings, read_settings
from quantization.transformer import quantize_transformer, transformer_cost


def frames_of(data: Path, sets: Sequence[str], split: str, count: int) -> np.ndarray:
    """uint8 [count, 64, 64, 3], evenly over all clips of a split. Raises SystemExit where there are none."""
    frames = read_clips(data, list(sets), split).frames.flatten(0, 1)
    return frames[np.linspace(0, len(frames) - 1, min(count, len(frames))).astype(int)].numpy()


def codes_of(features: np.ndarray, codes: FrameCodes) -> np.ndarray:
    """Numbers of the nearest entries, [cells, slices]; the lowest of equals. features [1, side, side, slices *
    width]."""
    slices, _, width = codes.entries.shape
    own = features.reshape(-1, slices, width).transpose(1, 0, 2)
    distance = (codes.entries**2).sum(-1)[:, None] - 2 * own @ codes.entries.transpose(0, 2, 1)
    return distance.argmin(-1).T


def entries_of(numbers: np.ndarray, codes: FrameCodes) -> np.ndarray:
    """Decoder input of codes [cells, slices]: float32 [1, side, side, slices * width]."""
    picked = np.stack([codes.entries[k][own] for k, own in enumerate(numbers.T)], 1)
    return np.ascontiguousarray(picked.reshape(1, codes.side, codes.side, -1))


def samples(folder: Path, frames: np.ndarray, codes: FrameCodes) -> dict[str, list[Sample]]:
    """Inputs of each graph of a fp32 bundle for frames."""
    encoder = session(folder / "encoder.onnx")
    images: list[Sample] = [{"image": frame[None].astype(np.float32)} for frame in frames]
    seen = [encoder.run(None, image)[0] for image in images]
    return {"encoder": images, "decoder": [{"features": entries_of(codes_of(own, codes), codes)} for own in seen]}


def cost(fp32: Path, int8: Path, frames: np.ndarray, codes: FrameCodes) -> dict[str, float]:
    """equal_codes: the share that is the same in both; psnr_db of rebuilt frames, of each."""
    numbers, rebuilt = {}, {}
    for name, folder in (("fp32", fp32), ("int8", int8)):
        encoder, decoder = session(folder / "encoder.onnx"), session(folder / "decoder.onnx")
        seen, made = [], []
        for frame in tqdm(frames, desc=name, unit="frame", leave=False):
            seen.append(codes_of(encoder.run(None, {"image": frame[None].astype(np.float32)})[0], codes))
            made.append(decoder.run(None, {"features": entries_of(seen[-1], codes)})[0])
        numbers[name], rebuilt[name] = np.stack(seen), torch.from_numpy(np.concatenate(made))
    truth = torch.from_numpy(frames)
    metrics = {f"psnr_db_{name}": round(float(psnr_db(own, truth).mean()), 2) for name, own in rebuilt.items()}
    return {"equal_codes": round(float((numbers["fp32"] == numbers["int8"]).mean()), 4)} | metrics


Quality = dict[str, dict[str, float]]  # signal to noise in dB, by graph and output


def quantized_images(options: argparse.Namespace, settings: PredictionSettings) -> tuple[Quality, dict[str, float]]:
    """Writes the graphs that see or make images into the int8 bundle; returns their quality and what int8 costs."""
    codes = read_code_file(options.fp32 / CODES)
    calibrating = frames_of(options.data, options.sets, "train", settings.frames)
    held_out = frames_of(options.data, options.sets, "val", settings.held_out_frames)
    given = samples(options.fp32, calibrating, codes), samples(options.fp32, held_out, codes)
    graphs = {name: settings.graphs[name] for name in GRAPHS}
    quality = quantize_graphs(options.fp32, options.out, graphs, *given)
    return quality, cost(options.fp32, options.out, held_out, codes)


def kept_images(options: argparse.Namespace) -> tuple[Quality, dict[str, float]]:
    """The same from the bundle to be kept. Raises SystemExit where that has other codes."""
    if (options.keep / CODES).read_bytes() != (options.fp32 / CODES).read_bytes():
        raise SystemExit(f"{options.keep} has other codes than {options.fp32}: leave --keep out.")
    for name in GRAPHS if options.keep.resolve() != options.out.resolve() else ():
        shutil.copyfile(options.keep / f"{name}.onnx", options.out / f"{name}.onnx")
    measured = read_manifest(options.keep)["measured"]
    of_images = {name: own for name, own in measured["int8_cost"].items() if name.startswith(("equal", "psnr"))}
    return {name: own for name, own in measured["sqnr_db"].items() if name in GRAPHS}, of_images


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fp32", type=Path, default=Path(".data/bundles/prediction-fp32"))
    parser.add_argument("--out", type=Path, default=Path(".data/bundles/prediction-int8"))
    parser.add_argument("--name", help="default: the folder's name")
    parser.add_argument("--data", type=Path, default=Path(".data/clips"))
    parser.add_argument("--codes", type=Path, default=Path(".data/prediction"), help="of clips, for the transformer")
    parser.add_argument("--sets", nargs="+", default=["pushing", "shapes"], help="default %(default)s")
    parser.add_argument("--settings", type=Path, default=PREDICTION)
    parser.add_argument(
        "--keep", type=Path, metavar="DIR", help="int8 bundle of the same codes: its autoencoder is taken as it is"
    )
    options = parser.parse_args()
    settings = read_settings(options.settings, PredictionSettings)
    options.out.mkdir(parents=True, exist_ok=True)
    quality, measured = kept_images(options) if options.keep else quantized_images(options, settings)
    print(", ".join(f"{name} {value}" for name, value in measured.items()))
    shutil.copyfile(options.fp32 / CODES, options.out / CODES)
    (options.out / TRANSFORMER).unlink(missing_ok=True)  # of an earlier bundle
    if (options.fp32 / TRANSFORMER).exists():
        calibrating = read_codes(options.codes, "train")
        quantize_transformer(options.fp32, options.out, calibrating, settings.frames)
        clips = read_codes(options.codes, "val")
        by_transformer = transformer_cost(options.fp32, options.out, clips, settings.held_out_frames)
        print(", ".join(f"{name} {value}" for name, value in by_transformer.items()))
        measured |= by_transformer
    info = int8_info(options.name or options.out.name, read_manifest(options.fp32), quality, int8_cost=measured)
    write_manifest(options.out, info)
    print(f"{options.out}: {bytes_of(options.out) / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
