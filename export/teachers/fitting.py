"""Fits the puppet to one person: landmarks, directions of limbs and the mask, by gradient descent (Adam).

The camera is a pinhole with its principal point in the middle of the photo. Lengths in the photo are measured in
`torso` units: the distance from shoulders to hips as it appears, in pixels.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import torch
from scipy.spatial.transform import Rotation
from torch.nn import functional

from export.keypoints import NAMES
from export.people.atlas import REGIONS
from export.teachers.body_model import JOINT, JOINTS, PARENT, SHAPES, Puppet, chained, turns
from export.teachers.pose_start import FACING_CAMERA, SHOWN, start_pose, turn_onto

FOCAL = 1.2  # of the photo's longer side: about 45 degrees
ITERATIONS = 240
_FIELD_SIDE = 256  # longer side of the map of distances from the mask
_BORDER_POINTS = 250
_MIN_LANDMARKS = 6  # of the body, seen and inside the photo: with fewer there is no pose to start from
_MIN_MASK_PX = 400
_MAX_FACE = 0.6  # face by torso; of head shots the landmark network squeezes a torso into the photo

# How far a joint turns from its start, radians (standard deviations about x, y, z of its bones at rest).
_LOOSE = {
    "pelvis": (0.3, 0.3, 0.3), "abdomen": (0.15, 0.1, 0.1), "chest": (0.2, 0.15, 0.2), "neck": (0.2, 0.15, 0.15),
    "head": (0.25, 0.2, 0.25), "clavicle": (0.1, 0.15, 0.15), "upper_arm": (0.45, 0.45, 0.35),
    "lower_arm": (0.35, 0.25, 0.35), "hand": (0.2, 0.2, 0.2), "upper_leg": (0.4, 0.35, 0.2),
    "lower_leg": (0.4, 0.1, 0.12), "foot": (0.25, 0.12, 0.15),
}  # fmt: skip
# Clothes, metres outwards (standard deviations), in the order of REGIONS; hair and hats belong to the head.
_CLOTHES = {"torso": 0.03, "head": 0.025, "upper_arm": 0.02, "lower_arm": 0.015, "hand": 0.001, "upper_leg": 0.025,
            "lower_leg": 0.02, "foot": 0.01}  # fmt: skip
# A landmark's error in torsos that counts as one; faces are seen more exactly than hips.
_LANDMARK_ERROR = 0.045
_EXACTNESS = {"hip": 0.6, "shoulder": 0.9, "ear": 0.8, "heel": 0.7, "toe": 0.7, "finger": 0.6, "thumb": 0.4}
_LIMBS = [(f"{side} {a}", f"{side} {b}") for side in ("left", "right")
          for a, b in (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle"),
                       ("heel", "toe"), ("wrist", "index finger"))]  # fmt: skip
_LIMBS += [("right shoulder", "left shoulder"), ("right hip", "left hip"), ("right ear", "left ear")]
# Landmarks that show a joint's bones: they count as seen if one of the last is.
_SHOWN_BY = {
    "upper_arm": ("shoulder", "elbow"), "lower_arm": ("elbow", "wrist"), "hand": ("wrist",),
    "upper_leg": ("hip", "knee"), "lower_leg": ("knee", "ankle"), "foot": ("ankle",),
}  # fmt: skip
_SHOULDERS, _HIPS = ([NAMES.index(f"{side} {n}") for side in ("left", "right")] for n in ("shoulder", "hip"))
_ARMS = [NAMES.index(f"{side} {n}") for n in ("elbow", "wrist", "index finger") for side in ("left", "right")]
_ARM_RADIUS_M = 0.03
_FACE = [NAMES.index(n) for n in ("nose", "left eye", "right eye", "left ear", "right ear")]
_HIDDEN_FRACTION = 0.05  # of the mask's pull on limbs that something hides


class CannotFit(ValueError):
    """Why a person has too little to be fitted to."""


@dataclass(frozen=True)
class Target:
    """One person of a photo. point [33, 2] pixels; visible [33]; world [33, 3] metres; mask bool [H, W]; elsewhere
    bool [H, W], pixels of other people, which may hide this one."""

    point: np.ndarray
    visible: np.ndarray
    world: np.ndarray
    mask: np.ndarray
    elsewhere: np.ndarray


@dataclass(frozen=True)
class Fit:
    """Pose and shape that were found.

    vertices float32 [V, 3] in camera axes, metres (x right, y down, z away): the whole body with its clothes' offset.
    rotations [19, 3, 3], in body axes; landmark [33, 2] pixels, where the body's landmarks are seen (NaN for those
    that it has not); torso_px; focal_px; shown [19], whether the teacher sees each joint's bones.
    """

    vertices: np.ndarray
    rotations: np.ndarray
    landmark: np.ndarray
    torso_px: float
    focal_px: float
    shown: np.ndarray


def torso_px(point: np.ndarray) -> float:
    """Shoulders to hips; seen from the side shoulders are close together, from above the torso is short."""
    at = dict(zip(NAMES, point, strict=True))
    middle = [(at[f"left {n}"] + at[f"right {n}"]) / 2 for n in ("shoulder", "hip")]
    across = np.linalg.norm(at["left shoulder"] - at["right shoulder"])
    return max(float(np.linalg.norm(middle[0] - middle[1])), 1.2 * float(across))


def face_by_torso(point: np.ndarray) -> float:
    """Longest distance within the face by the distance of shoulders and hips: 0.2 to 0.5 of people seen upright."""
    shoulders, hips = point[_SHOULDERS].mean(0), point[_HIPS].mean(0)
    face = point[_FACE]
    longest = np.linalg.norm(face[:, None] - face[None], axis=2).max()
    return float(longest / max(np.linalg.norm(shoulders - hips), 1e-6))


def inside(point: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Which points [K, 2] lie in an image of shape [H, W]."""
    return ((point >= 0) & (point < [shape[1], shape[0]])).all(1)


