"""VQ-VAE of single frames: a frame of 64 x 64 to 16 x 16 cells (or 8 x 8) of a few codes each, and back.

Without norms, as in the paper: a code then depends on what lies near its cell alone.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from export.prediction.codebook import Codebook
from export.prediction.config import CODE_SIDE, AutoencoderShape


class ResidualBlock(nn.Module):
    def __init__(self, width: int, hidden: int) -> None:
        super().__init__()
        self.layers = nn.Sequential(
            nn.ReLU(), nn.Conv2d(width, hidden, 3, padding=1), nn.ReLU(), nn.Conv2d(hidden, width, 1)
        )

    def forward(self, x: Tensor) -> Tensor:
        return x + self.layers(x)


def _blocks(shape: AutoencoderShape) -> list[nn.Module]:
    return [ResidualBlock(shape.widths[1], shape.residual) for _ in range(shape.blocks)]


def encoder(shape: AutoencoderShape) -> nn.Sequential:
    """[B, 3, 64, 64] in -1..1 -> [B, widths[1], side, side]."""
    near, far = shape.widths
    halved = [] if shape.side == CODE_SIDE else [nn.Conv2d(far, far, 4, 2, 1), nn.ReLU()]
    return nn.Sequential(
        nn.Conv2d(3, near, 4, 2, 1), nn.ReLU(), nn.Conv2d(near, far, 4, 2, 1), nn.ReLU(), *halved,
        nn.Conv2d(far, far, 3, padding=1), *_blocks(shape),
    )  # fmt: skip


def decoder(shape: AutoencoderShape) -> nn.Sequential:
    """[B, widths[1], side, side] -> [B, 3, 64, 64] in -1..1."""
    near, far = shape.widths

    def doubled(before: int, after: int) -> list[nn.Module]:
        if shape.depth_to_space:
            return [nn.Conv2d(before, 4 * after, 3, padding=1), nn.PixelShuffle(2)]
        return [nn.ConvTranspose2d(before, after, 4, 2, 1)]

    coarse = [] if shape.side == CODE_SIDE else [*doubled(far, far), nn.ReLU()]
    return nn.Sequential(
        nn.Conv2d(far, far, 3, padding=1), *_blocks(shape), nn.ReLU(), *coarse, *doubled(far, near), nn.ReLU(),
        *doubled(near, 3), nn.Tanh(),
    )  # fmt: skip


class Autoencoder(nn.Module):
    def __init__(self, shape: AutoencoderShape) -> None:
        """Raises ValueError for another number of cells than 16 or 8 in a row."""
        super().__init__()
        if shape.side not in (CODE_SIDE, CODE_SIDE // 2):
            raise ValueError(f"A frame has 16 or 8 places in a row, not {shape.side}.")
        self.shape = shape
        self.encoder, self.decoder = encoder(shape), decoder(shape)
        self.codebook = Codebook(shape.slices, shape.entries, shape.widths[1] // shape.slices)

    def forward(self, frames: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """frames [B, 3, 64, 64] in -1..1 -> rebuilt, codes [B, slices, side, side], commitment (mean square)."""
        quantized, codes, commitment = self.codebook(self.encoder(frames))
        return self.decoder(quantized), codes, commitment

    @torch.no_grad()
    def encode(self, frames: Tensor) -> Tensor:
        """frames uint8 [B, 64, 64, 3] -> codes int64 [B, slices, side, side]."""
        return self.codebook.nearest(self.encoder(scaled(frames)))

    @torch.no_grad()
    def decode(self, codes: Tensor) -> Tensor:
        """Codes [B, slices, side, side] -> float32 [B, 64, 64, 3], 0..255."""
        out = self.decoder(self.codebook.looked_up(codes))
        return ((out.float() + 1) * 127.5).permute(0, 2, 3, 1)


def scaled(frames: Tensor) -> Tensor:
    """uint8 [B, H, W, 3] -> float32 [B, 3, H, W] in -1..1."""
    return frames.permute(0, 3, 1, 2).float() / 127.5 - 1
