"""Writes the codes of clips, which the transformer is trained on, and says how many bits the table of codes needs.

    python -m export.prediction.codes --autoencoder .data/runs/prediction-autoencoder/weights.pt --sets pushing shapes

Writes codes-train.npz and codes-val.npz to --out: `codes` int16 [N, T, slices, 16, 16]; `motion` int16 [N, T,
horizons, slices, 16, 16], of the images that motion alone predicts (`motion_images.HORIZONS` frames after frame t),
-1 where there is none; `fps` [N], `names` [N]. Clips to train on are there mirrored as well. Needs the SDK's library,
for motion.
"""

from __future__ import annotations

import argparse
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from tqdm import tqdm

from export.jobs import Workers, results
from export.prediction.autoencoder import Autoencoder
from export.prediction.codebook import used_fraction
from export.prediction.config import CODE_SIDE
from export.prediction.data import Clips, read_clips
from export.prediction.motion_images import HORIZONS, MotionJob, is_known, motion_pictures
from export.prediction.table import CodeTable, bits_by_frequency, bits_by_table
from export.prediction.train_autoencoder import load_autoencoder
from export.prediction.transformer import UNSEEN

_AT_ONCE = 512  # images


@dataclass(frozen=True, eq=False)
class CodedClips:
    """codes int16 [N, T, slices, 16, 16]; fps float32 [N]; names: set and file of each; motion int16 [N, T, horizons,
    slices, 16, 16], or None: that of what motion predicts was not made."""

    codes: Tensor
    fps: Tensor
    names: list[str]
    motion: Tensor | None = None

    def __len__(self) -> int:
        return len(self.names)

    def on(self, device: torch.device) -> CodedClips:
        motion = None if self.motion is None else self.motion.to(device)
        return CodedClips(self.codes.to(device), self.fps.to(device), self.names, motion)


def encoded(net: Autoencoder, frames: Tensor) -> Tensor:
    """uint8 [N, 64, 64, 3] -> codes int16 [N, slices, 16, 16], on the network's device."""
    return torch.cat([net.encode(part).short() for part in frames.split(_AT_ONCE)])


def coded_clips(net: Autoencoder, clips: Clips, mirrored: bool, workers: Workers) -> CodedClips:
    """On the CPU. mirrored: each clip mirrored as well, right behind it."""
    device = next(net.parameters()).device
    count, frames = clips.frames.shape[:2]
    ways = 2 if mirrored else 1
    images_of_frame = 1 + len(HORIZONS)
    size = (net.shape.slices, CODE_SIDE, CODE_SIDE)
    found = torch.empty(count, ways, frames, images_of_frame, *size, dtype=torch.int16)
    jobs = [MotionJob(k, clips.frames[k].numpy(), float(clips.fps[k])) for k in range(count)]
    with tqdm(total=count, unit="clip", desc="motion and codes", leave=False) as bar:
        for job, moved in results(workers.run(motion_pictures, jobs)):
            pictures = torch.from_numpy(np.concatenate([job.frames[:, None], moved], 1)).to(device)
            both = torch.stack([pictures, pictures.flip(-2)][:ways])
            found[job.number] = encoded(net, both.flatten(0, 2)).view(found.shape[1:]).cpu()
            bar.update()
    names = [name + end for name in clips.names for end in ("", " mirrored")[:ways]]
    codes, motion = found[:, :, :, 0].flatten(0, 1), found[:, :, :, 1:].flatten(0, 1)
    motion[:, ~torch.tensor([[is_known(t, h, frames) for h in HORIZONS] for t in range(frames)])] = UNSEEN
    return CodedClips(codes, clips.fps.repeat_interleave(ways), names, motion)


def write_codes(clips: CodedClips, path: Path) -> None:
    """Not compressed: a gigabyte of small numbers would take minutes."""
    partial = path.with_name(f".{path.name}.partial")
    more = {} if clips.motion is None else {"motion": clips.motion.numpy()}
    with partial.open("wb") as file:
        np.savez(file, codes=clips.codes.numpy(), fps=clips.fps.numpy(), names=np.array(clips.names), **more)
    partial.rename(path)


def read_codes(folder: Path, split: str) -> CodedClips:
    """Raises SystemExit where there are none."""
    path = folder / f"codes-{split}.npz"
    if not path.exists():
        raise SystemExit(f"{path} does not exist. Write it: python -m export.prediction.codes --out {folder}")
    with np.load(path) as stored:
        motion = torch.from_numpy(stored["motion"]) if "motion" in stored else None
        codes, fps = torch.from_numpy(stored["codes"]), torch.from_numpy(stored["fps"])
        return CodedClips(codes, fps, stored["names"].tolist(), motion)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--autoencoder", type=Path, default=Path(".data/runs/prediction-autoencoder/weights.pt"))
    parser.add_argument("--data", type=Path, default=Path(".data/clips"))
    parser.add_argument("--sets", nargs="+", default=["pushing", "shapes"], help="default %(default)s")
    parser.add_argument("--out", type=Path, default=Path(".data/prediction"))
    parser.add_argument("--threads", type=int, help="default: one a core")
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu", help="default %(default)s")
    Workers.add_arguments(parser, os.cpu_count())
    options = parser.parse_args()
    if options.threads:
        torch.set_num_threads(options.threads)
    net = load_autoencoder(options.autoencoder).to(options.device)
    options.out.mkdir(parents=True, exist_ok=True)
    entries = net.shape.entries
    for split in ("train", "val"):
        read = read_clips(options.data, options.sets, split)
        clips = coded_clips(net, read, split == "train", Workers.of(options))
        write_codes(clips, options.out / f"codes-{split}.npz")
        equal = float((clips.codes[:, 1:] == clips.codes[:, :-1]).float().mean())
        used = used_fraction(clips.codes.flatten(0, 1), entries)
        print(f"{split}: {len(clips)} clips, {equal:.0%} of codes equal those before, {used:.0%} of entries used")
    train, val = (read_codes(options.out, split).on(torch.device(options.device)) for split in ("train", "val"))
    table = CodeTable.counted(train.codes, entries)
    by_frequency, by_table = bits_by_frequency(table, val.codes).mean(), bits_by_table(table, val.codes).mean()
    print(f"bits a code, held out: {by_frequency:.3f} by frequency, {by_table:.3f} by the table")


if __name__ == "__main__":
    main()
