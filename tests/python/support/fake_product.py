"""A product that finds people painted in plain greys, for `benchmarks.products`, and images of such people.

Person p, from 0, fills a rectangle with the value 80 * (p + 1). Keypoints lie in its box, in a fixed pattern.
"""

import time

import numpy as np

from export.keypoints import COUNT, MIRROR, NAMES

_STEP = 80
# Where keypoint k lies in the box, by width and height: left points on the right half, joints from top to bottom.
_LEVELS = {"shoulder": 0.2, "elbow": 0.35, "wrist": 0.5, "hip": 0.55, "knee": 0.75, "ankle": 0.95}
PATTERN = np.full((COUNT, 2), 0.1)
for _side, _x in (("left", 0.8), ("right", 0.2)):
    for _name, _y in _LEVELS.items():
        PATTERN[NAMES.index(f"{_side} {_name}")] = _x, _y


def painted(boxes, height=240, width=320):
    """uint8 [H, W, 3]: the people with these boxes [n, 4]."""
    image = np.zeros((height, width, 3), np.uint8)
    for p, (x0, y0, x1, y1) in enumerate(np.asarray(boxes, int)):
        image[y0:y1, x0:x1] = _STEP * (p + 1)
    return image


def keypoints_in(box):
    """[33, 2] for a box [4]."""
    box = np.asarray(box, float)
    return box[:2] + PATTERN * (box[2:] - box[:2])


class FakeProduct:
    """missed: people who are not found. swaps: ids of two people change in every frame. is_mirrored: left and right are
    exchanged. fails: what happens on a photograph, "raise" or "exit"."""

    def __init__(self, missed=(), swaps=False, is_mirrored=False, fails=""):
        self._missed, self._swaps, self._is_mirrored, self._fails = set(missed), swaps, is_mirrored, fails
        print("a product writes to stdout")

    def start(self):
        pass

    def photo(self, image):
        if self._fails == "raise":
            raise ValueError("this photograph is not to its taste")
        if self._fails == "exit":
            raise SystemExit(3)
        return image, 0

    def frame(self, image, sequence, time_ns):
        time.sleep(0.002)  # takes time, but no processor time
        return image, sequence

    def count(self, result):
        return len(self.found(result, result[0].shape[:2])["box"])

    def found(self, result, shape):
        image, sequence = result
        numbers = np.round(image[..., 0] / _STEP).astype(np.uint8)
        inds, boxes = np.zeros(shape, np.uint8), []
        for number in np.setdiff1d(np.unique(numbers), [0]):
            if number - 1 not in self._missed:
                y, x = np.nonzero(numbers == number)
                boxes.append([x.min(), y.min(), x.max() + 1, y.max() + 1])
                inds[numbers == number] = len(boxes)
        points = np.array([keypoints_in(box) for box in boxes]).reshape(-1, COUNT, 2)
        if self._is_mirrored:
            points = points[:, MIRROR]
        ids = np.arange(1, len(boxes) + 1)
        return {
            "box": np.array(boxes, np.float32).reshape(-1, 4),
            "score": np.ones(len(boxes), np.float32),
            "inds": inds,
            "keypoint": np.concatenate([points, np.ones((*points.shape[:2], 1))], 2).astype(np.float32),
            "id": ids[::-1] if self._swaps and sequence % 2 else ids,
        }
