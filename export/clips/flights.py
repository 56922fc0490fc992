"""Clips `flights`: cameras that fly through places of `export.places`: rooms, single things, tables with things.

Place, way, speed and lens are drawn anew for each clip; half of the cameras are held by hand. Splits share no model
(nor one of its family), tile, photograph, panorama or person.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d

from export.camera import Camera
from export.clips.clip import FRAMES, LARGE_PX, SPLITS, Clip, generator
from export.clips.film import filmed
from export.clips.handheld_motion import sway
from export.clips.place_film import PlaceFilm, PlaceMoment, asset_facts, stock_of
from export.places.cameras import Lens, looking
from export.places.recipe import LAYOUTS, NothingSeenError, choose_exposure, choose_views, sound
from export.places.render import Renderer

VERSION = "flights-1"
RATES_FPS = (10, 15, 30)
_VIEWS = 40  # of a place, along the ways that its recipe draws
_ATTEMPTS, _TRIES = 6, 6  # places for a clip, ways through a place
_SPEED = (0.15, 1.6)  # a second: what a step is by the distance of what is seen, and the turn in radians, together
_JUMP = 4.0  # of the median step between views: a longer one is no way


def lens_of(rng: np.random.Generator, large: bool) -> Lens:
    """40 to 75 degrees; of the shape of the large frames, where there are some."""
    aspect = LARGE_PX[0] / LARGE_PX[1] if large else float(rng.choice([1, 4 / 3, 16 / 9]))
    return Lens(round(LARGE_PX[1] * aspect), LARGE_PX[1], float(rng.uniform(40, 75)))


def _steps(centres: np.ndarray, forward: np.ndarray, scale: float) -> np.ndarray:
    turns = np.arccos(np.clip((forward[1:] * forward[:-1]).sum(1), -1, 1))
    return np.linalg.norm(np.diff(centres, axis=0), axis=1) / scale + turns + 1e-6


def _way(
    rng: np.random.Generator, views: list[Camera], scale: float, lens: Lens, fps: float
) -> list[Camera] | None:  # fmt: skip
    """A smooth way along neighbouring views, FRAMES cameras; None where there is none from where it began. scale: how
    far away things are, metres."""
    centres, forward = (np.array([getattr(c, name) for c in views]) for name in ("centre", "rotation"))
    forward = forward[:, 2]
    steps = _steps(centres, forward, scale)
    start = int(rng.integers(len(views)))
    joined = steps < _JUMP * np.median(steps)
    first, last = start, start
    while first > 0 and joined[first - 1]:
        first -= 1
    while last < len(views) - 1 and joined[last]:
        last += 1
    if last - first < 4:
        return None
    centres, forward = (gaussian_filter1d(a[first : last + 1], 1.5, axis=0) for a in (centres, forward))
    forward /= np.linalg.norm(forward, axis=1, keepdims=True)
    along = np.concatenate([[0], np.cumsum(_steps(centres, forward, scale))])
    spline = CubicSpline(along, np.concatenate([centres, forward], 1))
    seconds = np.arange(FRAMES) / fps
    pace = 1 + sway(rng, seconds, 0.35)
    travelled = np.concatenate([[0], np.cumsum(pace[:-1] / fps)]).clip(0)
    speed = min(float(np.exp(rng.uniform(*np.log(_SPEED)))), 0.95 * along[-1] / max(travelled[-1], 1e-6))
    way = speed * travelled
    at = rng.uniform(0, max(along[-1] - way[-1], 0)) + way
    if rng.random() < 0.5:
        at = along[-1] - at
    found = spline(np.clip(at, 0, along[-1]))
    by_hand = rng.random() < 0.5
    shift = sway(rng, seconds, 0.006 * scale * by_hand, 3)
    turn = sway(rng, seconds, 0.012 * by_hand, 3)
    roll = np.degrees(turn[:, 2]) + rng.normal(0, 2)
    return [
        looking(lens, eye + d, eye + d + towards + np.append(t[:2], t[1]), float(r))
        for eye, towards, d, t, r in zip(found[:, :3], found[:, 3:], shift, turn, roll, strict=True)
    ]  # fmt: skip


def _flown(renderer: Renderer, views: list[Camera], near: float, rng: np.random.Generator, lens: Lens, fps: float):
    """A way from which something can be seen all along, or None."""
    depths = np.concatenate([d[d > 0] for c in views[::6] if (d := renderer.depth(c.shrunk(8, 8))).any()])
    scale = float(np.median(depths))
    for _ in range(_TRIES):
        way = _way(rng, views, scale, lens, fps)
        if way is not None and all(sound(renderer.depth(c.shrunk(8, 8)), near) for c in [*way[::4], way[-1]]):
            return way
    return None


def flights_clip(split: str, number: int, large: bool) -> Clip:
    """A function of split and number. large: whether with frames of 320 x 240 as well. Raises NothingSeenError where
    no way through any of a few places was found."""
    if split not in SPLITS:
        raise ValueError(f"split is {split!r}; it must be one of {', '.join(SPLITS)}")
    rng = generator("flights", split, number)
    fps, lens = int(rng.choice(RATES_FPS)), lens_of(rng, large)
    shares = np.array([share for share, _ in LAYOUTS.values()])
    for _ in range(_ATTEMPTS):
        draw = [make for _, make in LAYOUTS.values()][rng.choice(len(LAYOUTS), p=shares / shares.sum())]
        staged = draw(stock_of(split), rng, lens, _VIEWS)
        with Renderer(staged.parts, staged.lighting, staged.near) as renderer:
            try:
                views = choose_views(renderer, staged, rng)
            except NothingSeenError:
                continue
            way = _flown(renderer, views, staged.near, rng, lens, fps)
            if way is None:
                continue
            exposure = choose_exposure(renderer, way, rng)
            small, big = filmed(PlaceFilm(renderer, exposure), [PlaceMoment(camera) for camera in way], large)
        facts = {"set": "flights", "split": split, "number": number, "fps": fps, "generator": VERSION,
                 "kind": staged.kind, "assets": asset_facts(staged.assets)}  # fmt: skip
        return Clip(small, big, facts)
    raise NothingSeenError(f"clip {number} of {split}: no way through {_ATTEMPTS} places was found")
