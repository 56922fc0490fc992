"""Clips for training: frames of 64 x 64 in memory."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from export.clips.clip import clip_paths, read_rgb


@dataclass(frozen=True, eq=False)
class Clips:
    """frames uint8 [N, T, 64, 64, 3]; fps float32 [N]; names: set and file of each."""

    frames: Tensor
    fps: Tensor
    names: list[str]

    def __len__(self) -> int:
        return len(self.names)


def read_clips(data: Path, kinds: list[str], split: str) -> Clips:
    """All clips of these sets. Raises SystemExit where there are none."""
    paths = [(kind, path) for kind in kinds for path in clip_paths(data, kind, split)]
    if not paths:
        raise SystemExit(
            f"No clips of {', '.join(kinds)} in {data} ({split}). Render some: python -m export.clips.dataset "
            f"{kinds[0]} --split {split} --out {data}"
        )
    read = [read_rgb(path) for _, path in paths]
    return Clips(
        torch.from_numpy(np.stack([rgb for rgb, _ in read])),
        torch.tensor([fps for _, fps in read]),
        [f"{kind}/{path.stem}" for kind, path in paths],
    )


def drawn_frames(clips: Clips, count: int) -> Tensor:
    """Frames at random, half of them mirrored: uint8 [count, 64, 64, 3]. Draws from torch's generator."""
    clip, t = torch.randint(len(clips), (count,)), torch.randint(clips.frames.shape[1], (count,))
    frames = clips.frames[clip, t]
    mirrored = torch.rand(count) < 0.5
    return torch.where(mirrored[:, None, None, None], frames.flip(2), frames)
