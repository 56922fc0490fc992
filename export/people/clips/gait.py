"""Motions of people in clips: how they walk and stand, from motion clips of one split; poses between poses.

A person walks without sliding: the way forward is what the feet that stand on the ground leave behind the body.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from export.people.body import Body, Shape
from export.people.motion import LIMBS, MotionClip, Pose, drawn_pose, posed

_ON_GROUND_M = 0.035  # above the lowest point: what stands on the ground
_MIN_SPEED = 0.5  # metres a second: a slower clip does not walk
_MAX_SPEED = 3.2
_MIN_CYCLE_S = 0.6
_UNEVEN = 0.6  # share of a step's changes of speed that is kept
_RUNS = 0.12  # share of people who run
_CLOSED = 0.15  # mean difference of limbs between two moments of a cycle, below which it repeats
_LEGS = [LIMBS.index(f"upper_leg.{side}") for side in "LR"]


@dataclass(frozen=True, eq=False)
class Cycle:
    """Frames of a motion that repeats and goes to the front. fps; root, chest [N, 3, 3]; limbs [N, 8, 3]. speed [N]:
    metres a second forward, 0 for somebody who stands."""

    name: str
    fps: float
    root: np.ndarray
    chest: np.ndarray
    limbs: np.ndarray
    speed: np.ndarray

    @property
    def length_s(self) -> float:
        return len(self.root) / self.fps

    def pose(self, seconds: float) -> Pose:
        k, share, then = self._at(seconds)
        ends = (Pose(self.root[j], self.chest[j], self.chest[j], self.limbs[j]) for j in (k, then))
        return between(*ends, share)

    def speed_at(self, seconds: float) -> float:
        k, share, then = self._at(seconds)
        return float((1 - share) * self.speed[k] + share * self.speed[then])

    def _at(self, seconds: float) -> tuple[int, float, int]:
        at = seconds * self.fps % len(self.root)
        k = int(at) % len(self.root)
        return k, at - int(at), (k + 1) % len(self.root)


def between(first: Pose, second: Pose, share: float) -> Pose:
    """The pose `share` of the way, 0 to 1, from the first to the second."""
    if share <= 0 or share >= 1:
        return first if share <= 0 else second
    turns = (
        Slerp([0, 1], Rotation.from_matrix(np.stack(pair)))(share).as_matrix()
        for pair in ((first.root, second.root), (first.chest, second.chest), (first.head, second.head))
    )
    limbs = (1 - share) * first.limbs + share * second.limbs
    return Pose(*turns, limbs / (np.linalg.norm(limbs, axis=1, keepdims=True) + 1e-9))


def _is_upright(clip: MotionClip) -> bool:
    """Whether somebody stands on straight legs all the time."""
    return bool((clip.root[:, 2, 2] > 0.9).all() and (clip.limbs[:, _LEGS, 2] < -0.75).all())


def walking_clips(clips: Sequence[MotionClip]) -> list[MotionClip]:
    return [c for c in clips if not c.rider and re.search("walk|jog|run", c.name) and c.length_s > _MIN_CYCLE_S]


def draw_walk(rng: np.random.Generator, clips: Sequence[MotionClip]) -> MotionClip:
    """One of the walks, or now and then a run."""
    walks = np.array(["walk" in c.name for c in clips])
    wanted = walks if rng.random() >= _RUNS and walks.any() else ~walks
    return clips[rng.choice(np.flatnonzero(wanted if wanted.any() else walks))]


def standing_clips(clips: Sequence[MotionClip]) -> list[MotionClip]:
    return [c for c in clips if not c.rider and "idle" in c.name and _is_upright(c)]


def standing(clip: MotionClip) -> Cycle:
    """There and back, so that it repeats."""
    root, chest, limbs = (np.concatenate([a, a[-2:0:-1]]) for a in (clip.root, clip.chest, clip.limbs))
    return Cycle(clip.name, clip.fps, root, chest, limbs, np.zeros(len(root)))


def walking(clip: MotionClip, body: Body, shape: Shape, hands: int) -> Cycle | None:
    """One cycle of a walk of this body; None for a clip that does not repeat, or that is too slow or too fast.

    hands: seed of the pose of hands and feet.
    """
    root, chest, limbs = clip.root, clip.chest, clip.limbs
    shortest = round(_MIN_CYCLE_S * clip.fps)
    apart = [np.abs(limbs[n] - limbs[0]).mean() for n in range(shortest, len(limbs))]
    if not apart or min(apart) > _CLOSED:
        return None
    period = shortest + int(np.argmin(apart))
    root, chest, limbs = root[:period], chest[:period], limbs[:period]
    frames = [Pose(root[k], chest[k], chest[k], limbs[k]) for k in (*range(period), 0)]
    feet = np.concatenate([np.flatnonzero(body.skin[:, body.bone[f"foot.{side}"]] > 0.3) for side in "LR"])
    places = np.stack([posed(body, shape, pose, np.random.default_rng(hands))[feet] for pose in frames])
    steps = np.diff(way_of(places), axis=0)
    dx, dy = steps.sum(0)
    ahead = np.array([dx, dy]) / max(float(np.hypot(dx, dy)), 1e-9)  # some hips do not face the way
    turn = Rotation.from_euler("z", -np.arctan2(dx, -dy)).as_matrix()
    root, chest, limbs = turn @ root, turn @ chest, limbs @ turn.T
    speed = steps @ ahead * clip.fps
    width = max(round(0.2 * clip.fps), 1)
    smooth = np.convolve(np.concatenate([speed[-width:], speed, speed[:width]]), np.ones(width) / width, "same")
    smooth = smooth[width:-width]
    # Hips go more evenly than feet that are retargeted say.
    speed = np.clip(smooth.mean() + _UNEVEN * (smooth - smooth.mean()), 0, None)
    if not _MIN_SPEED < speed.mean() < _MAX_SPEED:
        return None
    return Cycle(clip.name, clip.fps, root, chest, limbs, speed)


def way_of(feet: np.ndarray) -> np.ndarray:
    """The way [T, 2] of somebody whose feet [T, V, 3] are known about the hips alone: what stands on the ground stays
    where it is; in the air the way goes on as before."""
    at, step = [np.zeros(2)], np.zeros(2)
    for before, after in pairwise(feet):
        stands = np.ones(len(before), bool)
        for points in (before, after):
            stands &= points[:, 2] < points[:, 2].min() + _ON_GROUND_M
        if stands.any():
            step = (before - after)[stands, :2].mean(0)
        at.append(at[-1] + step)
    return np.array(at)


def stooping(rng: np.random.Generator, upright: Pose) -> Pose:
    """Bends down to the ground from a pose of standing."""
    u = rng.uniform
    root = Rotation.from_euler("x", u(25, 45), degrees=True).as_matrix() @ upright.root
    chest = Rotation.from_euler("x", u(65, 95), degrees=True).as_matrix() @ upright.chest
    limbs = upright.limbs.copy()
    for side, sign in (("L", 1), ("R", -1)):
        limbs[LIMBS.index(f"upper_arm.{side}")] = [sign * 0.1, -0.35, -1]
        limbs[LIMBS.index(f"lower_arm.{side}")] = [0, -0.25, -1]
        limbs[LIMBS.index(f"upper_leg.{side}")] = [sign * 0.1, -0.45, -1]
        limbs[LIMBS.index(f"lower_leg.{side}")] = [0, 0.35, -1]
    limbs /= np.linalg.norm(limbs, axis=1, keepdims=True)
    return Pose(root, chest, chest, limbs)


def sitting(rng: np.random.Generator) -> Pose:
    return drawn_pose(rng, 1.0)
