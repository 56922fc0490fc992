"""The pixels of a photo that a head is fitted to, and their order (sdk/src/head/fit/fit_rays, head_fit).

Random numbers are SplitMix64's, which are the same everywhere: so the same pixels are held out, and each step draws the
same rays, as on the device.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from export.heads.fitting.anchor_fit import LOG_SIGMA_RANGE
from export.heads.fitting.photo import HeadPhoto, shows_head, usable

INNER = 0.9  # of a matte; beyond this, no background shows through
MAX_SPREAD_DM = 0.25  # of the template points of neighbours on one surface
HELD_OUT_CELLS = 3  # a side of a square that is held out: the next pixel over would tell
MARGIN_CELLS = 5  # pixels farther than this from all cells of the head are left out
_STEP, _MASK = 0x9E3779B97F4A7C15, (1 << 64) - 1


@dataclass(frozen=True, eq=False)
class Rays:
    """pixels [N, 2] from the principal point; matte [N], 0..1, NaN where not known; rgb [N, 3], 0..1, where has_colour
    [N]; point [N, 3], dm, and its sigma [N] where has_point [N]. Real numbers are float32, as on the device."""

    pixels: np.ndarray
    matte: np.ndarray
    rgb: np.ndarray
    has_colour: np.ndarray
    point: np.ndarray
    point_sigma: np.ndarray
    has_point: np.ndarray

    def __len__(self) -> int:
        return len(self.pixels)

    def __getitem__(self, which: np.ndarray | slice) -> Rays:
        return Rays(*(getattr(self, name)[which] for name in self.__dataclass_fields__))


@dataclass(frozen=True, eq=False)
class RayLevel:
    """Rays of one resolution; cells_per_ray: how many of the encoder's cells one of them stands for."""

    fitted: Rays
    held_out: Rays
    cells_per_ray: float


def _finish(z: int | np.ndarray) -> int | np.ndarray:
    """SplitMix64's output function."""
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & _MASK
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & _MASK
    return z ^ (z >> 31)


class Shuffle:
    """Fisher and Yates' shuffles."""

    def __init__(self, seed: int) -> None:
        self.state = seed

    def run(self, values: np.ndarray) -> None:
        for i in range(len(values), 1, -1):
            self.state = (self.state + _STEP) & _MASK
            j = _finish(self.state) % i
            values[i - 1], values[j] = values[j], values[i - 1]


def _is_held_out(cell_x: np.ndarray, cell_y: np.ndarray, fraction: float, seed: int) -> np.ndarray:
    seeded = _finish((seed + _STEP) & _MASK)
    square = (cell_y // HELD_OUT_CELLS << 40) | (cell_x // HELD_OUT_CELLS << 20)
    by_square = {n: _finish((n + seeded + _STEP) & _MASK) >> 11 for n in np.unique(square).tolist()}
    return np.array([by_square[n] < fraction * 2.0**53 for n in square.tolist()], bool)


def rays_of(photo: HeadPhoto, side: int, held_out_fraction: float, seed: int) -> RayLevel:
    """The crop as side x side pixels; only those near the head, in the photo."""
    cells = photo.cells.astype(np.float64)
    grid = cells.shape[0]
    is_head, is_usable = shows_head(cells), usable(cells)
    window = np.ones((2 * MARGIN_CELLS + 1,) * 2, np.uint8)
    near = cv2.dilate(is_head.astype(np.uint8), window, borderType=cv2.BORDER_CONSTANT, borderValue=0) > 0
    middle = (np.arange(side) + 0.5) * (grid / side)
    x, y = (a.reshape(-1) for a in np.meshgrid(middle, middle))
    at = photo.in_photo(x, y)
    keep = near[y.astype(int), x.astype(int)] & ((at >= 0) & (at < photo.size)).all(1)
    rgb = cv2.resize(photo.rgb, (side, side), interpolation=cv2.INTER_AREA).reshape(-1, 3)[keep] / 255
    x, y, at = x[keep], y[keep], at[keep]

    # Between the middles of four cells.
    column, row = (np.clip(a - 0.5, 0, grid - 1) for a in (x, y))
    left, top = (np.minimum(a.astype(int), grid - 2) for a in (column, row))
    u, v = column - left, row - top
    corners = [(top, left), (top, left + 1), (top + 1, left), (top + 1, left + 1)]
    weights = [(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v]
    first = cells[corners[0]][:, :3]
    known, has_point = np.ones(len(x), bool), np.ones(len(x), bool)
    matte, sigma, point = np.zeros(len(x)), np.zeros(len(x)), np.zeros((len(x), 3))
    for corner, weight in zip(corners, weights, strict=True):
        cell = cells[corner]
        known &= is_usable[corner]
        has_point &= is_head[corner] & (np.linalg.norm(cell[:, :3] - first, axis=1) <= MAX_SPREAD_DM)
        matte += weight / (1 + np.exp(-cell[:, 4]))
        sigma += weight * np.exp(np.clip(cell[:, 3], *LOG_SIGMA_RANGE))
        point += weight[:, None] * cell[:, :3]
    matte = np.where(known, matte, np.nan).astype(np.float32)
    rays = Rays(
        (at - 0.5 - photo.centre).astype(np.float32), matte, rgb.astype(np.float32), matte > INNER,
        point.astype(np.float32), sigma.astype(np.float32), has_point,
    )  # fmt: skip
    held_out = _is_held_out(x.astype(int), y.astype(int), held_out_fraction, seed)
    return RayLevel(rays[~held_out], rays[held_out], (grid / side) ** 2)
