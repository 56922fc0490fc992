"""Poses: limb directions of motion clips and photographs, or drawn at random, and the bone rotations that take them.

Clips: 0 A.D. (`art/animation/biped`, object-space joints, 30 frames a second) and the DeepMimic clips inside
pybullet. Photographs: bodies fitted to people in those to train on (`photo_poses.json`, written by
`export.teachers.poses`). A pose keeps only what carries over between skeletons: the orientation of hips, chest and head
and the directions of eight limb bones, in the body's axes (x left, y back, z up), with the yaw removed.
"""

from __future__ import annotations

import hashlib
import json
import re
import struct
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from export.people import assets
from export.people.body import Body, Shape

LIMBS = ("upper_arm.L", "lower_arm.L", "upper_arm.R", "lower_arm.R",
         "upper_leg.L", "lower_leg.L", "upper_leg.R", "lower_leg.R")  # fmt: skip
_LIMB_BONES = {
    "upperarm01": ("lowerarm01", "upper_arm"),
    "lowerarm01": ("wrist", "lower_arm"),
    "upperleg01": ("lowerleg01", "upper_leg"),
    "lowerleg01": ("foot", "lower_leg"),
}
PHOTO_POSES = Path(__file__).with_name("photo_poses.json")
_FLIP = np.diag([-1.0, 1, 1])
_ZERO_AD_JOINTS = ("hip", "chest", "neck", "arm_L", "forearm_L", "hand_L", "arm_R", "forearm_R", "hand_R",
                   "thigh_L", "leg_L", "foot_L", "thigh_R", "leg_R", "foot_R")  # fmt: skip
_ZERO_AD_FPS = 30.0


@dataclass(frozen=True)
class Pose:
    """root, chest, head: rotations [3, 3]; limbs: unit directions [8, 3] in the order of `LIMBS`.

    `rests` is how the body is carried: "stands" (or moves), "sits" (on something below the buttocks), "lies".
    """

    root: np.ndarray
    chest: np.ndarray
    head: np.ndarray
    limbs: np.ndarray
    rests: str = "stands"


@dataclass(frozen=True)
class Clips:
    """All frames of a split: root [N, 3, 3], chest [N, 3, 3], limbs [N, 8, 3], rider [N] (seated on something)."""

    root: np.ndarray
    chest: np.ndarray
    limbs: np.ndarray
    rider: np.ndarray


@dataclass(frozen=True)
class MotionClip:
    """One clip from its first frame to its last, with its turns: at first it faces the front. name: the file's; fps;
    root, chest [N, 3, 3], limbs [N, 8, 3]; rider: seated on something."""

    name: str
    fps: float
    root: np.ndarray
    chest: np.ndarray
    limbs: np.ndarray
    rider: bool

    def pose(self, seconds: float) -> Pose:
        """Between the two frames next to that time, which must lie within the clip; the head looks with the chest."""
        at = min(max(seconds * self.fps, 0.0), len(self.root) - 1.000001)
        k, share = int(at), at % 1
        turns = (Slerp([0, 1], Rotation.from_matrix(r[k : k + 2]))(share).as_matrix() for r in (self.root, self.chest))
        root, chest = turns
        return Pose(root, chest, chest, _unit((1 - share) * self.limbs[k] + share * self.limbs[k + 1]))

    @property
    def length_s(self) -> float:
        return (len(self.root) - 1) / self.fps


@dataclass(frozen=True)
class PhotoPoses:
    """Poses of people in photographs: root, chest, head [N, 3, 3], limbs [N, 8, 3], NaN where the photo does not show
    the limb."""

    root: np.ndarray
    chest: np.ndarray
    head: np.ndarray
    limbs: np.ndarray


def split_of(name: str) -> str:
    """Which split a clip, texture or photo belongs to: 80 % train, 10 % val, 10 % test, by its name."""
    tenth = int(hashlib.sha1(name.encode()).hexdigest(), 16) % 10
    return "test" if tenth == 9 else "val" if tenth == 8 else "train"


