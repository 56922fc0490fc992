"""The SDK through its Python package, for `worker.py`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import maquette
import numpy as np

if TYPE_CHECKING:
    from maquette import DensePoseResult


class MaquetteProduct:
    """preset: "stream" or "photo". bundle: folder of the networks. threads: 0 lets the library choose."""

    def __init__(self, preset: str, bundle: str, threads: int = 0) -> None:
        self._dense = maquette.DensePose(bundle, preset=preset, threads=threads, has_keypoints=1)

    def start(self) -> None:
        self._dense.reset()

    def photo(self, image: np.ndarray) -> DensePoseResult:
        return self._dense.run(maquette.Frame(image))

    def frame(self, image: np.ndarray, sequence: int, time_ns: int) -> DensePoseResult:
        return self._dense.run(maquette.Frame(image, sequence=sequence, timestamp_ns=time_ns))

    def count(self, result: DensePoseResult) -> int:
        return len(result.people)

    def found(self, result: DensePoseResult, shape: tuple[int, int]) -> dict[str, np.ndarray]:
        people = result.people
        return {
            "box": np.array([person.box_px for person in people], np.float32).reshape(-1, 4),
            "score": np.array([person.score for person in people], np.float32),
            "inds": result.person,
            "keypoint": np.array([person.keypoints for person in people], np.float32).reshape(-1, 33, 3),
            "id": np.array([person.id for person in people], np.int64),
        }
