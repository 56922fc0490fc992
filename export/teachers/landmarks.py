"""33 landmarks and a mask of one person by BlazePose (MediaPipe pose landmark model "heavy", Apache-2.0)."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from export.teachers.models import model_file

SIDE = 256
_MIDDLE, _TOP = 33, 34  # auxiliary: middle of the hips, and a point above it on the circle around the whole person
_MARGIN = 1.25


@dataclass(frozen=True)
class Landmarks:
    """point: float32 [33, 2] pixels of the image. depth: [33] (same scale, 0 at the hips, negative towards the
    camera). visible: [33] probabilities. world: [33, 3] metres from the middle of the hips, x right, y down, z away.
    presence: probability that the crop shows a person. mask: float32 [H, W], probability of this person, over the
    whole image."""

    point: np.ndarray
    depth: np.ndarray
    visible: np.ndarray
    world: np.ndarray
    presence: float
    mask: np.ndarray


class LandmarkNetwork:
    def __init__(self, threads: int = 1) -> None:
        from ai_edge_litert.interpreter import Interpreter  # extra `teachers`: only those who label need it

        path = model_file("mediapipe-pose", "package/pose_landmark_heavy.tflite")
        self._net = Interpreter(str(path), num_threads=threads)
        self._net.allocate_tensors()
        self._input = self._net.get_input_details()[0]["index"]
        outputs = {tuple(d["shape"][1:]): d["index"] for d in self._net.get_output_details()}
        self._outputs = [outputs[shape] for shape in ((195,), (1,), (SIDE, SIDE, 1), (117,))]

    def find(self, image: np.ndarray, box: np.ndarray, passes: int = 2) -> Landmarks | None:
        """image: uint8 [H, W, 3] BGR; box: x0, y0, x1, y1 in pixels. None where the network sees nobody.

        The first pass looks at the square around the box, each further one at the square that the landmarks of the
        pass before it ask for (upright person, whole body).
        """
        centre, size, turn = (box[:2] + box[2:]) / 2, _MARGIN * float(max(box[2:] - box[:2])), 0.0
        found = None
        for _ in range(passes):
            found, centre, size, turn = self._pass(image, centre, size, turn)
            if found.presence < 0.5:
                return None
        return found

    def _pass(self, image: np.ndarray, centre: np.ndarray, size: float, turn: float):
        """One run on the square of `size` pixels around `centre`, turned by `turn`; and the square for the next."""
        scale, cos, sin = size / SIDE, np.cos(turn), np.sin(turn)
        linear = scale * np.array([[cos, -sin], [sin, cos]])  # from pixels of the crop to pixels of the image
        to_image = np.concatenate([linear, (centre - linear @ [SIDE / 2, SIDE / 2])[:, None]], 1)
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        crop = cv2.warpAffine(image, to_image, (SIDE, SIDE), flags=flags)
        self._net.set_tensor(self._input, crop[None, ..., ::-1].astype(np.float32) / 255)
        self._net.invoke()
        rows, presence, mask, world = (self._net.get_tensor(k)[0] for k in self._outputs)
        rows = rows.reshape(39, 5)
        point = rows[:, :2] @ linear.T + to_image[:, 2]
        world = world.reshape(39, 3)[:33].copy()
        world[:, :2] = world[:, :2] @ (linear / scale).T
        shape = image.shape[1::-1]
        probability = _sigmoid(mask[..., 0])
        found = Landmarks(
            point=point[:33].astype(np.float32),
            depth=rows[:33, 2] * scale,
            visible=_sigmoid(rows[:33, 3]),
            world=world,
            presence=float(presence[0]),
            mask=cv2.warpAffine(probability, to_image, shape, flags=cv2.INTER_LINEAR),
        )
        up = point[_TOP] - point[_MIDDLE]
        return found, point[_MIDDLE], 2 * _MARGIN * float(np.linalg.norm(up)), float(np.arctan2(up[0], -up[1]))


def _sigmoid(x: np.ndarray) -> np.ndarray:
    return 1 / (1 + np.exp(-np.clip(x, -30, 30)))
