"""Batches of crops that lie in a GPU's memory, cut and seen through sensors there.

One frame after the other takes a core 1.4 ms, its sensor alone; a GPU that learns from thousands a second would wait.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from export.edges.config import EPS_R
from export.edges.data import SCALES, Batches, frame_of
from export.edges.losses import FieldTarget
from export.solids.batched_sensors import SensorDeck
from export.solids.sensors import drawn

SENSORS = 16384  # that a run deals from


class DeviceBatches(Batches):
    """As `Batches`: the same crops in the same order, cut, mirrored, transposed, scaled and seen alike, with other
    random numbers. A batch depends on seed, number and the state of torch's generator (`training.seed_step`)."""

    def moved(self, device: torch.device) -> DeviceBatches:
        """Puts crops and sensors on a device; before the first batch. 10 bytes a pixel."""
        frames = [frame_of(record) for record in self.records]
        self.side_px = self.records[0].width

        def plane(name: str, kind: type) -> Tensor:
            stacked = np.stack([getattr(frame, name).astype(kind) for frame in frames])
            return torch.from_numpy(stacked).to(device).flatten()

        self._depth, self._distance = plane("depth", np.float32), plane("distance", np.float16)
        self._kind, self._counts = plane("kind", np.uint8), plane("counts", np.bool_)
        self._focal_px = torch.tensor([f.focal_px for f in frames], dtype=torch.float32, device=device)
        rng = np.random.default_rng([self.seed, 3])
        self._deck = SensorDeck([drawn(rng) for _ in range(SENSORS)], device)
        return self

    def _pixels(self, rng: np.random.Generator, crops: np.ndarray, device: torch.device) -> Tensor:
        """[N, S, S]: numbers of the pixels, among those of all crops, of one cut-out of each."""
        room = self.side_px - self.crop_px
        corner = rng.integers(room + 1, size=(2, self.batch))
        mirrored = rng.random((3, self.batch)) < 0.5
        table = torch.from_numpy(np.concatenate([crops[None], corner, mirrored]).astype(np.int64))
        crop, top, left, flip_y, flip_x, transpose = table.to(device, non_blocking=True)[:, :, None, None]
        along = torch.arange(self.crop_px, device=device)
        down, across = along[:, None], along[None, :]
        y, x = torch.where(transpose > 0, across, down), torch.where(transpose > 0, down, across)
        y = top + torch.where(flip_y > 0, self.crop_px - 1 - y, y)
        x = left + torch.where(flip_x > 0, self.crop_px - 1 - x, x)
        return (crop * self.side_px + y) * self.side_px + x

    @torch.no_grad()
    def draw(self, step: int, device: torch.device) -> tuple[Tensor, Tensor, FieldTarget]:
        """As `Batches.draw`."""
        rng = np.random.default_rng([self.seed, 2, step])
        crops = np.array([self.index(step * self.batch + k) for k in range(self.batch)])
        pixels = self._pixels(rng, crops, device)
        scale = torch.from_numpy((2 ** rng.uniform(*SCALES, self.batch)).astype(np.float32))
        scale = scale.to(device, non_blocking=True)
        focal_px = self._focal_px[torch.from_numpy(crops).to(device, non_blocking=True)]
        depth = self._depth[pixels] * scale[:, None, None]
        seen = self._deck.see(rng.integers(len(self._deck), size=self.batch), depth, focal_px)
        counts = self._counts[pixels] & (seen > 0)
        distance = self._distance[pixels].float().clamp_max(EPS_R)
        target = FieldTarget(distance, self._kind[pixels].long(), counts)
        return seen, focal_px[:, None].expand(-1, 2), target
