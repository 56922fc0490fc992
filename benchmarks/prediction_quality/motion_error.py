"""Measures the endpoint error of the motion between two frames of a clip, in pixels of 320 x 240.

Pixels count that move and are visible in both frames. Motion goes from a frame to the next one, as clips store it;
predictors estimate it from the newest frame to the one before.
"""

from __future__ import annotations

import itertools
import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.prediction_quality.dis import Dis
from export.clips.clip import Frames, read_clip

PROGRAM = Path("build/release/benchmarks/native/find_motion")
MIN_MOTION_PX = 0.5  # pixels with less motion from frame to frame do not count
METHODS = {"still": "standing still", "motion": "motion", "dis": "OpenCV DIS"}


def found_motion(bgr: np.ndarray) -> np.ndarray:
    """Returns the motion that predictors estimate in frames uint8 [T, H, W, 3]: float32 [T - 1, H, W, 2]. Raises
    FileNotFoundError without the program, subprocess.SubprocessError if it fails."""
    if not PROGRAM.exists():
        raise FileNotFoundError(f"{PROGRAM} is missing: cmake --build --preset release --target find_motion")
    frames = np.ascontiguousarray(bgr)
    count, height, width = frames.shape[:3]
    command = [str(PROGRAM), str(width), str(height)]
    given = subprocess.run(command, input=frames.tobytes(), capture_output=True, check=True).stdout
    return np.frombuffer(given, np.float32).reshape(count - 1, height, width, 2)


def endpoint_errors(motion: np.ndarray, frames: Frames) -> np.ndarray:
    """Returns errors in pixels of motion [T - 1, H, W, 2], for each pixel that moves and stays visible."""
    moves = frames.visible & (np.hypot(*np.moveaxis(frames.motion, -1, 0)) >= MIN_MOTION_PX)
    return np.hypot(*(motion[moves] - frames.motion[moves]).T.astype(np.float64))


def errors_of(frames: Frames) -> dict[str, tuple[float, float]] | None:
    """Returns the mean and median endpoint error of a clip by method; None if nothing moves."""
    bgr = frames.rgb[..., ::-1]
    dis = Dis(*bgr.shape[1:3])
    motions = {
        "still": np.zeros_like(frames.motion),
        "motion": found_motion(bgr),
        "dis": np.stack([dis.motion(one, other) for one, other in itertools.pairwise(bgr)]),
    }
    errors = {name: endpoint_errors(motion, frames) for name, motion in motions.items()}
    if not errors["still"].size:
        return None
    return {name: (float(own.mean()), float(np.median(own))) for name, own in errors.items()}


def measure(paths: Sequence[Path]) -> dict:
    """Returns means over the clips that have frames of 320 x 240: {"clips": count, method: [mean, median]}. Without
    such clips only the count is returned."""
    larges = (read_clip(path).large for path in paths)
    found = [own for large in larges if large is not None if (own := errors_of(large)) is not None]
    return {"clips": len(found)} | {
        name: np.mean([own[name] for own in found], 0).tolist() for name in METHODS if found
    }
