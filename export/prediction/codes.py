"""Writes the codes of clips, which the transformer is trained on, and says how many bits the table of codes needs.

    python -m export.prediction.codes --autoencoder .data/runs/prediction-autoencoder/weights.pt --sets pushing shapes

Writes codes-train.npz and codes-val.npz to --out: `codes` uint16 [N, T, slices, 16, 16], `fps` [N], `names` [N].
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from tqdm import tqdm

from export.prediction.autoencoder import Autoencoder
from export.prediction.codebook import used_fraction
from export.prediction.data import Clips, read_clips
from export.prediction.table import CodeTable, bits_by_frequency, bits_by_table
from export.prediction.train_autoencoder import load_autoencoder


@dataclass(frozen=True, eq=False)
class CodedClips:
    """codes int64 [N, T, slices, 16, 16]; fps float32 [N]; names: set and file of each."""

    codes: Tensor
    fps: Tensor
    names: list[str]

    def __len__(self) -> int:
        return len(self.names)


def encoded(net: Autoencoder, clips: Clips) -> CodedClips:
    codes = [net.encode(frames) for frames in tqdm(clips.frames, unit="clip", desc="encoding", leave=False)]
    return CodedClips(torch.stack(codes), clips.fps, clips.names)


def write_codes(clips: CodedClips, path: Path) -> None:
    partial = path.with_name(f".{path.name}.partial")
    with partial.open("wb") as file:
        np.savez_compressed(
            file, codes=clips.codes.numpy().astype(np.uint16), fps=clips.fps.numpy(), names=np.array(clips.names)
        )
    partial.rename(path)


def read_codes(folder: Path, split: str) -> CodedClips:
    """Raises SystemExit where there are none."""
    path = folder / f"codes-{split}.npz"
    if not path.exists():
        raise SystemExit(f"{path} does not exist. Write it: python -m export.prediction.codes --out {folder}")
    with np.load(path) as stored:
        codes = torch.from_numpy(stored["codes"].astype(np.int64))
        return CodedClips(codes, torch.from_numpy(stored["fps"]), stored["names"].tolist())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--autoencoder", type=Path, default=Path(".data/runs/prediction-autoencoder/weights.pt"))
    parser.add_argument("--data", type=Path, default=Path(".data/clips"))
    parser.add_argument("--sets", nargs="+", default=["pushing", "shapes"], help="default %(default)s")
    parser.add_argument("--out", type=Path, default=Path(".data/prediction"))
    parser.add_argument("--threads", type=int, help="default: one a core")
    options = parser.parse_args()
    if options.threads:
        torch.set_num_threads(options.threads)
    net = load_autoencoder(options.autoencoder)
    options.out.mkdir(parents=True, exist_ok=True)
    entries = net.shape.entries
    for split in ("train", "val"):
        clips = encoded(net, read_clips(options.data, options.sets, split))
        write_codes(clips, options.out / f"codes-{split}.npz")
        equal = float((clips.codes[:, 1:] == clips.codes[:, :-1]).float().mean())
        used = used_fraction(clips.codes.flatten(0, 1), entries)
        print(f"{split}: {len(clips)} clips, {equal:.0%} of codes equal those before, {used:.0%} of entries used")
    train, val = (read_codes(options.out, split) for split in ("train", "val"))
    table = CodeTable.counted(train.codes, entries)
    by_frequency, by_table = bits_by_frequency(table, val.codes).mean(), bits_by_table(table, val.codes).mean()
    print(f"bits a code, held out: {by_frequency:.3f} by frequency, {by_table:.3f} by the table")


if __name__ == "__main__":
    main()
