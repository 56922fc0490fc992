"""How people hold their joints: mean, precision and limits of the joints' rotation vectors.

The poses are those of rendered people of the split for training (`export.people.motion`): the motion clips of
pybullet, poses of photographs, and poses drawn at random. Their limbs do not twist, their collar bones do not move,
and their feet and hands hardly do, so a part of the spread is added by hand.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from export.people.body import Body
from export.people.motion import (
    Clips,
    clip_pose,
    drawn_pose,
    load_motion_clips,
    load_photo_poses,
    photo_pose,
    posed_bones,
    without_yaw,
)
from export.teachers.body_model import JOINTS, PARENT, mirrored_joint

POSES = 12000
# For each joint, the bone whose orientation is the joint's: the last one that goes with it.
_BONE = {"pelvis": "root", "abdomen": "spine03", "chest": "spine01", "neck": "neck02", "head": "head",
         "clavicle": "clavicle", "upper_arm": "upperarm01", "lower_arm": "lowerarm01", "hand": "wrist",
         "upper_leg": "upperleg01", "lower_leg": "lowerleg01", "foot": "foot"}  # fmt: skip
# Standard deviations that are added, radians about x, y, z.
_ADDED = {"abdomen": (0.12, 0.08, 0.08), "chest": (0.12, 0.1, 0.12), "neck": (0.12, 0.1, 0.12),
          "head": (0.1, 0.1, 0.1), "clavicle": (0.08, 0.12, 0.12), "upper_arm": (0.25, 0.25, 0.25),
          "lower_arm": (0.25, 0.2, 0.25), "hand": (0.15, 0.15, 0.15), "upper_leg": (0.15, 0.12, 0.2),
          "lower_leg": (0.15, 0.06, 0.1), "foot": (0.15, 0.12, 0.15)}  # fmt: skip
_LIMIT_QUANTILE = 0.002
_LIMIT_MARGIN = 1.0  # in added standard deviations, beyond the quantile


@dataclass(frozen=True)
class PosePrior:
    """Statistics of the 18 joints that have a parent, in the order of `JOINTS`, three numbers each: mean [54],
    precision [54, 54], low and high [54], radians."""

    mean: np.ndarray
    precision: np.ndarray
    low: np.ndarray
    high: np.ndarray


def bone_of(joint: str) -> str:
    base, dot, side = joint.partition(".")
    return f"{_BONE[base]}{dot}{side}"


def local_rotations(body: Body, rotations: np.ndarray) -> np.ndarray:
    """Rotations of the 19 joints relative to their parents, [19, 3, 3]. rotations: [B, 3, 3] of the body's bones."""
    turn = np.stack([rotations[body.bone[bone_of(name)]] for name in JOINTS])
    return np.stack([turn[k] if p < 0 else turn[p].T @ turn[k] for k, p in enumerate(PARENT)])


def everyday_clips(split: str) -> Clips:
    """Frames of pybullet's motion clips of a split."""
    parts = [
        (*without_yaw(clip.root, clip.chest, clip.limbs), np.full(len(clip.root), clip.rider))
        for clip in load_motion_clips(split)
        if clip.name.startswith("humanoid3d")
    ]
    return Clips(*(np.concatenate(part) for part in zip(*parts, strict=True)))


def drawn_rotations(body: Body, count: int, seed: int = 0) -> np.ndarray:
    """Rotation vectors [count, 54] of poses of the split for training."""
    rng = np.random.default_rng(seed)
    clips, photos = everyday_clips("train"), load_photo_poses("train")
    out = []
    for _ in range(count):
        kind = rng.random()
        pose = clip_pose(rng, clips) if kind < 0.45 else photo_pose(rng, photos) if kind < 0.75 else drawn_pose(rng)
        rotations, _ = posed_bones(body, body.template, pose, rng)
        out.append(local_rotations(body, rotations)[1:])
    return Rotation.from_matrix(np.concatenate(out)).as_rotvec().reshape(count, -1)


def mirrored(rotation: np.ndarray) -> np.ndarray:
    """Rotation vectors [N, 54] of the mirrored poses: left and right change places, turns about y and z change sign."""
    order = [JOINTS.index(mirrored_joint(name)) - 1 for name in JOINTS[1:]]
    return (rotation.reshape(len(rotation), -1, 3)[:, order] * [1, -1, -1]).reshape(rotation.shape)


def pose_prior(rotation: np.ndarray) -> PosePrior:
    """The prior of rotation vectors [N, 54]; symmetric."""
    every = np.concatenate([rotation, mirrored(rotation)])
    added = np.concatenate([_ADDED[name.partition(".")[0]] for name in JOINTS[1:]])
    covariance = np.cov(every.T) + np.diag(added**2)
    low, high = np.quantile(every, [_LIMIT_QUANTILE, 1 - _LIMIT_QUANTILE], axis=0)
    margin = _LIMIT_MARGIN * added
    return PosePrior(every.mean(0), np.linalg.inv(covariance), low - margin, high + margin)
