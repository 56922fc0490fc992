"""Events in clips: what a monitor of a camera should notice, at a known frame and place. For tests alone; each event
is a function of its clip and a generator.

| kind | what happens at the frame | where |
| --- | --- | --- |
| freeze | the image stands still until the end | all |
| cut | another clip goes on | all |
| drop | a third of a second is missing | all |
| reversal | time runs backward from here | all |
| blackout | the image is black for three frames | all |
| appears, vanishes | a piece of another clip is there from here on, or was there until here | a rectangle |
| jump | that piece lies elsewhere from here on | both rectangles |
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

KINDS = ("freeze", "cut", "drop", "reversal", "blackout", "appears", "vanishes", "jump")
BLACKOUT_FRAMES = 3
_PIECE = (0.2, 0.35)  # sides of a piece by those of the frame
_MIN_BEFORE, _MIN_AFTER = 10, 4  # frames of the clip before and after the event


@dataclass(frozen=True, eq=False)
class Event:
    """rgb uint8 [T, H, W, 3]; at: the first frame that shows the event; region bool [H, W]: where it happens."""

    kind: str
    rgb: np.ndarray
    at: int
    region: np.ndarray


def with_event(kind: str, rgb: np.ndarray, other: np.ndarray, fps: float, rng: np.random.Generator) -> Event:
    """A clip's frames uint8 [T, H, W, 3] with an event; `other`: frames of another clip, of that size. Raises
    ValueError for a clip that is too short, or for another kind."""
    count, height, width = rgb.shape[:3]
    missing = max(2, round(fps / 3)) if kind == "drop" else 0
    if count < _MIN_BEFORE + _MIN_AFTER + missing or other.shape[1:] != rgb.shape[1:] or len(other) < count:
        raise ValueError(f"An event needs {_MIN_BEFORE + _MIN_AFTER + missing} frames, and another clip as large.")
    at = int(rng.integers(_MIN_BEFORE, count - _MIN_AFTER - missing + 1))
    region = np.ones((height, width), bool)
    made = rgb.copy()
    if kind == "freeze":
        made[at:] = rgb[at - 1]
    elif kind == "cut":
        made[at:] = other[at:count]
    elif kind == "drop":
        made = np.delete(rgb, slice(at, at + missing), 0)
    elif kind == "reversal":
        back = rgb[at - 2 :: -1][: count - at]
        made = np.concatenate([rgb[:at], back])
    elif kind == "blackout":
        made[at : at + BLACKOUT_FRAMES] = 0
    elif kind in ("appears", "vanishes", "jump"):
        piece, there, elsewhere = _piece(other[0], rng)
        region = np.zeros((height, width), bool)
        places = {
            "appears": [(slice(at, None), there)],
            "vanishes": [(slice(None, at), there)],
            "jump": [(slice(None, at), there), (slice(at, None), elsewhere)],
        }[kind]
        for frames, place in places:
            made[frames, place[0], place[1]] = piece
            region[place] = True
    else:
        raise ValueError(f"{kind} is no event; there are {', '.join(KINDS)}.")
    return Event(kind, made, at, region)


def _piece(
    picture: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, tuple[slice, slice], tuple[slice, slice]]:
    """A rectangle of an image, and two places for it that do not overlap."""
    sizes = [int(rng.uniform(*_PIECE) * side) for side in picture.shape[:2]]

    def place() -> tuple[slice, slice]:
        first = [int(rng.integers(side - size + 1)) for side, size in zip(picture.shape[:2], sizes, strict=True)]
        return slice(first[0], first[0] + sizes[0]), slice(first[1], first[1] + sizes[1])

    here = place()
    while True:
        there = place()
        if any(abs(a.start - b.start) >= size for a, b, size in zip(here, there, sizes, strict=True)):
            return picture[place()], here, there
