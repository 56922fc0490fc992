"""The descriptors of one scene's points, learnt from its photos: NPBG++ (arXiv 2203.13318) after fitting.

Which point a pixel of a photo shows never changes, so it is found once. A step then renders one whole photo: each of
its points has one pixel there, and a crop would show some of them and save nothing a pixel. Optimisers are lazy, since
a step touches the points of one photo.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional as F

from export.camera import Camera
from export.scenes.config import BASIS, FEATURES, LEVELS, MULTIPLE, ROTATED_MULTIPLE
from export.scenes.fitting import Options, View, coverage, shown_in
from export.scenes.geometry.cameras import between, moves, upright
from export.scenes.geometry.raster import Pyramid, filled, pyramid
from export.scenes.losses import LossWeights, image_terms
from export.scenes.networks.basis import directions
from export.scenes.networks.system import Networks
from export.scenes.perceptual import Perceptual
from export.scenes.scene_file import SceneFile

BETAS = 0.9, 0.99  # a point that is met for the first time then moves by the rate, not by a multiple of it


@dataclass(frozen=True)
class Rates:
    """Learning rates of Adam: for the constant terms (`mean`) and the linear terms (`slope`) of descriptors, whose
    features are in 0..1."""

    mean: float = 1e-2
    slope: float = 3e-4


@dataclass(frozen=True, eq=False)
class Shown:
    """The points of a scene that a camera shows, independent of descriptors. frame: the upright image that is rendered,
    rotated: whether the camera's own image differs. points: int64 [V], slots: of each level, as in `Pyramid`. basis:
    [V, 6]."""

    camera: Camera
    frame: Camera
    rotated: bool
    points: Tensor
    slots: list[Tensor]
    basis: Tensor


class TunedScene(nn.Module):
    """The descriptors of a scene's points as parameters, and the networks that draw them."""

    def __init__(self, scene: SceneFile, networks: Networks, device: torch.device) -> None:
        super().__init__()
        self.networks = networks.to(device).eval().requires_grad_(False)
        self.options = Options(up=scene.up)
        self.positions = torch.from_numpy(scene.positions()).to(device)
        self.rows = torch.from_numpy(scene.slope_rows()).to(device)
        self.background = torch.from_numpy(scene.background()).to(device)
        means, slopes = (torch.from_numpy(values).to(device) for values in scene.descriptors())
        self.mean, self.slope = nn.Parameter(means), nn.Parameter(slopes)

    @torch.no_grad()
    def shown(self, camera: Camera) -> Shown:
        """The visible points of a camera of any size and roll."""
        up = np.asarray(self.options.up)
        frame = upright(camera, up, MULTIPLE)
        rotated = moves(camera, frame)
        if rotated:
            frame = upright(camera, up, ROTATED_MULTIPLE)
        found = pyramid(shown_in(self.positions, frame, self.options), LEVELS)
        centre = torch.from_numpy(frame.centre).to(self.positions)
        basis = self.networks.basis(directions(self.positions[found.points], centre).float())
        slots = [slot.int() for slot in found.slots]
        return Shown(camera, frame, rotated, found.points, slots, basis)

    def rasters(self, shown: Shown) -> list[Tensor]:
        """[1, 9, H/2^k, W/2^k] for each level, of the frame."""
        descriptors = F.embedding(shown.points, self.mean, sparse=True)
        rows = self.rows[shown.points]
        (varying,) = torch.where(rows >= 0)
        if len(varying):
            slopes = F.embedding(rows[varying], self.slope, sparse=True).view(-1, BASIS, FEATURES)
            descriptors = descriptors.index_add(0, varying, torch.einsum("pb,pbf->pf", shown.basis[varying], slopes))
        levels = Pyramid(shown.points, [slot.long() for slot in shown.slots]).rasters(descriptors)
        return filled([level[None] for level in levels], self.background)

    def picture(self, shown: Shown) -> Tensor:
        """RGB [1, 3, H, W] of the camera, not clamped."""
        rasters = self.rasters(shown)
        background = self.background[:, None, None]
        # Not clamped, so that what is too bright can be learnt to be darker; the SDK clamps before it blends.
        picture = background + coverage([level[0] for level in rasters]) * (self.networks.refiner(rasters) - background)
        camera, frame = shown.camera, shown.frame
        if not shown.rotated:
            left, top = np.rint(between(camera, frame)[:, 2]).astype(int)
            return picture[..., top : top + camera.height_px, left : left + camera.width_px]
        return _rotated(picture, camera, frame)

    @torch.no_grad()
    def rendered(self, camera: Camera) -> np.ndarray:
        """RGB float32 [H, W, 3] in 0..1."""
        picture = self.picture(self.shown(camera))[0].clamp(0, 1)
        return np.ascontiguousarray(picture.permute(1, 2, 0).cpu().numpy())

    def descriptors(self) -> tuple[np.ndarray, np.ndarray]:
        """Means [P, 8] and slopes [V, 48], float32, as they are now."""
        return tuple(values.detach().cpu().numpy().copy() for values in (self.mean, self.slope))


def _rotated(picture: Tensor, camera: Camera, frame: Camera) -> Tensor:
    """The frame's image [1, 3, h, w] in the pixels of the camera [1, 3, H, W]; bilinear, borders repeated."""
    rows, columns = torch.meshgrid(torch.arange(camera.height_px), torch.arange(camera.width_px), indexing="ij")
    pixels = torch.stack([columns, rows, torch.ones_like(rows)], -1).double()
    at = pixels @ torch.from_numpy(between(camera, frame)).T
    size = torch.tensor([frame.width_px, frame.height_px])
    grid = ((2 * at + 1) / size - 1).to(picture)
    return F.grid_sample(picture, grid[None], mode="bilinear", padding_mode="border", align_corners=False)


class Tuning:
    """Goes on with the descriptors of a scene, photo after photo, in an order drawn anew every round."""

    def __init__(
        self,
        scene: TunedScene,
        views: Sequence[View],
        rates: Rates,
        weights: LossWeights,
        perceptual: Perceptual | None = None,
        seed: int = 0,
    ) -> None:
        if not views:
            raise ValueError("there is no photo to learn from")
        self.scene, self.weights, self.perceptual = scene, weights, perceptual
        self._random = np.random.default_rng(seed)
        self._queue: list[int] = []
        device = scene.positions.device
        self.shown = [scene.shown(view.camera) for view in views]
        self._photos = [torch.from_numpy(view.image).permute(2, 0, 1)[None].to(device) for view in views]
        groups = [{"params": [scene.mean], "whole": rates.mean}, {"params": [scene.slope], "whole": rates.slope}]
        self._optimiser = torch.optim.SparseAdam([g for g in groups if g["params"][0].numel()], 1e-3, BETAS)

    def step(self, rate_fraction: float = 1.0) -> float:
        """Renders one photo and goes a step; the loss before it. rate_fraction: of the learning rates."""
        if not self._queue:
            self._queue = self._random.permutation(len(self._photos)).tolist()
        k = self._queue.pop()
        photo = self._photos[k]
        terms = image_terms(
            self.scene.picture(self.shown[k]), photo, torch.ones_like(photo[:, :1]), self.weights, self.perceptual
        )
        loss = sum(terms.values())
        self._optimiser.zero_grad(set_to_none=True)
        for group in self._optimiser.param_groups:
            group["lr"] = group["whole"] * rate_fraction
        loss.backward()
        if torch.isfinite(loss):
            self._optimiser.step()
        return loss.item()
