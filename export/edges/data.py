"""Data of training and validation: crops and frames of rendered solids, seen through a model of a depth camera."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from export.edges.config import EPS_R
from export.edges.losses import FieldTarget
from export.solids.compact import CompactCrop, read_compact
from export.solids.records import Record, RecordError, read_records
from export.solids.sensors import Sensor, drawn

__all__ = ["Batches", "Frame", "RecordError", "read_frames", "seen_by"]

# Kinds of export.solids.labels as the network's: 0 none, 1 crease, 2 boundary.
NETWORK_KIND = np.array([0, 1, 1, 2], np.int64)
SCALES = (-1.0, 1.0)  # powers of two that a scene's size and distance are multiplied by


@dataclass(frozen=True, eq=False)
class Frame:
    """A labelled view, planes [H, W]: depth float32 in metres, 0 where nothing is; distance in r; kind int64, of the
    network; counts bool: there is a label. number: of the frame in its folder."""

    depth: np.ndarray
    distance: np.ndarray
    kind: np.ndarray
    counts: np.ndarray
    focal_px: float
    number: int = 0


def frame_of(record: Record | CompactCrop, number: int = 0) -> Frame:
    planes = record.decoded()
    counts = ~planes["ignore"] & (planes["depth"] > 0)
    distance = planes["distance"].astype(np.float32)
    return Frame(planes["depth"], distance, NETWORK_KIND[planes["kind"]], counts, record.intrinsics[0], number)


def read_frames(folder: Path, width_px: int | None = None, limit: int | None = None) -> list[Frame]:
    """Views of a folder, those of one width where it is given, at most `limit`, evenly. Raises RecordError."""
    records = [r for r in read_records(folder) if width_px in (None, r.width)]
    if not records:
        raise RecordError(f"{folder} has no views {width_px} px wide. Make some: export.solids.dataset --whole")
    chosen = np.linspace(0, len(records) - 1, min(limit or len(records), len(records))).astype(int)
    return [frame_of(records[k], int(k)) for k in chosen]


def seen_by(sensor: Sensor, depth: np.ndarray, focal_px: float, rng: np.random.Generator) -> np.ndarray:
    """Depth with the errors of a sensor: float32 [H, W]."""
    return np.nan_to_num(sensor(depth, focal_px, rng), nan=0, posinf=0, neginf=0).astype(np.float32)


class Batches:
    """Crops in a new order each pass, cut, mirrored, transposed and scaled, each through a sensor of its own.

    Batch k depends on the seed and k alone. folder: of shards, or a file of `export.solids.compact`.
    """

    def __init__(self, folder: Path, crop_px: int, batch: int, seed: int, limit: int | None = None) -> None:
        records = read_records(folder) if folder.is_dir() else read_compact(folder)
        self.records = list(islice(records, limit))
        sides = {side for record in self.records for side in (record.height, record.width)}
        if len(self.records) < batch:
            raise RecordError(f"{folder} has {len(self.records)} crops, fewer than a batch of {batch}.")
        if len(sides) > 1 or crop_px > min(sides) or crop_px % 16:
            raise RecordError(
                f"Crops have sides of {sorted(sides)} px: cut multiples of 16 px out of them, not {crop_px}."
            )
        self.crop_px, self.batch, self.seed = crop_px, batch, seed
        self._pass, self._order = -1, np.empty(0, int)

    def index(self, number: int) -> int:
        """Index of the crop of sample `number`."""
        turn, at = divmod(number, len(self.records))
        if turn != self._pass:
            self._pass = turn
            self._order = np.random.default_rng([self.seed, 1, turn]).permutation(len(self.records))
        return int(self._order[at])

    def example(self, number: int) -> Frame:
        """The `number`-th crop, as a sensor of its own sees it."""
        rng = np.random.default_rng([self.seed, 2, number])
        crop = frame_of(self.records[self.index(number)])
        y, x = rng.integers(crop.depth.shape[0] - self.crop_px + 1, size=2)
        flip_y, flip_x, transpose = rng.random(3) < 0.5
        depth, distance, kind, counts = (
            np.ascontiguousarray(_rotated(p[y : y + self.crop_px, x : x + self.crop_px], flip_y, flip_x, transpose))
            for p in (crop.depth, crop.distance, crop.kind, crop.counts)
        )
        depth = depth * np.float32(2 ** rng.uniform(*SCALES))
        seen = seen_by(drawn(rng), depth, crop.focal_px, rng)
        return Frame(seen, distance, kind, counts & (seen > 0), crop.focal_px)

    def draw(self, step: int, device: torch.device) -> tuple[Tensor, Tensor, FieldTarget]:
        """Batch of a step: depth [N, S, S], focal lengths [N, 2], and what is right."""
        examples = [self.example(step * self.batch + k) for k in range(self.batch)]
        depth, distance, kind, counts = (
            torch.from_numpy(np.stack([getattr(example, name) for example in examples])).to(device)
            for name in ("depth", "distance", "kind", "counts")
        )
        focal_px = torch.tensor([[e.focal_px, e.focal_px] for e in examples], dtype=torch.float32, device=device)
        return depth, focal_px, FieldTarget(distance.clamp_max(EPS_R), kind, counts)


def _rotated(plane: np.ndarray, flip_y: bool, flip_x: bool, transpose: bool) -> np.ndarray:
    plane = plane[::-1] if flip_y else plane
    plane = plane[:, ::-1] if flip_x else plane
    return plane.T if transpose else plane
