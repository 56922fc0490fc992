"""Input of a training step: a crop of a photo, the source photos, and their cloud."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
import torch
from torch import Tensor
from torchvision.transforms import functional as colour

from export.camera import Camera
from export.scenes.captures import Capture
from export.scenes.fitting import Options, Sources, gathered, seen_in
from export.scenes.geometry.cameras import upright, warped
from export.scenes.geometry.source_views import drawn

SCORED_POINTS = 512  # of the cloud, enough to tell which photos see the same


@dataclass(frozen=True, eq=False)
class Sample:
    """camera: of the crop, upright. target: RGB float32 [3, S, S]; mask [1, S, S] is 1 where the photo is. sources: the
    photos, and what they see of the crop."""

    camera: Camera
    target: Tensor
    mask: Tensor
    sources: Sources
    options: Options


@dataclass(frozen=True)
class Sampling:
    """crop_px: side of the crops, a multiple of 32. sources: photos a crop is made from, at least and at most; the
    paper has 3. margin_px: the extractor sees of a photo a square so much wider than the crop. long_side_px: larger
    photos are made smaller. jitter: how often colours are changed, the same for all photos of a sample. unseen: how
    often the target is a held-out photo, which the cloud was not made from."""

    crop_px: int = 256
    sources: tuple[int, int] = (3, 3)
    margin_px: int = 64
    long_side_px: int = 640
    jitter: float = 0.8
    unseen: float = 0.75


def draw_sample(captures: Sequence[Capture], sampling: Sampling, rng: np.random.Generator) -> Sample:
    """Depends on the generator alone. Raises CaptureError where a photo cannot be decoded."""
    capture = captures[rng.integers(len(captures))]
    places = capture.cloud.positions
    unseen = sorted(capture.held_out) if rng.random() < sampling.unseen else []
    target = int(rng.choice(unseen or len(capture.cameras)))
    scored = places[rng.integers(len(places), size=min(SCORED_POINTS, len(places)))]
    count = int(rng.integers(sampling.sources[0], sampling.sources[1] + 1))
    chosen = drawn(target, capture.cameras, capture.sources(), scored, count, rng)
    change = _jitter(rng) if rng.random() < sampling.jitter else lambda image: image
    views = [capture.view(k, sampling.long_side_px) for k in (target, *chosen)]
    views = [replace(view, image=change(view.image)) for view in views]
    photo = views[0]
    rotated = upright(photo.camera, np.asarray(capture.up), 1)
    # Anywhere inside, or in the middle where the photo is smaller than a crop.
    free = np.array([rotated.width_px, rotated.height_px]) - sampling.crop_px
    left, top = (int(rng.integers(room + 1)) if room > 0 else room // 2 for room in free)
    camera = rotated.reframed(left, top, sampling.crop_px, sampling.crop_px)
    there = np.ones(photo.image.shape[:2], np.float32)
    mask = warped(there, photo.camera, camera, cv2.BORDER_CONSTANT) > 0.999
    crop = warped(photo.image, photo.camera, camera)
    points, options = torch.from_numpy(places), Options(up=capture.up)
    seen = [_seen(capture, k, points, view.camera, options) for k, view in zip(chosen, views[1:], strict=True)]
    sources = gathered(points, views[1:], options, camera, sampling.crop_px + sampling.margin_px, seen)
    return Sample(
        camera, torch.from_numpy(crop).permute(2, 0, 1), torch.from_numpy(mask)[None].float(), sources, options
    )


def _seen(capture: Capture, k: int, points: Tensor, camera: Camera, options: Options) -> Tensor:
    """Which points photo k sees. It is the same each time the photo is drawn, so it is kept, a bit a point."""
    key = (k, camera.width_px)
    if key not in capture.seen:
        capture.seen[key] = np.packbits(seen_in(points, camera, options).numpy())
    return torch.from_numpy(np.unpackbits(capture.seen[key], count=len(points)).astype(bool))


def _jitter(rng: np.random.Generator) -> Callable[[np.ndarray], np.ndarray]:
    """A change of brightness, saturation and hue by the paper's amounts."""
    brightness, saturation, hue = 1 + 0.1 * rng.uniform(-1, 1), 1 + 0.5 * rng.uniform(-1, 1), 0.5 * rng.uniform(-1, 1)

    def change(image: np.ndarray) -> np.ndarray:
        picture = torch.from_numpy(image).permute(2, 0, 1)
        picture = colour.adjust_saturation(colour.adjust_brightness(picture, brightness), saturation)
        return np.ascontiguousarray(colour.adjust_hue(picture, hue).permute(1, 2, 0).numpy())

    return change
