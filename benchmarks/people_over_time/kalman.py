"""A Kalman filter of a box that moves evenly: the one of SORT and ByteTrack here."""

from __future__ import annotations

import numpy as np

# Standard deviations as parts of the box's height, at 30 frames a second (DeepSORT, Wojke et al. 2017).
_PLACE, _SPEED = 1 / 20, 1 / 160
_RATE = 30.0


class BoxFilter:
    """State: middle x, y, width, height, and their changes a frame of 1/30 s; boxes are left, top, right, bottom."""

    def __init__(self, box: np.ndarray) -> None:
        self.mean = np.concatenate([_measured(box), np.zeros(4)])
        height = self.mean[3]
        self.covariance = np.diag(np.repeat([2 * _PLACE * height, 10 * _SPEED * height], 4) ** 2)

    def predict(self, seconds: float) -> None:
        steps = seconds * _RATE
        move = np.eye(8) + steps * np.eye(8, k=4)
        height = max(self.mean[3], 1.0)
        noise = np.diag(np.repeat([_PLACE * height, _SPEED * height], 4) ** 2) * steps
        self.mean = move @ self.mean
        self.mean[2:4] = np.maximum(self.mean[2:4], 1.0)
        self.covariance = move @ self.covariance @ move.T + noise

    def update(self, box: np.ndarray) -> None:
        noise = np.eye(4) * (_PLACE * max(self.mean[3], 1.0)) ** 2
        gain = self.covariance[:, :4] @ np.linalg.inv(self.covariance[:4, :4] + noise)
        self.mean = self.mean + gain @ (_measured(box) - self.mean[:4])
        self.covariance = self.covariance - gain @ self.covariance[:4]

    @property
    def box(self) -> np.ndarray:
        half = self.mean[2:4] / 2
        return np.concatenate([self.mean[:2] - half, self.mean[:2] + half])


def _measured(box: np.ndarray) -> np.ndarray:
    box = np.asarray(box, float)
    return np.concatenate([(box[:2] + box[2:]) / 2, np.maximum(box[2:] - box[:2], 1.0)])
