"""A first guess of the pose from BlazePose's world landmarks: orientation of each of the puppet's joints."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from export.keypoints import NAMES
from export.teachers.body_model import JOINT, JOINTS, PARENT, Puppet

# Columns: the body's x (left), y (back) and z (up) in camera axes, for somebody who faces the camera.
FACING_CAMERA = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
SHOWN = 0.5  # least probability of a landmark that is believed


def unit(v: np.ndarray) -> np.ndarray:
    return v / (np.linalg.norm(v, axis=-1, keepdims=True) + 1e-9)


def turn_onto(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Smallest rotation [3, 3] that takes direction a to direction b; any of them for opposite directions."""
    a, b = unit(a), unit(b)
    axis, cosine = np.cross(a, b), float(a @ b)
    if cosine < -0.9999:
        axis = np.cross(a, np.eye(3)[np.abs(a).argmin()])
    return Rotation.from_rotvec(unit(axis) * np.arccos(np.clip(cosine, -1, 1))).as_matrix()


def frame(left: np.ndarray, up: np.ndarray) -> np.ndarray:
    """Rotation [3, 3] with columns left, back and up; `left` is kept, `up` made orthogonal to it."""
    left = unit(left)
    up = unit(up - left * (up @ left))
    return np.stack([left, np.cross(up, left), up], 1)


def start_pose(puppet: Puppet, world: np.ndarray, visible: np.ndarray) -> np.ndarray:
    """world: [33, 3] metres in camera axes (x right, y down, z away). Orientations [19, 3, 3] in body axes of somebody
    who faces the camera (`FACING_CAMERA` takes them to camera axes); what is not seen continues its parent."""
    at = dict(zip(NAMES, world @ FACING_CAMERA, strict=True))
    rest = dict(zip(NAMES, puppet.landmarks.rest.numpy(), strict=True))
    seen = dict(zip(NAMES, visible >= SHOWN, strict=True))

    def middle(points: dict, joint: str) -> np.ndarray:
        return (points[f"left {joint}"] + points[f"right {joint}"]) / 2

    def across(points: dict, joint: str) -> np.ndarray:
        return points[f"left {joint}"] - points[f"right {joint}"]

    up = middle(at, "shoulder") - middle(at, "hip")
    pelvis, chest = frame(across(at, "hip"), up), frame(across(at, "shoulder"), up)
    # The line from hips to shoulders leans in the rest pose too.
    lean = middle(rest, "shoulder") - middle(rest, "hip")
    pelvis, chest = (turned @ frame(np.array([1.0, 0, 0]), lean).T for turned in (pelvis, chest))

    def face(points: dict) -> np.ndarray:
        ears = middle(points, "ear")
        forward = points["nose"] - ears
        return frame(across(points, "ear"), np.cross(forward, across(points, "ear")))

    head = face(at) @ face(rest).T
    spine = Slerp([0, 1], Rotation.from_matrix([pelvis, chest]))
    neck = Slerp([0, 1], Rotation.from_matrix([chest, head]))
    out = np.zeros((len(JOINTS), 3, 3))
    out[JOINT["pelvis"]], out[JOINT["chest"]], out[JOINT["head"]] = pelvis, chest, head
    out[JOINT["abdomen"]], out[JOINT["neck"]] = spine(0.5).as_matrix(), neck(0.5).as_matrix()
    for letter, side in (("L", "left"), ("R", "right")):
        out[JOINT[f"clavicle.{letter}"]] = chest
        for limb, (start, bend, end) in {
            "arm": ("shoulder", "elbow", "wrist"),
            "leg": ("hip", "knee", "ankle"),
        }.items():
            names = [f"{side} {joint}" for joint in (start, bend, end)]
            upper, lower = JOINT[f"upper_{limb}.{letter}"], JOINT[f"lower_{limb}.{letter}"]
            known = seen[names[1]], seen[names[1]] and seen[names[2]]
            first, second = (at[names[k + 1]] - at[names[k]] for k in (0, 1))
            first_rest, second_rest = (rest[names[k + 1]] - rest[names[k]] for k in (0, 1))
            # A knee bends about the body's left; the elbow's axis follows from its bend at rest.
            hinge = np.array([1.0, 0, 0]) if limb == "leg" else np.cross(first_rest, second_rest)
            carried = out[PARENT[upper]]
            out[upper] = turn_onto(carried @ first_rest, first) @ carried if known[0] else carried
            if known[1]:
                out[upper] = _twisted(out[upper], hinge, first, second)
            carried = out[upper]
            out[lower] = turn_onto(carried @ second_rest, second) @ carried if known[1] else carried
        out[JOINT[f"hand.{letter}"]] = _hand(out[JOINT[f"lower_arm.{letter}"]], at, rest, seen, side)
        out[JOINT[f"foot.{letter}"]] = _foot(out[JOINT[f"lower_leg.{letter}"]], at, rest, seen, side)
    return out


def _twisted(turned: np.ndarray, hinge: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Turns a limb's upper bone about itself until the joint below can bend as it does; a stretched limb tells
    nothing about its twist."""
    axis, now, wanted = unit(first), turned @ hinge, np.cross(unit(first), unit(second))
    now = unit(now - axis * (now @ axis))
    angle = np.arctan2(axis @ np.cross(now, wanted), now @ wanted)
    sure = np.clip((np.linalg.norm(wanted) - 0.2) / 0.3, 0, 1)
    return Rotation.from_rotvec(axis * sure * np.clip(angle, -1.6, 1.6)).as_matrix() @ turned


def _hand(carried: np.ndarray, at: dict, rest: dict, seen: dict, side: str) -> np.ndarray:
    names = [f"{side} {n}" for n in ("wrist", "index finger", "little finger")]
    if not all(seen[n] for n in names):
        return carried

    def palm(points: dict) -> np.ndarray:
        wrist, index, little = (points[n] for n in names)
        return frame(index - little, (index + little) / 2 - wrist)

    turned = palm(at) @ palm(rest).T
    # World landmarks of hands are rough: a wrist does not turn farther than this against the forearm.
    relative = Rotation.from_matrix(carried.T @ turned).as_rotvec()
    angle = np.linalg.norm(relative)
    return carried @ Rotation.from_rotvec(relative * min(1, 1.2 / max(angle, 1e-6))).as_matrix()


def _foot(carried: np.ndarray, at: dict, rest: dict, seen: dict, side: str) -> np.ndarray:
    heel, toe = f"{side} heel", f"{side} toe"
    if not (seen[heel] and seen[toe]):
        return carried
    turned = turn_onto(carried @ (rest[toe] - rest[heel]), at[toe] - at[heel])
    relative = Rotation.from_matrix(turned).as_rotvec()
    angle = np.linalg.norm(relative)
    return Rotation.from_rotvec(relative * min(1, 0.9 / max(angle, 1e-6))).as_matrix() @ carried
