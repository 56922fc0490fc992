"""Compares the networks with the last frame, with motion, and with the SDK's `auto` on held-out clips, by frames ahead.

    python -m export.prediction.refiner.evaluate --sets pushing --split val

Prints PSNR in dB at 64 x 64 pixels, the mean over frames spread over all clips. `convolutional` predicts from frames
alone, `mender` refines the prediction of `auto`. `best` is the better one of the last frame and motion; a useful
network is above it.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from tqdm import tqdm

from export.prediction.data import Clips, read_clips
from export.prediction.motion_images import HORIZONS, MotionJob, motion_pictures
from export.prediction.refiner.auto_predictions import foreseen
from export.prediction.refiner.convolutional import ConvolutionalNet, times_ahead
from export.prediction.refiner.image_error import psnr_db
from export.prediction.refiner.train_convolutional import load_convolutional

Rows = dict[str, dict[int, list[float]]]  # PSNR of each frame by method and frames ahead


@dataclass(frozen=True, eq=False)
class Networks:
    """A network that is None is left out."""

    convolutional: ConvolutionalNet | None
    mender: ConvolutionalNet | None


@torch.no_grad()
def pictures_of(
    networks: Networks, frames: Tensor, by_motion: Tensor, by_auto: Tensor, fps: float, now: int, h: int
) -> dict[str, Tensor]:
    """Predictions of each method HORIZONS[h] frames after frame `now` of a clip uint8 [T, 64, 64, 3]."""
    last, moved = frames[now][None].float(), by_motion[now, h][None].float()
    found = {"last": last, "motion": moved, "auto": by_auto[now, h][None].float()}
    times = times_ahead(torch.tensor([fps]), torch.tensor([float(HORIZONS[h])]))
    for name, net in (("convolutional", networks.convolutional), ("mender", networks.mender)):
        if net is not None:
            shown = [
                frames[now + 1 - net.shape.frames : now + 1],
                *([by_auto[now, h][None]] if net.shape.motion else []),
            ]
            found[name] = net.predicted(torch.cat(shown)[None], times)
    return found


def measured(networks: Networks, clips: Clips, stride: int) -> Rows:
    rows: Rows = {}
    for k in tqdm(range(len(clips)), unit="clip", leave=False):
        frames, fps = clips.frames[k], float(clips.fps[k])
        by_motion = torch.from_numpy(motion_pictures(MotionJob(k, frames.numpy(), fps)))
        by_auto = torch.from_numpy(foreseen(frames.numpy(), fps))
        for now in range(3, len(frames) - 1, stride):
            for h, horizon in enumerate(HORIZONS):
                if now + horizon >= len(frames):
                    continue
                truth = frames[now + horizon][None]
                found = {
                    name: float(psnr_db(picture, truth)) for name, picture in
                    pictures_of(networks, frames, by_motion, by_auto, fps, now, h).items()
                }  # fmt: skip
                found["best"] = max(found["last"], found["motion"])
                for name, decibels in found.items():
                    rows.setdefault(name, {}).setdefault(horizon, []).append(decibels)
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=Path(".data/clips"))
    parser.add_argument("--sets", nargs="+", default=["pushing"], help="default %(default)s")
    parser.add_argument("--split", choices=("val", "test"), default="val")
    parser.add_argument("--runs", type=Path, default=Path(".data/runs"), help="prediction-*/weights.pt in it")
    parser.add_argument("--stride", type=int, default=5, help="frames between those predicted from")
    options = parser.parse_args()

    def there(name: str) -> Path | None:
        path = options.runs / f"prediction-{name}" / "weights.pt"
        return path if path.exists() else None

    networks = Networks(
        *(load_convolutional(path) if (path := there(name)) else None for name in ("convolutional", "mender"))
    )
    rows = measured(networks, read_clips(options.data, options.sets, options.split), options.stride)
    print("| dB | " + " | ".join(map(str, HORIZONS)) + " |")
    print("| --- |" + " --- |" * len(HORIZONS))
    for name, by_horizon in rows.items():
        print(f"| {name} | " + " | ".join(f"{np.mean(by_horizon[h]):.2f}" for h in HORIZONS) + " |")


if __name__ == "__main__":
    main()
