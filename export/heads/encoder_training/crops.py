"""Training crops of a pool of images and of real faces, a whole batch at once; `encoder_data` cuts single crops.

Random numbers that belong to a crop are drawn on the CPU; noise is drawn where the crops are.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn import functional as F

from export.heads.encoder import CELL_PX, CELLS, CROP_PX, UNKNOWN_MATTE
from export.heads.encoder_data import FACE_FRACTION, MAX_BILINEAR_ZOOM
from export.heads.encoder_training.head_images import Pool
from export.heads.encoder_training.image_corruptions import as_cameras_see
from export.heads.head_shards import FACE_SIDES, LABEL_STEP, POINT_SCALE

CHUNK = 64  # crops cut at once: images are copied as floats
_GREY = 127.0


@dataclass(frozen=True)
class Placings:
    """Maps from pixels of B crops to pixels of their images: linear [B, 2, 2], offset [B, 2], mirrored bool [B],
    zoom [B]; on the CPU."""

    linear: Tensor
    offset: Tensor
    mirrored: Tensor
    zoom: Tensor

    def to(self, device: torch.device) -> Placings:
        return Placings(*(value.to(device) for value in vars(self).values()))

    def part(self, at: slice | Tensor) -> Placings:
        return Placings(*(value[at] for value in vars(self).values()))


def uniform(count: int, low: float, high: float, random: torch.Generator) -> Tensor:
    return low + (high - low) * torch.rand(count, generator=random)


def placings(side: int, face: Tensor, of_face: Tensor, random: torch.Generator) -> Placings:
    """`encoder_data.placing`, augmented, of B crops of images of `side` pixels. face [B, 4]: boxes, NaN where there
    is none; of_face bool [B]: whose crops show the face alone. All on the CPU."""
    count = len(face)
    of_face = of_face & torch.isfinite(face).all(1)
    box = torch.nan_to_num(face)
    size = side * uniform(count, 0.72, 1.12, random)
    close = FACE_SIDES * (box[:, 2:] - box[:, :2]).amax(1) * uniform(count, 0.85, 1.3, random)
    size = torch.where(of_face, close.clamp(min=8), size)
    middle = torch.where(of_face[:, None], box.view(-1, 2, 2).mean(1), torch.tensor((side - 1) / 2))
    turn = torch.randn(count, generator=random) * math.radians(12)
    shift = torch.randn(count, 2, generator=random) * 0.05 * size[:, None]
    mirrored = torch.rand(count, generator=random) < 0.5
    zoom = size / CROP_PX
    cos, sin = zoom * turn.cos(), zoom * turn.sin()
    sign = torch.where(mirrored, -1.0, 1.0)
    linear = torch.stack([torch.stack([cos * sign, -sin], 1), torch.stack([sin * sign, cos], 1)], 1)
    offset = middle + shift - linear.sum(2) * ((CROP_PX - 1) / 2)
    return Placings(linear, offset, mirrored, zoom)


def cut(pictures: Tensor, place: Placings, border: str = "zeros", nearest: bool = False) -> Tensor:
    """Crops [B, C, 192, 192] of images float [B, C, H, W]; where images shrink, of four places a pixel."""
    device = pictures.device
    height, width = pictures.shape[2:]
    index = torch.arange(CROP_PX, device=device, dtype=torch.float32)
    spread = torch.where(place.zoom > MAX_BILINEAR_ZOOM, 0.25, 0.0) * (not nearest)
    quarter = torch.tensor([-1.0, 1.0], device=device)
    at = index[None, :, None] + quarter * spread[:, None, None]  # [B, 192, 2]
    at = at.flatten(1)[:, :: 2 if nearest else 1]
    count = at.shape[1]
    x = at[:, None, :].expand(-1, count, -1)
    y = at[:, :, None].expand(-1, -1, count)
    source = torch.stack([x, y], -1).flatten(1, 2) @ place.linear.transpose(1, 2) + place.offset[:, None]
    grid = (source + 0.5) * source.new_tensor([2 / width, 2 / height]) - 1
    mode = "nearest" if nearest else "bilinear"
    found = F.grid_sample(pictures, grid.view(-1, count, count, 2), mode=mode, padding_mode=border, align_corners=False)
    return found if nearest else F.avg_pool2d(found, 2)


class Backgrounds:
    """images uint8 [N, S, S, 3], on the device that crops are made on."""

    def __init__(self, images: Tensor) -> None:
        self.images = images

    def crops(self, count: int, random: torch.Generator) -> Tensor:
        """Random squares, mirrored half of the time: float32 [count, 3, 192, 192]."""
        side = self.images.shape[1]
        number = torch.randint(len(self.images), (count,), generator=random)
        size = uniform(count, side / 8, side, random)
        sign = torch.where(torch.rand(count, generator=random) < 0.5, -1.0, 1.0)
        linear = torch.zeros(count, 2, 2)
        linear[:, 0, 0], linear[:, 1, 1] = sign * size / CROP_PX, size / CROP_PX
        middle = size[:, None] / 2 + (side - size[:, None]) * torch.rand(count, 2, generator=random) - 0.5
        offset = middle - linear.sum(2) * ((CROP_PX - 1) / 2)
        place = Placings(linear, offset, sign < 0, size / CROP_PX).to(self.images.device)
        chosen = self.images[number.to(self.images.device)].permute(0, 3, 1, 2).float()
        return cut(chosen, place, "border")


def occluders(count: int, random: torch.Generator, device: torch.device) -> Tensor:
    """How much of each pixel something before the head covers, [count, 1, 192, 192]: in 3 of 10 an ellipse or a bar."""
    index = torch.arange(CROP_PX, device=device, dtype=torch.float32)

    def drawn(low: float, high: float, *shape: int) -> Tensor:
        return (low + (high - low) * torch.rand(*shape, generator=random)).to(device)

    there = (torch.rand(count, generator=random) < 0.3).to(device)
    round_ = (torch.rand(count, generator=random) < 0.6).to(device)
    middle, axes = drawn(0.1, 0.9, count, 2) * CROP_PX, drawn(0.05, 0.25, count, 2) * CROP_PX
    turn = drawn(0, math.pi, count)
    x, y = index[None, None] - middle[:, :1, None], index[None, :, None] - middle[:, 1:, None]
    cos, sin = turn.cos()[:, None, None], turn.sin()[:, None, None]
    u, v = x * cos + y * sin, y * cos - x * sin
    relative = torch.sqrt((u / axes[:, :1, None]) ** 2 + (v / axes[:, 1:, None]) ** 2)
    ellipse = (relative - 1) * axes.amin(1)[:, None, None]
    way = drawn(-0.2, 1.2, count, 2) * CROP_PX - middle
    along = (x * way[:, :1, None] + y * way[:, 1:, None]) / (way.square().sum(1)[:, None, None] + 1e-6)
    along = along.clamp(0, 1)
    off = torch.hypot(x - along * way[:, :1, None], y - along * way[:, 1:, None])
    bar = off - drawn(0.015, 0.075, count)[:, None, None] * CROP_PX
    distance = torch.where(round_[:, None, None], ellipse, bar)
    return (torch.special.ndtr(-distance / 0.8) * there[:, None, None])[:, None]


def occluded(image: Tensor, backgrounds: Backgrounds, random: torch.Generator) -> tuple[Tensor, Tensor]:
    """As `encoder_data.occluded`, of a batch [B, 3, 192, 192]; covers [B, 1, 192, 192]."""
    count = len(image)
    part = occluders(count, random, image.device)
    flat = (torch.rand(count, 3, 1, 1, generator=random) * 255).to(image.device)
    textured = (torch.rand(count, 1, 1, 1, generator=random) < 0.6).to(image.device)
    texture = torch.where(textured, backgrounds.crops(count, random), flat)
    return image * (1 - part) + part * texture, part


def cell_means(values: Tensor) -> Tensor:
    """[B, 1, 192, 192] -> [B, 48, 48]."""
    return F.avg_pool2d(values, CELL_PX)[:, 0]


class Cropper:
    """Makes batches. kernels: strokes of a moving camera, float32 [K, 11, 11]."""

    def __init__(self, backgrounds: Backgrounds, kernels: Tensor, device: torch.device, seed: int) -> None:
        self.backgrounds, self.kernels, self.device = backgrounds, kernels.to(device), device
        self._random = torch.Generator().manual_seed(seed)

    @torch.no_grad()
    def made(self, pool: Pool, filled: int, count: int) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Crops of the first `filled` images of a pool: image float32 [B, 192, 192, 3], template
        [B, 48, 48, 3] dm, matte [B, 48, 48], normal [B, 48, 48, 3]."""
        random = self._random
        number = torch.randint(filled, (count,), generator=random).to(self.device)
        of_face = torch.rand(count, generator=random) < FACE_FRACTION
        place = placings(pool.planes.shape[1], pool.face[number].cpu(), of_face, random).to(self.device)
        images, mattes = [], []
        for start in range(0, count, CHUNK):
            part = slice(start, start + CHUNK)
            planes = pool.planes[number[part]].permute(0, 3, 1, 2)
            mask = planes[:, 3:]
            on = [(mask > least).to(torch.uint8) * 255 for least in (200, 0)]
            planes = torch.cat([planes[:, :3], *on], 1).float()
            found = cut(planes, place.part(part))
            images.append(found[:, :3] + (1 - found[:, 4:] / 255) * self.backgrounds.crops(len(found), random))
            mattes.append(found[:, 3:4] / 255)
        image, matte = torch.cat(images), torch.cat(mattes)
        image, cover = occluded(image, self.backgrounds, random)
        matte = matte * (1 - cover)
        # Labels are picked at the middle of each cell, never mixed.
        index = CELL_PX * torch.arange(CELLS, device=self.device) + (CELL_PX - 1) / 2
        middle = torch.stack(torch.meshgrid(index, index, indexing="xy"), -1).view(1, -1, 2)
        source = middle @ place.linear.transpose(1, 2) + place.offset[:, None]
        at = (source / LABEL_STEP).round().long()
        limit = pool.template.shape[1] - 1
        inside = ((at >= 0) & (at <= limit)).all(-1)
        at = at.clamp(0, limit)
        template = pool.template[number[:, None], at[..., 1], at[..., 0]].float() / POINT_SCALE
        normal = pool.normal[number[:, None], at[..., 1], at[..., 0]]
        known = (normal != 0).any(-1) & inside
        normal = normal.float() / 127
        cells = cell_means(matte) * known.view(-1, CELLS, CELLS)
        turn = place.linear / place.zoom[:, None, None]
        normal = torch.cat([normal[..., :2] @ turn, normal[..., 2:]], -1)
        template = template * torch.where(place.mirrored[:, None, None], template.new_tensor([-1.0, 1, 1]), 1.0)
        image = as_cameras_see(image, self.kernels, random)
        return (
            finished(image), template.view(-1, CELLS, CELLS, 3), cells, normal.view(-1, CELLS, CELLS, 3)
        )  # fmt: skip

    @torch.no_grad()
    def real(self, faces: RealFaces, count: int) -> tuple[Tensor, Tensor, Tensor, Tensor, Tensor]:
        """Crops of real faces: image, pixel, template, weight and matte as in `photos.judge.PhotoCrop`."""
        random = self._random
        number = torch.randint(len(faces.rgb), (count,), generator=random)
        of_face = torch.rand(count, generator=random) < FACE_FRACTION
        place = placings(faces.rgb.shape[1], faces.face[number], of_face, random).to(self.device)
        number = number.to(self.device)
        rgb = faces.rgb[number].permute(0, 3, 1, 2).float()
        grey = cut(rgb - _GREY, place) + _GREY
        replicated = cut(rgb, place, "border")
        which = (torch.rand(count, 1, 1, 1, generator=random) < 0.5).to(self.device)
        image = torch.where(which, replicated, grey)
        matte = cut(faces.known[number].permute(0, 3, 1, 2).float(), place, nearest=True)  # head, nothing
        # The map turns and scales: its inverse is its transpose by the square of the scale.
        pixel = (faces.pixel[number] - place.offset[:, None]) @ place.linear / place.zoom[:, None, None] ** 2
        weight = faces.weight[number] * ((pixel >= 0) & (pixel <= CROP_PX - 1)).all(-1)
        image, cover = occluded(image, self.backgrounds, random)
        at = pixel.round().long().clamp(0, CROP_PX - 1)
        one = torch.arange(count, device=self.device)[:, None]
        weight = weight * (cover[one, 0, at[..., 1], at[..., 0]] < 0.5)
        share = cell_means(matte[:, :1] * (1 - cover))
        sure = cell_means(matte.sum(1, keepdim=True).clamp(max=1)) > 0.999
        template = faces.template[None].expand(count, -1, -1)
        template = template * torch.where(place.mirrored[:, None, None], template.new_tensor([-1.0, 1, 1]), 1.0)
        image = as_cameras_see(image, self.kernels, random)
        return finished(image), pixel, template, weight, torch.where(sure, share, UNKNOWN_MATTE)


