"""The place behind the people of a clip, the light from it, and the response of the camera, the same in all frames."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from export.camera import Camera
from export.people.clips.camera_path import CameraPath
from export.people.panoramas import Panorama
from export.people.props import Prop
from export.people.render import Light
from export.people.scene import Studio, photo_light

KINDS = {"room": 0.4, "photo": 0.4, "panorama": 0.2}
_FAR_M = 9.6  # wall of a room, behind everybody


@dataclass(frozen=True, eq=False)
class Backdrop:
    """photo: BGR float32, as far away as the sky, or None; panorama with its yaw and exposure, or None. light: in the
    axes of the first camera."""

    kind: str
    props: list[Prop]
    light: Light
    first: Camera
    photo: np.ndarray | None = None
    widest: float = 1.0
    panorama: Panorama | None = None
    yaw: float = 0.0
    exposure: float = 1.0

    def behind(self, camera: Camera) -> np.ndarray:
        """The camera's view behind the people: float32 [H, W, 3] BGR."""
        if self.panorama is not None:
            return self.panorama.seen(camera, self.yaw, self.exposure)
        if self.photo is None:
            return np.zeros((camera.height_px, camera.width_px, 3), np.float32)
        return seen_photo(self.photo, camera, self.first, self.widest)

    def light_for(self, camera: Camera) -> Light:
        """The same light in the axes of another camera."""
        turn = camera.rotation @ self.first.rotation.T
        return replace(self.light, up=turn @ self.light.up, directions=self.light.directions @ turn.T)


def seen_photo(photo: np.ndarray, camera: Camera, middle: Camera, widest: float) -> np.ndarray:
    """A photo so far away that turning the camera moves it and shifting it does not.

    middle: looks at the photo's middle; the photo reaches to `widest` (a tangent) on both sides and is mirrored beyond.
    """
    height, width = photo.shape[:2]
    focal = min(width / 2 / widest, height / 2 / (widest * camera.height_px / camera.width_px))
    from_photo = np.array([[focal, 0, (width - 1) / 2], [0, focal, (height - 1) / 2], [0, 0, 1]])
    to_photo = from_photo @ middle.rotation @ camera.rotation.T @ np.linalg.inv(camera.intrinsics)
    size = (camera.width_px, camera.height_px)
    how = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return cv2.warpPerspective(photo, to_photo, size, flags=how, borderMode=cv2.BORDER_REFLECT_101).astype(np.float32)


def draw_backdrop(rng: np.random.Generator, studio: Studio, path: CameraPath) -> Backdrop:
    """A room, a photo of the split or a panorama of the split."""
    kind = str(rng.choice(list(KINDS), p=list(KINDS.values())))
    first = path.cameras[0]
    if kind == "panorama":
        panorama, yaw = studio.panoramas[rng.integers(len(studio.panoramas))], rng.uniform(0, 2 * np.pi)
        exposure = panorama.exposure(rng.uniform(0.45, 1.0))
        light = panorama.light(first, yaw, exposure, rng)
        return Backdrop(kind, [], light, first, panorama=panorama, yaw=yaw, exposure=exposure)
    photo = studio.photos[rng.integers(len(studio.photos))].astype(np.float32)
    if rng.random() < 0.5:
        photo = photo[:, ::-1]
    if rng.random() < 0.4:
        photo = cv2.GaussianBlur(photo, (0, 0), rng.uniform(0.5, 2.5))
    photo = np.ascontiguousarray(photo)
    if kind == "room":
        light = photo_light(rng, first, photo, indoors=True)
        return Backdrop(kind, studio.director.maker.room(rng, first.centre, _FAR_M), light, first)
    seen = seen_photo(photo, first, first, path.widest)
    return Backdrop(kind, [], photo_light(rng, first, seen, indoors=False), first, photo, path.widest)


@dataclass(frozen=True)
class Response:
    """A camera's exposure, tone curve, colours, focus and noise, which do not change in a clip. brightness: mean of the
    first frame that automatic exposure goes towards, by the share `automatic`."""

    brightness: float
    automatic: float
    gamma: float
    contrast: float
    colours: tuple[float, float, float]
    blur_px: float
    noise: float

    @staticmethod
    def drawn(rng: np.random.Generator) -> Response:
        u = rng.uniform
        colours = tuple(map(float, 1 + rng.normal(0, 0.04, 3)))
        blur = u(0.3, 1.0) if u() < 0.4 else 0.0
        return Response(u(85, 140), u(0.4, 0.9), u(0.85, 1.2), u(0.8, 1.1), colours, blur, u(0.5, 6))

    def gain_for(self, first: np.ndarray) -> float:
        return float(np.clip((self.brightness / max(float(first.mean()), 1)) ** self.automatic, 0.6, 2.5))

    def of(self, image: np.ndarray, gain: float, rng: np.random.Generator) -> np.ndarray:
        """BGR float -> uint8; rng: the noise of this frame."""
        if self.blur_px:
            image = cv2.GaussianBlur(image, (0, 0), self.blur_px)
        image = 255 * np.clip(image * gain / 255, 0, 1) ** self.gamma
        image = ((image - 128) * self.contrast + 128) * np.array(self.colours, np.float32)
        noise = rng.standard_normal(image.shape, np.float32) * np.float32(self.noise)
        return np.clip(image + noise, 0, 255).astype(np.uint8)
