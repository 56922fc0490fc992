"""21 points of a hand by MediaPipe's hand landmark model ("full", Apache-2.0), looked for where BlazePose says one is.

BlazePose knows a wrist and three knuckles of a hand, often beside it. Where the hand network sees a hand there, its
outline is the label of a hand.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from export.keypoints import NAMES
from export.teachers.label import PhotoLabels
from export.teachers.models import model_file

SIDE = 224
SIDES = {"left": 3, "right": 2}  # and the coarse regions of `export.surface` that hands are
_WRIST, _MIDDLE_KNUCKLE = 0, 9
_FIRST_MARGIN, _MARGIN = 4.0, 2.0  # of the square looked at, in wrist-knuckle distances and in sizes of the hand
_MIN_PRESENCE = 0.8
_MAX_OFF = 1.2  # of BlazePose's knuckles from the hand's middle, in sizes of the hand
_MIN_SIZE_PX = 12
_MIN_VISIBLE = 0.5
_FLESH = 0.09  # of the hand's size: fingers are this much wider than the lines between the points


@dataclass(frozen=True)
class Hand:
    """point: float64 [21, 2] pixels of the image, from the wrist to the tip of the little finger. presence:
    probability that the square looked at shows a hand."""

    point: np.ndarray
    presence: float

    @property
    def size(self) -> float:
        """The longer side of its box, pixels."""
        return float((self.point.max(0) - self.point.min(0)).max())

    def mask(self, shape: tuple[int, int]) -> np.ndarray:
        """bool [H, W]: the palm and the fingers, each as wide as flesh is."""
        out = np.zeros(shape, np.uint8)
        wide = max(1, round(2 * _FLESH * self.size))
        at = np.round(self.point).astype(np.int32)
        palm = at[[0, 1, 5, 9, 13, 17]]
        cv2.fillConvexPoly(out, cv2.convexHull(palm), 1)
        cv2.polylines(out, [palm], True, 1, wide)
        for finger in range(5):
            cv2.polylines(out, [at[1 + 4 * finger : 5 + 4 * finger]], False, 1, wide)
        return out > 0


class HandNetwork:
    def __init__(self, threads: int = 1) -> None:
        from ai_edge_litert.interpreter import Interpreter  # extra `teachers`: only those who label need it

        path = model_file("mediapipe-hands", "package/hand_landmark_full.tflite")
        self._net = Interpreter(str(path), num_threads=threads)
        self._net.allocate_tensors()
        self._input = self._net.get_input_details()[0]["index"]
        outputs = sorted(self._net.get_output_details(), key=lambda d: d["name"])  # points, presence, side, metres
        self._points, self._presence = (d["index"] for d in outputs[:2])

    def find(self, image: np.ndarray, wrist: np.ndarray, knuckles: np.ndarray) -> Hand | None:
        """image: uint8 [H, W, 3] BGR; wrist: [2], knuckles: [2], the middle of index and little finger's, pixels. None
        where no hand is seen. It runs twice: at the end on the square that its first points ask for."""
        along = knuckles - wrist
        centre, size = wrist + along, _FIRST_MARGIN * float(np.linalg.norm(along))
        for _ in range(2):
            if size < _MIN_SIZE_PX:
                return None
            hand = self._look(image, centre, size, along)
            along = hand.point[_MIDDLE_KNUCKLE] - hand.point[_WRIST]
            centre, size = (hand.point.max(0) + hand.point.min(0)) / 2, _MARGIN * hand.size
        far = float(np.linalg.norm(centre - knuckles))
        return hand if hand.presence >= _MIN_PRESENCE and far < _MAX_OFF * hand.size else None

    def _look(self, image: np.ndarray, centre: np.ndarray, size: float, up: np.ndarray) -> Hand:
        """At the square of `size` pixels around `centre`, turned so that `up` [2] is upright."""
        turn = np.arctan2(up[0], -up[1])
        linear = size / SIDE * np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        to_image = np.concatenate([linear, (centre - linear @ [SIDE / 2, SIDE / 2])[:, None]], 1)
        crop = cv2.warpAffine(image, to_image, (SIDE, SIDE), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
        self._net.set_tensor(self._input, crop[None, ..., ::-1].astype(np.float32) / 255)
        self._net.invoke()
        point = self._net.get_tensor(self._points).reshape(21, 3)[:, :2].astype(np.float64)
        return Hand(point @ linear.T + to_image[:, 2], float(self._net.get_tensor(self._presence).reshape(-1)[0]))


def hands_of(network: HandNetwork, image: np.ndarray, labels: PhotoLabels) -> dict[tuple[int, str], Hand]:
    """The hands seen of people with landmarks, by person and "left" or "right"; none where both sides are one hand."""
    out = {}
    for k in np.flatnonzero(labels.sure):
        found = {}
        for side in SIDES:
            wrist, *knuckles = (NAMES.index(f"{side} {n}") for n in ("wrist", "index finger", "little finger"))
            if labels.visible[k, wrist] >= _MIN_VISIBLE:
                point = labels.point[k].astype(np.float64)
                hand = network.find(image, point[wrist], point[knuckles].mean(0))
                if hand is not None:
                    found[side] = hand
        if len(found) == 2:
            left, right = found.values()
            apart = np.linalg.norm(left.point.mean(0) - right.point.mean(0))
            if apart < 0.3 * max(left.size, right.size):
                continue
        out |= {(int(k), side): hand for side, hand in found.items()}
    return out
