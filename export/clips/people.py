"""Clips `people`: dressed people of `export.people` move before still, panned and hand-held cameras, in furnished rooms
of `export.places`, before a photograph, or outdoors in a panorama.

Bodies, clothes, motions, places, light, camera and frame rate are drawn anew for each clip. Splits share no body,
motion, fabric, photograph, panorama, tile or model.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from export.camera import Camera
from export.clips.clip import FRAMES, SPLITS, Clip, generator
from export.clips.film import filmed
from export.clips.flights import RATES_FPS, lens_of
from export.clips.handheld_motion import sway
from export.clips.place_film import PlaceFilm, PlaceMoment, asset_facts, stock_of
from export.clips.walkers import Walker, walker
from export.people.motion import MotionClip, load_motion_clips
from export.places.cameras import Lens, looking
from export.places.catalogue import Asset, Stock, people_assets
from export.places.furnish import quad
from export.places.mesh import Material, Part, part_of
from export.places.recipe import choose_exposure, sound
from export.places.render import Lighting, Renderer
from export.places.rooms import RoomMaker
from export.places.subjects import ground, outdoors

VERSION = "people-2"
_COUNTS = (0.5, 0.35, 0.15)  # how often one, two, three people
_PLACES = {"room": 0.45, "photograph": 0.35, "outdoors": 0.2}
_CAMERAS = {"still": 0.4, "panned": 0.25, "hand-held": 0.35}
_ATTEMPTS, _TRIES = 6, 25  # places for a clip, cameras for a place
_SEEN = (0.03, 0.6)  # of the picture: how much of it people are in the middle of a clip
_NEAR_M = 0.03


class NobodySeenError(ValueError):
    """No camera was found that shows the people of a clip."""


@dataclass(frozen=True, eq=False)
class _Set:
    """Where people move. spots [N, 2]; room: half its sides [2] where it has walls; makes sure that cameras stand free
    by `maker`."""

    parts: list[Part]
    lighting: Lighting
    assets: list[Asset]
    spots: np.ndarray
    room: np.ndarray | None = None
    maker: RoomMaker | None = None
    height: float = 2.4


@lru_cache(maxsize=1)
def _motions(split: str) -> list[MotionClip]:
    return load_motion_clips(split)


def _room(stock: Stock, rng: np.random.Generator, count: int) -> _Set | None:
    """A furnished room with free places for people; None where there is none left."""
    empty = Stock.__new__(Stock)
    empty.__dict__ |= vars(stock) | {"people": None}  # those of places stand still
    maker = RoomMaker(empty, rng)
    maker.shell()
    maker.furnish()
    spots = []
    for _ in range(count):
        if maker.stand([], (0.8, 0.8, 1.8), at_wall=False) is None:
            break
        spots.append(maker.middles[-1][:2])
    lighting = maker.light()
    if not spots:
        return None
    half = maker.size[:2] / 2 - 0.25
    return _Set(maker.parts, lighting, maker.assets, np.array(spots), half, maker, float(maker.size[2]))


def _spots(rng: np.random.Generator, count: int) -> np.ndarray:
    return rng.normal(0, 0.4, (count, 2)) + np.stack([np.arange(count) - (count - 1) / 2, np.zeros(count)], 1)


def _outdoors(stock: Stock, rng: np.random.Generator, count: int, photograph: bool) -> _Set:
    """A wide ground in a panorama; or before a photograph, as large as a wall."""
    assets: list[Asset] = []
    lighting = replace(outdoors(stock, rng, assets), plain=None)
    parts = [ground(stock, rng, assets, rng.uniform(12, 20), 1 / rng.uniform(0.8, 3))]
    if photograph:
        photo, asset = stock.photo(rng)
        assets.append(asset)
        width = rng.uniform(9, 14)
        height = width * photo.shape[0] / photo.shape[1]
        at = (rng.normal(0, 0.5), rng.uniform(1.2, 3.5), height / 2 - rng.uniform(0, 0.15) * height)
        pane = Material(photo, emission=rng.uniform(0.3, 1))
        parts.append(part_of(quad(at, (1, 0, 0), (0, 0, 1), width, height), pane, shades=False))
    return _Set(parts, lighting, assets, _spots(rng, count))


def _eye(rng: np.random.Generator, own: _Set, target: np.ndarray, behind_open: bool) -> np.ndarray | None:
    """A place for a camera from 1.3 to 5 m before somebody; None where it has no room."""
    u = rng.uniform
    distance = float(np.exp(u(*np.log((1.3, 5.0)))))
    # A photograph stands behind: the camera looks at it from the front.
    angle = u(0, 2 * np.pi) if behind_open else -np.pi / 2 + rng.normal(0, 0.35)
    eye = np.array([*(target[:2] + distance * np.array([np.cos(angle), np.sin(angle)])), u(0.7, 2.0)])
    if own.room is not None and ((np.abs(eye[:2]) > own.room).any() or own.maker.ground.clear(eye) < 0.2):
        return None
    return eye


def _cameras(
    rng: np.random.Generator, lens: Lens, eye: np.ndarray, middle: np.ndarray, seconds: np.ndarray, kind: str
) -> list[Camera]:
    """FRAMES cameras at `eye` that look at or about somebody whose body's middle [T, 3] is known."""
    u, count = rng.uniform, len(seconds)
    aim = middle[count // 2] + [*rng.normal(0, 0.15, 2), u(-0.1, 0.45)]
    look, eyes, roll = np.repeat(aim[None], count, 0), np.repeat(eye[None], count, 0), np.full(count, rng.normal(0, 2))
    distance = float(np.linalg.norm(aim - eye))
    if kind == "panned":
        if u() < 0.4:  # with who moves
            look = look + (middle - middle[count // 2]) * [1, 1, 0.3]
        else:
            side = np.cross(aim - eye, [0, 0, 1.0])
            turn = np.radians(u(5, 35)) * rng.choice([-1, 1]) * (seconds - seconds[count // 2])
            look = look + side * np.tan(np.clip(turn, -0.9, 0.9))[:, None]
    if kind == "hand-held":
        look = look + sway(rng, seconds, 0.02 * distance, 3)
        eyes = eyes + sway(rng, seconds, 0.025, 3) + rng.normal(0, 0.12, 3) * (seconds - seconds[count // 2])[:, None]
        roll = roll + sway(rng, seconds, 1.0)
    return [looking(lens, e, at, float(r)) for e, at, r in zip(eyes, look, roll, strict=True)]


def _moments(cameras: list[Camera], walkers: list[Walker]) -> list[PlaceMoment]:
    shown = zip(cameras, *(own.parts for own in walkers), strict=True)
    return [PlaceMoment(camera, tuple(part for parts in people for part in parts)) for camera, *people in shown]


def _framed(film: PlaceFilm, moments: list[PlaceMoment]) -> bool:
    """Whether the middle of a clip shows people well, its first or last frame some, and none is seen from within a
    thing."""
    ends = 0
    for t in (len(moments) // 2, 0, len(moments) - 1):
        labels = film.labels(moments[t], moments[t], (40, 30))
        seen = float((labels.thing > 1).mean())
        if seen > 0.75 or not sound(np.where(labels.thing > 0, labels.depth, 0), _NEAR_M):
            return False
        if t == len(moments) // 2 and not _SEEN[0] < seen < _SEEN[1]:
            return False
        ends += seen > _SEEN[0] / 2
    return ends > 1


def people_clip(split: str, number: int, large: bool) -> Clip:
    """A function of split and number. large: whether with frames of 320 x 240 as well. Raises NobodySeenError where no
    camera was found in any of a few places."""
    if split not in SPLITS:
        raise ValueError(f"split is {split!r}; it must be one of {', '.join(SPLITS)}")
    rng, stock = generator("people", split, number), stock_of(split)
    fps, lens = int(rng.choice(RATES_FPS)), lens_of(rng, large)
    seconds = np.arange(FRAMES) / fps
    for _ in range(_ATTEMPTS):
        count = 1 + int(rng.choice(len(_COUNTS), p=_COUNTS))
        place = str(rng.choice(list(_PLACES), p=list(_PLACES.values())))
        own = _room(stock, rng, count) if place == "room" else _outdoors(stock, rng, count, place == "photograph")
        if own is None:
            continue
        walkers = [
            walker(stock.people, _motions(split), rng, seconds, spot, rng.uniform(-np.pi, np.pi), own.room)
            for spot in own.spots
        ]
        first = [part for one in walkers for part in one.parts[0]]
        owners = [2 + k for k, one in enumerate(walkers) for _ in one.parts[0]]
        with Renderer([*own.parts, *first], own.lighting, _NEAR_M) as renderer:
            film = PlaceFilm(renderer, 1.0, owners)
            kind = str(rng.choice(list(_CAMERAS), p=list(_CAMERAS.values())))
            for _ in range(_TRIES):
                somebody = walkers[rng.integers(len(walkers))]
                eye = _eye(rng, own, somebody.middle[FRAMES // 2], place != "photograph")
                if eye is None:
                    continue
                moments = _moments(_cameras(rng, lens, eye, somebody.middle, seconds, kind), walkers)
                if _framed(film, moments):
                    break
            else:
                continue
            film.exposure = choose_exposure(renderer, [m.camera for m in moments], rng)
            small, big = filmed(film, moments, large)
        facts = {"set": "people", "split": split, "number": number, "fps": fps, "generator": VERSION, "kind": place,
                 "camera": kind, "motions": [one.motion for one in walkers],
                 "assets": asset_facts([*own.assets, *people_assets()])}  # fmt: skip
        return Clip(small, big, facts)
    raise NobodySeenError(f"clip {number} of {split}: no camera in {_ATTEMPTS} places shows its people")