def _unit(v: np.ndarray) -> np.ndarray:
    return v / (np.linalg.norm(v, axis=-1, keepdims=True) + 1e-9)


def _frames(left: np.ndarray, up: np.ndarray) -> np.ndarray:
    """Rotations [N, 3, 3] whose columns are left, back and up."""
    left = _unit(left)
    up = _unit(up - left * (up * left).sum(-1, keepdims=True))
    return np.stack([left, np.cross(up, left), up], -1)


def without_yaw(root: np.ndarray, *others: np.ndarray) -> list[np.ndarray]:
    """Rotations [N, 3, 3] and directions [N, K, 3] turned about the vertical so that `root` faces the front."""
    back = root[..., 1]
    turn = Rotation.from_rotvec(np.arctan2(back[:, :1], back[:, 1:2]) * [[0, 0, 1.0]]).as_matrix()
    *rotations, limbs = (root, *others)
    return [*(turn @ r for r in rotations), np.einsum("nij,nlj->nli", turn, limbs)]


def _zero_ad_clip(path: Path, order: list[str], step: int = 2):
    """Reads every `step`-th frame of one PSA clip, with its turns: 7 floats a bone and frame (object-space position,
    quaternion)."""
    data = path.read_bytes()
    at = 16 + struct.unpack_from("<I", data, 12)[0]
    _, bones, frames = struct.unpack_from("<fII", data, at)
    joints = np.frombuffer(data, "<f4", bones * frames * 7, at + 12).reshape(frames, bones, 7)[::step, :, :3]
    # The game's y is up and its axes are left-handed: exchanging y and z makes them right-handed.
    joints = joints[:, [order.index(n) for n in _ZERO_AD_JOINTS]][..., [0, 2, 1]].astype(np.float64)
    p = dict(zip(_ZERO_AD_JOINTS, np.moveaxis(joints, 1, 0), strict=True))
    root = _frames(p["thigh_L"] - p["thigh_R"], p["chest"] - p["hip"])
    chest = _frames(p["arm_L"] - p["arm_R"], p["neck"] - p["chest"])
    ends = (("arm", "forearm"), ("forearm", "hand"), ("thigh", "leg"), ("leg", "foot"))
    limbs = [p[f"{b}_{s}"] - p[f"{a}_{s}"] for pair in (ends[:2], ends[2:]) for s in "LR" for a, b in pair]
    return root, chest, _unit(np.stack(limbs, 1))


def bullet_clip(path: Path):
    """One DeepMimic clip, each frame facing the front."""
    return without_yaw(*_bullet_clip(path)[1:])


def _bullet_clip(path: Path):
    """Reads one DeepMimic clip: duration, root position, then joint rotations (x forward, y up, z right). Returns
    frames a second, and the rest with its turns."""
    frames = np.array(json.loads(path.read_text())["Frames"])

    def ball(at: int) -> Rotation:
        return Rotation.from_quat(frames[:, [at + 1, at + 2, at + 3, at]])

    def hinge(at: int) -> Rotation:
        return Rotation.from_rotvec(frames[:, at : at + 1] * [[0, 0, 1.0]])

    to_body = np.array([[0, 0, -1.0], [-1, 0, 0], [0, 1, 0]])  # columns: forward -> -y, up -> z, right -> -x
    root = ball(4)
    chest = root * ball(8)
    down = np.array([0, -1.0, 0])

    def limb(base: Rotation, joint: int, bend: int) -> list[np.ndarray]:
        upper = base * ball(joint)
        return [upper.apply(down), (upper * hinge(bend)).apply(down)]

    right_leg, left_leg = limb(root, 16, 20), limb(root, 30, 34)
    right_arm, left_arm = limb(chest, 25, 29), limb(chest, 39, 43)
    limbs = np.stack([*left_arm, *right_arm, *left_leg, *right_leg], 1) @ to_body.T
    turn = (to_body @ r.as_matrix() @ to_body.T for r in (root, chest))
    return (1 / float(np.median(frames[:-1, 0])), *turn, limbs)


