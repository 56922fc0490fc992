"""Faces of real photographs as crops of the encoder's kind, with template points at MediaPipe's face points.

    python -m export.heads.photos.faces              # .data/heads/photos/{train,val,test}; look at the sheets

In: photos (`export.photos people`), people's masks (`python -m export.teachers`), `face_points.json`. One file a
photo that shows a face, and one sheet a split. A face that the teacher does not see the same way in several looks, from
behind an ear, or smaller than some 40 pixels is left out.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from tqdm import tqdm

from export.heads.head_shards import CROP_SIDES, SIDE
from export.heads.photos.face_points import FacePoints, read_face_points
from export.keypoints import NAMES
from export.teachers.faces import Face, FaceDetector, FaceNetwork, Square, faces_of
from export.teachers.label import PhotoLabels
from export.teachers.stored import Stored

SPLITS = ("train", "val", "test")
HEAD, UNKNOWN, NOTHING = 255, 128, 0  # of mattes
MIN_SIZE_PX = 40
MIN_PRESENCE = 0.8
MAX_SPREAD = 0.02  # of the face's size: median of the points used
MIN_INSIDE = 0.8  # of the points used: share that lies in the photo
MAX_YAW = np.radians(60)
MAX_RESIDUAL = 0.15  # dm, root mean square: a face that no turn of the template explains
_STEADY = 0.012  # of the face's size: a point that wanders so far weighs 0.6 times as much
# The head as an ellipsoid of the template's frame (dm), where no mask tells more.
_CENTRE, _RADII = np.array([0.0, -0.1, 0.0]), np.array([0.85, 1.05, 1.35])
_CHIN, _BODY = -1.1, -2.3  # dm up: what is higher is head, what is lower is not; the neck is left open
_JAW, _SHOULDER = 0.75, -0.6  # dm: farther from the middle than the jaw, shoulders may reach so high
_WIDE, _TOP = 1.5, 1.9  # dm from the middle: farther parts of the person may be arms or hats
_WIDEST, _MAX_WIDE = 1.25, 0.35  # dm, and the share of the two strips from there to `_WIDE` that may be head
_HAND = 0.6  # dm around a hand's points


@dataclass(frozen=True)
class PhotoFaces(Stored):
    """K faces. rgb uint8 [K, 256, 256, 3]; pixel float32 [K, P, 2] of the crop, where `template` float32 [P, 3] (dm)
    is seen; weight float32 [K, P], 0..1, 0 where hidden or not believed; matte uint8 [K, 256, 256]: 255 head, 0 not,
    128 unknown; square float32 [K, 3]: middle x, y and side in pixels of the photo."""

    rgb: np.ndarray
    pixel: np.ndarray
    template: np.ndarray
    weight: np.ndarray
    matte: np.ndarray
    square: np.ndarray


@dataclass(frozen=True)
class FacePose:
    """Weak perspective: pixel = scale * (rotation p)[:2] + shift. rotation [3, 3] from the head's frame to x right,
    y down, z away; scale: pixels a dm; residual: dm."""

    rotation: np.ndarray
    scale: float
    shift: np.ndarray
    residual: float

    @property
    def yaw(self) -> float:
        """How far the face looks to the person's left, radians."""
        forward = self.rotation @ [0.0, -1.0, 0.0]
        return float(np.arctan2(forward[0], -forward[2]))

    def pixels(self, points: np.ndarray) -> np.ndarray:
        return self.scale * (points @ self.rotation[:2].T) + self.shift

    def up(self, pixels: np.ndarray) -> np.ndarray:
        """z [N] (dm) of what is seen at pixels [N, 2] if it lies in the middle of the head (y = 0)."""
        plane = self.rotation[:2, [0, 2]]
        return ((pixels - self.shift) / self.scale) @ np.linalg.inv(plane)[1]

    def aside(self, pixels: np.ndarray) -> np.ndarray:
        """How far [N] (dm) pixels [N, 2] lie beside the line through the middle of the head along its up axis."""
        up = self.rotation[:2, 2] / np.linalg.norm(self.rotation[:2, 2])
        return abs((pixels - self.pixels(_CENTRE[None])) @ [-up[1], up[0]]) / self.scale


def pose_of(template: np.ndarray, pixel: np.ndarray) -> FacePose:
    """template: [N, 3] dm, pixel: [N, 2]. Least squares, then the nearest rotation."""
    middle, centre = template.mean(0), pixel.mean(0)
    linear = np.linalg.lstsq(template - middle, pixel - centre, rcond=None)[0].T  # [2, 3]
    u, s, v = np.linalg.svd(linear, full_matrices=False)
    rows = u @ v
    rotation = np.stack([*rows, np.cross(*rows)])
    scale = float(s.mean())
    shift = centre - scale * rows @ middle
    away = scale * (template @ rows.T) + shift - pixel
    return FacePose(rotation, scale, shift, float(np.sqrt((away**2).sum(1).mean()) / scale))


