"""From a fitted body to labels (I, U, V) for each pixel of a photo, and the reasons for not believing a fit."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy import ndimage

from export import surface
from export.camera import Camera
from export.keypoints import NAMES
from export.people import render
from export.people.atlas import Atlas
from export.people.lookup import LabelLookup
from export.people.wardrobe import Layer, Model
from export.teachers.body_model import JOINT, Puppet
from export.teachers.fitting import CannotFit, Fit, Target, fit_person, inside, neck_angle
from export.teachers.label import PhotoLabels
from export.teachers.pose_start import SHOWN

LONGEST_SIDE = 1024
UNKNOWN = 255  # in channel I: this person, but no telling which part
MIN_IOU = 0.85
MAX_LANDMARK_ERROR = 0.12  # median, in torsos
MAX_NECK_DEGREES = 100.0
_DRAWN = 512  # side of the square that a person is drawn in, pixels
_NEAR = 0.06  # torsos beside the body that take its label
MAX_JOINT_ERROR = 0.35  # of the worst shoulder, elbow, wrist, knee or ankle, torsos
_SEEN_WITHIN_M = 0.03
_NOSE = NAMES.index("nose")
_FACE_SURE_M = 0.05  # a face seen from the side is neither towards the camera nor away from it
# Hips are left out: near the photo's lower edge the landmark network draws them up into it.
_JOINT_LANDMARK = np.array([name.endswith(("shoulder", "elbow", "wrist", "knee", "ankle")) for name in NAMES])
# Joint of the puppet whose bones each coarse region (0..14) shows.
_COARSE_JOINTS = ("chest", "chest", "hand.R", "hand.L", "foot.L", "foot.R", "upper_leg.R", "upper_leg.L",
                  "lower_leg.R", "lower_leg.L", "upper_arm.L", "upper_arm.R", "lower_arm.L", "lower_arm.R",
                  "head")  # fmt: skip
_PART_JOINTS = np.array([JOINT[name] for name in _COARSE_JOINTS])[surface.PART_TO_COARSE]


@dataclass(frozen=True)
class DensePerson:
    """label uint8 [h, w, 3] (I, U*255, V*255), 0 beside the mask, I = UNKNOWN where no part is known; of a photo whose
    longer side is at most LONGEST_SIDE. iou: of the body's silhouette and the mask. landmark_error: median over
    visible landmarks, torsos. reason: empty if the label may be believed, else why not. rotations [19, 3, 3] as
    in `Fit`, None where nothing could be fitted."""

    label: np.ndarray
    iou: float
    landmark_error: float
    reason: str
    rotations: np.ndarray | None = None

    @property
    def accepted(self) -> bool:
        return not self.reason


def label_size(shape: tuple[int, int]) -> tuple[int, int]:
    """(h, w) of the labels of a photo of shape (H, W)."""
    scale = min(1.0, LONGEST_SIDE / max(shape))
    return max(round(shape[0] * scale), 1), max(round(shape[1] * scale), 1)


_DARK = render.Light(np.array([0, -1.0, 0]), np.zeros(3), np.zeros(3), np.array([[0, 0, -1.0]] * 2), np.zeros((2, 3)))


class DenseTeacher:
    """Fits people and draws what was fitted. Owns the OpenGL context: one a process."""

    def __init__(self, puppet: Puppet) -> None:
        self.puppet = puppet
        atlas = Atlas(puppet.body)
        self.model = Model(puppet.body, atlas)
        self._nose = puppet.template_nose
        skin = np.full((16, 16, 3), 200, np.uint8)
        self.renderer = render.Renderer(self.model, LabelLookup(atlas), skin, _DRAWN, _DRAWN)

    def photo(self, labels: PhotoLabels) -> dict[int, DensePerson]:
        """Every `sure` person of a photo, by index."""
        everybody = labels.mask[labels.outlined].sum(0)
        out = {}
        for k in np.flatnonzero(labels.sure):
            elsewhere = everybody - labels.mask[k] > 0
            target = Target(labels.point[k], labels.visible[k], labels.world[k], labels.mask[k], elsewhere)
            out[int(k)] = self.person(target)
        return out

    def person(self, target: Target) -> DensePerson:
        try:
            fit = fit_person(self.puppet, target)
        except CannotFit as error:
            return DensePerson(np.zeros((*label_size(target.mask.shape), 3), np.uint8), 0.0, np.inf, str(error))
        return judged(fit, target, *self.draw(fit, target.mask.shape), self._nose)

    def draw(self, fit: Fit, shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
        """Label uint8 [h, w, 3] and point of the template's surface float32 [h, w, 3] (NaN beside the body)."""
        height, width = label_size(shape)
        scale = height / shape[0]
        focal = fit.focal_px * scale
        body = fit.vertices[self.puppet.body.groups["body"]]
        seen = focal * body[:, :2] / np.maximum(body[:, 2:], 0.1) + [width / 2, height / 2]
        low = np.clip(np.floor(seen.min(0)) - 1, 0, [width - 1, height - 1]).astype(int)
        high = np.clip(np.ceil(seen.max(0)) + 1, low + 1, [width, height]).astype(int)
        side = max(high - low)
        # In place of a rotation, a shear moves the principal point into the middle of the square that is drawn.
        off = (np.array([width / 2, height / 2]) - (low + side / 2)) / focal
        shear = np.array([[1, 0, off[0]], [0, 1, off[1]], [0, 0, 1]])
        camera = Camera.centred(_DRAWN, _DRAWN, focal * _DRAWN / side, shear, np.zeros(3))
        person = render.Person(fit.vertices, [Layer(self.model.range["body"])])
        picture = self.renderer.draw([person], camera, _DARK, np.random.default_rng(0))
        square = cv2.resize(picture.label, (side, side), interpolation=cv2.INTER_NEAREST)
        label = np.zeros((height, width, 3), np.uint8)
        part = square[: high[1] - low[1], : high[0] - low[0]]
        label[low[1] : high[1], low[0] : high[0]] = np.where(part[..., 3:] > 0, part[..., :3], 0)
        point = cv2.resize(picture.point, (side, side), interpolation=cv2.INTER_NEAREST)
        surface_point = np.full((height, width, 3), np.nan, np.float32)
        drawn = label[..., 0] > 0
        surface_point[low[1] : high[1], low[0] : high[0]] = point[: high[1] - low[1], : high[0] - low[0]]
        surface_point[~drawn] = np.nan
        return label, surface_point


