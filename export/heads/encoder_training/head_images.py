"""Images of made heads as `export.heads.views` makes them, drawn in torch many at a time, and a pool of them.

What differs from the images with rays: shadows come from depth seen from each lamp, and normals where skin, eyes and
hair meet are those of each part alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from export.heads.encoder_training.generator import BUST, EYE, HAIR, MAX_LAMPS, SKIN, Meshes
from export.heads.encoder_training.rasterizer import rasterized
from export.heads.head_shards import FACE_RADIUS_DM, LABEL_STEP, NOSE_TIP, POINT_SCALE, SIDE
from export.heads.shapes import CUT_NORMAL, CUT_POINT

NEAREST_DM = 0.3
SHADOW_PX, SHADOW_DM, SHADOW_BIAS_DM = 384, 4.2, 0.05  # side of a lamp's view, px, and half of it, dm
MIN_FACE_FRACTION, STRAY_FRACTION = 0.01, 0.01
_TEXTURE_MEAN = (185.0, 145.0, 123.0)


@dataclass
class Pool:
    """N images, the fields of `HeadImages` that crops are cut from. planes uint8 [N, 512, 512, 4]: RGB and masks;
    template int16 [N, 256, 256, 3]; normal int8 [N, 256, 256, 3]; face float32 [N, 4]: box of the face, px, NaN where
    too little is seen of it."""

    planes: Tensor
    template: Tensor
    normal: Tensor
    face: Tensor

    @staticmethod
    def empty(count: int, device: torch.device) -> Pool:
        half = SIDE // LABEL_STEP
        return Pool(
            torch.zeros(count, SIDE, SIDE, 4, dtype=torch.uint8, device=device),
            torch.zeros(count, half, half, 3, dtype=torch.int16, device=device),
            torch.zeros(count, half, half, 3, dtype=torch.int8, device=device),
            torch.full((count, 4), float("nan"), device=device),
        )

    def put(self, at: int, pictures: Pool) -> None:
        """Replaces those from `at` on; `at` and all that follows must fit."""
        for name, value in vars(pictures).items():
            getattr(self, name)[at : at + len(value)] = value


def slow_noise(points: Tensor, picture: Tensor, frequency: float, pictures: int, generator: torch.Generator) -> Tensor:
    """`hair.slow_noise` of points [N, 3], another for each image [N]."""
    directions = torch.randn(pictures, 6, 3, generator=generator)
    lengths = frequency * 2 * torch.pi * (0.6 + 0.8 * torch.rand(pictures, 6, 1, generator=generator))
    directions = (directions / directions.norm(dim=-1, keepdim=True) * lengths).to(points.device)
    phases = (2 * torch.pi * torch.rand(pictures, 6, generator=generator)).to(points.device)
    out = torch.zeros(len(points), device=points.device)
    for k in range(6):
        out += torch.sin((points * directions[picture, k]).sum(1) + phases[picture, k])
    return out / 3**0.5


def piecewise(x: Tensor, at: tuple[float, ...], values: tuple[float, ...]) -> Tensor:
    """numpy.interp."""
    out = torch.full_like(x, values[0])
    for k in range(len(at) - 1):
        t = ((x - at[k]) / (at[k + 1] - at[k])).clamp(0, 1)
        out = torch.where(x > at[k], values[k] + (values[k + 1] - values[k]) * t, out)
    return out


class Painter:
    """Draws batches of images. skin: texture, RGB uint8 [H, W, 3]; eye [3]: middle of the template's right eye."""

    def __init__(self, skin: Tensor, eye: Tensor, device: torch.device, seed: int) -> None:
        self.skin, self.eye, self.device = skin.to(device).float(), eye.float().to(device), device
        self._random = torch.Generator().manual_seed(seed)
        self._cut = torch.tensor(CUT_NORMAL, dtype=torch.float32, device=device)
        self._cut_at = torch.tensor(CUT_POINT, dtype=torch.float32, device=device)
        self._nose = torch.tensor(NOSE_TIP, dtype=torch.float32, device=device)

    @torch.no_grad()
    def draw(self, heads: Meshes, view: int) -> Pool:
        """Image `view` of each head, H images; everything on the painter's device."""
        count = len(heads.tone)
        camera, extras = heads.cameras[:, view], heads.extras[:, view]
        of_face = heads.face_head
        corner = heads.positions[heads.faces]  # [F, 3, 3]
        rotation, shift = camera[:, :9].view(-1, 3, 3), camera[:, 9:12]
        seen = torch.einsum("fij,fkj->fki", rotation[of_face], corner) + shift[of_face][:, None]
        depth = seen[..., 2]
        near = torch.where(depth > NEAREST_DM, 1 / depth.clamp(min=NEAREST_DM), torch.zeros_like(depth))
        focal, middle = camera[:, 12], camera[:, 13:15]
        pixels = focal[of_face, None, None] * seen[..., :2] * near[..., None] + middle[of_face][:, None]
        hits = rasterized(pixels, near, of_face, SIDE, perspective=True)
        picture = hits.pixel // (SIDE * SIDE)
        corners = heads.faces[hits.face]

        def mixed(values: Tensor) -> Tensor:
            return (values[corners] * hits.weight[..., None]).sum(1)

        point, template = mixed(heads.positions), mixed(heads.template)
        normal = mixed(heads.normals)
        normal = normal / normal.norm(dim=1, keepdim=True).clamp(min=1e-9)
        centre = -torch.einsum("bji,bj->bi", rotation, shift)
        away = point - centre[picture]
        away = away / away.norm(dim=1, keepdim=True)
        shown = torch.where((normal * away).sum(1, keepdim=True) > 0, -normal, normal)
        colour = self._colours(heads, hits, picture, point, template, extras, count)
        lit = self._lit(heads, view, corner, point, shown, picture)
        lamps = heads.lamps[:, view]
        light = heads.ambient[picture, view] * (1 + 0.25 * shown[:, 2:])
        for k in range(MAX_LAMPS):
            cosine = (shown * lamps[picture, k, :3]).sum(1).clamp(min=0) * lit[:, k]
            light = light + cosine[:, None] * lamps[picture, k, 3:]
        half = lamps[picture, 0, :3] - away
        half = half / half.norm(dim=1, keepdim=True).clamp(min=1e-9)
        shine = extras[picture, 0] * (shown * half).sum(1).clamp(min=0) ** 25 * lit[:, 0]
        rgb = colour * light + 255 * shine[:, None] * lamps[picture, 0, 3:]
        is_head = (point - self._cut_at) @ self._cut < 0
        planes = torch.zeros(count * SIDE * SIDE, 4, dtype=torch.uint8, device=self.device)
        mask = torch.where(is_head, 255.0, 128.0)
        planes[hits.pixel] = torch.cat([rgb.clamp(0, 255).round(), mask[:, None]], 1).to(torch.uint8)
        # Labels of every second pixel of every second row.
        row, column = hits.pixel // SIDE % SIDE, hits.pixel % SIDE
        kept = ((row % LABEL_STEP == 0) & (column % LABEL_STEP == 0)).nonzero()[:, 0]
        side = SIDE // LABEL_STEP
        at = (picture[kept] * side + row[kept] // LABEL_STEP) * side + column[kept] // LABEL_STEP
        points = torch.zeros(count * side * side, 3, dtype=torch.int16, device=self.device)
        points[at] = (template[kept] * POINT_SCALE).clamp(-32767, 32767).round().to(torch.int16)
        normals = torch.zeros(count * side * side, 3, dtype=torch.int8, device=self.device)
        turned = torch.einsum("nij,nj->ni", rotation[picture[kept]], normal[kept])
        normals[at] = (turned * 127).clamp(-127, 127).round().to(torch.int8)
        faces = torch.zeros(count * side * side, dtype=torch.bool, device=self.device)
        faces[at] = is_head[kept] & ((template[kept] - self._nose).norm(dim=1) < FACE_RADIUS_DM)
        return Pool(
            planes.view(count, SIDE, SIDE, 4), points.view(count, side, side, 3), normals.view(count, side, side, 3),
            face_boxes(faces.view(count, side, side)),
        )  # fmt: skip

    def _lit(self, heads: Meshes, view: int, corner: Tensor, point: Tensor, shown: Tensor, picture: Tensor) -> Tensor:
        """[N, 2]: 1, and 0.25 where something lies between a point and a lamp."""
        out = torch.ones(len(point), MAX_LAMPS, device=self.device)
        scale = SHADOW_PX / (2 * SHADOW_DM)
        for k in range(MAX_LAMPS):
            direction = heads.lamps[:, view, k, :3]
            there = direction.norm(dim=1) > 0.5
            up = torch.where(
                (direction[:, 2:].abs() > 0.9), direction.new_tensor([1.0, 0, 0]), direction.new_tensor([0, 0, 1.0])
            )
            right = torch.linalg.cross(up, direction)
            right = right / right.norm(dim=1, keepdim=True).clamp(min=1e-6)
            down = torch.linalg.cross(direction, right)
            axes = torch.stack([right * scale, down * scale, direction], 1)  # [H, 3, 3]

            def placed(points: Tensor, number: Tensor, axes: Tensor = axes) -> Tensor:
                of_lamp = torch.einsum("nij,n...j->n...i", axes[number], points)
                offset = of_lamp.new_tensor([SHADOW_PX / 2, SHADOW_PX / 2, 10.0])  # nearness: positive everywhere
                return of_lamp + offset

            from_lamp = placed(corner, heads.face_head)
            near = from_lamp[..., 2] * there[heads.face_head][:, None]
            hits = rasterized(from_lamp[..., :2].contiguous(), near, heads.face_head, SHADOW_PX, perspective=False)
            depth = torch.zeros(len(there) * SHADOW_PX * SHADOW_PX, device=self.device)
            depth[hits.pixel] = hits.nearness
            at = placed(point + 0.03 * shown, picture)
            x, y = (at[:, i].round().long().clamp(0, SHADOW_PX - 1) for i in (0, 1))
            first = depth[(picture * SHADOW_PX + y) * SHADOW_PX + x]
            facing = (shown * direction[picture]).sum(1) > 0
            out[:, k] = torch.where(facing & (first > at[:, 2] + SHADOW_BIAS_DM), 0.25, 1.0)
        return out

    def _colours(
        self, heads: Meshes, hits, picture: Tensor, point: Tensor, template: Tensor, extras: Tensor, count: int
    ) -> Tensor:
        """RGB [N, 3] without light: skin and hair, clothes, glasses."""
        kind = heads.kind[hits.face]
        uv = (heads.uv[hits.face] * hits.weight[..., None]).sum(1)
        shade = (heads.shade[heads.faces[hits.face]] * hits.weight).sum(1) * (kind != BUST)

        def noise(at: Tensor, frequency: float) -> Tensor:
            return slow_noise(at, picture, frequency, count, self._random)

        out = self._skin(heads, uv, template, shade, picture, noise, count)
        out = torch.where((kind == EYE)[:, None], self._eyes(template, heads.iris[picture]), out)
        strands = 1 + 0.14 * noise(point * point.new_tensor([1, 1, 0.12]), 7.0) + 0.1 * noise(point, 0.8)
        hair = heads.hair[picture] * strands.clamp(0.4, 1.7)[:, None]
        out = torch.where((kind == HAIR)[:, None], hair, out).clamp(0, 255)
        worn = extras[picture]
        clothed = (template[:, 2] < worn[:, 4] + 0.35 * template[:, 0].abs()) & (template[:, 2] < -1.5)
        folds = 1 + 0.12 * noise(template, 0.7) + 0.1 * noise(template, 3.0)
        out = torch.where(clothed[:, None], worn[:, 1:4] * folds[:, None], out)
        x, z = template[:, 0].abs(), template[:, 2]
        front = template[:, 1] < -0.45
        lens, rim = worn[:, 5], worn[:, 6]
        box = (torch.stack([x - 0.33, z - 0.01], 1)).abs() - worn[:, 10:12] + 0.1
        edge = box.clamp(min=0).norm(dim=1) + box.amax(1).clamp(max=0) - 0.1
        glass = front & (edge < 0)
        frame = front & (edge.abs() < rim)
        frame |= front & (x < 0.12) & ((z - 0.05).abs() < rim)
        frame |= (x > 0.5) & (template[:, 1] < 0.1) & ((z - 0.08).abs() < rim)
        out = torch.where(glass[:, None], out * (1 - lens)[:, None], out)
        out = torch.where((frame & (rim > 0))[:, None], worn[:, 7:10], out)
        return out.clamp(0, 255)

    def _skin(
        self, heads: Meshes, uv: Tensor, template: Tensor, shade: Tensor, picture: Tensor, noise, count: int
    ) -> Tensor:
        """As `Head.skin_colours`."""
        height, width = self.skin.shape[:2]
        x = (uv[:, 0] * width - 0.5).clamp(0, width - 1.001)
        y = ((1 - uv[:, 1]) * height - 0.5).clamp(0, height - 1.001)
        x0, y0 = x.long(), y.long()
        fx, fy = (x - x0)[:, None], (y - y0)[:, None]
        texture = (self.skin[y0, x0] * (1 - fx) + self.skin[y0, x0 + 1] * fx) * (1 - fy) + (
            self.skin[y0 + 1, x0] * (1 - fx) + self.skin[y0 + 1, x0 + 1] * fx
        ) * fy
        out = heads.tone[picture] * (texture / texture.new_tensor(_TEXTURE_MEAN)) ** 1.15
        out = out * (1 + 0.05 * noise(template, 0.7) + 0.03 * noise(template, 4.0))[:, None]
        x, z = template[:, 0].abs(), template[:, 2]
        blush = torch.exp(-(((x - 0.45) / 0.25) ** 2 + ((z + 0.35) / 0.25) ** 2))
        amount = 2 * torch.rand(count, generator=self._random).to(self.device)[picture] * blush
        out = out * (1 + amount[:, None] * out.new_tensor([0.06, -0.04, -0.04]))
        arc = piecewise(x, (0.08, 0.2, 0.4, 0.58), (0.19, 0.235, 0.27, 0.17))
        brow = torch.exp(-(((z - arc) / 0.045) ** 4)) * ((x - 0.1) / 0.08).clamp(0, 1)
        brow = brow * ((0.58 - x) / 0.12).clamp(0, 1) * heads.brows[picture] * (template[:, 1] < -0.5)
        cover = torch.maximum(brow, shade)[:, None]
        dark = torch.where(shade > brow, 1.0, 0.6)[:, None]
        return out * (1 - cover) + cover * heads.hair[picture] * dark

    def _eyes(self, template: Tensor, iris: Tensor) -> Tensor:
        side = torch.where(template[:, :1] < 0, 1.0, -1.0)
        middle = self.eye * torch.cat([side, torch.ones_like(side), torch.ones_like(side)], 1)
        offset = template - middle
        offset = offset / offset.norm(dim=1, keepdim=True).clamp(min=1e-9)
        angle = torch.arccos((-offset[:, 1]).clamp(-1, 1))[:, None]
        white = torch.full_like(iris, 225.0)
        return torch.where(angle < 0.2, torch.full_like(iris, 12.0), torch.where(angle < 0.5, iris, white))


def face_boxes(faces: Tensor) -> Tensor:
    """As `encoder_data.face_box_of`, of B maps bool [B, H, W] of where the face is: [B, 4] in pixels of the image,
    NaN where too few are."""
    total = faces.sum((1, 2))
    strays = (STRAY_FRACTION * total).long()
    out = []
    for axis in (1, 2):  # over rows: columns, then the other way round
        upto = faces.sum(axis).cumsum(1)
        first = (upto <= strays[:, None]).sum(1)
        last = (upto < (total - strays)[:, None]).sum(1)
        out += [first, last + 1]
    box = torch.stack([out[0], out[2], out[1], out[3]], 1).float() * LABEL_STEP - 0.5
    few = total < MIN_FACE_FRACTION * faces[0].numel()
    return torch.where(few[:, None], torch.full_like(box, float("nan")), box)


__all__ = ["BUST", "EYE", "HAIR", "SKIN", "Painter", "Pool", "face_boxes", "slow_noise"]