def weights_of(face: Face, points: FacePoints, pose: FacePose) -> np.ndarray:
    """[468]: 0 where not used or turned away, less where the point wanders between looks."""
    towards = -(points.normal @ pose.rotation.T)[:, 2]
    facing = np.clip((towards - 0.15) / 0.35, 0, 1)
    steady = np.exp(-0.5 * (face.spread / (_STEADY * face.size)) ** 2)
    return points.used * facing * steady * face.presence


def inside(pixels: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """bool [N]: which pixels [N, 2] lie in an image of H x W."""
    return ((pixels >= 0) & (pixels <= np.array(shape[::-1]) - 1)).all(1)


def refused(face: Face, points: FacePoints, pose: FacePose, shape: tuple[int, int]) -> str:
    """Why the face of a photo of H x W is not taken, or an empty string."""
    wander = float(np.median(face.spread[points.used])) / face.size
    if face.size < MIN_SIZE_PX:
        return "small"
    if face.presence < MIN_PRESENCE:
        return "unsure"
    if inside(face.point[points.used], shape).mean() < MIN_INSIDE:
        return "cut"
    if wander > MAX_SPREAD:
        return "unsteady"
    if abs(pose.yaw) > MAX_YAW:
        return "profile"
    return "misshapen" if pose.residual > MAX_RESIDUAL else ""


def matte_of(face: Face, pose: FacePose, labels: PhotoLabels | None, shape: tuple[int, int]) -> np.ndarray:
    """uint8 [H, W] over the photo: which pixels show this head, as far as people's masks and the face tell."""
    out = np.full(shape, UNKNOWN, np.uint8)
    if labels is None or not labels.outlined.any():
        return out
    at = np.clip(np.round(face.point).astype(int), 0, np.array(shape[::-1]) - 1)
    covered = labels.mask[:, at[:, 1], at[:, 0]].mean(1) * labels.outlined
    own = int(covered.argmax())
    if covered[own] < 0.8:
        return out
    anyone = labels.mask[labels.outlined].any(0) | labels.doubt.any(0)
    for x0, y0, x1, y1 in np.round(labels.box[~labels.outlined]).astype(int):
        anyone[max(0, y0) : y1, max(0, x0) : x1] = True
    near = cv2.dilate(anyone.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    out[~near] = NOTHING
    y, x = np.nonzero(near)
    pixels = np.stack([x, y], 1)
    up, aside = pose.up(pixels), pose.aside(pixels)
    out[y[up < _BODY], x[up < _BODY]] = NOTHING
    core = cv2.erode(labels.mask[own].astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    sure = core & ~labels.doubt[own]
    head = sure[y, x] & (up > np.where(aside < _JAW, _CHIN, _SHOULDER)) & (up < _TOP) & (aside < _WIDE)
    hands = [k for k, name in enumerate(NAMES) if "wrist" in name or "finger" in name or "thumb" in name]
    for person in np.flatnonzero(labels.sure):
        for hand in labels.point[person, hands]:
            head &= np.hypot(x - hand[0], y - hand[1]) > _HAND * pose.scale
    # Heads are not so wide: a mask that is wide on one side up there shows a hat, arms, somebody else or a thing.
    ring = (aside > _WIDEST) & (aside < _WIDE) & (up > -0.2) & (up < 1.0)
    if np.count_nonzero(head & ring) > _MAX_WIDE * 2 * (_WIDE - _WIDEST) * 1.2 * pose.scale**2:
        return out
    out[y[head], x[head]] = HEAD
    return out


def square_of(pose: FacePose, matte: np.ndarray) -> Square:
    """The upright square around the head, `CROP_SIDES` times its box's longer side."""
    reach = np.linalg.norm(pose.rotation[:2] * _RADII, axis=1) * pose.scale
    middle = pose.pixels(_CENTRE[None])[0]
    low, high = middle - reach, middle + reach
    y, x = np.nonzero(matte == HEAD)
    if len(x):  # hair that reaches farther than the ellipsoid
        found = np.array([[x.min(), y.min()], [x.max(), y.max()]])
        low, high = np.minimum(low, found[0]), np.maximum(high, found[1])
    return Square((low + high) / 2, CROP_SIDES * float((high - low).max()), 0.0)


def crop_face(
    image: np.ndarray, face: Face, points: FacePoints, pose: FacePose, labels: PhotoLabels | None
) -> tuple[np.ndarray, ...]:
    """A row of `PhotoFaces`, without the template."""
    matte = matte_of(face, pose, labels, image.shape[:2])
    square = square_of(pose, matte)
    rgb = square.cut(image, SIDE)[..., ::-1]
    # The area outside of the photo is grey in the crop and shows no head.
    index = (np.arange(SIDE) + 0.5) / SIDE * square.size - square.size / 2
    x, y = np.round(square.centre[0] + index).astype(int), np.round(square.centre[1] + index).astype(int)
    inside_x, inside_y = (x >= 0) & (x < image.shape[1]), (y >= 0) & (y < image.shape[0])
    cut = matte[np.clip(y, 0, image.shape[0] - 1)][:, np.clip(x, 0, image.shape[1] - 1)]
    cut = np.where(inside_y[:, None] & inside_x, cut, np.uint8(NOTHING))
    pixel = ((face.point - square.centre) / square.size + 0.5) * SIDE - 0.5
    weight = weights_of(face, points, pose)
    weight = weight * inside(pixel, (SIDE, SIDE)) * inside(face.point, image.shape[:2])
    return rgb, pixel.astype(np.float32), weight.astype(np.float32), cut, np.append(square.centre, square.size)


def head_squares(labels: PhotoLabels | None) -> list[Square]:
    """Where BlazePose's face landmarks say that a face is: for faces that the detector does not find."""
    out = []
    for person in np.flatnonzero(labels.sure) if labels is not None else ():
        point = labels.point[person, : NAMES.index("mouth right") + 1].astype(np.float64)
        size = 1.6 * float((point.max(0) - point.min(0)).max())
        if size > MIN_SIZE_PX / 2:
            out.append(Square((point.max(0) + point.min(0)) / 2, size, 0.0))
    return out


def photo_faces(
    image: np.ndarray, labels: PhotoLabels | None, points: FacePoints, teachers: tuple[FaceDetector, FaceNetwork]
) -> tuple[PhotoFaces | None, list[str]]:
    """The faces of a photo (BGR), and what became of each face found: empty, or why it was refused."""
    rows, fates = [], []
    for face in faces_of(*teachers, image, head_squares(labels)):
        pose = pose_of(points.template[points.used], face.point[points.used])
        fates.append(refused(face, points, pose, image.shape[:2]))
        if not fates[-1]:
            rows.append(crop_face(image, face, points, pose, labels))
    if not rows:
        return None, fates
    rgb, pixel, weight, matte, square = (np.stack(column) for column in zip(*rows, strict=True))
    template = points.template.astype(np.float32)
    return PhotoFaces(rgb, pixel, template, weight, matte, square.astype(np.float32)), fates


def read_photos(folder: Path, split: str) -> list[PhotoFaces]:
    paths = sorted((folder / split).glob("*.npz"))
    if not paths:
        raise FileNotFoundError(f"{folder / split} holds no faces: run `python -m export.heads.photos.faces` first.")
    return [PhotoFaces.load(path) for path in paths]


def drawn(faces: PhotoFaces, k: int) -> np.ndarray:
    """A crop with its points, coloured by template point, as bright as they weigh; and its matte. RGB."""
    left = faces.rgb[k].copy()
    for at, point, weight in zip(faces.pixel[k], faces.template, faces.weight[k], strict=True):
        if weight > 0:
            colour = np.clip((point / 3 + 0.5) * 255 * weight, 0, 255)
            cv2.circle(left, np.round(at).astype(int).tolist(), 1, colour.tolist(), -1)
    tint = np.zeros_like(left)
    tint[faces.matte[k] == HEAD, 1] = 255
    tint[faces.matte[k] == UNKNOWN] = (255, 0, 0)
    right = (0.6 * faces.rgb[k] + 0.4 * tint).astype(np.uint8)
    return np.hstack([left, right])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--photos", type=Path, default=Path(".data/photos"))
    parser.add_argument("--labels", type=Path, default=Path(".data/teachers/labels"))
    parser.add_argument("--out", type=Path, default=Path(".data/heads/photos"))
    parser.add_argument("--splits", nargs="+", choices=SPLITS, default=SPLITS)
    arguments = parser.parse_args()
    cv2.setNumThreads(1)
    points, teachers = read_face_points(), (FaceDetector(), FaceNetwork())
    for split in arguments.splits:
        tiles, counts = [], {}
        (arguments.out / split).mkdir(parents=True, exist_ok=True)
        for path in tqdm(sorted((arguments.photos / split).glob("*.jpg")), desc=split, unit="photo", disable=None):
            known = arguments.labels / f"{path.stem}.npz"
            labels = PhotoLabels.load(known) if known.exists() else None
            faces, fates = photo_faces(cv2.imread(str(path)), labels, points, teachers)
            for fate in fates:
                counts[fate or "taken"] = counts.get(fate or "taken", 0) + 1
            out = arguments.out / split / f"{path.stem}.npz"
            out.unlink(missing_ok=True)
            if faces is not None:
                faces.save(out)
                tiles += [drawn(faces, k) for k in range(len(faces.rgb))]
        print(f"{split}: " + (", ".join(f"{n} {name}" for name, n in sorted(counts.items())) or "no faces"))
        for number in range(0, len(tiles), 40):
            part = tiles[number : number + 40]
            part += [np.zeros_like(tiles[0])] * (-len(part) % 4)
            sheet = np.vstack([np.hstack(part[k : k + 4]) for k in range(0, len(part), 4)])
            name = arguments.out / f"{split}-{number // 40}.png"
            cv2.imwrite(str(name), cv2.resize(sheet, None, fx=0.75, fy=0.75, interpolation=cv2.INTER_AREA)[..., ::-1])


if __name__ == "__main__":
    main()
