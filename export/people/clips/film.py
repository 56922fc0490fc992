"""One clip: its people, plan, camera and place are drawn from (split, set, number), then filmed frame by frame."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from export.camera import Camera
from export.people.clips.backdrop import Backdrop, Response, draw_backdrop
from export.people.clips.camera_path import KINDS, CameraPath, draw_path
from export.people.clips.cast import JOINTS, Actor, actor_of, different_bodies, draw_look
from export.people.clips.clip_file import Truth
from export.people.clips.gait import standing_clips, walking_clips
from export.people.clips.script import draw_roles, fault_of, in_view
from export.people.motion import MotionClip, load_motion_clips
from export.people.props import Prop
from export.people.scene import SPLITS, Studio, composed
from export.shards import visible_boxes

VERSION = "people-clips-1"
RATES_FPS = (15, 30, 15, 30, 15, 30, 15, 60)  # by the number of the clip
COUNTS = (2, 3, 4, 5)
_PLANS = 400
_NEAR_M = 0.05


class PlanError(ValueError):
    """No plan was found for a clip."""


@dataclass(frozen=True, eq=False)
class Plan:
    """Everything of a clip before it is filmed."""

    facts: dict
    seconds: np.ndarray
    actors: list[Actor]
    path: CameraPath
    backdrop: Backdrop
    props: list[Prop]
    response: Response
    quality: int
    tone: int


class Motions:
    """Motion clips of a split by what people do in them."""

    def __init__(self, clips: list[MotionClip]) -> None:
        self.walks, self.idles = walking_clips(clips), standing_clips(clips)

    @staticmethod
    def of(split: str) -> Motions:
        return Motions(load_motion_clips(split))


def plan_clip(studio: Studio, motions: Motions, own_set: int, number: int) -> Plan:
    """A function of the studio's split, set and number. Raises PlanError."""
    rng = np.random.default_rng([SPLITS[studio.split], 11, own_set, number])
    fps, kind = RATES_FPS[number % len(RATES_FPS)], KINDS[number % len(KINDS)]
    length = rng.uniform(7, 10) if fps < 60 else rng.uniform(6, 7)
    seconds = np.arange(round(length * fps)) / fps
    count = int(rng.choice(COUNTS, p=(0.1, 0.35, 0.35, 0.2)))
    bodies = different_bodies(rng, studio.split, count)
    looks = [draw_look(rng, studio, body, motions.walks, motions.idles) for body in bodies]
    path = draw_path(rng, kind, seconds, studio.width, studio.height)
    yaw = path.yaw
    for _ in range(_PLANS):
        roles = draw_roles(rng, count, path.widest, seconds[-1])
        actors = [actor_of(studio, *pair, seconds, rng) for pair in zip(looks, roles, strict=True)]
        seen = in_view(np.stack([a.track.place for a in actors]), yaw, path.half_view)
        seats = [(k, a.seat(np.random.default_rng([number, k]))) for k, a in enumerate(actors)]
        places = [(k, place) for k, (_, place) in seats if place is not None]
        fault = fault_of([a.track for a in actors], places, seen, seconds)
        if not fault:
            break
    else:
        raise PlanError(f"clip {number} of set {own_set}, {studio.split}: no plan in {_PLANS} tries ({fault})")
    backdrop = draw_backdrop(rng, studio, path)
    props = [*backdrop.props, *(prop for _, (own, _) in seats for prop in own)]
    facts = {
        "set": own_set, "split": studio.split, "number": number, "fps": fps, "generator": VERSION,
        "camera": kind, "place": backdrop.kind, "joints": JOINTS,
        "people": [
            {"body": a.look.body, "role": a.role.name, "walk": a.look.walk.name, "stand": a.look.idle.name}
            for a in actors
        ],
    }  # fmt: skip
    tone, quality = int(rng.integers(1 << 31)), int(rng.integers(70, 93))
    return Plan(facts, seconds, actors, path, backdrop, props, Response.drawn(rng), quality, tone)


