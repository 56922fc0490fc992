"""Sharpness and motion of small grey images."""

from __future__ import annotations

import numpy as np

SMALL_WIDTH_PX = 160
_TILE_PX = 40
_CLEAR_PEAK = 1.25  # of a correlation, over the highest value elsewhere: 1.2 at most for images of different things
_ALIKE_PX = 4.0  # between shifts of tiles, as of near and far things
_MIN_FOUND = 1 / 3  # of the tiles with content
_MIN_SPREAD = 1.5  # grey levels: a tile with less shows nothing that can be followed


def shrunk(grey: np.ndarray) -> np.ndarray:
    """float32 [h, w] with the longer side of about SMALL_WIDTH_PX, by means of blocks."""
    block = max(1, round(max(grey.shape) / SMALL_WIDTH_PX))
    height, width = (side // block * block for side in grey.shape)
    blocks = grey[:height, :width].reshape(height // block, block, width // block, block)
    return blocks.mean((1, 3), dtype=np.float32)


def sharpness(grey: np.ndarray) -> float:
    """Variance of the Laplacian of grey [H, W], uint8."""
    g = grey.astype(np.int16)
    laplacian = g[1:-1, :-2] + g[1:-1, 2:] + g[:-2, 1:-1] + g[2:, 1:-1] - 4 * g[1:-1, 1:-1]
    return float(laplacian.var(dtype=np.float64))


def motion_between(before: np.ndarray, after: np.ndarray) -> float | None:
    """How far the image content moved between two images of `shrunk`, as a fraction of the diagonal: the upper
    quartile of tiles with content. None if few tiles are found again, as after a cut or in a fast pan."""
    height, width = before.shape
    rows, columns = height // _TILE_PX, width // _TILE_PX
    size = _TILE_PX
    window = np.hanning(size)[:, None] * np.hanning(size)[None]
    shifts, tiles = [], 0
    for row in range(rows):
        for column in range(columns):
            cut = np.s_[row * size : (row + 1) * size, column * size : (column + 1) * size]
            a, b = before[cut], after[cut]
            if a.std() < _MIN_SPREAD and b.std() < _MIN_SPREAD:
                continue
            tiles += 1
            cross = np.conj(np.fft.rfft2((a - a.mean()) * window)) * np.fft.rfft2((b - b.mean()) * window)
            correlation = np.fft.irfft2(cross / np.sqrt(np.abs(cross) + 1e-9), (size, size))
            y, x = np.unravel_index(int(correlation.argmax()), correlation.shape)
            peak = correlation[y, x]
            around = [(int(y) + dy) % size for dy in (-1, 0, 1)], [(int(x) + dx) % size for dx in (-1, 0, 1)]
            rest = correlation.copy()
            rest[np.ix_(*around)] = 0
            if peak <= 0 or peak < _CLEAR_PEAK * rest.max():
                continue
            shifts.append([_subpixel(correlation, int(y), int(x), axis) for axis in (0, 1)])
    if tiles == 0:
        return 0.0
    if not shifts:
        return None
    found = np.array(shifts)
    middle = np.median(found, 0)
    alike = np.linalg.norm(found - middle, axis=1) < max(_ALIKE_PX, 0.5 * float(np.linalg.norm(middle)))
    if alike.sum() < _MIN_FOUND * tiles:
        return None
    return float(np.quantile(np.linalg.norm(found[alike], axis=1), 0.75) / np.hypot(height, width))


def _subpixel(correlation: np.ndarray, y: int, x: int, axis: int) -> float:
    """The peak along an axis by a parabola, from -size / 2 to size / 2."""
    size = correlation.shape[axis]
    at = (y, x)[axis]
    line = correlation[:, x] if axis == 0 else correlation[y]
    left, middle, right = line[(at - 1) % size], line[at], line[(at + 1) % size]
    bend = left - 2 * middle + right
    place = at + (0.5 * (left - right) / bend if bend < 0 else 0.0)
    return place - size if place > size / 2 else place