@dataclass(frozen=True)
class RealFaces:
    """K faces of photographs: rgb uint8 [K, H, W, 3]; known uint8 [K, H, W, 2]: 1 where surely head, surely none; pixel
    [K, P, 2], weight [K, P], template [P, 3] dm, float32; face float32 [K, 4] on the CPU: boxes of the points that
    weigh."""

    rgb: Tensor
    known: Tensor
    pixel: Tensor
    weight: Tensor
    template: Tensor
    face: Tensor

    @staticmethod
    def of(rgb: Tensor, known: Tensor, pixel: Tensor, weight: Tensor, template: Tensor) -> RealFaces:
        far = torch.where(weight[..., None] > 0, pixel, torch.tensor(float("nan")))
        low, high = far.nan_to_num(float("inf")).amin(1), far.nan_to_num(-float("inf")).amax(1)
        return RealFaces(rgb, known, pixel, weight, template, torch.cat([low, high], 1))

    def to(self, device: torch.device) -> RealFaces:
        moved = {name: value.to(device) for name, value in vars(self).items() if name != "face"}
        return RealFaces(**moved, face=self.face)


def finished(image: Tensor) -> Tensor:
    """[B, 3, 192, 192] -> [B, 192, 192, 3], whole numbers 0..255 as of files."""
    return image.clamp(0, 255).floor().permute(0, 2, 3, 1)
