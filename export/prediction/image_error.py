"""PSNR of images, and of what can be had from the true codes of later frames."""

from __future__ import annotations

import torch
from torch import Tensor

from export.prediction.autoencoder import Autoencoder

HORIZONS = (1, 3, 8)
_CAP_DB = 50.0  # of one image: equal images would make every mean infinite


def psnr_db(a: Tensor, b: Tensor) -> Tensor:
    """PSNR of each image [B, H, W, 3], 0..255: float32 [B], at most 50 dB."""
    square = (a.float().clamp(0, 255) - b.float().clamp(0, 255)).square().mean((1, 2, 3))
    return (10 * torch.log10(255**2 / square.clamp(min=1e-6))).clamp(max=_CAP_DB)


@torch.no_grad()
def rebuilt(net: Autoencoder, frames: Tensor, batch: int = 64) -> tuple[Tensor, Tensor]:
    """Frames uint8 [B, 64, 64, 3] -> what the decoder makes of their codes, float32, and the codes."""
    codes = torch.cat([net.encode(part) for part in frames.split(batch)])
    return torch.cat([net.decode(part) for part in codes.split(batch)]), codes


@torch.no_grad()
def horizon_figures(net: Autoencoder, frames: Tensor, stride: int = 5) -> dict[str, float]:
    """Mean PSNR, dB, `horizon` frames ahead, of clips uint8 [N, T, 64, 64, 3]: `last` repeats the last frame, `plain`
    decodes the true next codes, `difference` adds to the last frame what the decoded codes changed by. The latter two
    are bounds for a predictor of codes, since a predictor does not know them."""
    clips, count = frames.shape[:2]
    decoded = rebuilt(net, frames.flatten(0, 1))[0].unflatten(0, (clips, count))
    figures = {}
    for horizon in HORIZONS:
        now, then = slice(0, count - horizon, stride), slice(horizon, count, stride)
        last, truth = frames[:, now].flatten(0, 1).float(), frames[:, then].flatten(0, 1)
        before, after = decoded[:, now].flatten(0, 1), decoded[:, then].flatten(0, 1)
        for name, picture in (("last", last), ("plain", after), ("difference", last + after - before)):
            figures[f"{name} {horizon}"] = float(psnr_db(picture, truth).mean())
    return figures
