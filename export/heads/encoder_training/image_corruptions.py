"""Camera artefacts (`export.people.imaging.camera_faults`) for a whole batch at once in torch.

Each artefact affects some crops of a batch; the other crops get strength 0. Low resolution is a blur and bilinear
interpolation between coarser pixels; compression works on the crop's own blocks.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor
from torch.nn import functional as F

_LUMINANCE = (
    (16, 11, 10, 16, 24, 40, 51, 61), (12, 12, 14, 19, 26, 58, 60, 55), (14, 13, 16, 24, 40, 57, 69, 56),
    (14, 17, 22, 29, 51, 87, 80, 62), (18, 22, 37, 56, 68, 109, 103, 77), (24, 35, 55, 64, 81, 104, 113, 92),
    (49, 64, 78, 87, 103, 121, 120, 101), (72, 92, 95, 98, 112, 100, 103, 99),
)  # fmt: skip
_YCC = ((0.299, 0.587, 0.114), (-0.169, -0.331, 0.5), (0.5, -0.419, -0.081))


class Draws:
    """Random numbers of a batch's crops, [B, 1, 1, 1], from a generator of the CPU to the device of the crops."""

    def __init__(self, count: int, random: torch.Generator, device: torch.device) -> None:
        self._count, self._random, self._device = count, random, device

    def uniform(self, low: float, high: float, channels: int = 1) -> Tensor:
        drawn = torch.rand(self._count, channels, 1, 1, generator=self._random)
        return (low + (high - low) * drawn).to(self._device)

    def normal(self, sigma: float, channels: int = 1) -> Tensor:
        return (sigma * torch.randn(self._count, channels, 1, 1, generator=self._random)).to(self._device)

    def happens(self, share: float) -> Tensor:
        return (torch.rand(self._count, 1, 1, 1, generator=self._random) < share).to(self._device)