def shown_joints(point: np.ndarray, visible: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """bool [19]: joints whose bones are seen, as far as the photo reaches. What leaves the photo is not hidden: the
    part of it inside must agree with the mask."""
    ok = dict(zip(NAMES, (visible >= SHOWN) | ~inside(point, shape), strict=True))
    out = np.ones(len(JOINTS), bool)
    for k, name in enumerate(JOINTS):
        base, _, letter = name.partition(".")
        if base in _SHOWN_BY:
            out[k] = all(ok[f"{'left' if letter == 'L' else 'right'} {n}"] for n in _SHOWN_BY[base])
    return out


def fit_person(puppet: Puppet, target: Target, iterations: int = ITERATIONS) -> Fit:
    """Raises CannotFit where landmarks or mask are missing."""
    if not (np.isfinite(target.point).all() and np.isfinite(target.world).all()):
        raise CannotFit("landmarks are not numbers")
    counted = puppet.has_landmark & (target.visible >= SHOWN) & inside(target.point, target.mask.shape)
    if counted.sum() < _MIN_LANDMARKS:
        raise CannotFit(f"{counted.sum()} landmarks visible, {_MIN_LANDMARKS} needed")
    if target.mask.sum() < _MIN_MASK_PX:
        raise CannotFit(f"mask of {target.mask.sum()} pixels, {_MIN_MASK_PX} needed")
    torso = torso_px(target.point)
    if torso < 8:
        raise CannotFit(f"torso of {torso:.0f} pixels, 8 needed")
    if face_by_torso(target.point) > _MAX_FACE:
        raise CannotFit(f"face {face_by_torso(target.point):.1f} times as long as the torso: head and shoulders only")
    return _Problem(puppet, target, torso).solve(iterations)


def _soft(square: torch.Tensor) -> torch.Tensor:
    """Pseudo-Huber: squared for small errors, linear for large ones. Takes squared errors."""
    return torch.sqrt(1 + square) - 1


class _Adam:
    """Adam (Kingma and Ba, ICLR 2015, algorithm 1). torch.optim's brings in Triton, whose LLVM and that of Mesa's
    software rasteriser do not live in one process."""

    def __init__(self, rates: dict[torch.Tensor, float], beta1: float = 0.9, beta2: float = 0.98) -> None:
        self.rates, self.beta1, self.beta2 = rates, beta1, beta2
        self.first = [torch.zeros_like(p) for p in rates]
        self.second = [torch.zeros_like(p) for p in rates]
        self.steps = 0

    def step(self, loss: torch.Tensor, share: float) -> None:
        """One step down the gradient of `loss`, at `share` of the rates."""
        self.steps += 1
        gradients = torch.autograd.grad(loss, list(self.rates))
        with torch.no_grad():
            for (p, rate), g, m, v in zip(self.rates.items(), gradients, self.first, self.second, strict=True):
                m.lerp_(g, 1 - self.beta1)
                v.lerp_(g * g, 1 - self.beta2)
                size = torch.sqrt(v / (1 - self.beta2**self.steps)) + 1e-8
                p -= share * rate / (1 - self.beta1**self.steps) * m / size


class _Problem:
    def __init__(self, puppet: Puppet, target: Target, torso: float) -> None:
        self.puppet, self.target, self.torso = puppet, target, torso
        height, width = target.mask.shape
        self.focal = FOCAL * max(height, width)
        self.middle = np.array([width / 2, height / 2])
        self.shown = shown_joints(target.point, target.visible, target.mask.shape)
        self._start()
        self._measure_landmarks()
        self._measure_mask()
        self.vertex_weight = puppet.sample.weights @ torch.tensor(np.where(self.shown, 1, _HIDDEN_FRACTION)).float()
        self.loose = torch.tensor([_LOOSE[name.partition(".")[0]] for name in JOINTS])
        self.cloth = torch.tensor([_CLOTHES[name] for name in REGIONS])

    def _start(self) -> None:
        """Pose from the world landmarks, place from those that are seen: f X = (u - c) Z is linear in the shift."""
        target, puppet = self.target, self.puppet
        seen = puppet.has_landmark & inside(target.point, target.mask.shape)
        # World landmarks are as seen straight on; the person stands where the ray through the landmarks points.
        ray = np.append((np.median(target.point[seen], 0) - self.middle) / self.focal, 1)
        world = target.world @ turn_onto(np.array([0, 0, 1.0]), ray).T
        start = start_pose(puppet, world.astype(np.float64), target.visible)
        local = [start[0]] + [start[p].T @ start[k] for k, p in enumerate(PARENT) if p >= 0]
        self.start = torch.tensor(np.stack(local), dtype=torch.float32)
        none = torch.zeros(SHAPES)
        bones = puppet.bones(torch.tensor(start, dtype=torch.float32), none)
        body, _ = puppet.place(puppet.landmarks, bones, none, torch.zeros(len(REGIONS)))
        self.to_camera = torch.tensor(FACING_CAMERA, dtype=torch.float32)
        body = (body @ self.to_camera.T).numpy()
        weight = np.where(seen, np.clip(target.visible, 0.05, 1), 0)
        ray = (target.point - self.middle) / self.focal
        rows, values = [], []
        for axis in (0, 1):
            row = np.zeros((len(ray), 3))
            row[:, axis], row[:, 2] = 1, -ray[:, axis]
            rows.append(row * weight[:, None])
            values.append((ray[:, axis] * body[:, 2] - body[:, axis]) * weight)
        shift = np.linalg.lstsq(np.concatenate(rows), np.concatenate(values))[0]
        # A body 50 cm from the camera or behind it means that the landmarks do not fit any: start from its size.
        if shift[2] < 0.5:
            depth = self.focal * 0.5 / self.torso
            shift = np.append(np.median(ray[seen], 0) * depth, depth)
        self.shift = torch.tensor(shift, dtype=torch.float32)

    def _measure_landmarks(self) -> None:
        target = self.target
        weight = np.where(self.puppet.has_landmark, np.clip(target.visible, 0, 1) ** 2, 0)
        # Outside the photo landmarks are guesses.
        weight = weight * np.where(inside(target.point, target.mask.shape), 1, 0.15)
        for word, share in _EXACTNESS.items():
            weight = weight * [share if word in name else 1 for name in NAMES]
        self.landmark_weight = torch.tensor(weight, dtype=torch.float32)
        self.point = torch.tensor(target.point, dtype=torch.float32)
        pairs = np.array([[NAMES.index(n) for n in pair] for pair in _LIMBS])
        self.limb_from, self.limb_to = pairs.T.tolist()
        along = self.target.world[pairs[:, 1]] - self.target.world[pairs[:, 0]]
        along = along / (np.linalg.norm(along, axis=1, keepdims=True) + 1e-9)
        self.limb = torch.tensor(along, dtype=torch.float32)
        self.limb_weight = torch.tensor(target.visible[pairs].min(1), dtype=torch.float32)

    def _measure_mask(self) -> None:
        """Distance from the mask around the person, and points of its border with their outward normals, both in
        pixels of the photo. Borders with the photo's edge and with other people are no contours of this one."""
        mask, elsewhere = self.target.mask, self.target.elsewhere
        height, width = mask.shape
        y, x = np.nonzero(mask)
        margin = int(self.torso)
        x0, x1 = max(x.min() - margin, 0), min(x.max() + 1 + margin, width)
        y0, y1 = max(y.min() - margin, 0), min(y.max() + 1 + margin, height)
        scale = min(1.0, _FIELD_SIDE / max(x1 - x0, y1 - y0))
        size = max(round((x1 - x0) * scale), 2), max(round((y1 - y0) * scale), 2)

        def small(a: np.ndarray) -> np.ndarray:
            return cv2.resize(a[y0:y1, x0:x1].astype(np.float32), size, interpolation=cv2.INTER_AREA)

        person, other = small(mask) > 0.5, small(elsewhere) > 0.5
        grow = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (5, 5))
        allowed = person | other
        outside = cv2.distanceTransform((~allowed).astype(np.uint8), cv2.DIST_L2, 5)
        # Distances are between pixels' middles: the border runs half a pixel before the first pixel beside the mask.
        outside = np.maximum(outside - 0.5, 0)
        self.field = torch.tensor(outside / (scale * self.torso), dtype=torch.float32)[None, None]
        self.window = torch.tensor([x0, y0, x1 - x0, y1 - y0], dtype=torch.float32)
        self.frame = torch.tensor([width, height], dtype=torch.float32)
        # The mask's slope, smoothed, says which way its border faces.
        smooth = cv2.GaussianBlur(person.astype(np.float32), (0, 0), 1.5)
        slope = np.stack([cv2.Sobel(smooth, cv2.CV_32F, *d, ksize=3) for d in ((1, 0), (0, 1))], -1)
        border = person & (cv2.erode(person.astype(np.uint8), np.ones((3, 3), np.uint8)) == 0)
        border &= cv2.dilate(other.astype(np.uint8), grow) == 0
        by, bx = np.nonzero(border)
        normal = -slope[by, bx]
        normal = normal / (np.linalg.norm(normal, axis=1, keepdims=True) + 1e-9)
        at = (np.stack([bx, by], 1) + 0.5 + 0.5 * normal) / scale + [x0, y0]
        edge = 2 / scale
        keep = (at > edge).all(1) & (at < [width - edge, height - edge]).all(1)
        at, normal = at[keep], normal[keep]
        chosen = np.random.default_rng(0).permutation(len(at))[:_BORDER_POINTS]
        self.border = torch.tensor(at[chosen], dtype=torch.float32)
        self.border_normal = torch.tensor(normal[chosen], dtype=torch.float32)

    def _project(self, points: torch.Tensor) -> torch.Tensor:
        """Camera axes to pixels."""
        middle = torch.tensor(self.middle, dtype=torch.float32)
        return self.focal * points[:, :2] / points[:, 2:].clamp(min=0.1) + middle

    def solve(self, iterations: int) -> Fit:
        turn = torch.zeros(len(JOINTS), 3, requires_grad=True)
        shape = torch.zeros(SHAPES, requires_grad=True)
        clothes = torch.full((len(REGIONS),), 0.01, requires_grad=True)
        move = torch.zeros(3, requires_grad=True)  # in torsos across the view, in shares of the distance along it
        descent = _Adam({turn: 0.03, shape: 0.06, clothes: 0.002, move: 0.02})
        for k in range(iterations):
            share = k / iterations
            loss = self._loss(turn, shape, clothes, move, share)
            descent.step(loss, 1 - 0.9 * share)
        with torch.no_grad():
            rotations, bones, shift = self._pose(turn, shape, move)
            whole, _ = self.puppet.place(self.puppet.whole, bones, shape, clothes)
            landmark, _ = self.puppet.place(self.puppet.landmarks, bones, shape, torch.zeros_like(clothes))
            whole, landmark = (p @ self.to_camera.T + shift for p in (whole, landmark))
            landmark = self._project(landmark).numpy()
            if not (np.isfinite(landmark).all() and torch.isfinite(whole).all()):
                raise CannotFit("the fit diverged")
            landmark[~self.puppet.has_landmark] = np.nan
        return Fit(whole.numpy(), rotations.numpy(), landmark, self.torso, self.focal, self.shown)

    def _pose(self, turn: torch.Tensor, shape: torch.Tensor, move: torch.Tensor):
        rotations = chained(self.start @ turns(turn))
        depth = self.shift[2] * torch.exp(move[2])
        across = (self.shift[:2] / self.shift[2] + move[:2] * self.torso / self.focal) * depth
        return rotations, self.puppet.bones(rotations, shape), torch.cat([across, depth[None]])

    def _loss(self, turn, shape, clothes, move, share: float) -> torch.Tensor:
        """share: of the iterations that are done. The mask joins after the landmarks, and then narrows its view."""
        puppet = self.puppet
        _, bones, shift = self._pose(turn, shape, move)
        joints, _ = puppet.place(puppet.landmarks, bones, shape, torch.zeros(len(REGIONS)))
        joints = joints @ self.to_camera.T + shift
        error = (self._project(joints) - self.point) / (self.torso * _LANDMARK_ERROR)
        loss = 1.5 * (self.landmark_weight * _soft((error**2).sum(1))).sum()
        limb = functional.normalize(joints[self.limb_to] - joints[self.limb_from], dim=1)
        loss = loss + 2 * (self.limb_weight * (1 - (limb * self.limb).sum(1))).sum()
        loss = loss + 0.5 * ((turn / self.loose) ** 2).sum() + 0.5 * (shape**2).sum()
        loss = loss + 0.5 * ((clothes / self.cloth) ** 2).sum() + 0.5 * ((clothes.clamp(max=0) / 0.003) ** 2).sum()
        loss = loss + self._hyperextension(turn) + self._arms_in_torso(joints, clothes)
        if share > 0.2:
            error = 0.07 - 0.045 * share
            loss = loss + min(1.0, (share - 0.2) / 0.2) * self._silhouette(bones, shape, clothes, shift, error)
        return loss

    def _hyperextension(self, turn: torch.Tensor) -> torch.Tensor:
        """Knees bend backwards only: the shank's turn about the thigh's x axis is positive."""
        knees = [JOINT["lower_leg.L"], JOINT["lower_leg.R"]]
        # The shank's downward axis in the thigh's axes: its y component is how far it points backwards.
        back = -(self.start[knees] @ turns(turn[knees]))[:, 1, 2]
        return 0.5 * (((-back - 0.05).clamp(min=0) / 0.1) ** 2).sum()

    @staticmethod
    def _arms_in_torso(joints: torch.Tensor, clothes: torch.Tensor) -> torch.Tensor:
        """Arms stay outside the torso, which hides them when it swells to a coat: an elliptic cylinder between the
        middles of hips and shoulders, as wide as shoulders allow. Silhouettes cannot tell an arm that sank in."""
        shoulders, hips = joints[_SHOULDERS], joints[_HIPS]
        low, high = hips.mean(0), shoulders.mean(0)
        left = shoulders[0] - shoulders[1]
        half = 0.5 * left.norm()
        axis = high - low
        length = axis.norm()
        axis = axis / length
        left = functional.normalize(left - axis * (left @ axis), dim=0)
        back = torch.linalg.cross(axis, left)
        arms = torch.cat([joints[_ARMS], (joints[_ARMS[:2]] + joints[_ARMS[2:4]]) / 2])
        relative = arms - low
        swollen = clothes[REGIONS.index("torso")] + _ARM_RADIUS_M
        x, y = relative @ left / (0.85 * half + swollen), relative @ back / (0.6 * half + swollen)
        radius = torch.sqrt(x**2 + y**2 + 1e-6)
        beside = (relative @ axis > -0.1) & (relative @ axis < 0.9 * length)
        return 0.5 * (beside * ((1 - radius).clamp(min=0) / 0.08) ** 2).sum()

    def _silhouette(self, bones, shape, clothes, shift, error: float) -> torch.Tensor:
        """error: distance from the mask's border that counts as one, torsos."""
        body, normals = self.puppet.place(self.puppet.sample, bones, shape, clothes)
        body, normals = body @ self.to_camera.T + shift, normals @ self.to_camera.T
        seen = self._project(body)
        # Vertices beside the mask are pulled into it, as far as the photo reaches.
        where = (seen - self.window[:2]) / self.window[2:] * 2 - 1
        away = functional.grid_sample(self.field, where[None, None], padding_mode="border", align_corners=False)
        away = away[0, 0, 0]
        within = ((seen > 0) & (seen < self.frame)).all(1) * self.vertex_weight
        loss = 100 * (within * _soft((away / error) ** 2)).sum() / len(within)
        if not len(self.border):
            return loss
        # The mask's border is pulled to the nearest contour vertex whose contour runs the same way.
        with torch.no_grad():
            facing = (normals * functional.normalize(body, dim=1)).sum(1)
            flat = functional.normalize(normals[:, :2], dim=1)
            contour = torch.nonzero((facing.abs() < 0.35) & (within > 0.5))[:, 0]
            if len(contour) < 8:
                return loss
            cost = torch.cdist(self.border, seen[contour]) / self.torso
            cost = cost + 0.35 * (1 - self.border_normal @ flat[contour].T)
            nearest = contour[cost.argmin(1)]
        gap = ((seen[nearest] - self.border) * self.border_normal).sum(1) / self.torso
        slide = ((seen[nearest] - self.border) ** 2).sum(1) / self.torso**2
        # Bags, hair and skirts make borders that no body has: far ones stop pulling (Geman-McClure).
        square = (gap**2 + 0.1 * slide) / error**2
        return loss + 50 * (square / (1 + square / 12)).mean()


def neck_angle(rotations: np.ndarray) -> float:
    """How far the head is turned against the chest, degrees."""
    relative = rotations[JOINT["chest"]].T @ rotations[JOINT["head"]]
    return float(np.degrees(np.linalg.norm(Rotation.from_matrix(relative).as_rotvec())))
