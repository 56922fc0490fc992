"""Frames of a film: equal motion of the image between them, and of each piece the sharpest."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from maquette.frames import Frame, PixelFormat
from maquette.native import MaquetteError
from maquette.scene_making.motion import motion_between, sharpness, shrunk
from maquette.scene_making.photos import LeftOut, Photo, Prepared, fault_of, scaled_size
from maquette.sources import Source

ENDINGS = (
    ".mp4",
    ".mov",
    ".m4v",
    ".avi",
    ".mkv",
    ".webm",
    ".mpg",
    ".mpeg",
    ".ts",
    ".mts",
    ".3gp",
    ".wmv",
    ".flv",
    ".ogv",
)
_RATE = 10.0  # candidates a second, of films up to a minute
_MAX_CANDIDATES = 600
_PIECES = 4  # of time for each frame that may be chosen; the sharpest candidate of each is kept
_STEP = 0.035  # motion of the image between chosen frames, in diagonals
_STILL = 0.03  # motion of a whole film below which nothing is seen from two sides
_CUT = 1.5  # change of the image in a cut, over the median
_MIN_RATE = 2.0  # chosen frames a second, where little moves


@dataclass(eq=False)
class _Candidate:
    time_s: float
    way: float  # motion of the image from the film's start, in diagonals
    sharpness: float
    file: Path
    size: tuple[int, int]


def is_film(path: Path) -> bool:
    return path.suffix.lower() in ENDINGS


def film_uri(path: Path, options: str = "") -> str:
    escaped = os.fspath(path).replace("%", "%25").replace("?", "%3F")
    return f"video:{escaped}{options}"


def prepare_film(path: Path, target: Path, max_frames: int, progress: Callable[[float], None]) -> Prepared:
    """Writes chosen frames to `target`. Raises MaquetteError for a film that cannot be read, that shows nothing, or
    whose camera does not move."""
    with Source(film_uri(path)) as source:
        info = source.info
    width, height = scaled_size(info["width_px"], info["height_px"])
    fps = float(info["fps"])
    frames = int(info.get("frame_count") or 0)
    duration_s = frames / fps if frames > 0 else 60.0
    rate = min(fps, _RATE, max(2.0, _MAX_CANDIDATES / duration_s))
    piece_s = max(duration_s / (_PIECES * max_frames), 1 / rate)
    kept: list[_Candidate] = []
    faults: dict[str, int] = {}
    jumps: list[tuple[float, float, float]] = []  # time, duration, change of the image in grey levels
    changes: list[float] = []
    best: tuple[float, float, float, Frame] | None = None  # time, way, sharpness
    before: np.ndarray | None = None
    way, lost, count, end_s = 0.0, False, 0, piece_s
    with Source(film_uri(path, f"?size={width}x{height}&fps={rate:g}")) as source:
        for frame in source:
            time_s = frame.timestamp_ns / 1e9
            progress(min(time_s / duration_s, 1.0))
            count += 1
            grey = frame.pixels(PixelFormat.GREY8)
            if time_s >= end_s:
                _keep(best, kept, target)
                best, end_s = None, end_s + piece_s * np.ceil((time_s - end_s + 1e-9) / piece_s)
            fault = fault_of(grey)
            if fault:
                faults[fault.split(":")[0]] = faults.get(fault.split(":")[0], 0) + 1
                continue
            small = shrunk(grey)
            moved = 0.0 if before is None else motion_between(before, small)
            change = 0.0 if before is None else float(np.abs(small - before).mean())
            if moved is None:
                first = jumps.pop() if lost else (time_s, 0.0, change)
                jumps.append((first[0], time_s - first[0], max(first[2], change)))
                lost, moved = True, _STEP
            else:
                changes.append(change)
                lost = False
            way += moved
            before = small
            sharp = sharpness(grey)
            if best is None or sharp > best[2]:
                best = (time_s, way, sharp, frame)
    _keep(best, kept, target)
    if not kept:
        fault = max(faults, key=lambda key: faults[key]) if faults else "empty"
        problem = f"{path} shows nothing that can be matched: its frames are {fault}. Film in even, brighter light."
        if fault == "overexposed":
            problem = f"{path} is overexposed throughout. Film with less exposure, or without a lamp in the picture."
        raise MaquetteError(problem, "MAQ_ERROR_UNREADABLE")
    if way < _STILL:
        raise MaquetteError(
            f"The camera of {path} does not move: its image shifts by {100 * way:.1f} % of its diagonal in all. "
            "Walk around what you film: depth is seen only from several places.",
            "MAQ_ERROR_UNREADABLE",
        )
    # A cut is one jump between calm pieces; in a fast pan several pairs of frames show nothing in common.
    calm = float(np.median(changes)) if changes else 0.0
    cuts = [time_s for time_s, long_s, change in jumps if long_s < 0.5 / rate and change > _CUT * calm]
    chosen = _choose(kept, min(max_frames, len(kept)), _MIN_RATE * (kept[-1].time_s - kept[0].time_s))
    files = {candidate.file for candidate in chosen}
    for candidate in kept:
        if candidate.file not in files:
            candidate.file.unlink()
    photos = [Photo(c.file.name, f"{c.time_s:.2f} s", *c.size, f"{c.size[0]}x{c.size[1]}") for c in chosen]
    notes = [f"The film has a cut at {cut:.1f} s; one take without cuts is better." for cut in cuts]
    left_out = [LeftOut(f"{number} frames", kind) for kind, number in faults.items()]
    return Prepared(photos, left_out, count, not cuts, notes)


def _keep(best: tuple[float, float, float, Frame] | None, kept: list[_Candidate], target: Path) -> None:
    if best is None:
        return
    time_s, way, sharp, frame = best
    file = target / f"{len(kept):04d}.jpg"
    frame.save(file)
    height, width = frame.shape
    kept.append(_Candidate(time_s, way, sharp, file, (width, height)))


def _choose(kept: list[_Candidate], max_frames: int, min_frames: float) -> list[_Candidate]:
    """The sharpest of each of equal pieces of the way."""
    total = kept[-1].way - kept[0].way
    count = min(max(round(total / _STEP), round(min_frames), 1), max_frames)
    edges = kept[0].way + total * np.arange(count + 1) / count
    edges[-1] += 1e-9
    chosen = []
    for k in range(count):
        piece = [candidate for candidate in kept if edges[k] <= candidate.way < edges[k + 1]]
        if piece:
            chosen.append(max(piece, key=lambda candidate: candidate.sharpness))
    return chosen
