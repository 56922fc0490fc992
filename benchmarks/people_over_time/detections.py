"""Boxes, scores and ids of each frame of a clip: from the library as it sees a stream, or read from a file."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np


@dataclass(frozen=True, eq=False)
class Detections:
    """One frame: boxes [N, 4], scores [N], ids [N]: from 1."""

    time_ns: int
    boxes: np.ndarray
    scores: np.ndarray
    ids: np.ndarray


def detect(recording: Path, **settings: object) -> list[Detections]:
    """Runs dense pose on every frame of a recording. settings: of `maquette.DensePose`. Raises MaquetteError."""
    import maquette

    found = []
    with maquette.DensePose(**settings) as dense, maquette.Source(recording) as source:
        for frame in source:
            people = dense.run(frame).people
            boxes = np.array([p.box_px for p in people], float).reshape(-1, 4)
            ids = np.array([p.id for p in people], int)
            found.append(Detections(frame.timestamp_ns, boxes, np.array([p.score for p in people], float), ids))
    return found


def save(path: Path, clips: dict[str, list[Detections]]) -> None:
    """clips: by the name of the clip."""
    rows = {name: [{k: np.asarray(v).tolist() for k, v in asdict(f).items()} for f in frames]
            for name, frames in clips.items()}  # fmt: skip
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(rows))


def load(path: Path) -> dict[str, list[Detections]]:
    """Raises OSError, and ValueError for a file that `save` did not write."""
    try:
        return {
            name: [
                Detections(f["time_ns"], np.reshape(f["boxes"], (-1, 4)).astype(float), np.array(f["scores"], float),
                           np.array(f["ids"], int))
                for f in frames
            ]
            for name, frames in json.loads(path.read_text()).items()
        }  # fmt: skip
    except (KeyError, TypeError, AttributeError, json.JSONDecodeError) as error:
        raise ValueError(f"{path} holds no detections of people ({error!r}); make it with --save.") from None
