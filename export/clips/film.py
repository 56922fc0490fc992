"""From moments to the frames of a clip: colour, motion and visibility at each size."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, Protocol

import numpy as np

from export.clips.clip import LARGE_PX, SIDE_PX, Frames
from export.clips.motion import visible_next
from export.clips.render import Labels


class Filming(Protocol):
    """Renders moments of one kind: `render.Renderer`, `place_film.PlaceFilm`."""

    def colour(self, moment: Any, sizes: Sequence[tuple[int, int]]) -> list[np.ndarray]: ...

    def labels(self, moment: Any, then: Any, size: tuple[int, int]) -> Labels: ...


def filmed(renderer: Filming, moments: Sequence[Any], large: bool) -> tuple[Frames, Frames | None]:
    """Frames of 64 x 64, and of 320 x 240 where `large`."""
    sizes = [(SIDE_PX, SIDE_PX), *([LARGE_PX] if large else [])]
    pictures = [renderer.colour(moment, sizes) for moment in moments]
    out: list[Frames | None] = []
    for k, size in enumerate(sizes):
        # The last moment's labels are needed for its depth alone.
        labels = [renderer.labels(a, b, size) for a, b in zip(moments, [*moments[1:], moments[-1]], strict=True)]
        visible = [_visible(a, b) for a, b in pairwise(labels)]
        motion = np.stack([one.motion for one in labels[:-1]])
        out.append(Frames(np.stack([frame[k] for frame in pictures]), motion, np.stack(visible)))
    return out[0], out[1] if large else None


def _visible(now: Labels, then: Labels) -> np.ndarray:
    return visible_next(now.motion, now.next_depth, now.thing, then.depth, then.thing)
