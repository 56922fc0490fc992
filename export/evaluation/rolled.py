"""Labelled images turned in their plane, to see what a tilted camera or a leaning person costs."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from export.densepose.data import MEAN
from export.densepose.person_crop import rotation
from export.shards import LabelledImage, visible_boxes


def rolled(image: LabelledImage, degrees: float) -> LabelledImage:
    """The image turned clockwise about its middle, on a square as wide as its diagonal, so that nothing is cut off.

    At 0 degrees it is the same image on the same square: what another angle is to be compared with. Boxes are those
    of the turned outlines; people whom the turn leaves without a pixel are gone.
    """
    height, width = image.label.shape[:2]
    side = int(np.ceil(np.hypot(height, width)))
    turn = rotation(degrees)
    middle = np.array([width - 1, height - 1]) / 2
    into = np.concatenate([turn, ((side - 1) / 2 - turn @ middle)[:, None]], 1)

    def turned(plane: np.ndarray, flags: int, fill: tuple[float, ...] = ()) -> np.ndarray:
        return cv2.warpAffine(plane, into, (side, side), flags=flags, borderValue=fill or 0)

    label = turned(image.label, cv2.INTER_NEAREST)
    box, instance, _ = visible_boxes(label)
    known = dict(zip(image.instance.tolist(), image.ignore.tolist(), strict=True))
    return replace(
        image,
        image=turned(image.image, cv2.INTER_LINEAR, tuple(MEAN.tolist())),
        label=label,
        point=None if image.point is None else turned(image.point, cv2.INTER_NEAREST),
        box=box,
        instance=instance,
        ignore=np.array([known.get(int(number), True) for number in instance], bool),
        axis=None if image.axis is None else _axes(image, instance) @ turn.T.astype(np.float32),
    )


def _axes(image: LabelledImage, instance: np.ndarray) -> np.ndarray:
    """Axes of these instance numbers [n] in their order, float32 [n, 2]; NaN where unknown."""
    known = dict(zip(image.instance.tolist(), image.axis, strict=True))
    return np.array([known.get(int(number), [np.nan, np.nan]) for number in instance], np.float32).reshape(-1, 2)
