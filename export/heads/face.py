"""The face of a head: what its figures are about, beside those of the whole head."""

from __future__ import annotations

import numpy as np

NOSE_TIP = np.array([0.0, -1.24, -0.35])  # of the template, dm
FACE_RADIUS_DM = 0.95
FACE_SIDES = 1.3  # side of the encoder's closer look by the longer side of the face's box


def is_face(template: np.ndarray) -> np.ndarray:
    """Which points belong to the face, by their template points [..., 3]."""
    return np.linalg.norm(template - NOSE_TIP, axis=-1) < FACE_RADIUS_DM
