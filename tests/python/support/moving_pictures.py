"""Small films and photos of a texture, for tests of scene making."""

import functools
import subprocess
from pathlib import Path

import numpy as np

SIZE = 320, 240


@functools.cache
def texture(seed: int = 0, side: int = 900) -> np.ndarray:
    """uint8 [side, side, 3]: rectangles of many sizes and colours."""
    rng = np.random.default_rng(seed)
    image = np.full((side, side, 3), 128, np.uint8)
    for _ in range(6000 * side * side // 900**2):
        x, y = rng.integers(-20, side, 2)
        width, height = rng.integers(3, 40, 2)
        image[max(y, 0) : max(y + height, 0), max(x, 0) : max(x + width, 0)] = rng.integers(20, 235, 3)
    return image


def window(image: np.ndarray, x: float, y: float = 100) -> np.ndarray:
    width, height = SIZE
    return np.ascontiguousarray(image[round(y) : round(y) + height, round(x) : round(x) + width])


def write_film(path: Path, frames: list[np.ndarray], fps: int = 10) -> Path:
    """An AVI file of JPEG images, which is written fast."""
    height, width = frames[0].shape[:2]
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", str(fps), "-i", "-"]
    command = ["ffmpeg", "-y", "-loglevel", "error", *raw, "-c:v", "mjpeg", "-q:v", "2", path]
    subprocess.run(command, input=b"".join(frame.tobytes() for frame in frames), check=True)
    return path
