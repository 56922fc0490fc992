"""Which pixels show people, by MediaPipe's selfie segmentation (general model, Apache-2.0)."""

from __future__ import annotations

import cv2
import numpy as np

from export.teachers.models import model_file

SIDE = 256
_MARGIN = 1.3  # of the box: the network expects some surroundings


class MatteNetwork:
    """It does not tell people apart: its answer is of use for a box in which nobody else is."""

    def __init__(self, threads: int = 1) -> None:
        from ai_edge_litert.interpreter import Interpreter  # extra `teachers`: only those who label need it

        path = model_file("mediapipe-selfie-segmentation", "package/selfie_segmentation.tflite")
        self._net = Interpreter(str(path), num_threads=threads)
        self._net.allocate_tensors()
        self._input = self._net.get_input_details()[0]["index"]
        self._output = self._net.get_output_details()[0]["index"]

    def find(self, image: np.ndarray, box: np.ndarray) -> np.ndarray:
        """image: uint8 [H, W, 3] BGR; box: x0, y0, x1, y1 in pixels. bool [H, W], false away from the box."""
        centre, half = (box[:2] + box[2:]) / 2, _MARGIN * (box[2:] - box[:2]) / 2
        limit = np.array(image.shape[1::-1])
        low = np.floor(np.clip(centre - half, 0, limit - 1)).astype(int)
        high = np.ceil(np.clip(centre + half, low + 1, limit)).astype(int)
        crop = np.ascontiguousarray(image[low[1] : high[1], low[0] : high[0]])
        small = cv2.resize(crop, (SIDE, SIDE), interpolation=cv2.INTER_AREA)
        self._net.set_tensor(self._input, small[None, ..., ::-1].astype(np.float32) / 255)
        self._net.invoke()
        person = cv2.resize(self._net.get_tensor(self._output)[0, ..., 0], crop.shape[1::-1]) > 0.5
        out = np.zeros(image.shape[:2], bool)
        out[low[1] : high[1], low[0] : high[0]] = _largest(person)
        return out


def _largest(mask: np.ndarray) -> np.ndarray:
    """The largest connected piece and those of at least a tenth of its size, without holes below a hundredth of it."""
    count, piece, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
    if count < 2:
        return mask
    area = stats[1:, cv2.CC_STAT_AREA]
    kept = np.isin(piece, 1 + np.flatnonzero(area >= 0.1 * area.max()))
    count, piece, stats, _ = cv2.connectedComponentsWithStats((~kept).astype(np.uint8))
    holes = 1 + np.flatnonzero(stats[1:, cv2.CC_STAT_AREA] < 0.01 * area.max())
    return kept | np.isin(piece, holes)
