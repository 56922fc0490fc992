"""Composes one training image: the photo behind, the light, the people drawn before it, the camera's faults."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np

from export.camera import Camera
from export.keypoints import COUNT
from export.people import assets
from export.people.animals import load_animals
from export.people.atlas import Atlas
from export.people.augmentation import CLOSE, Variety
from export.people.body import Body, Shape, sample_phenotype
from export.people.imaging import camera_faults, lens_map, points_through_lens, through_lens
from export.people.landmarks import Landmarks
from export.people.lookup import LabelLookup
from export.people.motion import load_clips, load_photo_poses
from export.people.panoramas import load_panoramas
from export.people.render import Light, Picture, Renderer
from export.people.staging import Director
from export.people.wardrobe import Fabrics, Model

SPLITS = {"train": 0, "val": 1, "test": 2}
PANORAMA_FRACTION = 0.2  # of the images outside rendered rooms
TILTED_PEOPLE = 0.25  # of the tilted images: the people are, not the camera
BODIES = {"train": 400, "val": 60, "test": 60}
_NEAR_M = 0.2  # a body's middle closer to the camera than this says nothing about its direction


@dataclass(frozen=True)
class Sample:
    """image uint8 [H, W, 3] BGR; label uint8 [H, W, 4] = (I, U*255, V*255, instance); point float32 [H, W, 3];
    axis float32 [people, 2], keypoint float32 [people, 33, 3] by instance number - 1 (`export.shards.Record`)."""

    image: np.ndarray
    label: np.ndarray
    point: np.ndarray | None
    axis: np.ndarray
    keypoint: np.ndarray


def body_axis(hips: np.ndarray, skull: np.ndarray, camera: Camera) -> np.ndarray:
    """Direction of the body axis in the image, float32 [2]; its length is the sine of the angle to the line of sight.

    hips, skull: world points [3]. NaN where the head is behind the camera.
    """
    ends = (np.stack([hips, skull]) - camera.centre) @ camera.rotation.T
    along, middle = ends[1] - ends[0], ends.mean(0)
    # The hips of people before a webcam may lie behind it.
    at = middle if middle[2] > _NEAR_M else ends[1]
    if at[2] <= _NEAR_M:
        return np.full(2, np.nan, np.float32)
    across = along - at * (along @ at) / (at @ at)
    in_image = along[:2] - at[:2] / at[2] * along[2]
    length = np.linalg.norm(across) / np.linalg.norm(along)
    return (in_image * length / max(float(np.linalg.norm(in_image)), 1e-9)).astype(np.float32)


class Studio:
    """Everything one process needs to draw images of one split and size."""

    def __init__(
        self, split: str, width: int, height: int, places: Path, points: bool, bare: bool = False,
        variety: Variety = CLOSE,
    ) -> None:  # fmt: skip
        self.split, self.width, self.height, self.variety = split, width, height, variety
        self.body = Body()
        atlas = Atlas(self.body)
        self.model = Model(self.body, atlas)
        self.landmarks = Landmarks(self.body)
        backgrounds = places / "backgrounds" / split
        files = sorted(backgrounds.glob("*.jpg"))
        if not files:
            raise FileNotFoundError(f"no photos in {backgrounds}: run `python -m export.photos backgrounds` first")
        self.panoramas = load_panoramas(places / "panoramas" / split)
        self.photos = [_shrunk(cv2.imread(str(f))) for f in files]
        self.fabrics = Fabrics(split, self.photos, bare)
        skin = cv2.resize(cv2.imread(str(assets.skin_texture())), (1024, 1024), interpolation=cv2.INTER_AREA)
        self.renderer = Renderer(self.model, LabelLookup(atlas), skin[..., ::-1], width, height)
        self.points = points
        self.shape = lru_cache(maxsize=128)(self._shape)
        self.director = Director(
            self.model, self.fabrics, load_clips(split), load_photo_poses(split), self.shape, BODIES[split],
            (width, height), variety, load_animals(split) if variety.animals_alone else (),
        )  # fmt: skip

    def _shape(self, number: int) -> Shape:
        """Body `number` of this split: the same phenotype whenever it is asked for."""
        return self.body.shape(sample_phenotype(np.random.default_rng([SPLITS[self.split], number])))

    def sample(self, rng: np.random.Generator) -> Sample:
        stage = self.director.stage(rng)
        if not stage.indoors and rng.random() < PANORAMA_FRACTION:
            panorama, yaw = self.panoramas[rng.integers(len(self.panoramas))], rng.uniform(0, 2 * np.pi)
            exposure = panorama.exposure(rng.uniform(0.35, 1.1))
            behind = panorama.seen(stage.camera, yaw, exposure)
            light = panorama.light(stage.camera, yaw, exposure, rng)
        else:
            behind = self._background_behind(rng, stage.roll_degrees)
            light = photo_light(rng, stage.camera, behind, stage.indoors)
        picture = self.renderer.draw(stage.people, stage.camera, light, rng, stage.props)
        image = composed(rng, picture, behind)
        label, point = picture.label, picture.point
        keypoint = [self.landmarks.projected(p.vertices, stage.camera) for p in stage.people]
        if rng.random() < 0.14:
            image, label = self._occluder(rng, image, label)
        if rng.random() < 0.35:
            source = lens_map(rng, self.width, self.height)
            image = through_lens(image, source, labels=False)
            label, point = (through_lens(a, source, labels=True) for a in (label, point))
            keypoint = [points_through_lens(at, source) for at in keypoint]
        keypoint = [self.landmarks.seen(at, k, label, point) for k, at in enumerate(keypoint, 1)]
        point = np.where(label[..., 3:] > 0, point, 0) if self.points else None
        ends = [[p.vertices[at].mean(0) for at in (self.model.buttocks, self.model.skull)] for p in stage.people]
        axis = np.array([body_axis(*pair, stage.camera) for pair in ends], np.float32).reshape(-1, 2)
        keypoint = np.array(keypoint, np.float32).reshape(-1, COUNT, 3)
        return Sample(camera_faults(rng, image), label, point, axis, keypoint)

    def _background_behind(self, rng: np.random.Generator, roll_degrees: float) -> np.ndarray:
        """A photo behind people; most of the time it is tilted with them, as by a camera that is held so."""
        if not roll_degrees or rng.random() < TILTED_PEOPLE:
            return self._background(rng, self.width, self.height)
        side = int(np.ceil(np.hypot(self.width, self.height)))
        photo = self._background(rng, side, side)
        matrix = cv2.getRotationMatrix2D(((side - 1) / 2, (side - 1) / 2), -roll_degrees, 1.0)
        matrix[:, 2] -= [(side - self.width) / 2, (side - self.height) / 2]
        return cv2.warpAffine(photo, matrix, (self.width, self.height))

    def _background(self, rng: np.random.Generator, width: int, height: int) -> np.ndarray:
        if rng.random() < 0.05:
            return np.full((height, width, 3), rng.integers(0, 256, 3), np.float32)
        photo = self.photos[rng.integers(len(self.photos))]
        full = min(photo.shape[1] / width, photo.shape[0] / height)
        scale = full * rng.uniform(0.3, 1)
        w, h = int(width * scale), int(height * scale)
        x, y = rng.integers(0, photo.shape[1] - w + 1), rng.integers(0, photo.shape[0] - h + 1)
        crop = photo[y : y + h, x : x + w]
        crop = cv2.resize(crop, (width, height), interpolation=cv2.INTER_AREA if scale > 1 else cv2.INTER_LINEAR)
        if rng.random() < 0.5:
            crop = crop[:, ::-1]
        if rng.random() < 0.3:
            crop = cv2.GaussianBlur(crop, (0, 0), rng.uniform(0.5, 4))
        return crop.astype(np.float32)

    def _occluder(self, rng: np.random.Generator, image: np.ndarray, label: np.ndarray):
        """Something flat in front: a polygon or ellipse cut out of another photo."""
        height, width = image.shape[:2]
        mask = np.zeros((height, width), np.float32)
        x, y = rng.uniform(0, width), rng.uniform(height * 0.4, height * 1.1)
        size = rng.uniform(0.1, 0.5, 2) * height
        if rng.random() < 0.4:
            points = cv2.boxPoints(((x, y), tuple(size), rng.uniform(0, 40))).astype(np.int32)
            cv2.fillPoly(mask, [points], 1.0, lineType=cv2.LINE_AA)
        elif rng.random() < 0.5:
            points = (np.array([x, y]) + rng.normal(0, 0.15 * height, (7, 2))).astype(np.int32)
            cv2.fillPoly(mask, [cv2.convexHull(points)[:, 0]], 1.0, lineType=cv2.LINE_AA)
        else:
            cv2.ellipse(mask, ((x, y), tuple(size), rng.uniform(0, 180)), 1.0, -1, lineType=cv2.LINE_AA)
        label = np.where(mask[..., None] > 0.5, 0, label).astype(np.uint8)
        front = self._background(rng, width, height)
        return image * (1 - mask[..., None]) + front * mask[..., None], label


def _shrunk(photo: np.ndarray) -> np.ndarray:
    scale = min(640 / min(photo.shape[:2]), 1)
    return cv2.resize(photo, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)


def photo_light(rng: np.random.Generator, camera: Camera, photo: np.ndarray, indoors: bool) -> Light:
    """Sky, ground, a key light and a weaker one; most of the time with the photo's colours, brightness and bright side.

    photo: BGR float32 [H, W, 3].
    """
    u = rng.uniform
    up = camera.rotation @ [0, 0, 1.0]
    key = np.array([rng.normal(0, 1), -abs(rng.normal(0.6, 0.6)), -abs(rng.normal(0.7, 0.5))])
    sky, ground, sun = (1 + rng.normal(0, spread, 3) for spread in (0.08, 0.08, 0.06))
    brightness = 1.0
    if rng.random() < 0.7 and not indoors:
        height, width = photo.shape[:2]
        rgb = photo[..., ::-1] / 255 + 0.02
        above, below = rgb[: height // 2].mean((0, 1)), rgb[height // 2 :].mean((0, 1))
        sky, ground = (own * (c / c.mean()) ** 0.6 for own, c in ((sky, above), (ground, below)))
        brightness = float(np.clip((rgb.mean() / 0.45) ** 0.6, 0.55, 1.4))
        if rgb[:, : width // 2].mean() > rgb[:, width // 2 :].mean():
            key[0] = -abs(key[0])
        else:
            key[0] = abs(key[0])
    directions = np.stack([key, rng.normal(0, 1, 3)])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    colours = np.stack([sun * u(0.25, 1.1), u(0, 0.4) * (1 + rng.normal(0, 0.15, 3))])
    shadow = u(0.4, 1) if u() < 0.75 else 0.0
    return Light(
        up,
        brightness * u(0.25, 0.75) * sky,
        brightness * u(0.15, 0.6) * ground,
        directions,
        brightness * colours,
        shadow=shadow,
        softness=u(0.002, 0.03),
        catcher=0.0 if indoors or not shadow else u(0.15, 0.6),
        occlusion=u(0.15, 0.6) if u() < 0.85 else 0.0,
    )


def composed(rng: np.random.Generator, picture: Picture, behind: np.ndarray) -> np.ndarray:
    """The image over the photo `behind`: BGR float32 [H, W, 3]."""
    alpha, colour = picture.alpha, picture.rgb[..., ::-1]
    if rng.random() < 0.5:
        # Haze, lens and film give a photo one range of tones, of which people in it have their part.
        share = rng.uniform(0.2, 0.75)
        low, high = np.quantile(behind[::4, ::4].reshape(-1, 3), (0.01, 0.99), axis=0)
        high = np.maximum(high, low + 110)
        low, high = share * low, 255 * (1 - share) + share * high
        colour = alpha[..., None] * low + colour * (high - low) / 255
    if rng.random() < 0.3:
        soft = cv2.GaussianBlur(alpha, (0, 0), rng.uniform(0.4, 0.9))
        # Colours were averaged with black where a person ends: that is premultiplied alpha.
        shown = np.minimum(alpha, soft)
        colour = colour * np.where(alpha > 0, shown / np.maximum(alpha, 1e-3), 0)[..., None]
        alpha = shown
    return (behind * (1 - alpha[..., None]) + colour).astype(np.float32)
