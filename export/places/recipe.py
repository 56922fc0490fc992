"""From (split, seed) to a place with its cameras, and from there to images, depth and exposure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from export.camera import Camera
from export.places.assets import SPLITS
from export.places.cameras import Lens, draw_lens
from export.places.render import Renderer
from export.places.rooms import Staged, draw_room
from export.places.subjects import draw_still_life, draw_subject

LAYOUTS = {"room": (0.6, draw_room), "subject": (0.22, draw_subject), "still life": (0.18, draw_still_life)}
FRAMES = 40
_TRIES = 12
_NUMBERS = 8  # generators of an attempt
_TOO_NEAR = 0.35  # metres, in rooms: a camera of which much is nearer stands in something


def generator(split: str, seed: int, what: int) -> np.random.Generator:
    """Random numbers of one place; `what` keeps cameras, cloud and furniture from disturbing each other."""
    return np.random.default_rng([SPLITS[split], 11, seed, what])


class NothingSeenError(ValueError):
    """A place was drawn that no camera of it sees."""


def draw_place(
    stock, split: str, seed: int, small: bool = False, frames: int = FRAMES, attempt: int = 0
) -> tuple[Staged, Lens]:
    """The place of a seed. The same seed drawn `small` is the same place with a quarter of the pixels. attempt: another
    place, for a seed whose first cannot be seen (NothingSeenError)."""
    lens = draw_lens(generator(split, seed, 0), small)
    rng = generator(split, seed, 1 + _NUMBERS * attempt)
    shares = np.array([share for share, _ in LAYOUTS.values()])
    draw = [make for _, make in LAYOUTS.values()][rng.choice(len(LAYOUTS), p=shares / shares.sum())]
    return draw(stock, rng, lens, frames), lens


def sound(depth: np.ndarray, near: float) -> bool:
    """Whether a view shows something, and is not taken from within a thing."""
    seen = depth > 0
    too_near = (depth < near * _TOO_NEAR / 0.03) & seen
    return bool(seen.mean() > 0.1 and too_near.mean() < 0.12)


def choose_views(renderer: Renderer, staged: Staged, rng: np.random.Generator) -> list[Camera]:
    """The place's cameras; each that stands in a thing is replaced by its neighbour, moved a little."""
    small = [c.shrunk(8, 8) for c in staged.cameras]
    good = [sound(renderer.depth(c), staged.near) for c in small]
    kept = [k for k, ok in enumerate(good) if ok]
    if not kept:
        raise NothingSeenError(f"no camera of this {staged.kind} sees anything")
    chosen = []
    for k, camera in enumerate(staged.cameras):
        if not good[k]:
            camera = _moved_until_sound(renderer, staged, rng, min(kept, key=lambda j: abs(j - k)))
        chosen.append(camera)
    return chosen


def _moved_until_sound(renderer: Renderer, staged: Staged, rng: np.random.Generator, source: int) -> Camera:
    start = staged.cameras[source]
    for attempt in range(_TRIES):
        size = 3 * staged.near / (1 + 0.3 * attempt)
        moved = replace(start, centre=start.centre + rng.normal(0, size, 3))
        if sound(renderer.depth(moved.shrunk(8, 8)), staged.near):
            return moved
    return start


def choose_exposure(renderer: Renderer, cameras: list[Camera], rng: np.random.Generator) -> float:
    """One exposure for all views: their mean is about that of a photograph. A plain background has no say."""
    wanted = rng.uniform(0.36, 0.56)
    views = [c.shrunk(8, 8) for c in cameras[:: max(len(cameras) // 6, 1)]]
    first = 0.7
    light = []
    for view in views:
        shown = renderer.colour(view, first)[renderer.depth(view) > 0].astype(np.float64)
        light.append(-np.log(1 - (np.minimum(shown, 253) / 255) ** 2.2) / first)  # the shader's curve, backwards
    light = np.concatenate(light)
    low, high = 0.02, 100.0
    for _ in range(24):
        middle = float(np.sqrt(low * high))
        mean = ((1 - np.exp(-middle * light)) ** (1 / 2.2)).mean() if len(light) else wanted
        low, high = (middle, high) if mean < wanted else (low, middle)
    return float(np.sqrt(low * high))
