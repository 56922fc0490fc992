"""How far the motion that is found between two frames of a clip is from the exact one: endpoint error in pixels of
320 x 240, where things move and can be seen in both. From a frame to the next, the way clips have it; predictors look
from the newest frame to the one before."""

from __future__ import annotations

import itertools
import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.prediction_quality.dis import Dis
from export.clips.clip import Frames, read_clip

PROGRAM = Path("build/release/benchmarks/native/find_motion")
MIN_MOTION_PX = 0.5  # what moves by less from frame to frame does not count
METHODS = {"still": "standing still", "motion": "motion", "dis": "OpenCV DIS"}


def found_motion(bgr: np.ndarray) -> np.ndarray:
    """As predictors find it, of frames uint8 [T, H, W, 3]: float32 [T - 1, H, W, 2]. Raises FileNotFoundError where the
    program was not built, subprocess.SubprocessError where it fails."""
    if not PROGRAM.exists():
        raise FileNotFoundError(f"{PROGRAM} is missing: cmake --build --preset release --target find_motion")
    frames = np.ascontiguousarray(bgr)
    count, height, width = frames.shape[:3]
    command = [str(PROGRAM), str(width), str(height)]
    given = subprocess.run(command, input=frames.tobytes(), capture_output=True, check=True).stdout
    return np.frombuffer(given, np.float32).reshape(count - 1, height, width, 2)


def endpoint_errors(motion: np.ndarray, frames: Frames) -> np.ndarray:
    """Of motion [T - 1, H, W, 2] against the exact one: pixels, of each that moves and stays visible."""
    moves = frames.visible & (np.hypot(*np.moveaxis(frames.motion, -1, 0)) >= MIN_MOTION_PX)
    return np.hypot(*(motion[moves] - frames.motion[moves]).T.astype(np.float64))


def errors_of(frames: Frames) -> dict[str, tuple[float, float]] | None:
    """Of a clip, by method: mean and median of endpoint errors; None where nothing moves."""
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
    """Of clips that have frames of 320 x 240, means over clips: {"clips": count, method: [mean, median]}; the count
    alone where there are none."""
    larges = (read_clip(path).large for path in paths)
    found = [own for large in larges if large is not None if (own := errors_of(large)) is not None]
    return {"clips": len(found)} | {
        name: np.mean([own[name] for own in found], 0).tolist() for name in METHODS if found
    }
