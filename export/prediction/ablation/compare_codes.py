"""Autoencoders with more or fewer codes, side by side: error of rebuilt frames, entries used, bits, time.

    for s in 1 2 4; do python -m export.prediction.train_autoencoder --slices $s --steps 700 --batch 16 \\
        --warm-up 100 --out .data/runs/codes/$s; done
    python -m export.prediction.ablation.compare_codes .data/runs/codes/*/weights.pt

Of held-out clips and of real ones (.data/photos/clip, squeezed to 64 x 64): PSNR of rebuilt frames in dB, fraction of
entries used, bits a frame of all its codes by their frequency and by the table of what follows which, both counted on
the same clips to train on; milliseconds of one frame to codes and back, the median, in torch on one thread.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import cv2
import numpy as np
import torch
from torch import Tensor
from tqdm import tqdm

from export.prediction.autoencoder import Autoencoder
from export.prediction.codebook import used_fraction
from export.prediction.data import Clips, read_clips
from export.prediction.pictures.picture_error import psnr_db, rebuilt
from export.prediction.table import CodeTable, bits_by_frequency, bits_by_table
from export.prediction.train_autoencoder import load_autoencoder

HEAD = (
    "codes",
    "entries",
    "places",
    "parameters, M",
    "used",
    "frequency, bits",
    "table, bits",
    "to codes, ms",
    "back, ms",
)
_SIDE_PX = 64
_FRAMES_OF_FILM = 40


def real_frames(folder: Path) -> dict[str, Tensor]:
    """Frames spread over each real clip, as networks see them: uint8 [T, 64, 64, 3] by name; none where there is no
    clip."""
    found = {}
    for path in sorted(folder.glob("*.*")):
        capture = cv2.VideoCapture(str(path))
        step = max(1, int(capture.get(cv2.CAP_PROP_FRAME_COUNT)) // _FRAMES_OF_FILM)
        frames, number = [], 0
        while capture.grab():
            if number % step == 0:
                frame = capture.retrieve()[1][..., ::-1]
                frames.append(cv2.resize(frame, (_SIDE_PX, _SIDE_PX), interpolation=cv2.INTER_AREA))
            number += 1
        if frames:
            found[path.stem] = torch.from_numpy(np.ascontiguousarray(np.stack(frames)))
    return found


def codes_of(net: Autoencoder, clips: Clips) -> Tensor:
    """int16 [N, T, slices, side, side]."""
    return torch.stack([net.encode(frames).short() for frames in clips.frames])


def times_ms(net: Autoencoder, frame: Tensor, rounds: int = 30) -> tuple[float, float]:
    """Of one frame uint8 [1, 64, 64, 3]: to codes, and back."""
    codes = net.encode(frame)
    found: list[list[float]] = [[], []]
    for _ in range(rounds):
        for own, work, given in zip(found, (net.encode, net.decode), (frame, codes), strict=True):
            begin = time.perf_counter()
            work(given)
            own.append(1e3 * (time.perf_counter() - begin))
    return float(np.median(found[0])), float(np.median(found[1]))


def row_of(net: Autoencoder, counted: Clips, held_out: Clips, real: dict[str, Tensor]) -> tuple[list[str], list[str]]:
    """The cells of HEAD, and PSNR of held-out clips and of each real one."""
    shape = net.shape
    codes = codes_of(net, held_out)
    table = CodeTable.counted(codes_of(net, counted), shape.entries)
    of_frame = codes[0, 0].numel()
    bits = [float(by(table, codes).mean()) * of_frame for by in (bits_by_frequency, bits_by_table)]
    parameters = sum(p.numel() for p in net.parameters()) / 1e6
    used = used_fraction(codes.flatten(0, 1), shape.entries)
    milliseconds = times_ms(net, held_out.frames[0, :1])
    cells = [str(shape.slices), str(shape.entries), f"{shape.side} x {shape.side}", f"{parameters:.2f}", f"{used:.0%}",
             *(f"{own:.0f}" for own in bits), *(f"{own:.1f}" for own in milliseconds)]  # fmt: skip
    pictures = [held_out.frames[:, ::5].flatten(0, 1), *real.values()]
    return cells, [f"{float(psnr_db(rebuilt(net, own)[0], own).mean()):.2f}" for own in pictures]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("weights", type=Path, nargs="+", metavar="WEIGHTS", help="of train_autoencoder")
    parser.add_argument("--data", type=Path, default=Path(".data/clips"))
    parser.add_argument("--set", default="pushing", help="default %(default)s")
    parser.add_argument("--photos", type=Path, default=Path(".data/photos/clip"), help="folder of real clips")
    parser.add_argument("--counted", type=int, default=120, help="clips that tables are counted on")
    parser.add_argument("--threads", type=int, default=1)
    options = parser.parse_args()
    torch.set_num_threads(options.threads)
    counted, held_out = (read_clips(options.data, [options.set], split) for split in ("train", "val"))
    count = min(options.counted, len(counted))
    counted = Clips(counted.frames[:count], counted.fps[:count], counted.names[:count])
    real = real_frames(options.photos)
    print("| " + " | ".join([*HEAD, f"{options.set}, dB", *(f"{name}, dB" for name in real)]) + " |")
    print("|" + " --- |" * (len(HEAD) + 1 + len(real)))
    for path in tqdm(options.weights, disable=None):
        cells, decibels = row_of(load_autoencoder(path), counted, held_out, real)
        print("| " + " | ".join([*cells, *decibels]) + " |", flush=True)


if __name__ == "__main__":
    main()
