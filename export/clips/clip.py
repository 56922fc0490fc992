"""A clip: its frames, the exact motion of every pixel to the next frame, and what is known of it; files of clips."""

from __future__ import annotations

import json
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

FORMAT = 1
SPLITS = ("train", "val", "test")
FRAMES = 30
SIDE_PX = 64  # of the frames that networks see: an image of any shape is squeezed to this square
LARGE_PX = (320, 240)  # width and height of the frames that val and test clips have as well
_SETS = ("shapes", "pushing", "collages")


class ClipError(ValueError):
    """A file is not a clip, or not one of this format."""


@dataclass(frozen=True, eq=False)
class Frames:
    """One size of a clip.

    rgb: uint8 [T, H, W, 3]. motion: float32 [T - 1, H, W, 2], pixels to the right and down: the point of the surface
    that frame t shows at the centre of pixel (x, y) lies at (x, y) + motion[t, y, x] in frame t + 1. visible: bool
    [T - 1, H, W], whether frame t + 1 shows that point.
    """

    rgb: np.ndarray
    motion: np.ndarray
    visible: np.ndarray

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height."""
        return self.rgb.shape[2], self.rgb.shape[1]


@dataclass(frozen=True, eq=False)
class Clip:
    """small: 64 x 64. large: 320 x 240 of the same clip, or None. facts: set, split, number, fps, packages with their
    licences. bits, surprise_bits: float32 [T], entropy of each frame given all before it and its own information
    -log2 p, NaN where not known; only `shapes` has them."""

    small: Frames
    large: Frames | None
    facts: dict
    bits: np.ndarray | None = None
    surprise_bits: np.ndarray | None = None

    @property
    def fps(self) -> float:
        return float(self.facts["fps"])


def generator(kind: str, split: str, number: int) -> np.random.Generator:
    """Random numbers of one clip: a function of set, split and number alone."""
    return np.random.default_rng([_SETS.index(kind), SPLITS.index(split), number])


def write_clip(clip: Clip, path: Path) -> None:
    """Atomically: written under another name, then renamed. Motion is kept in half precision (1/32 px at 64 px)."""
    arrays: dict[str, np.ndarray] = {}
    for name, frames in (("small", clip.small), ("large", clip.large)):
        if frames is None:
            continue
        arrays[f"{name}_rgb"] = frames.rgb
        arrays[f"{name}_motion"] = frames.motion.astype(np.float16)
        arrays[f"{name}_visible"] = np.packbits(frames.visible, axis=-1)
    if clip.bits is not None:
        arrays["bits"], arrays["surprise_bits"] = clip.bits, clip.surprise_bits
    facts = json.dumps({"format": FORMAT, **clip.facts}).encode()
    partial = path.with_name(f".{path.name}.partial")
    with partial.open("wb") as file:
        np.savez_compressed(file, facts=np.frombuffer(facts, np.uint8), **arrays)
    partial.rename(path)


def _frames(stored: np.lib.npyio.NpzFile, name: str) -> Frames | None:
    if f"{name}_rgb" not in stored:
        return None
    rgb = stored[f"{name}_rgb"]
    visible = np.unpackbits(stored[f"{name}_visible"], axis=-1, count=rgb.shape[2]).astype(bool)
    return Frames(rgb, stored[f"{name}_motion"].astype(np.float32), visible)


def read_clip(path: Path) -> Clip:
    """Raises ClipError."""
    with _opened(path) as stored:
        facts = _facts(stored, path)
        bits = (stored["bits"], stored["surprise_bits"]) if "bits" in stored else (None, None)
        return Clip(_frames(stored, "small"), _frames(stored, "large"), facts, *bits)


def read_rgb(path: Path) -> tuple[np.ndarray, float]:
    """Only what trainings need: frames uint8 [T, 64, 64, 3] and frames a second. Raises ClipError."""
    with _opened(path) as stored:
        return stored["small_rgb"], float(_facts(stored, path)["fps"])


def _opened(path: Path) -> np.lib.npyio.NpzFile:
    try:
        return np.load(path)
    except (OSError, EOFError, ValueError, zipfile.BadZipFile) as error:
        raise ClipError(f"{path} cannot be read as a clip ({error}): delete it and render it again.") from None


def _facts(stored: np.lib.npyio.NpzFile, path: Path) -> dict:
    facts = json.loads(stored["facts"].tobytes()) if "facts" in stored else {}
    if facts.get("format") != FORMAT:
        raise ClipError(f"{path} has format {facts.get('format')}, this program reads {FORMAT}: render it again.")
    return facts


def clip_paths(data: Path, kind: str, split: str) -> list[Path]:
    """Files of a set's split, by number."""
    return sorted((data / kind / split).glob("clip-*.npz"))
