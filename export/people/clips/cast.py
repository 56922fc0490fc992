"""Dressed people who follow a script: where each one's surface and joints are in each frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from export.people.body import Shape
from export.people.clips.gait import Cycle, between, draw_walk, sitting, standing, stooping, walking
from export.people.clips.script import Role, Track, track_of
from export.people.motion import MotionClip, Pose, posed_bones
from export.people.props import Prop
from export.people.render import Person
from export.people.scene import BODIES, Studio
from export.people.wardrobe import Layer, brim, dress

_BONES = ("upperarm01", "lowerarm01", "wrist", "upperleg01", "lowerleg01", "foot")
_NAMES = ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
JOINT_BONES = ("root", "neck01", "head", *(f"{bone}.{side}" for bone in _BONES for side in "LR"))
JOINTS = ("pelvis", "neck", "head", *(f"{side}_{name}" for name in _NAMES for side in ("left", "right")))
_MAX_TRIES = 40


@dataclass(frozen=True, eq=False)
class Look:
    """A body of the split with clothes and its own way to walk, stand and bend. hands, cloth: seeds that keep hands,
    feet and fabrics as they are."""

    body: int
    shape: Shape
    layers: list[Layer]
    walk: Cycle
    idle: Cycle
    start_s: float
    hands: int
    cloth: int


def draw_look(
    rng: np.random.Generator, studio: Studio, body: int, walks: Sequence[MotionClip], idles: Sequence[MotionClip]
) -> Look:
    """Raises ValueError where no motion clip lets this body walk."""
    shape = studio.shape(body)
    layers = dress(studio.model, studio.fabrics, rng)
    hands, cloth = (int(rng.integers(1 << 31)) for _ in range(2))
    idle = standing(idles[rng.integers(len(idles))])
    for _ in range(_MAX_TRIES):
        walk = walking(draw_walk(rng, walks), studio.body, shape, hands)
        if walk is not None:
            return Look(body, shape, layers, walk, idle, float(rng.uniform(0, idle.length_s)), hands, cloth)
    raise ValueError(f"no motion clip of the split {studio.split} lets body {body} walk")


def different_bodies(rng: np.random.Generator, split: str, count: int) -> list[int]:
    return [int(k) for k in rng.permutation(BODIES[split])[:count]]


@dataclass(frozen=True, eq=False)
class Actor:
    """One person of a clip. bend: the pose on a seat or bent to the ground."""

    studio: Studio
    look: Look
    role: Role
    track: Track
    bend: Pose
    seconds: np.ndarray

    def at(self, frame: int) -> tuple[Person, np.ndarray]:
        """The person in a frame, and its joints [15, 3] in the order of `JOINTS`, both in the world."""
        track, look = self.track, self.look
        upright = between(
            look.idle.pose(look.start_s + self.seconds[frame]), look.walk.pose(track.phase[frame]), track.walks[frame]
        )
        pose = between(upright, self.bend, track.bends[frame])
        vertices, joints = self._placed(pose, frame)
        worn = brim(self.studio.model, look.layers, vertices, np.random.default_rng(look.cloth))
        return Person(vertices, look.layers, worn, look.cloth), joints

    def _placed(self, pose: Pose, frame: int) -> tuple[np.ndarray, np.ndarray]:
        """Feet on the ground: who stands or bends keeps them where they are; who walks goes on with the hips."""
        body, track = self.studio.body, self.track
        rotations, heads = posed_bones(body, self.look.shape, pose, np.random.default_rng(self.look.hands))
        vertices = body.skinned(self.look.shape, rotations, heads)
        feet = heads[[body.bone["foot.L"], body.bone["foot.R"]], :2].mean(0)
        walks = track.walks[frame]
        anchor = walks * heads[body.bone["root"], :2] + (1 - walks) * feet
        low = vertices[body.groups["body"], 2].min()
        turn = Rotation.from_euler("z", track.yaw[frame]).as_matrix()
        shift = np.array([*track.place[frame], 0.0])
        from_there = np.array([*anchor, low])
        joints = heads[[body.bone[name] for name in JOINT_BONES]]
        return ((p - from_there) @ turn.T + shift for p in (vertices, joints))

    def seat(self, rng: np.random.Generator) -> tuple[list[Prop], np.ndarray | None]:
        """The seat of this person in the clip, and its place [2]; none for people who do not sit."""
        if self.role.kind != "sit" or self.track.bends.max() < 0.99:
            return [], None
        model = self.studio.model
        frame = int(self.track.bends.argmax())
        vertices, _ = self._placed(self.bend, frame)
        yaw = float(self.track.yaw[frame])
        back = Rotation.from_euler("z", -yaw).as_matrix()
        below, torso = (vertices[at] @ back.T for at in (model.buttocks, model.torso))
        height = float(np.quantile(below[:, 2], 0.03)) + 0.015
        x, y = below[below[:, 2] < height + 0.08][:, :2].mean(0)
        props = self.studio.director.maker.seat(rng, height, float(torso[:, 1].max() - y) + 0.01)
        place = (np.array([x, y, 0]) @ back)[:2]
        return [p.moved(*place, yaw) for p in props], place


def actor_of(studio: Studio, look: Look, role: Role, seconds: np.ndarray, rng: np.random.Generator) -> Actor:
    bend = sitting(rng) if role.kind == "sit" else stooping(rng, look.idle.pose(look.start_s))
    return Actor(studio, look, role, track_of(role, look.walk, seconds, look.start_s), bend, seconds)
