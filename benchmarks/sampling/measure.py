"""Measures sampled frames: PSNR, uncertainty, realism and time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch

from benchmarks.sampling import frechet, times, uncertainty
from benchmarks.sampling.continuations import GIVEN, MADE, SAMPLES, continued
from export.clips.clip import clip_paths, read_rgb
from export.prediction.data import Clips, read_clips
from export.prediction.image_error import psnr_db

AHEAD = (1, 2, 4, 8, 11)  # frames ahead in the tables
FAR = slice(4, MADE)  # 5 to 11 frames ahead


def psnr(images: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Returns the PSNR of each image [..., H, W, 3]: [...]."""
    both = (torch.from_numpy(np.ascontiguousarray(a).reshape(-1, *a.shape[-3:])) for a in (images, truth))
    return psnr_db(*both).numpy().reshape(images.shape[:-3])


def images_db(images: dict[str, np.ndarray], truth: np.ndarray) -> dict[str, np.ndarray]:
    """Returns PSNR by method [clips, MADE]: of the first sample, of the mean of samples, and of the best of N samples
    for each frame."""
    found = {name: psnr(own[:, 0], truth) for name, own in images.items()}
    samples = images["temperature 1"].shape[1]
    for name in [name for name in images if name.startswith("temperature")]:
        own = images[name]
        of_each = np.stack([psnr(own[:, s], truth) for s in range(own.shape[1])], 1)
        for count in [count for count in (4, 8, SAMPLES) if count <= own.shape[1]]:
            found[f"{name}, mean of {count}"] = psnr(own[:, :count].mean(1, dtype=np.float32), truth)
            found[f"{name}, best of {count}"] = of_each[:, :count].max(1)
    mean = images["temperature 1"].mean(1, dtype=np.float32)
    found[f"mean of auto and of {samples}"] = psnr(0.5 * (mean + images["auto"][:, 0]), truth)
    return found


def real_clips(data: Path, kind: str, count: int) -> np.ndarray:
    """Returns frames of training clips, as many as there are compared clips, spread evenly: uint8 [clips, MADE, 64, 64,
    3]."""
    paths = clip_paths(data, kind, "train")
    chosen = [paths[k] for k in np.linspace(0, len(paths) - 1, count).astype(int)] if paths else []
    return np.stack([read_rgb(path)[0][GIVEN : GIVEN + MADE] for path in chosen]) if chosen else np.empty(0)


def frechet_ratios(images: dict[str, np.ndarray], truth: np.ndarray, others: np.ndarray) -> dict[str, dict]:
    """Returns the distance from the true clips as a ratio of the last frame's, by kind of features and method."""
    network = frechet.FrameFeatures()
    shown = {name: network.of(own[:, 0]) for name, own in images.items()}
    if len(others):
        shown["other real clips"] = network.of(others)
    real, found = network.of(truth), {}
    for name, of in (("frames", frechet.stills), ("changes", frechet.changes)):
        distances = {method: frechet.frechet_distance(of(real), of(own)) for method, own in shown.items()}
        found[name] = {method: own / distances["last frame"] for method, own in distances.items()}
        found[name]["last frame, distance"] = distances["last frame"]
    return found


def clips_of(data: Path, kind: str, count: int | None) -> Clips:
    """Reads at most `count` validation clips. Raises SystemExit if there are none."""
    clips = read_clips(data, [kind], "val")
    count = min(count or len(clips), len(clips))
    return Clips(clips.frames[:count], clips.fps[:count], clips.names[:count])


def uncertainties(clips: Clips, images: dict[str, np.ndarray], bits: dict[str, np.ndarray]) -> dict[str, tuple]:
    """Returns an uncertainty measure of each cell and the error of the cell, by comparison: [clips, MADE, 16, 16]
    twice."""
    given, truth = (part.numpy() for part in clips.frames[:, : GIVEN + MADE].split((GIVEN, MADE), 1))
    sample_bits = bits["temperature 1"].mean(1)
    changed = np.broadcast_to(uncertainty.cell_errors(given[:, -2:-1], given[:, -1:]), sample_bits.shape)
    mean = uncertainty.cell_errors(images["temperature 1"].mean(1, dtype=np.float32), truth)
    of_auto = uncertainty.cell_errors(images["auto"][:, 0], truth)
    return {
        "likeliest, its bits": (
            bits["likeliest"][:, 0],
            uncertainty.cell_errors(images["likeliest"][:, 0], truth),
        ),
        "mean of samples, their bits": (sample_bits, mean),
        "mean of samples, latest change": (changed, mean),
        "auto, bits of samples": (sample_bits, of_auto),
        "auto, latest change": (changed, of_auto),
    }


def measure_images(
    clips: Clips, others: np.ndarray, bundle: Path, samples: int = SAMPLES
) -> tuple[dict, dict[str, float]]:
    """Returns the document, and all metrics except times. others: real clips of real_clips()."""
    truth = clips.frames[:, GIVEN : GIVEN + MADE].numpy()
    images, bits = continued(clips, bundle, samples)
    decibels = images_db(images, truth)
    document: dict = {"clips": len(clips), "given": GIVEN, "made": MADE, "ahead": list(AHEAD)}
    document |= {"psnr_db": {}, "rank": {}, "reliability": {}}
    better = np.maximum(decibels["last frame"].mean(0), decibels["motion"].mean(0))
    gained = {name: float((own.mean(0) - better)[FAR].mean()) for name, own in decibels.items()}
    document["gain_db"] = gained
    for name, own in decibels.items():
        document["psnr_db"][name] = [float(own[:, k - 1].mean()) for k in AHEAD]
    metrics = {"sampled_mean_gain_db": gained[f"temperature 1, mean of {min(samples, 8)}"]}
    for name, (uncertain, errors) in uncertainties(clips, images, bits).items():
        each = uncertainty.by_frame(uncertain, errors)
        document["rank"][name] = [float(each[:, k - 1].mean()) for k in AHEAD] + [float(each.mean())]
        document["reliability"][name] = uncertainty.reliability(uncertain, errors)
    metrics["uncertainty_rank"] = document["rank"]["mean of samples, their bits"][-1]
    document["frechet"] = frechet_ratios(images, truth, others)
    metrics["sampled_frechet_ratio"] = document["frechet"]["changes"]["temperature 1"]
    return document, metrics


def measure_times(clips: Clips, bundle: Path, threads: int) -> tuple[dict[str, float], dict[str, float]]:
    """Returns milliseconds by case, and the metrics of times."""
    found = times.times_ms(bundle, clips.frames[0].numpy(), 1 / float(clips.fps[0]), threads)
    return found, times.metrics_of(found)