@dataclass(frozen=True, eq=False)
class Shot:
    """One frame. jpeg: the coded image; label: uint8 [H, W, 4]; joints [P, 15, 3] in the world, metres; full_box
    [P, 4], pixels."""

    frame: int
    jpeg: bytes
    label: np.ndarray
    joints: np.ndarray
    full_box: np.ndarray


def shots_of(plan: Plan, studio: Studio, frames: Iterable[int]) -> Iterator[Shot]:
    """Films some frames; the others do not change them."""

    body = studio.body.groups["body"]

    def seen(k: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        camera = plan.path.cameras[k]
        people, joints = zip(*(actor.at(k) for actor in plan.actors), strict=True)
        same = np.random.default_rng(plan.tone)  # the same tones in all frames
        light = plan.backdrop.light_for(camera)
        picture = studio.renderer.draw(list(people), camera, light, same, plan.props)
        boxes = np.stack([_box_of(camera, person.vertices[body]) for person in people])
        return composed(same, picture, plan.backdrop.behind(camera)), picture.label, np.stack(joints), boxes

    gain = plan.response.gain_for(seen(0)[0])
    for k in frames:
        image, label, joints, boxes = seen(k)
        image = plan.response.of(image, gain, np.random.default_rng([plan.tone, k]))
        coded = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, plan.quality])[1].tobytes()
        yield Shot(k, coded, label, joints, boxes)


def truth_of(plan: Plan, shots: Sequence[Shot]) -> Truth:
    frames, count = len(shots), len(plan.actors)
    visible = np.full((frames, count, 4), np.nan, np.float32)
    pixels = np.zeros((frames, count), np.int32)
    joints_px = np.full((frames, count, len(JOINTS), 2), np.nan, np.float32)
    shown = np.zeros((frames, count, len(JOINTS)), bool)
    cameras = [plan.path.cameras[shot.frame] for shot in shots]
    for t, (shot, camera) in enumerate(zip(shots, cameras, strict=True)):
        boxes, ids, _ = visible_boxes(shot.label)
        visible[t, ids.astype(int) - 1] = boxes
        pixels[t] = np.bincount(shot.label[..., 3].ravel(), minlength=256)[1 : count + 1]
        for p, joints in enumerate(shot.joints):
            at, depth = camera.projected(joints)
            joints_px[t, p, depth > _NEAR_M] = at[depth > _NEAR_M]
            shown[t, p] = _shows(shot.label[..., 3], joints_px[t, p], p + 1)
    full, joints_m = (np.stack([getattr(s, key) for s in shots]).astype(np.float32) for key in ("full_box", "joints"))
    first = cameras[0]
    intrinsics = np.array([first.fx_px, first.fy_px, first.cx_px, first.cy_px])
    poses = np.stack([camera.world_to_camera for camera in cameras])
    time_ns = np.round(plan.seconds[[shot.frame for shot in shots]] * 1e9).astype(np.int64)
    return Truth(time_ns, visible, pixels, full, joints_px, joints_m, shown, intrinsics, poses, plan.facts)


def _box_of(camera: Camera, points: np.ndarray) -> np.ndarray:
    """Around points in the image, right and bottom exclusive; NaN where some are behind the camera."""
    at, depth = camera.projected(points)
    if depth.min() < _NEAR_M:
        return np.full(4, np.nan)
    return np.concatenate([at.min(0), at.max(0) + 1])


def _shows(ids: np.ndarray, at: np.ndarray, number: int) -> np.ndarray:
    """Whether the pixel at each point [N, 2] shows person `number`."""
    height, width = ids.shape
    x, y = (np.nan_to_num(np.round(c), nan=-1).astype(int) for c in at.T)
    inside = (x >= 0) & (y >= 0) & (x < width) & (y < height)
    return inside & (ids[np.clip(y, 0, height - 1), np.clip(x, 0, width - 1)] == number)