def _zero_ad_files(split: str) -> list[tuple[Path, bool]]:
    """The game's clips of a split, and whether who moves rides."""
    paths = sorted((assets.zero_ad() / "animation" / "biped").rglob("*.psa"))
    return [(p, bool(re.search("rider|chariot|elephant", str(p)))) for p in paths if split_of(p.stem) == split]


def _bullet_files(split: str) -> list[Path]:
    return [p for p in sorted(assets.bullet_motions().glob("humanoid3d_*.txt")) if split_of(p.stem) == split]


def _zero_ad_bones() -> list[str]:
    skeleton = ElementTree.parse(assets.zero_ad() / "skeletons" / "biped.xml").find("standard_skeleton")
    return [bone.get("name") for bone in skeleton.iter("bone")]


def load_motion_clips(split: str) -> list[MotionClip]:
    """All clips of a split of half a second and more, one by one."""
    order = _zero_ad_bones()
    read = [(p.stem, _ZERO_AD_FPS, *_zero_ad_clip(p, order, 1), rider) for p, rider in _zero_ad_files(split)]
    read += [(path.stem, *_bullet_clip(path), False) for path in _bullet_files(split)]
    found = []
    for name, fps, root, chest, limbs, rider in read:
        if len(root) - 1 < 0.5 * fps or not all(np.isfinite(part).all() for part in (root, chest, limbs)):
            continue
        back = root[0, :, 1]
        turn = _euler(0, 0, float(np.degrees(np.arctan2(back[0], back[1]))))
        found.append(MotionClip(name, fps, turn @ root, turn @ chest, limbs @ turn.T, rider))
    return found


def load_clips(split: str) -> Clips:
    """Frames of all clips of a split; parsed once and cached."""
    cache = assets.cache_dir() / f"clips-{split}.npz"
    if not cache.exists():
        order = _zero_ad_bones()
        parts = [(*without_yaw(*_zero_ad_clip(p, order)), rider) for p, rider in _zero_ad_files(split)]
        parts += [(*bullet_clip(path), False) for path in _bullet_files(split)]
        root, chest, limbs = (np.concatenate([p[k] for p in parts]).astype(np.float32) for k in range(3))
        rider = np.concatenate([np.full(len(p[0]), p[3]) for p in parts])
        ok = np.isfinite(limbs).all((1, 2)) & np.isfinite(root).all((1, 2)) & np.isfinite(chest).all((1, 2))
        assets.save_cache(cache, root=root[ok], chest=chest[ok], limbs=limbs[ok], rider=rider[ok])
    with np.load(cache) as data:
        return Clips(data["root"], data["chest"], data["limbs"], data["rider"])


def limb_directions(body: Body, rotations: dict[str, np.ndarray]) -> np.ndarray:
    """Directions [8, 3] of `LIMBS` of a body whose limbs are turned by `rotations` [3, 3] from rest, by name."""
    heads = body.template.heads
    out = []
    for limb in LIMBS:
        bone, (end, _) = next((b, row) for b, row in _LIMB_BONES.items() if row[1] == limb[:-2])
        rest = heads[body.bone[f"{end}{limb[-2:]}"]] - heads[body.bone[f"{bone}{limb[-2:]}"]]
        out.append(_unit(rotations[limb] @ rest))
    return np.array(out)


def load_photo_poses(split: str) -> PhotoPoses:
    """Poses of the photographs to train on; the other splits have none."""
    rows = json.loads(PHOTO_POSES.read_text())["poses"] if split == "train" else []
    root, chest, head = (
        Rotation.from_rotvec(np.reshape([row[key] for row in rows], (-1, 3))).as_matrix()
        for key in ("root", "chest", "head")
    )
    limbs = [[limb or [np.nan] * 3 for limb in row["limbs"]] for row in rows]
    return PhotoPoses(root, chest, head, _unit(np.reshape(np.array(limbs, float), (-1, len(LIMBS), 3))))


