"""Batches of crops that lie in a GPU's memory, cut and seen through sensors there.

One frame after the other takes a core 1.4 ms, its sensor alone; a GPU that learns from thousands a second would wait.
"""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from export.edges.config import EPS_R
from export.edges.data import SCALES, Batches, Frame, frame_of
from export.edges.losses import FieldTarget
from export.solids.batched_sensors import SensorDeck
from export.solids.ray_scenes import Crops, drawn_scenes, labelled
from export.solids.sensors import drawn

SENSORS = 16384  # that a run deals from
MADE_CROPS = 6144  # of scenes that are made meanwhile: the newest so many
MADE_AT_ONCE = 8
FIRST_S = 6.0  # at most, to make the first ones; some are made in any case
TIME_FRACTION = 0.25  # of a run, for making more


class Stock:
    """Square crops of one side, in a device's memory: 8 bytes a pixel."""

    def __init__(self, crops: int, side_px: int, device: torch.device) -> None:
        self.side_px, shape = side_px, crops * side_px**2
        self.depth = torch.zeros(shape, device=device)
        self.distance = torch.zeros(shape, dtype=torch.float16, device=device)
        self.kind = torch.zeros(shape, dtype=torch.uint8, device=device)
        self.counts = torch.zeros(shape, dtype=torch.bool, device=device)
        self.focal_px = torch.ones(crops, device=device)
        self.device = device

    def put(self, first: int, crops: Crops) -> None:
        """Crops of this side, from number `first` on."""
        pixels = slice(first * self.side_px**2, (first + len(crops.focal_px)) * self.side_px**2)
        for name in ("depth", "distance", "kind", "counts"):
            plane = getattr(self, name)
            plane[pixels] = getattr(crops, name).flatten().to(plane.dtype)
        self.focal_px[first : first + len(crops.focal_px)] = crops.focal_px

    def cut(self, rng: np.random.Generator, crops: np.ndarray, crop_px: int) -> Crops:
        """One cut-out of each of these crops, mirrored and transposed."""
        count = len(crops)
        corner = rng.integers(self.side_px - crop_px + 1, size=(2, count))
        mirrored = rng.random((3, count)) < 0.5
        table = torch.from_numpy(np.concatenate([crops[None], corner, mirrored]).astype(np.int64))
        table = table.to(self.device, non_blocking=True)
        crop, top, left, flip_y, flip_x, transpose = table[:, :, None, None]
        along = torch.arange(crop_px, device=self.device)
        down, across = along[:, None], along[None, :]
        y, x = torch.where(transpose > 0, across, down), torch.where(transpose > 0, down, across)
        y = top + torch.where(flip_y > 0, crop_px - 1 - y, y)
        x = left + torch.where(flip_x > 0, crop_px - 1 - x, x)
        pixels = (crop * self.side_px + y) * self.side_px + x
        planes = (plane[pixels] for plane in (self.depth, self.distance, self.kind, self.counts))
        return Crops(*planes, self.focal_px[table[0]])


def _stock_of(frames: Sequence[Frame], device: torch.device) -> Stock:
    stock = Stock(len(frames), frames[0].depth.shape[1], device)
    for k, frame in enumerate(frames):
        planes = (torch.from_numpy(getattr(frame, name))[None] for name in ("depth", "distance", "kind", "counts"))
        stock.put(k, Crops(*planes, torch.tensor([frame.focal_px])))
    return stock


class DeviceBatches(Batches):
    """As `Batches`: the same crops in the same order, cut, mirrored, transposed, scaled and seen alike, with other
    random numbers. A batch depends on seed, number and the state of torch's generator (`training.seed_step`); with
    scenes that are made meanwhile, on how fast the device is, too."""

    def moved(self, device: torch.device, made_fraction: float = 0.0) -> DeviceBatches:
        """Puts crops and sensors on a device; before the first batch. made_fraction: of a batch, of new scenes."""
        self._stock = _stock_of([frame_of(record) for record in self.records], device)
        rng = np.random.default_rng([self.seed, 3])
        self._deck = SensorDeck([drawn(rng) for _ in range(SENSORS)], device)
        self._made, self.made_crops = 0, 0
        if made_fraction > 0:
            self._made_stock = Stock(MADE_CROPS, self.crop_px, device)
            self._made = round(made_fraction * self.batch)
            start = time.monotonic()
            torch.manual_seed(self.seed)
            self._make(device)
            while self.made_crops < MADE_CROPS // 4 and time.monotonic() - start < FIRST_S:
                self._make(device)
        return self

    def _make(self, device: torch.device) -> None:
        """Makes some crops in place of the oldest."""
        if device.type == "cuda":
            torch.cuda.synchronize(device)  # what waits there is not of this
        start = time.monotonic()
        crops = labelled(*drawn_scenes(MADE_AT_ONCE, self.crop_px, device), self.crop_px)
        self._made_stock.put(self.made_crops % MADE_CROPS, crops)
        self.made_crops += MADE_AT_ONCE
        now = time.monotonic()
        self._next = now + (now - start) * (1 / TIME_FRACTION - 1)

    def _cut(self, rng: np.random.Generator, step: int, device: torch.device) -> Crops:
        count = self.batch - self._made
        own = np.array([self.index(step * count + k) for k in range(count)], np.int64)
        crops = self._stock.cut(rng, own, self.crop_px)
        if not self._made:
            return crops
        if time.monotonic() >= self._next:
            self._make(device)
        made = rng.integers(min(self.made_crops, MADE_CROPS), size=self._made)
        both = zip(vars(crops).values(), vars(self._made_stock.cut(rng, made, self.crop_px)).values(), strict=True)
        return Crops(*(torch.cat(pair) for pair in both))

    @torch.no_grad()
    def draw(self, step: int, device: torch.device) -> tuple[Tensor, Tensor, FieldTarget]:
        """As `Batches.draw`."""
        rng = np.random.default_rng([self.seed, 2, step])
        crops = self._cut(rng, step, device)
        scale = torch.from_numpy((2 ** rng.uniform(*SCALES, self.batch)).astype(np.float32))
        depth = crops.depth * scale.to(device, non_blocking=True)[:, None, None]
        seen = self._deck.see(rng.integers(len(self._deck), size=self.batch), depth, crops.focal_px)
        distance = crops.distance.float().clamp_max(EPS_R)
        target = FieldTarget(distance, crops.kind.long(), crops.counts & (seen > 0))
        return seen, crops.focal_px[:, None].expand(-1, 2), target