def filtered(image: Tensor, kernel: Tensor) -> Tensor:
    """Each image [B, C, H, W] by its own kernel [B, h, w] of odd sides, replicated at the border."""
    count, channels, height, width = image.shape
    tall, wide = kernel.shape[1:]
    padded = F.pad(image, (wide // 2, wide // 2, tall // 2, tall // 2), mode="replicate")
    weight = kernel[:, None].repeat_interleave(channels, 0)
    out = F.conv2d(padded.reshape(1, count * channels, *padded.shape[2:]), weight, groups=count * channels)
    return out.view(count, channels, height, width)


def blurred(image: Tensor, sigma: Tensor, reach: int) -> Tensor:
    """Gaussian blur by sigma [B, 1, 1, 1] pixels, up to `reach` pixels away; 0 changes nothing."""
    away = torch.arange(-reach, reach + 1, device=image.device, dtype=torch.float32)
    kernel = torch.exp(-0.5 * (away / sigma.view(-1, 1).clamp(min=0.05)) ** 2)
    kernel = kernel / kernel.sum(1, keepdim=True)
    return filtered(filtered(image, kernel[:, None, :]), kernel[:, :, None])


def coarse(image: Tensor, share: Tensor) -> Tensor:
    """As if scaled to `share` [B, 1, 1, 1] <= 1 of its size by areas, and back by bilinear interpolation."""
    height, width = image.shape[2:]
    smooth = blurred(image, 0.33 / share * (share < 0.999), 6)
    out = 0.0
    y = (torch.arange(height, device=image.device) + 0.5) * share.view(-1, 1) - 0.5  # [B, H], in coarse pixels
    x = (torch.arange(width, device=image.device) + 0.5) * share.view(-1, 1) - 0.5
    for dy in (0, 1):
        row = y.floor() + dy
        of_row = (1 - (y - row).abs())[:, None, :, None]
        for dx in (0, 1):
            column = x.floor() + dx
            of_column = (1 - (x - column).abs())[:, None, None, :]
            grid_x = (column + 0.5) / share.view(-1, 1) * (2 / width) - 1
            grid_y = (row + 0.5) / share.view(-1, 1) * (2 / height) - 1
            grid = torch.stack(
                [grid_x[:, None, :].expand(-1, height, -1), grid_y[:, :, None].expand(-1, -1, width)], -1
            )
            found = F.grid_sample(smooth, grid, padding_mode="border", align_corners=False)
            out = out + of_row * of_column * found
    return torch.where(share < 0.999, out, image)


def compressed(image: Tensor, quality: Tensor) -> Tensor:
    """As JPEG of `quality` [B, 1, 1, 1] in 1..100 leaves it (colours are not halved in size)."""
    count, _, height, width = image.shape
    k = torch.arange(8, device=image.device, dtype=torch.float32)
    cosine = torch.cos((2 * k[None] + 1) * k[:, None] * math.pi / 16) * 0.5
    cosine[0] *= 0.5**0.5
    turn = image.new_tensor(_YCC)
    blocks = torch.einsum("ij,bjhw->bihw", turn, image - 128)
    blocks = blocks.view(count, 3, height // 8, 8, width // 8, 8).permute(0, 1, 2, 4, 3, 5)
    scale = torch.where(quality < 50, 50 / quality, 2 - quality / 50).view(-1, 1, 1, 1, 1, 1)
    table = (image.new_tensor(_LUMINANCE) * scale).clamp(min=1)
    spectrum = cosine @ blocks @ cosine.T
    rounded = (spectrum / table).round() * table
    back = (cosine.T @ rounded @ cosine).permute(0, 1, 2, 4, 3, 5).reshape(count, 3, height, width)
    return torch.einsum("ij,bjhw->bihw", torch.linalg.inv(torch.tensor(_YCC)).to(back), back) + 128


def as_cameras_see(image: Tensor, kernels: Tensor, random: torch.Generator) -> Tensor:
    """`encoder_data.as_cameras_see` of float RGB [B, 3, H, W], 0..255. kernels: strokes of motion [K, h, w]."""
    count, _, height, width = image.shape
    draw = Draws(count, random, image.device)
    image = image * draw.normal(0.1, 3).exp()
    size = torch.exp(draw.uniform(math.log(40), math.log(width)))
    image = coarse(image, torch.where(draw.happens(0.4), size / width, 1.0)).clamp(0, 255)
    number = torch.randint(len(kernels), (count,), generator=random).to(image.device)
    stroke, still = kernels[number], torch.zeros_like(kernels[0])
    still[still.shape[0] // 2, still.shape[1] // 2] = 1
    image = filtered(image, torch.where(draw.happens(0.12).view(-1, 1, 1), stroke, still))
    image = blurred(image, draw.uniform(0.3, 1.2) * draw.happens(0.35), 4)
    x = torch.linspace(-1, 1, width, device=image.device)
    y = torch.linspace(-1, 1, height, device=image.device)
    radius = (x[None] ** 2 + y[:, None] ** 2)[None, None] / 2
    image = image * (1 + draw.uniform(0.05, 0.35) * draw.happens(0.35) * radius) ** -2
    mean = image.mean((1, 2, 3), keepdim=True).clamp(min=1)
    gain = ((draw.uniform(80, 140) / mean) ** draw.uniform(0.4, 0.9)).clamp(0.6, 2.5)
    image = image * torch.where(draw.happens(0.6), gain, 1.0)
    image = 255 * (image * draw.uniform(0.7, 1.2) / 255).clamp(0, 1) ** draw.uniform(0.8, 1.25)
    image = (image - 128) * draw.uniform(0.75, 1.15) + 128
    grey, balance = image.mean(1, keepdim=True), 1 + draw.normal(0.05, 3)
    image = torch.where(draw.happens(0.06), grey.expand_as(image), image * balance)
    webcam = draw.happens(0.2)
    squeezed = coarse(image, torch.where(webcam, draw.uniform(0.35, 0.8), 1.0))
    packed = compressed(squeezed.clamp(0, 255), draw.uniform(25, 80))
    image = torch.where(webcam & draw.happens(0.5), packed, squeezed)
    sharp = image - blurred(image, draw.uniform(0.7, 1.5), 4)
    image = image + draw.uniform(0.3, 1.2) * draw.happens(0.2) * sharp
    return (image + noise(image, draw) * draw.happens(0.5)).clamp(0, 255)


def noise(image: Tensor, draw: Draws) -> Tensor:
    """White, or coarser as denoising leaves it; by half of cameras with the root of the light."""
    out = torch.randn_like(image) * draw.uniform(1, 9)
    soft = draw.happens(0.4)
    out = torch.where(soft, 1.8 * blurred(out, draw.uniform(0.5, 1), 3), out)
    return out * torch.where(draw.happens(0.5), (image.clamp(8, 255) / 128).sqrt(), 1.0)
