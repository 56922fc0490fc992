"""Clips for training: frames of 64 x 64 in memory, and photographs beside them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch
from torch import Tensor

from export.clips.clip import SIDE_PX, clip_paths, read_rgb

_GAIN = 0.15  # standard deviations of a frame's gain (natural logarithm) and offset (grey levels)
_OFFSET = 8.0
_NOISE = 5.0  # largest standard deviation of a frame's noise, grey levels
_SMALLEST_CROP = 0.3  # of a photograph's shorter side


@dataclass(frozen=True, eq=False)
class Clips:
    """frames uint8 [N, T, 64, 64, 3]; fps float32 [N]; names: set and file of each."""

    frames: Tensor
    fps: Tensor
    names: list[str]

    def __len__(self) -> int:
        return len(self.names)

    def on(self, device: torch.device) -> Clips:
        return Clips(self.frames.to(device), self.fps.to(device), self.names)


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


def read_stills(folder: Path, crops: int, seed: int = 0) -> Tensor:
    """Random crops of photographs (*.jpg), squeezed as frames are: uint8 [photographs * crops, 64, 64, 3], RGB. Crops
    have the shape of a camera's frame. Raises SystemExit where there are none."""
    rng, found = np.random.default_rng(seed), []
    for path in sorted(folder.glob("*.jpg")):
        photo = cv2.imread(str(path))[..., ::-1]
        high, wide = photo.shape[:2]
        for _ in range(crops):
            width = min(wide, high * 4 / 3) * rng.uniform(_SMALLEST_CROP, 1)
            height = width * 3 / 4
            x, y = (int(rng.uniform(0, room - side + 1e-6)) for room, side in ((wide, width), (high, height)))
            crop = photo[y : y + max(int(height), 1), x : x + max(int(width), 1)]
            found.append(cv2.resize(crop, (SIDE_PX, SIDE_PX), interpolation=cv2.INTER_AREA))
    if not found:
        raise SystemExit(f"No photographs (*.jpg) in {folder}. Fetch some: python -m export.photos backgrounds")
    return torch.from_numpy(np.stack(found))


def drawn_frames(clips: Clips, count: int) -> Tensor:
    """Frames at random: uint8 [count, 64, 64, 3]. Draws from torch's generator."""
    device = clips.frames.device
    clip = torch.randint(len(clips), (count,), device=device)
    return clips.frames[clip, torch.randint(clips.frames.shape[1], (count,), device=device)]


def varied(frames: Tensor) -> tuple[Tensor, Tensor]:
    """As another camera would show them: mirrored or not, with other gain and offset, float32 [B, 64, 64, 3] in 0..255;
    first with noise, then without."""

    def normal(*shape: int) -> Tensor:
        return torch.randn(*shape, device=frames.device)

    count = len(frames)
    mirrored = torch.rand(count, 1, 1, 1, device=frames.device) < 0.5
    frames = torch.where(mirrored, frames.flip(2), frames).float()
    true = (frames * (_GAIN * normal(count, 1, 1, 1)).exp() + _OFFSET * normal(count, 1, 1, 1)).clamp(0, 255)
    noise = _NOISE * torch.rand(count, 1, 1, 1, device=frames.device)
    return (true + noise * normal(*true.shape)).clamp(0, 255), true
