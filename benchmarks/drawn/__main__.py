"""How near frames that are drawn are to the truth, what their uncertainty is worth, and how real they look.

    python -m benchmarks.drawn                   validation clips of pushing, 5 frames given, 11 made (10 minutes)
    python -m benchmarks.drawn --clips 4         fewer clips, to see that it runs
    python -m benchmarks.drawn --times           how long drawing takes, on a quiet machine; nothing else

Needs clips of `export.clips` (.data/clips/pushing/val; for the distance of real clips from one another, train too) and
the built library (`make build`).
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
import torch

from benchmarks.drawn import frechet, times, uncertainty
from benchmarks.drawn.continuations import GIVEN, MADE, SAMPLES, went_on
from benchmarks.prediction import BUNDLE
from export.clips.clip import clip_paths, read_rgb
from export.prediction.data import Clips, read_clips
from export.prediction.pictures.picture_error import psnr_db

AHEAD = (1, 2, 4, 8, 11)  # frames, of tables
FAR = slice(4, MADE)  # 5 to 11 frames ahead


def psnr(pictures: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Of each picture [..., 64, 64, 3]: [...]."""
    both = (torch.from_numpy(np.ascontiguousarray(a).reshape(-1, *a.shape[-3:])) for a in (pictures, truth))
    return psnr_db(*both).numpy().reshape(pictures.shape[:-3])


def pictures_db(pictures: dict[str, np.ndarray], truth: np.ndarray) -> dict[str, np.ndarray]:
    """By method [clips, MADE]: of several samples the first, their mean, and the best of so many for each frame."""
    found = {name: psnr(own[:, 0], truth) for name, own in pictures.items()}
    for name, counts in (("temperature 0.5", (4,)), ("temperature 1", (4, 8, SAMPLES))):
        own = pictures[name]
        of_each = psnr(own, np.broadcast_to(truth[:, None], own.shape))
        for count in counts:
            found[f"{name}, mean of {count}"] = psnr(own[:, :count].mean(1, dtype=np.float32), truth)
            found[f"{name}, best of {count}"] = of_each[:, :count].max(1)
    half = 0.5 * (pictures["temperature 1"].mean(1, dtype=np.float32) + pictures["auto"][:, 0])
    found[f"mean of auto and of {SAMPLES}"] = psnr(half, truth)
    return found


def real_clips(data: Path, kind: str, count: int) -> np.ndarray:
    """Frames of clips to train on, as many as are compared: uint8 [clips, MADE, 64, 64, 3]; spread over all."""
    paths = clip_paths(data, kind, "train")
    chosen = [paths[k] for k in np.linspace(0, len(paths) - 1, count).astype(int)] if paths else []
    return np.stack([read_rgb(path)[0][GIVEN : GIVEN + MADE] for path in chosen]) if chosen else np.empty(0)


def frechet_ratios(pictures: dict[str, np.ndarray], truth: np.ndarray, others: np.ndarray) -> dict[str, dict]:
    """By kind of features, by method: the distance from the true clips as a share of the last frame's."""
    network = frechet.FrameFeatures()
    shown = {name: network.of(own[:, 0]) for name, own in pictures.items()}
    if len(others):
        shown["other real clips"] = network.of(others)
    real, found = network.of(truth), {}
    for name, of in (("frames", frechet.stills), ("changes", frechet.changes)):
        distances = {method: frechet.frechet_distance(of(real), of(own)) for method, own in shown.items()}
        found[name] = {method: own / distances["last frame"] for method, own in distances.items()}
        found[name]["last frame, distance"] = distances["last frame"]
    return found


def table(title: list[str], rows: dict[str, list[str]]) -> None:
    print(" | ".join(title))
    for name, cells in rows.items():
        print(" | ".join([name, *cells]))
    print(flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.drawn", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--bundle", type=Path, default=BUNDLE)
    parser.add_argument("--data", type=Path, default=Path(".data/clips"))
    parser.add_argument("--set", default="pushing", help="default %(default)s")
    parser.add_argument("--clips", type=int, help="at most so many; default: all")
    parser.add_argument("--times", action="store_true")
    parser.add_argument("--threads", type=int, default=1, help="with --times (default %(default)s)")
    options = parser.parse_args()
    clips = read_clips(options.data, [options.set], "val")
    count = min(options.clips or len(clips), len(clips))
    clips = Clips(clips.frames[:count], clips.fps[:count], clips.names[:count])
    if options.times:
        found = times.times_ms(options.bundle, clips.frames[0].numpy(), 1 / float(clips.fps[0]), options.threads)
        table(["case", "ms"], {name: [f"{own:.1f}"] for name, own in found.items()})
        print(json.dumps(times.figures_of(found)))
        return
    truth = clips.frames[:, GIVEN : GIVEN + MADE].numpy()
    pictures, bits = went_on(clips, options.bundle)
    figures: dict[str, float] = {}

    decibels = pictures_db(pictures, truth)
    rows = {name: [f"{own[:, k - 1].mean():.2f}" for k in AHEAD] for name, own in decibels.items()}
    table(["PSNR, frames ahead", *map(str, AHEAD)], rows)
    better = np.maximum(decibels["last frame"].mean(0), decibels["motion"].mean(0))
    figures["drawn_mean_gain_db"] = float((decibels["temperature 1, mean of 8"].mean(0) - better)[FAR].mean())

    correlations, parts = {}, {}
    for name, of in (("likeliest", 0), ("temperature 1", slice(None))):
        own = bits[name].mean(1)
        made = pictures[name][:, of].mean(1, dtype=np.float32) if name == "temperature 1" else pictures[name][:, of]
        errors = uncertainty.cell_errors(made, truth)
        each = uncertainty.by_frame(own, errors)
        correlations[name] = [f"{each[:, k - 1].mean():.2f}" for k in AHEAD] + [f"{each.mean():.3f}"]
        parts[name] = [f"{own_bits:.2f}: {error:.1f}" for own_bits, error in uncertainty.reliability(own, errors)]
        figures[f"uncertainty_rank_{name.split()[0]}"] = float(each.mean())
    figures["uncertainty_rank"] = figures.pop("uncertainty_rank_temperature")
    table(["rank correlation of bits and error, frames ahead", *map(str, AHEAD), "all"], correlations)
    table(["bits of a code: error in grey levels, fifths of all cells"], parts)

    ratios = frechet_ratios(pictures, truth, real_clips(options.data, options.set, count))
    rows = {method: [f"{ratios[kind][method]:.3f}" for kind in ratios] for method in ratios["frames"]}
    table(["Fréchet distance, share of the last frame's", *ratios], rows)
    figures["drawn_frechet_ratio"] = ratios["changes"]["temperature 1"]
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
