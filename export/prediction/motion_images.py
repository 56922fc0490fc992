"""Images that motion alone predicts, by the SDK's own method at the networks' size: what they see besides the frames
before, and must beat."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from export.clips.clip import SIDE_PX

HORIZONS = (1, 2, 4, 8, 12)  # frames ahead


@dataclass(frozen=True, eq=False)
class MotionJob:
    """Frames uint8 [T, 64, 64, 3] of clip number `number`."""

    number: int
    frames: np.ndarray
    fps: float


def is_known(t: int, horizon: int, frames: int) -> bool:
    """Whether motion predicts what is `horizon` frames after frame t of a clip: two frames show it, and the clip goes
    on for so long."""
    return t >= 1 and t + horizon < frames


def motion_pictures(job: MotionJob) -> np.ndarray:
    """uint8 [T, horizons, 64, 64, 3]: made after frame t was seen, as if HORIZONS[h] frames later; 0 where not known.
    Raises MaquetteError where the SDK's library was not built."""
    import maquette  # in the process that does it: its library starts threads

    count, fps = len(job.frames), job.fps
    pictures = np.zeros((count, len(HORIZONS), SIDE_PX, SIDE_PX, 3), np.uint8)
    with maquette.Predictor(method="motion") as predictor:
        for t, frame in enumerate(job.frames):
            predictor.push(maquette.Frame(frame, timestamp_ns=round(t * 1e9 / fps)))
            for h, horizon in enumerate(HORIZONS):
                if is_known(t, horizon, count):
                    pictures[t, h] = predictor.predict(horizon / fps).pixels()
    return pictures
