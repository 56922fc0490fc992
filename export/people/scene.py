"""Composes one training image: who stands where, the camera, the light, the photo behind, the camera's faults."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from export.people import assets
from export.people.atlas import Atlas
from export.people.body import Body, Shape, sample_phenotype
from export.people.lookup import LabelLookup
from export.people.motion import clip_pose, drawn_pose, load_clips, posed
from export.people.render import Camera, Light, Person, Renderer
from export.people.wardrobe import Fabrics, Model, dress

SPLITS = {"train": 0, "val": 1, "test": 2}
BODIES = {"train": 400, "val": 60, "test": 60}
PEOPLE_SHARE = (0.12, 0.4, 0.22, 0.11, 0.06, 0.04, 0.03, 0.02)  # images with 0, 1, 2, … 7 people
# Framing: (share, centre of view in body heights, visible height in body heights: low, high)
FRAMINGS = (
    (0.34, 0.5, 1.05, 1.7),
    (0.14, 0.66, 0.75, 0.95),
    (0.2, 0.78, 0.45, 0.65),
    (0.12, 0.9, 0.28, 0.4),
    (0.2, 0.5, 1.8, 4.5),
)


@dataclass(frozen=True)
class Sample:
    """image uint8 [H, W, 3] BGR; label uint8 [H, W, 4] = (I, U*255, V*255, instance); point float32 [H, W, 3]."""

    image: np.ndarray
    label: np.ndarray
    point: np.ndarray | None


class Studio:
    """Everything one process needs to draw images of one split and size."""

    def __init__(self, split: str, width: int, height: int, backgrounds: Path, points: bool) -> None:
        self.split, self.width, self.height = split, width, height
        self.body = Body()
        atlas = Atlas(self.body)
        self.model = Model(self.body, atlas)
        self.clips = load_clips(split)
        files = sorted((backgrounds / split).glob("*.jpg"))
        if not files:
            raise FileNotFoundError(
                f"no photos in {backgrounds / split}: run `python -m export.photos backgrounds` first"
            )
        self.photos = [_shrunk(cv2.imread(str(f))) for f in files]
        self.fabrics = Fabrics(split, self.photos)
        skin = cv2.resize(cv2.imread(str(assets.skin_texture())), (1024, 1024), interpolation=cv2.INTER_AREA)
        self.renderer = Renderer(self.model, LabelLookup(atlas), skin[..., ::-1], width, height)
        self.points = points
        self.shape = lru_cache(maxsize=128)(self._shape)

    def _shape(self, number: int) -> Shape:
        """Body `number` of this split: the same phenotype whenever it is asked for."""
        return self.body.shape(sample_phenotype(np.random.default_rng([SPLITS[self.split], number])))

    def sample(self, rng: np.random.Generator) -> Sample:
        count = int(rng.choice(len(PEOPLE_SHARE), p=PEOPLE_SHARE))
        image = self._background(rng, self.width, self.height)
        people, camera = self._people(rng, count)
        picture = self.renderer.draw(people, camera, _light(rng, camera), rng)
        label, point = picture.label, picture.point if self.points else None
        alpha = picture.alpha
        if rng.random() < 0.3:
            soft = cv2.GaussianBlur(alpha, (0, 0), rng.uniform(0.4, 0.9))
            alpha = np.minimum(alpha, soft)
        # Colours were averaged with black where a person ends: that is premultiplied alpha.
        scale = np.where(picture.alpha > 0, alpha / np.maximum(picture.alpha, 1e-3), 0)[..., None]
        image = image * (1 - alpha[..., None]) + picture.rgb[..., ::-1] * scale
        if rng.random() < 0.2:
            image, label = self._occluder(rng, image, label)
        if point is not None:
            point = np.where(label[..., 3:] > 0, point, 0)
        return Sample(_camera_faults(rng, image), label, point)

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

    def _person(self, rng: np.random.Generator) -> Person:
        """A dressed person at the origin, feet (or whatever is lowest) on z = 0."""
        shape = self.shape(int(rng.integers(BODIES[self.split])))
        pose = clip_pose(rng, self.clips) if rng.random() < 0.55 else drawn_pose(rng)
        vertices = posed(self.body, shape, pose, rng)
        yaw = np.radians(rng.normal(0, 40) if rng.random() < 0.6 else rng.uniform(-180, 180))
        vertices = vertices @ Rotation.from_euler("z", yaw).as_matrix().T
        body = vertices[self.body.groups["body"]]
        vertices -= [*body[:, :2].mean(0), body[:, 2].min()]
        return Person(vertices, dress(self.model, self.fabrics, rng))

    def _people(self, rng: np.random.Generator, count: int) -> tuple[list[Person], Camera]:
        """The first person is framed; the others stand around on the same ground."""
        u = rng.uniform
        people = [self._person(rng) for _ in range(count)]
        tall = float(people[0].vertices[self.body.groups["body"], 2].max()) if people else 1.7
        kind = rng.choice(len(FRAMINGS), p=[f[0] for f in FRAMINGS])
        _, middle, low, high = FRAMINGS[kind]
        visible = tall * u(low, high)
        field_of_view = np.radians(u(28, 68))
        distance = max(visible / (2 * np.tan(field_of_view / 2)), 0.6)
        focal = self.height / (2 * np.tan(field_of_view / 2))
        pitch, roll = np.radians(rng.normal(5, 9)), np.radians(rng.normal(0, 4) if u() < 0.9 else u(-50, 50))
        # Camera axes in the world before pitch and roll: x right, y down (-z), z forward (+y).
        look = np.array([[1, 0, 0], [0, 0, -1], [0, 1.0, 0]])
        rotation = Rotation.from_euler("xz", [pitch, roll]).as_matrix() @ look
        aspect = self.width / self.height
        target = np.array(
            [
                u(-0.35, 0.35) * visible * aspect * min(1, visible / tall),
                0,
                middle * tall + u(-0.08, 0.08) * visible,
            ]
        )
        eye = target - distance * rotation[2]
        camera = Camera(self.width, self.height, focal, np.concatenate([rotation, -(rotation @ eye)[:, None]], 1))
        taken = [np.zeros(2)]
        placed = people[:1]
        for person in people[1:]:
            for _ in range(20):
                depth = distance * u(0.75, 2.5) if u() < 0.6 else distance + u(-0.4, 0.8)
                spot = (
                    eye
                    + depth * rotation[2]
                    + u(-0.6, 0.6) * depth * aspect * np.tan(field_of_view / 2) * 2 * rotation[0]
                )
                if depth > 0.9 and min(np.linalg.norm(spot[:2] - t) for t in taken) > 0.4:
                    taken.append(spot[:2])
                    placed.append(Person(person.vertices + [spot[0], spot[1], 0], person.layers))
                    break
        return placed, camera

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


def _light(rng: np.random.Generator, camera: Camera) -> Light:
    up = camera.world_to_camera[:, :3] @ [0, 0, 1.0]
    key = np.array([rng.normal(0, 1), -abs(rng.normal(0.6, 0.6)), -abs(rng.normal(0.7, 0.5))])
    directions = np.stack([key, rng.normal(0, 1, 3)])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)

    def tinted(strength: float, spread: float) -> np.ndarray:
        return strength * (1 + rng.normal(0, spread, 3))

    colours = np.stack([tinted(rng.uniform(0.25, 1.1), 0.06), tinted(rng.uniform(0, 0.4), 0.15)])
    return Light(up, tinted(rng.uniform(0.25, 0.75), 0.08), tinted(rng.uniform(0.15, 0.6), 0.08), directions, colours)


def _camera_faults(rng: np.random.Generator, image: np.ndarray) -> np.ndarray:
    """Exposure, tone curve, white balance, blur, low resolution, noise and JPEG: BGR float -> uint8."""
    u = rng.uniform
    image = 255 * np.clip(image * u(0.7, 1.2) / 255, 0, 1) ** u(0.8, 1.25)
    image = (image - 128) * u(0.75, 1.15) + 128
    if u() < 0.06:
        image = np.repeat(image.mean(-1, keepdims=True), 3, -1)
    else:
        image = image * (1 + rng.normal(0, 0.05, 3))
    image = image.astype(np.float32)
    if u() < 0.35:
        image = cv2.GaussianBlur(image, (0, 0), u(0.3, 1.2))
    if u() < 0.12:
        height, width = image.shape[:2]
        share = u(0.4, 0.8)
        small = cv2.resize(image, (int(width * share), int(height * share)), interpolation=cv2.INTER_AREA)
        image = cv2.resize(small, (width, height))
    if u() < 0.5:
        image = image + rng.normal(0, u(1, 9), image.shape)
    return np.clip(image, 0, 255).astype(np.uint8)
