"""Images of predictions: parts in colour over the photo, lines of equal U and V, boxes with scores."""

from __future__ import annotations

import colorsys

import cv2
import numpy as np

from export.evaluation.backends import Prediction
from export.surface import PART_COUNT


def _palette() -> np.ndarray:
    """uint8 [25, 3] RGB. Left and right of a limb share a hue; neighbours along the body differ."""
    pairs = {(1,): 0.60, (2,): 0.55, (3, 4): 0.02, (5, 6): 0.12, (7, 8): 0.33, (9, 10): 0.28, (11, 12): 0.47}
    pairs |= {(13, 14): 0.43, (15, 16): 0.75, (17, 18): 0.80, (19, 20): 0.90, (21, 22): 0.95, (23, 24): 0.15}
    right = {3, 6, 7, 9, 11, 13, 16, 18, 20, 22, 23}
    colors = np.zeros((PART_COUNT + 1, 3), np.uint8)
    for parts, hue in pairs.items():
        for part in parts:
            rgb = colorsys.hsv_to_rgb(hue, 0.85, 0.95 if part in right else 0.65)
            colors[part] = np.round(255 * np.array(rgb))
    return colors


PALETTE = _palette()


def paint(image: np.ndarray, prediction: Prediction, opacity: float = 0.6) -> np.ndarray:
    """image: uint8 [H, W, 3] RGB. Returns a new image of the same shape."""
    part = prediction.iuv[..., 0]
    person = part > 0
    picture = image.astype(np.float32)
    picture[person] = (1 - opacity) * picture[person] + opacity * PALETTE[part[person]]
    picture[_contours(prediction.iuv)] *= 0.55
    picture = picture.astype(np.uint8)
    thickness = max(1, round(max(image.shape[:2]) / 320))
    for box, score in zip(prediction.box, prediction.score, strict=True):
        x0, y0, x1, y1 = np.round(box).astype(int).tolist()
        cv2.rectangle(picture, (x0, y0), (x1 - 1, y1 - 1), (255, 255, 255), thickness)
        position = (x0 + 2 * thickness, max(y0, 0) + 12 * thickness)
        cv2.putText(picture, f"{score:.2f}", position, cv2.FONT_HERSHEY_SIMPLEX, 0.4 * thickness,
                    (255, 255, 255), thickness, cv2.LINE_AA)  # fmt: skip
    return picture


def _contours(iuv: np.ndarray, steps: int = 8) -> np.ndarray:
    """bool [H, W]: where U or V passes a multiple of 1/steps between neighbours of the same part."""
    lines = np.zeros(iuv.shape[:2], bool)
    part = iuv[..., 0]
    level = iuv[..., 1:].astype(np.int32) * steps // 256
    for here, there in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
        crossing = (level[here] != level[there]).any(-1)
        lines[here] |= crossing & (part[here] == part[there]) & (part[here] > 0)
    return lines


def labelled_tile(picture: np.ndarray, text: str, width: int, height: int) -> np.ndarray:
    """The image fitted into width x height pixels with a line of text below it."""
    scale = min(width / picture.shape[1], (height - 16) / picture.shape[0])
    fitted = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    tile = np.zeros((height, width, 3), np.uint8)
    tile[: fitted.shape[0], : fitted.shape[1]] = fitted[:height, :width]
    cv2.putText(tile, text, (3, height - 5), cv2.FONT_HERSHEY_SIMPLEX, 0.38, (230, 230, 230), 1, cv2.LINE_AA)
    return tile


def mosaic(tiles: list[np.ndarray], columns: int) -> np.ndarray:
    """Tiles of one size, row by row; empty places stay black."""
    rows = -(-len(tiles) // columns)
    height, width = tiles[0].shape[:2]
    sheet = np.zeros((rows * height, columns * width, 3), np.uint8)
    for k, tile in enumerate(tiles):
        y, x = k // columns * height, k % columns * width
        sheet[y : y + height, x : x + width] = tile
    return sheet
