"""The encoder of heads: a crop of a photo to a grid of template points, matte and normals.

The trunk and neck are those of the person detector (`export.densepose.network`), whose weights it begins with.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional as F

from export.densepose.config import NetworkConfig
from export.densepose.data import MEAN, STD
from export.densepose.network import BiFPN, ConvBn, InvertedResidual, MobileNetV2

CROP_PX, CELL_PX = 192, 4
CELLS = CROP_PX // CELL_PX
OUTPUTS = 8  # template point (dm), log of its sigma (dm), logit of the matte, normal in the camera's axes
POINT, LOG_SIGMA, MATTE, NORMAL = slice(0, 3), 3, 4, slice(5, 8)
WIDTH = 64
CONTEXT_WIDTH, CONTEXT = 32, 128
STRIDE = 32  # of the coarsest map
UNKNOWN_MATTE = -1.0  # of a label


class HeadEncoder(nn.Module):
    """[N, 192, 192, 3] RGB 0..255 -> cells [N, 48, 48, 8].

    Cell (i, j) stands for the crop's pixel (4 j + 1.5, 4 i + 1.5). Template points are the sum of an affine function of
    the cell's place, which the whole crop tells, and of what is seen there: convolutions alone, which do not know where
    they are, were off by 6 mm at the tip of the nose.

    deep: whether there is a further block at the coarsest map and two at the finest. They begin as the identity, so
    that an encoder without them can be gone on from.
    """

    def __init__(self, deep: bool = True) -> None:
        super().__init__()
        self.backbone = MobileNetV2()
        self.neck = BiFPN(NetworkConfig.BACKBONES["mobilenet_v2"], WIDTH)
        self.head = nn.Sequential(ConvBn(WIDTH + 2, WIDTH, 3), ConvBn(WIDTH, WIDTH, 3), nn.Conv2d(WIDTH, OUTPUTS, 1))
        coarsest = NetworkConfig.BACKBONES["mobilenet_v2"][-1]
        self.deeper, self.refine = nn.Identity(), nn.Identity()
        if deep:
            self.deeper = InvertedResidual(coarsest, coarsest, 1, 3)
            self.refine = nn.Sequential(*(InvertedResidual(WIDTH, WIDTH, 1, 4) for _ in range(2)))
            for block in (self.deeper, *self.refine):
                nn.init.zeros_(block.project.bn.weight)
        self.context = ConvBn(coarsest, CONTEXT_WIDTH, 1)
        self.context_hidden = nn.Linear(CONTEXT_WIDTH * (CROP_PX // STRIDE) ** 2, CONTEXT)
        self.affine, self.bias = nn.Linear(CONTEXT, 9), nn.Linear(CONTEXT, WIDTH)
        for layer in (self.affine, self.bias):
            nn.init.zeros_(layer.weight)
            nn.init.zeros_(layer.bias)
        self.register_buffer("mean", torch.from_numpy(MEAN), persistent=False)
        self.register_buffer("scale", torch.from_numpy(1 / STD), persistent=False)
        j = (torch.arange(CELLS) + 0.5) * (2 / CELLS) - 1
        place = torch.stack([j[None].expand(CELLS, CELLS), j[:, None].expand(CELLS, CELLS)])
        self.register_buffer("place", place[None].contiguous(), persistent=False)  # x and y of cells, -1..1

    def forward(self, image: Tensor) -> Tensor:
        taps = self.backbone(((image - self.mean) * self.scale).permute(0, 3, 1, 2))
        taps[-1] = self.deeper(taps[-1])
        context = F.relu(self.context_hidden(self.context(taps[-1]).flatten(1)))
        place = self.place.expand(len(image), -1, -1, -1)
        first, second, last = self.head
        finest = self.neck.finest(taps)
        seen = first(torch.cat([finest, place.to(finest.dtype)], 1)) + self.bias(context)[..., None, None]
        seen = second(self.refine(seen))
        # Half a millimetre is one step of bfloat16 at the border of the face: what says places is float32.
        with torch.autocast(image.device.type, enabled=False):
            cells = last(seen.float()).permute(0, 2, 3, 1)
            affine = self.affine(context.float()).unflatten(1, (3, 3))  # of x, y and 1
            points = (affine[..., :2] @ self.place.flatten(2) + affine[..., 2:]).transpose(1, 2)
            points = points.unflatten(1, (CELLS, CELLS))
            return torch.cat([cells[..., POINT] + points, cells[..., POINT.stop :]], -1)


def start_from_detector(encoder: HeadEncoder, path: Path) -> None:
    """Takes trunk and neck from the weights of a person detector (`export/weights/densepose-b.pt`)."""
    state = torch.load(path, map_location="cpu", weights_only=True)["ema"]
    own = {n: v.float() for n, v in state.items() if n.startswith(("backbone.", "neck."))}
    _, unexpected = encoder.load_state_dict(own, strict=False)
    if unexpected or not own:
        raise ValueError(f"{path} holds no MobileNetV2 with a neck of {WIDTH} channels.")
    encoder.backbone.freeze()


def losses(cells: Tensor, template: Tensor, matte: Tensor, normal: Tensor) -> dict[str, Tensor]:
    """Negative log likelihoods: template points (Laplace, of their own sigma), matte; and 1 - cosine of normals.

    cells [N, 48, 48, 8]; template [N, 48, 48, 3] dm, matte [N, 48, 48] 0..1, normal [N, 48, 48, 3] or 0 where unknown.
    """
    on = matte > 0.6
    away = (cells[..., POINT] - template).abs().sum(-1)[on]
    log_sigma = cells[..., LOG_SIGMA][on].clamp(-5, 1)
    # The mean of |x| of a Laplace distribution is sigma over the root of 2.
    point = (away * (2**0.5) * (-log_sigma).exp() / 3 + log_sigma).mean()
    cosine = F.cosine_similarity(cells[..., NORMAL][on], normal[on], dim=-1)
    return {
        "point": point,
        "coarse": away.mean(),
        "matte": F.binary_cross_entropy_with_logits(cells[..., MATTE], matte),
        "normal": (1 - cosine).mean(),
    }


SCALES = {"point": 0.3, "coarse": 1.0, "matte": 1.0, "normal": 0.3}


@torch.no_grad()
def cell_metrics(cells: Tensor, template: Tensor, matte: Tensor, normal: Tensor) -> dict[str, float]:
    """Mean and median error of template points (mm), those within two of their sigmas, IoU of mattes, degrees."""
    on = matte > 0.6
    away = (cells[..., POINT] - template).norm(dim=-1)[on] * 100
    sigma = cells[..., LOG_SIGMA][on].exp() * 100 * 3**0.5
    found = cells[..., MATTE] > 0
    cosine = F.cosine_similarity(cells[..., NORMAL][on], normal[on], dim=-1)
    both, either = (found & (matte > 0.5)).sum(), (found | (matte > 0.5)).sum()
    return {
        "point_mm": float(away.mean()),
        "median_mm": float(away.median()),
        "within_2_sigma": float((away < 2 * sigma).float().mean()),
        "matte_iou": float(both / either.clamp(min=1)),
        "normal_deg": float(torch.rad2deg(cosine.clamp(-1, 1).acos()).mean()),
    }


def at_pixels(cells: Tensor, pixel: Tensor) -> Tensor:
    """cells [N, 48, 48, C] between their middles, at pixels [N, P, 2] of the crop: [N, P, C]."""
    grid = (pixel + 0.5) * (2 / CROP_PX) - 1
    return F.grid_sample(
        cells.permute(0, 3, 1, 2), grid[:, None], padding_mode="border", align_corners=False
    )[:, :, 0].transpose(1, 2)  # fmt: skip


def photo_losses(cells: Tensor, pixel: Tensor, template: Tensor, weight: Tensor, matte: Tensor) -> dict[str, Tensor]:
    """Terms as of `losses`, of photos: template points [N, P, 3] at pixels [N, P, 2] with weights [N, P], and mattes
    [N, 48, 48] where they are known (>= 0). No normals."""
    found = at_pixels(cells, pixel)
    away = (found[..., POINT] - template).abs().sum(-1)
    log_sigma = found[..., LOG_SIGMA].clamp(-5, 1)
    total = weight.sum().clamp(min=1e-6)
    known = matte >= 0
    entropy = F.binary_cross_entropy_with_logits(cells[..., MATTE], matte.clamp(min=0), reduction="none")
    return {
        "point": (weight * (away * (2**0.5) * (-log_sigma).exp() / 3 + log_sigma)).sum() / total,
        "coarse": (weight * away).sum() / total,
        "matte": (entropy * known).sum() / known.sum().clamp(min=1),
    }


@torch.no_grad()
def photo_metrics(cells: Tensor, pixel: Tensor, template: Tensor, weight: Tensor, matte: Tensor) -> dict[str, float]:
    """Weighted mean and median (mm) of how far template points at the face points are from the teacher's, those within
    two sigmas, IoU of mattes where known."""
    found = at_pixels(cells, pixel)
    on = weight > 0.3
    away = (found[..., POINT] - template).norm(dim=-1) * 100
    sigma = found[..., LOG_SIGMA].exp() * 100 * 3**0.5
    head, mine = matte > 0.5, (cells[..., MATTE] > 0) & (matte >= 0)
    return {
        "photo_mm": float((weight * away).sum() / weight.sum().clamp(min=1e-6)),
        "photo_median_mm": float(away[on].median()),
        "photo_within_2_sigma": float((away < 2 * sigma)[on].float().mean()),
        "photo_matte_iou": float((head & mine).sum() / (head | mine).sum().clamp(min=1)),
    }


def load_encoder(path: Path) -> HeadEncoder:
    """In evaluation mode. Raises FileNotFoundError, and what torch raises for other files."""
    state = torch.load(path, map_location="cpu", weights_only=True)["state"]
    encoder = HeadEncoder(deep=any(name.startswith("refine.") for name in state))
    encoder.load_state_dict(state)
    return encoder.eval()


def start_from_encoder(encoder: HeadEncoder, path: Path) -> None:
    """Takes the weights of an encoder, with or without the further blocks. Raises ValueError for other weights."""
    state = load_encoder(path).state_dict()
    missing, unexpected = encoder.load_state_dict(state, strict=False)
    if unexpected or any(not name.startswith(("deeper.", "refine.")) for name in missing):
        raise ValueError(f"{path} holds an encoder of another kind.")


def run_encoder(encoder: HeadEncoder, crop: np.ndarray) -> np.ndarray:
    """Crop RGB [192, 192, 3] -> cells float32 [48, 48, 8]."""
    with torch.no_grad():
        return encoder(torch.from_numpy(np.ascontiguousarray(crop, np.float32))[None])[0].numpy()
