"""A convolutional network that predicts a frame from the three before, in the manner of SimVP (arXiv 2206.05099): an
encoder, blocks of wide convolutions at a quarter of the size, a decoder. It has no codes and no probabilities: what the
transformer is compared with. Given a predicted image as well, it refines that: it mixes it, cell by cell, with
its own."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from export.prediction.autoencoder import scaled


def times_ahead(fps: Tensor, frames: Tensor) -> Tensor:
    """[B], [B] -> [B, 2]: log2 of ten times the seconds from frame to frame, and to the predicted frame."""
    return torch.log2(torch.stack([10 / fps, 10 * frames / fps], 1))


@dataclass(frozen=True)
class ConvolutionalShape:
    """widths: channels at 64 x 64, 32 x 32 and 16 x 16 pixels; blocks: at the last; frames: seen; kernel: of blocks;
    motion: whether an image that motion predicts is seen as well, and refined."""

    widths: tuple[int, int, int] = (32, 96, 192)
    blocks: int = 6
    frames: int = 3
    kernel: int = 7
    motion: bool = False

    @property
    def seen(self) -> int:
        """Images that the network is given: frames before, oldest first, and last the predicted one."""
        return self.frames + self.motion


class TimedBlock(nn.Module):
    """A depthwise convolution and two pointwise ones, scaled by channel by the times that it is told."""

    def __init__(self, width: int, kernel: int) -> None:
        super().__init__()
        self.spatial = nn.Conv2d(width, width, kernel, padding=kernel // 2, groups=width)
        self.scale = nn.Linear(2, width)
        self.mixed = nn.Sequential(nn.Conv2d(width, 2 * width, 1), nn.ReLU(), nn.Conv2d(2 * width, width, 1))
        nn.init.zeros_(self.mixed[-1].weight)

    def forward(self, x: Tensor, times: Tensor) -> Tensor:
        return x + self.mixed(self.spatial(x) * (1 + self.scale(times)[..., None, None]))


class ConvolutionalNet(nn.Module):
    def __init__(self, shape: ConvolutionalShape) -> None:
        super().__init__()
        self.shape = shape
        first, second, third = shape.widths
        self.fine = nn.Sequential(nn.Conv2d(3 * shape.seen, first, 3, padding=1), nn.ReLU())
        self.middle = nn.Sequential(
            nn.Conv2d(first, second, 4, 2, 1), nn.ReLU(), nn.Conv2d(second, second, 3, padding=1)
        )
        self.quarter = nn.Conv2d(second, third, 4, 2, 1)
        self.blocks = nn.ModuleList(TimedBlock(third, shape.kernel) for _ in range(shape.blocks))
        self.to_half = nn.Sequential(nn.Conv2d(third, 4 * second, 1), nn.PixelShuffle(2))
        self.to_fine = nn.Sequential(
            nn.ReLU(), nn.Conv2d(second, second, 3, padding=1), nn.ReLU(), nn.Conv2d(second, 4 * first, 1),
            nn.PixelShuffle(2),
        )  # fmt: skip
        self.out = nn.Sequential(
            nn.ReLU(),
            nn.Conv2d(first, first, 3, padding=1),
            nn.ReLU(),
            nn.Conv2d(first, 3 + shape.motion, 3, padding=1),
        )
        nn.init.zeros_(self.out[-1].weight)  # a new one repeats the last frame, or half of that and of the prediction
        nn.init.zeros_(self.out[-1].bias)

    def forward(self, before: Tensor, times: Tensor) -> Tensor:
        """before [B, seen, 3, 64, 64] in -1..1, oldest first; times [B, 2] of `times_ahead` -> [B, 3, 64, 64].

        What the last frame changes by is learnt; and how much of the image is that, the rest being the prediction.
        """
        fine = self.fine(before.flatten(1, 2))
        half = self.middle(fine)
        x = self.quarter(F.relu(half))
        for block in self.blocks:
            x = block(x, times)
        found = self.out(fine + self.to_fine(half + self.to_half(x)))
        if not self.shape.motion:
            return before[:, -1] + found
        own, share = before[:, -2] + found[:, :3], found[:, 3:].sigmoid()
        return before[:, -1] + share * (own - before[:, -1])

    def begin_with(self, other: ConvolutionalNet) -> None:
        """Takes over the weights of a network of the same widths and blocks; where that sees no
        predicted image, and this one does, half of its image and half of that."""
        known = other.state_dict()
        for name, own in self.state_dict().items():
            grown = torch.zeros_like(own)
            grown[tuple(slice(side) for side in known[name].shape)] = known[name]
            known[name] = grown
        self.load_state_dict(known)

    def predicted(self, frames: Tensor, times: Tensor) -> Tensor:
        """frames [B, seen, 64, 64, 3], 0..255 -> float32 [B, 64, 64, 3], 0..255."""
        before = scaled(frames.flatten(0, 1)).unflatten(0, frames.shape[:2])
        return ((self(before, times).float() + 1) * 127.5).permute(0, 2, 3, 1)
