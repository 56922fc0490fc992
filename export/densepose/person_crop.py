"""Person crops: one person cut out of the source image, turned upright, at one size.

The trunk's finest map and the dense head go over such a crop in a second pass, for people who are small, tilted or
crowded in the whole image. Coordinates are continuous: pixel (x, y) covers [x, x + 1) x [y, y + 1).
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

CONTEXT = 1.15  # side of the crop over the long side of the person's turned box
UPRIGHT = np.array([0.0, -1.0])


@dataclass(frozen=True)
class PersonCrop:
    """A square crop. into: float64 [2, 3], from the image to the crop; box: float64 [4], the person in the crop."""

    into: np.ndarray
    box: np.ndarray
    side_px: int

    @property
    def back(self) -> np.ndarray:
        """float64 [2, 3], from the crop to the image."""
        return cv2.invertAffineTransform(self.into)


def turn_upright(axis: np.ndarray) -> np.ndarray:
    """The rotation [2, 2] that takes the direction `axis` [2] in the image to upright."""
    x, y = np.asarray(axis, np.float64) / np.linalg.norm(axis)
    return np.array([[-y, x], [-x, -y]])


def rotation(degrees: float) -> np.ndarray:
    """[2, 2]; a positive angle turns what the image shows clockwise."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, -s], [s, c]])


def outline(mask: np.ndarray) -> np.ndarray:
    """Points float64 [K, 2] whose convex hull is that of the mask's pixels [H, W]; none for an empty mask."""
    y = np.flatnonzero(mask.any(1))
    rows = mask[y]
    left, right = rows.argmax(1), mask.shape[1] - rows[:, ::-1].argmax(1)
    corners = [np.stack([x, row], 1) for x in (left, right) for row in (y, y + 1)]
    return np.concatenate(corners).astype(np.float64)


def turned_box(points: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Box float64 [4] around `points` [K, 2] after the rotation `turn` about the image's origin."""
    turned = points @ turn.T
    return np.concatenate([turned.min(0), turned.max(0)])


def crop_around(box: np.ndarray, turn: np.ndarray, side_px: int) -> PersonCrop:
    """The crop with `box`, in turned coordinates as of `turned_box`, in its middle."""
    low, high = box[:2], box[2:]
    scale = side_px / (CONTEXT * max(float((high - low).max()), 1.0))
    shift = side_px / 2 - scale * (low + high) / 2
    into = np.concatenate([scale * turn, shift[:, None]], 1)
    return PersonCrop(into, np.concatenate([scale * low + shift, scale * high + shift]), side_px)


def _between_centres(into: np.ndarray) -> np.ndarray:
    """The map between indices of pixels, whose centres lie half a pixel from their corners."""
    out = into.copy()
    out[:, 2] += into[:, :2] @ [0.5, 0.5] - 0.5
    return out


def cut(image: np.ndarray, crop: PersonCrop, fill: tuple[float, ...]) -> np.ndarray:
    """The crop of an image uint8 [H, W, C]; `fill` where the image has ended. Shrunk pixels are averaged."""
    into, size = crop.into, (crop.side_px, crop.side_px)
    scale = float(np.hypot(*into[:, 0]))
    if scale < 0.8:
        # Only what the crop shows is made smaller, by whole pixels on its upper left so that the map stays exact.
        corners = np.array([[0, 0], [1, 0], [0, 1], [1, 1]]) * crop.side_px
        seen = corners @ crop.back[:, :2].T + crop.back[:, 2]
        x0, y0 = np.clip(np.floor(seen.min(0)).astype(int) - 2, 0, [image.shape[1] - 1, image.shape[0] - 1])
        x1, y1 = np.clip(np.ceil(seen.max(0)).astype(int) + 2, [x0 + 1, y0 + 1], [image.shape[1], image.shape[0]])
        small = (max(round((x1 - x0) * scale), 1), max(round((y1 - y0) * scale), 1))
        image = cv2.resize(image[y0:y1, x0:x1], small, interpolation=cv2.INTER_AREA)
        grown = np.array([(x1 - x0) / small[0], (y1 - y0) / small[1]])
        into = np.concatenate([into[:, :2] * grown, (into[:, :2] @ [x0, y0] + into[:, 2])[:, None]], 1)
    return cv2.warpAffine(image, _between_centres(into), size, flags=cv2.INTER_LINEAR, borderValue=fill)


def cut_label(label: np.ndarray, crop: PersonCrop) -> np.ndarray:
    """The crop of labels uint8 [H, W, C], not mixed; 0 where the image has ended."""
    size = (crop.side_px, crop.side_px)
    return cv2.warpAffine(label, _between_centres(crop.into), size, flags=cv2.INTER_NEAREST)
