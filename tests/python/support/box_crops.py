"""Labelled crops of a box before a wall, drawn without a renderer: what trainings of edges read in tests."""

from pathlib import Path

import numpy as np

from export.solids.records import packed, write_shard

FOCAL_PX = 150.0


def planes(rng: np.random.Generator, side_px: int) -> dict[str, np.ndarray]:
    """A board, seen head-on, before a wall: its rim is a boundary for the board's own pixels."""
    y, x = np.mgrid[:side_px, :side_px]
    left, top = rng.integers(side_px // 4, side_px // 2, size=2)
    right, bottom = rng.integers(side_px * 5 // 8, side_px * 7 // 8, size=2)
    board = (x >= left) & (x < right) & (y >= top) & (y < bottom)
    to_rim = np.minimum.reduce([x - left, right - 1 - x, y - top, bottom - 1 - y]) + 0.5
    distance = np.where(board, np.minimum(to_rim, 16), 16)
    return {
        "depth": np.where(board, 1.0, 1.4).astype(np.float32),
        "distance": distance.astype(np.float16),
        "kind": np.where(distance < 16, 3, 0).astype(np.uint8),
        "ignore": np.zeros(board.shape, bool),
        "patch": board.astype(np.uint16),
    }


def write_crops(folder: Path, seed: int, count: int, side_px: int = 64) -> Path:
    folder.mkdir(parents=True)
    rng = np.random.default_rng(seed)
    centre = (side_px - 1) / 2
    records = [packed(f"box/{k}", planes(rng, side_px), (FOCAL_PX, FOCAL_PX, centre, centre)) for k in range(count)]
    write_shard(folder / "solids-00000.npz", records, {})
    return folder