def _euler(x: float, y: float, z: float) -> np.ndarray:
    return Rotation.from_euler("xyz", [x, y, z], degrees=True).as_matrix()


def _mirrored(root: np.ndarray, chest: np.ndarray, limbs: np.ndarray):
    return _FLIP @ root @ _FLIP, _FLIP @ chest @ _FLIP, limbs[[2, 3, 0, 1, 6, 7, 4, 5]] * [-1, 1, 1]


def _head(rng: np.random.Generator, chest: np.ndarray) -> np.ndarray:
    pitch, roll, yaw = (np.clip(rng.normal(0, s), -m, m) for s, m in ((14, 35), (8, 20), (25, 65)))
    return chest @ _euler(pitch, roll, yaw)


def clip_pose(rng: np.random.Generator, clips: Clips) -> Pose:
    """A frame of a clip, mirrored half of the time, with a little noise in the limbs."""
    seated = rng.random() < 0.15 and clips.rider.any()
    k = rng.choice(np.flatnonzero(clips.rider == seated))
    root, chest, limbs = (a[k].astype(np.float64) for a in (clips.root, clips.chest, clips.limbs))
    if rng.random() < 0.5:
        root, chest, limbs = _mirrored(root, chest, limbs)
    limbs = _unit(limbs + rng.normal(0, 0.06, (8, 3)))
    return Pose(root, chest, _head(rng, chest), limbs, "sits" if seated else "stands")


def photo_pose(rng: np.random.Generator, poses: PhotoPoses) -> Pose:
    """Somebody's pose in a photograph, mirrored half of the time, with a little noise; hidden limbs as `drawn_pose`."""
    k = rng.integers(len(poses.root))
    root, chest, head, limbs = poses.root[k], poses.chest[k], poses.head[k], poses.limbs[k]
    if rng.random() < 0.5:
        head = _FLIP @ head @ _FLIP
        root, chest, limbs = _mirrored(root, chest, limbs)
    drawn = drawn_pose(rng)
    shown = np.isfinite(limbs).all(1, keepdims=True)
    limbs = _unit(np.where(shown, limbs, drawn.limbs) + rng.normal(0, 0.06, limbs.shape))
    thighs = [LIMBS.index(f"upper_leg.{side}") for side in "LR"]
    level = limbs[thighs, 2].mean() > -0.5  # thighs more than 60 degrees away from hanging down
    return Pose(root, chest, head, limbs, "lies" if root[2, 2] < 0.5 else "sits" if level else "stands")


def lying(rng: np.random.Generator, pose: Pose) -> Pose:
    """The pose laid down: on the back, the belly or a side."""
    turn = _euler(-90 + rng.normal(0, 6), 0, 0) @ _euler(0, 0, rng.choice([0, 0, 180, 90, -90]) + rng.normal(0, 12))
    return Pose(turn @ pose.root, turn @ pose.chest, turn @ pose.head, pose.limbs @ turn.T, "lies")


