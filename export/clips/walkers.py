"""Dressed people who move as motion clips have it: where each of their surfaces is at each moment of a clip."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from export.people.motion import LIMBS, MotionClip, posed
from export.people.render import Person
from export.people.scene import BODIES
from export.people.wardrobe import brim, dress
from export.places.crowd import Crowd
from export.places.furnish import about_z
from export.places.mesh import Part, part_of_prop

_IDLE = 0.35  # how often somebody stands about, as a share of what there are clips of it
_ON_GROUND_M = 0.035  # above the lowest point: what stands on the ground
_CLOSED = 0.15  # mean difference of limbs between a clip's ends, below which it begins again


@dataclass(frozen=True, eq=False)
class Walker:
    """parts: of each moment, as many and with as many triangles each; middle [T, 3]: of the body, metres."""

    parts: list[tuple[Part, ...]]
    middle: np.ndarray
    motion: str


def _is_seated(clip: MotionClip) -> bool:
    """Upright with level thighs, mostly: on a seat that is not there."""
    thighs = clip.limbs[:, [LIMBS.index(f"upper_leg.{side}") for side in "LR"], 2].mean(1)
    return bool(((thighs > -0.5) & (clip.root[:, 2, 2] > 0.7)).mean() > 0.8)


def motion_of(clips: Sequence[MotionClip], rng: np.random.Generator) -> MotionClip:
    """One of those in which nobody rides or sits."""
    walking = [clip for clip in clips if not clip.rider and not _is_seated(clip)]
    shares = np.array([_IDLE if "idle" in clip.name else 1.0 for clip in walking])
    return walking[rng.choice(len(walking), p=shares / shares.sum())]


def times_in(clip: MotionClip, seconds: np.ndarray) -> np.ndarray:
    """Where in a clip it is after so many seconds [T]: where its ends meet it begins again, else it goes back."""
    around = np.abs(clip.limbs[-1] - clip.limbs[0]).mean() < _CLOSED
    length = clip.length_s
    at = seconds % (length if around else 2 * length)
    return np.where(at > length, 2 * length - at, at)


def steps_of(bodies: np.ndarray) -> np.ndarray:
    """The way [T, 2] of somebody whose vertices [T, V, 3] are known about the hips alone: what stands on the ground
    stays where it is; in the air the way goes on as before."""
    at, step = [np.zeros(2)], np.zeros(2)
    for before, after in pairwise(bodies):
        standing = np.ones(len(before), bool)
        for body in (before, after):
            standing &= body[:, 2] < body[:, 2].min() + _ON_GROUND_M
        if standing.any():
            step = (before - after)[standing, :2].mean(0)
        at.append(at[-1] + step)
    return np.array(at)


def walker(
    crowd: Crowd, clips: Sequence[MotionClip], rng: np.random.Generator, seconds: np.ndarray, place: np.ndarray,
    yaw: float, room: np.ndarray | None,
) -> Walker:  # fmt: skip
    """Somebody of a crowd at times `seconds` [T]; in the middle of the clip at `place` [2], at first turned by `yaw`.
    room: half its sides [2], metres, which nobody leaves: who would, moves on the spot."""
    clip = motion_of(clips, rng)
    shape = crowd.shape(int(rng.integers(BODIES[crowd.split])))
    layers = dress(crowd.model, crowd.director.fabrics, rng)
    own, cloth = (int(rng.integers(1 << 31)) for _ in range(2))
    start, pace = rng.uniform(0, clip.length_s), rng.uniform(0.8, 1.2)
    times = times_in(clip, start + pace * seconds)
    # The same random numbers at each moment keep hands, feet and fabrics as they are.
    poses = [posed(crowd.body, shape, clip.pose(t), np.random.default_rng(own)) @ about_z(yaw).T for t in times]
    vertices = np.stack(poses).astype(np.float64)
    bodies = vertices[:, crowd.body.groups["body"]]
    way = steps_of(bodies)
    way = way - way[len(way) // 2] + place - bodies[len(way) // 2, :, :2].mean(0)
    if room is not None and (np.abs(way + bodies[:, :, :2].mean(1)) > room).any():
        way = np.broadcast_to(place - bodies[:, :, :2].mean(1).mean(0), way.shape)
    shift = np.concatenate([way, -bodies[:, :, 2].min(1)[:, None]], 1)
    found = []
    for standing in vertices + shift[:, None]:
        fixed = np.random.default_rng(cloth)
        worn = brim(crowd.model, layers, standing, fixed)
        person = Person(standing, layers, worn)
        found.append((*crowd.parts(person, fixed), *(part_of_prop(prop) for prop in worn)))
    return Walker(found, (bodies + shift[:, None]).mean(1), clip.name)
