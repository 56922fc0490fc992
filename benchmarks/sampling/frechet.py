"""Computes the Fréchet distance of sets of clips, by features of the detector's network (MobileNetV2).

It is not FVD, which uses a video network trained on Kinetics whose weights are not free. This distance measures motion
by the change of features from frame to frame.
"""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from export.bundle import read_manifest
from export.densepose.graphs import session

DETECTOR = Path("sdk/models/densepose-b-int8")
LEVELS = ("p3", "p4", "p5")
SIDE_PX = 128  # side of a frame at the network's input
KEPT = 32  # principal directions of the real clips' features; more would need more clips


class FrameFeatures:
    def __init__(self, bundle: Path = DETECTOR) -> None:
        manifest = read_manifest(bundle)
        self.mean, self.std = (np.float32(manifest["input"][name]) for name in ("mean", "std"))
        self.trunk = session(bundle / manifest["graphs"]["trunk"]["file"])

    def of(self, frames: np.ndarray) -> np.ndarray:
        """Maps uint8 [..., H, W, 3] to float32 [..., features]: means of the quarters of each level."""
        found = []
        for frame in frames.reshape(-1, *frames.shape[-3:]):
            large = cv2.resize(frame, (SIDE_PX, SIDE_PX), interpolation=cv2.INTER_LINEAR)
            image = ((large - self.mean) / self.std).transpose(2, 0, 1)[None].astype(np.float32)
            parts = []
            for level in self.trunk.run(list(LEVELS), {"image": image}):
                half = level.shape[1] // 2
                quarters = level[0].reshape(2, half, 2, half, -1)
                parts.append(quarters.mean((1, 3)).ravel())
            found.append(np.concatenate(parts))
        return np.stack(found).reshape(*frames.shape[:-3], -1)


def changes(features: np.ndarray) -> np.ndarray:
    """Returns changes from frame to frame of the features [clips, T, features]: [clips * (T - 1), features]."""
    return np.diff(features, axis=1).reshape(-1, features.shape[-1])


def stills(features: np.ndarray) -> np.ndarray:
    """Returns the features of all frames: [clips * T, features]."""
    return features.reshape(-1, features.shape[-1])


def frechet_distance(real: np.ndarray, made: np.ndarray) -> float:
    """Returns the distance of normal distributions with the means and covariances (Dowson and Landau 1982), along the
    principal directions of `real` [N, features], scaled to variance 1 in each."""
    mean = real.mean(0)
    _, values, directions = np.linalg.svd(real - mean, full_matrices=False)
    kept = min(KEPT, int((values > 1e-6 * values[0]).sum()))
    scale = np.sqrt(len(real)) / values[:kept]
    a, b = ((rows - mean) @ directions[:kept].T * scale for rows in (real, made))
    one, other = (np.cov(rows, rowvar=False, bias=True) for rows in (a, b))
    # The trace of the root of the product is that of a symmetric matrix with the same eigenvalues.
    eigenvalues, vectors = np.linalg.eigh(one)
    root = vectors * np.sqrt(eigenvalues.clip(0)) @ vectors.T
    cross = np.sqrt(np.linalg.eigvalsh(root @ other @ root).clip(0)).sum()
    return float(((a.mean(0) - b.mean(0)) ** 2).sum() + np.trace(one) + np.trace(other) - 2 * cross)