def drawn_pose(rng: np.random.Generator, sitting_fraction: float = 0.25) -> Pose:
    """An everyday pose drawn at random: standing or sitting, arms hanging, bent or raised."""
    u = rng.uniform
    root = _euler(u(-6, 8), u(-4, 4), 0)
    chest = root @ _euler(rng.normal(4, 8), rng.normal(0, 5), rng.normal(0, 9))
    sitting = u() < sitting_fraction
    arms, legs = [], []
    for side in (1, -1):
        if u() < 0.8:
            upper = np.array([side * abs(rng.normal(0.22, 0.15)), rng.normal(0, 0.2), -1])
        else:
            upper = rng.normal(0, 1, 3) * [0.6, 0.5, 0.9] + [side * 0.8, -0.3, 0]
        upper = _unit(upper)
        bend = np.radians(u(0, 25) if u() < 0.45 else u(30, 140))
        inward = _unit(np.array([-side * u(-0.2, 1.1), -1, u(-0.4, 0.5)]))
        inward = _unit(inward - upper * (inward @ upper) * 0.999)
        arms += [chest @ upper, chest @ (np.cos(bend) * upper + np.sin(bend) * inward)]
        if sitting:
            thigh = np.array([side * u(0, 0.4), -1, u(-0.5, 0.15)])
            shank = np.array([side * u(-0.2, 0.2), u(-0.4, 0.4), -1])
        else:
            thigh = _unit(np.array([side * u(-0.02, 0.2), rng.normal(0, 0.15), -1]))
            shank = thigh + [side * u(-0.08, 0.05), abs(rng.normal(0, 0.15)), 0]
        legs += [root @ _unit(thigh), root @ _unit(shank)]
    limbs = _unit(np.stack(arms + legs) + rng.normal(0, 0.06, (8, 3)))
    return Pose(root, chest, _head(rng, chest), limbs, "sits" if sitting else "stands")


def _turn_onto(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Smallest rotation that takes direction a to direction b."""
    a, b = _unit(a), _unit(b)
    cosine, axis = a @ b, np.cross(a, b)
    if cosine < -0.9999:
        return Rotation.from_rotvec(np.pi * _unit(np.cross(a, [0.3, 0.2, 0.9]))).as_matrix()
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + k + k @ k / (1 + cosine)


def posed(body: Body, shape: Shape, pose: Pose, rng: np.random.Generator) -> np.ndarray:
    """Vertices [V, 3] of a body in a pose; hands, fingers and feet are drawn from `rng`."""
    return body.skinned(shape, *posed_bones(body, shape, pose, rng))


def posed_bones(
    body: Body, shape: Shape, pose: Pose, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Rotations [B, 3, 3] and heads [B, 3] of the bones of a body in a pose, as `posed` skins it."""
    limb = dict(zip(LIMBS, pose.limbs, strict=True))
    given = {"root": pose.root, "head": pose.head}
    spine = Slerp([0, 1], Rotation.from_matrix([pose.root, pose.chest]))
    given |= {f"spine0{5 - k}": spine((k + 1) / 5).as_matrix() for k in range(5)}
    neck = Slerp([0, 1], Rotation.from_matrix([pose.chest, pose.head]))
    given |= {f"neck0{k}": neck(k / 4).as_matrix() for k in (1, 2, 3)}
    wrist = {s: _euler(*rng.normal(0, 18, 3)) for s in "LR"}
    foot = {s: _euler(rng.normal(0, 10), 0, rng.normal(0, 6)) for s in "LR"}
    curl = {"L": (1, rng.uniform(-5, 45)), "R": (-1, rng.uniform(-5, 45))}
    rotations = np.zeros((len(body.bones), 3, 3))
    heads = np.zeros((len(body.bones), 3))
    for k, name in enumerate(body.bones):
        parent = body.parents[k]
        carried = rotations[parent] if parent >= 0 else pose.root
        base, _, side = name.partition(".")
        if name in given:
            rotations[k] = given[name]
        elif base in _LIMB_BONES:
            end, key = _LIMB_BONES[base]
            rest = shape.heads[body.bone[f"{end}.{side}"]] - shape.heads[k]
            rotations[k] = _turn_onto(carried @ rest, limb[f"{key}.{side}"]) @ carried
        elif base == "wrist":
            rotations[k] = carried @ wrist[side]
        elif base == "foot":
            rotations[k] = carried @ foot[side]
        elif base.startswith("finger") and not base.startswith("finger1"):
            sign, degrees = curl[side]
            rotations[k] = (
                carried @ Rotation.from_rotvec(np.radians(degrees) * np.array([0, 0.9 * sign, 0])).as_matrix()
            )
        else:
            rotations[k] = carried
        heads[k] = (
            heads[parent] + rotations[parent] @ (shape.heads[k] - shape.heads[parent])
            if parent >= 0
            else shape.heads[k]
        )
    return rotations, heads