def judged(fit: Fit, target: Target, drawn: np.ndarray, point: np.ndarray, nose: np.ndarray) -> DensePerson:
    """drawn [h, w, 3] and point [h, w, 3] as `DenseTeacher.draw` gives them; nose [3]: of the template's surface."""
    height, width = drawn.shape[:2]
    mask, elsewhere = (
        cv2.resize(a.astype(np.uint8), (width, height), interpolation=cv2.INTER_NEAREST) > 0
        for a in (target.mask, target.elsewhere)
    )
    body = drawn[..., 0] > 0
    # Pixels hidden by an object or a person are not missing from the mask.
    hidden = elsewhere | ~np.concatenate([[True], fit.shown[_PART_JOINTS[1:]]])[drawn[..., 0]]
    counted = body & ~(hidden & ~mask)
    iou = float((counted & mask).sum() / max((counted | mask).sum(), 1))
    error = np.linalg.norm(fit.landmark - target.point, axis=1) / fit.torso_px
    sure = (target.visible >= SHOWN) & inside(target.point, target.mask.shape) & np.isfinite(error)
    median = float(np.median(error[sure]))
    reasons = []
    if iou < MIN_IOU:
        reasons.append(f"IoU {iou:.2f}, {MIN_IOU} needed")
    if median > MAX_LANDMARK_ERROR:
        reasons.append(f"landmarks {median:.2f} torsos off, {MAX_LANDMARK_ERROR} allowed")
    farthest = int(np.where(sure & _JOINT_LANDMARK, error, 0).argmax())
    if sure[farthest] and _JOINT_LANDMARK[farthest] and error[farthest] > MAX_JOINT_ERROR:
        reasons.append(f"{NAMES[farthest]} {error[farthest]:.2f} torsos off, {MAX_JOINT_ERROR} allowed")
    if neck_angle(fit.rotations) > MAX_NECK_DEGREES:
        reasons.append(f"head turned by {neck_angle(fit.rotations):.0f} degrees, {MAX_NECK_DEGREES:.0f} possible")
    if inside(target.point[[_NOSE]], target.mask.shape)[0]:
        with np.errstate(invalid="ignore"):
            shown = bool((np.linalg.norm(point - nose, axis=-1) < _SEEN_WITHIN_M).any())
        ahead = _face_towards_camera(target.world)
        if abs(ahead) > _FACE_SURE_M and shown != (ahead > 0):
            reasons.append(f"the face looks {'towards' if ahead > 0 else 'away from'} the camera, the body's does not")
    near = _NEAR * fit.torso_px * height / target.mask.shape[0]
    return DensePerson(_filled(drawn, mask, near), iou, median, "; ".join(reasons), fit.rotations)


def _face_towards_camera(world: np.ndarray) -> float:
    """How much nearer the camera the nose is than the ears, metres. BlazePose calls noses visible from behind too."""
    ears = [NAMES.index(f"{side} ear") for side in ("left", "right")]
    return float(world[ears, 2].mean() - world[_NOSE, 2])


def _filled(drawn: np.ndarray, mask: np.ndarray, near_px: float) -> np.ndarray:
    """Labels of the mask's pixels: the body's, the nearest one's within `near_px` of it, UNKNOWN farther away."""
    out = np.zeros_like(drawn)
    out[mask, 0] = UNKNOWN
    body = drawn[..., 0] > 0
    if not (body & mask).any():
        return out
    distance, index = ndimage.distance_transform_edt(~body, return_indices=True)
    known = mask & (distance <= near_px)
    out[known] = drawn[tuple(i[known] for i in index)]
    return out
