"""Faces in photographs: found by MediaPipe's short-range face detector (BlazeFace), 468 points each by its face
landmark model (both Apache-2.0).

The landmark network says nothing about single points. How far they move when it is shown the same face in slightly
other squares does.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from export.teachers.models import model_file

POINTS = 468
SIDE, DETECTOR_SIDE = 192, 128
RIGHT_EYE, LEFT_EYE = 33, 263  # outer corners; the person's right is on the image's left
_PACKAGE, _MODELS = "mediapipe-faces", "mediapipe/modules/"
_MARGIN = 1.5  # of the square looked at, in longer sides of the face's box
_MIN_SCORE, _MIN_PRESENCE = 0.5, 0.5
_SAME_FACE_IOU = 0.3
_TILES_PX = (1.0, 0.6, 0.38)  # sides of the windows that the detector is shown, in short sides of the photo
_MIN_TILE_PX = 160
# Other looks at a face: size, shift to the right and down (in sides of the square), turn (radians).
_LOOKS = ((1.0, 0.0, 0.0, 0.0), (0.9, 0.02, 0.0, 0.1), (1.1, -0.02, 0.02, -0.1), (1.05, 0.02, -0.03, 0.05),
          (0.95, -0.03, -0.02, -0.05))  # fmt: skip


@dataclass(frozen=True)
class Square:
    """A turned square of a photo: centre [2] px, side px, turn (radians) of its down axis against the photo's.

    Points are of pixels' centres: (0, 0) is the middle of the first pixel.
    """

    centre: np.ndarray
    size: float
    turn: float

    def linear(self) -> np.ndarray:
        cos, sin = np.cos(self.turn), np.sin(self.turn)
        return self.size * np.array([[cos, -sin], [sin, cos]])

    def to_photo(self, shares: np.ndarray) -> np.ndarray:
        """shares [N, 2], 0..1 of the square -> pixels of the photo [N, 2]."""
        return (shares - 0.5) @ self.linear().T + self.centre

    def cut(self, image: np.ndarray, side: int) -> np.ndarray:
        """The square as image [side, side, C]; grey outside of the photo. Shrunk by areas: not in one step."""
        linear = self.linear() / side
        reduce = max(1, int(self.size / side))  # whole steps by area first, so that nothing is skipped
        middle = self.centre + linear @ np.full(2, 0.5 - side / 2)
        if reduce > 1:
            small = cv2.resize(
                image, (max(1, image.shape[1] // reduce), max(1, image.shape[0] // reduce)),
                interpolation=cv2.INTER_AREA,
            )  # fmt: skip
            scale = np.array([small.shape[1] / image.shape[1], small.shape[0] / image.shape[0]])
            linear, middle, image = scale[:, None] * linear, scale * (middle + 0.5) - 0.5, small
        matrix = np.concatenate([linear, middle[:, None]], 1)
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        return cv2.warpAffine(image, matrix, (side, side), flags=flags, borderValue=(127, 127, 127))


@dataclass(frozen=True)
class Face:
    """point: float64 [468, 2] pixels of the photo. depth: [468], same scale, smaller is nearer. spread: [468] pixels,
    how far the point moves between looks. presence: probability that there is a face."""

    point: np.ndarray
    depth: np.ndarray
    spread: np.ndarray
    presence: float

    @property
    def box(self) -> np.ndarray:
        """x0, y0, x1, y1."""
        return np.concatenate([self.point.min(0), self.point.max(0)])

    @property
    def size(self) -> float:
        """The longer side of its box, pixels."""
        return float((self.box[2:] - self.box[:2]).max())


def square_around(point: np.ndarray, right: np.ndarray, left: np.ndarray) -> Square:
    """The square that the landmark network wants to see: upright by the eyes, with a margin around the points."""
    along = left - right
    turn = float(np.arctan2(along[1], along[0]))
    axes = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    turned = point @ axes
    low, high = turned.min(0), turned.max(0)
    return Square(axes @ ((low + high) / 2), _MARGIN * float((high - low).max()), turn)


class FaceDetector:
    """Boxes with six places: both eyes, tip of the nose, mouth, both ears' tragus."""

    def __init__(self, threads: int = 1) -> None:
        self._net = _interpreter("face_detection/face_detection_short_range.tflite", threads)
        self._input = self._net.get_input_details()[0]["index"]
        self._outputs = {d["name"]: d["index"] for d in self._net.get_output_details()}
        grids = [(16, 2), (8, 6)]  # cells a side, anchors a cell
        middles = [(np.arange(n) + 0.5) / n for n, _ in grids]
        cells = [
            np.repeat(np.stack(np.meshgrid(m, m), -1).reshape(-1, 2), each, 0)
            for m, (_, each) in zip(middles, grids, strict=True)
        ]
        self._anchors = np.concatenate(cells)  # [896, 2] shares

    def squares(self, image: np.ndarray) -> list[Square]:
        """image: uint8 [H, W, 3] BGR. Where the landmark network should look, best first."""
        boxes, places, scores = [], [], []
        for window in windows(image.shape[:2]):
            box, place, score = self._look(image, window)
            boxes.append(box)
            places.append(place)
            scores.append(score)
        box, place, score = (np.concatenate(parts) for parts in (boxes, places, scores))
        sides = np.concatenate([box[:, :2], box[:, 2:] - box[:, :2]], 1)
        keep = np.array(cv2.dnn.NMSBoxes(sides.tolist(), score.tolist(), _MIN_SCORE, _SAME_FACE_IOU), int).reshape(-1)
        corners = box[:, [0, 1, 2, 1, 0, 3, 2, 3]].reshape(-1, 4, 2)
        return [square_around(corners[k], place[k, 0], place[k, 1]) for k in keep[np.argsort(-score[keep])]]

    def _look(self, image: np.ndarray, window: Square) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Boxes [N, 4] and places [N, 6, 2] in pixels of the photo, scores [N]."""
        crop = window.cut(image, DETECTOR_SIDE)[..., ::-1].astype(np.float32)
        self._net.set_tensor(self._input, crop[None] / 127.5 - 1)
        self._net.invoke()
        rows = self._net.get_tensor(self._outputs["regressors"])[0].reshape(-1, 8, 2) / DETECTOR_SIDE
        score = _sigmoid(self._net.get_tensor(self._outputs["classificators"])[0, :, 0])
        kept = score >= _MIN_SCORE
        rows, anchors = rows[kept], self._anchors[kept]
        middle, half = rows[:, 0] + anchors, rows[:, 1] / 2
        low, high = window.to_photo(middle - half), window.to_photo(middle + half)
        places = window.to_photo((rows[:, 2:] + anchors[:, None]).reshape(-1, 2)).reshape(-1, 6, 2)
        return np.concatenate([low, high], 1), places, score[kept]


def windows(shape: tuple[int, int]) -> list[Square]:
    """Squares that the detector is shown: the whole photo, and smaller ones that overlap by half."""
    height, width = shape
    out = [Square(np.array([width - 1, height - 1]) / 2, float(max(height, width)), 0.0)]
    for share in _TILES_PX:
        side = share * min(height, width)
        if side < _MIN_TILE_PX:
            break
        count = [int(np.ceil((length - side) / (side / 2))) + 1 for length in (width, height)]
        xs, ys = (
            np.linspace(side / 2, length - side / 2, n) - 0.5 for length, n in zip((width, height), count, strict=True)
        )
        out += [Square(np.array([x, y]), side, 0.0) for y in ys for x in xs]
    return out


class FaceNetwork:
    def __init__(self, threads: int = 1) -> None:
        self._net = _interpreter("face_landmark/face_landmark.tflite", threads)
        self._input = self._net.get_input_details()[0]["index"]
        outputs = {int(np.prod(d["shape"])): d["index"] for d in self._net.get_output_details()}
        self._points, self._presence = outputs[3 * POINTS], outputs[1]

    def find(self, image: np.ndarray, start: Square, passes: int = 2) -> Face | None:
        """image: uint8 [H, W, 3] BGR. Each pass looks at the square that the pass before it asks for, the last one at
        several like it. None where no face is seen."""
        square = start
        for _ in range(passes):
            point, _, presence = self._look(image, square)
            if presence < _MIN_PRESENCE:
                return None
            square = square_around(point, point[RIGHT_EYE], point[LEFT_EYE])
        axes = square.linear()
        looks = [
            self._look(image, Square(square.centre + axes @ [x, y], square.size * size, square.turn + turn))
            for size, x, y, turn in _LOOKS
        ]
        points = np.stack([look[0] for look in looks])
        point = points.mean(0)
        presence = float(np.mean([look[2] for look in looks]))
        if presence < _MIN_PRESENCE:
            return None
        spread = np.sqrt(((points - point) ** 2).sum(-1).mean(0))
        return Face(point, np.mean([look[1] for look in looks], 0), spread, presence)

    def _look(self, image: np.ndarray, square: Square) -> tuple[np.ndarray, np.ndarray, float]:
        """Points [468, 2] and depth [468] in pixels of the photo, presence."""
        crop = square.cut(image, SIDE)[..., ::-1].astype(np.float32) / 255
        self._net.set_tensor(self._input, crop[None])
        self._net.invoke()
        rows = self._net.get_tensor(self._points).reshape(POINTS, 3).astype(np.float64) / SIDE
        presence = float(_sigmoid(self._net.get_tensor(self._presence).reshape(-1)[0]))
        return square.to_photo(rows[:, :2]), rows[:, 2] * square.size, presence


def faces_of(
    detector: FaceDetector, network: FaceNetwork, image: np.ndarray, more: list[Square] | None = None
) -> list[Face]:
    """Every face of the photo once, largest first. `more`: further squares to look at."""
    found = [network.find(image, square) for square in detector.squares(image) + (more or [])]
    faces = sorted((face for face in found if face is not None), key=lambda face: -face.presence)
    kept: list[Face] = []
    for face in faces:
        if all(_iou(face.box, other.box) < _SAME_FACE_IOU for other in kept):
            kept.append(face)
    return sorted(kept, key=lambda face: -face.size)


def _iou(a: np.ndarray, b: np.ndarray) -> float:
    shared = np.clip(np.minimum(a[2:], b[2:]) - np.maximum(a[:2], b[:2]), 0, None).prod()
    return float(shared / ((a[2:] - a[:2]).prod() + (b[2:] - b[:2]).prod() - shared))


def _interpreter(model: str, threads: int):
    from ai_edge_litert.interpreter import Interpreter  # extra `teachers`: only those who label need it

    net = Interpreter(str(model_file(_PACKAGE, _MODELS + model)), num_threads=threads)
    net.allocate_tensors()
    return net


def _sigmoid(x: np.ndarray) -> np.ndarray:
    return 1 / (1 + np.exp(-np.clip(x, -30, 30)))
