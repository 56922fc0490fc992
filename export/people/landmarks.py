"""The 33 keypoints of `export.keypoints` on the body's mesh: each is a mean of vertices, so that it moves with them.

BlazePose's shoulders lie between the joint and the skin above it; its knuckles stand for fingers.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from export.camera import Camera
from export.keypoints import COUNT, NAMES
from export.people.atlas import REGIONS, vertex_regions
from export.people.body import Body

# Keypoints that are joints: the bone whose head they are.
_BONES = {
    "shoulder": "upperarm01", "elbow": "lowerarm01", "wrist": "wrist", "hip": "upperleg01", "knee": "lowerleg01",
    "ankle": "foot", "index finger": "finger2-1", "little finger": "finger5-1", "thumb": "finger1-2",
}  # fmt: skip
_MOUTH_FROM_NOSE_M = np.array([0.025, 0.024, -0.035])  # the left corner, on the template
_NEAR_M = 0.05


def landmark_rows(body: Body) -> sp.csr_matrix:
    """[33, V]: the vertices that each keypoint is a mean of."""
    vertices, regions = body.template.vertices, vertex_regions(body)
    skin = np.zeros(len(vertices), bool)
    skin[body.groups["body"]] = True
    x, y, z = vertices.T

    def extreme(region: str, value: np.ndarray) -> list[int]:
        """The body vertex of a region where `value` is greatest."""
        own = skin & (regions[:, REGIONS.index(region)] > 0.9)
        return [int(np.where(own, value, -np.inf).argmax())]

    rows = {"nose": extreme("head", -y - 100 * (np.abs(x) > 0.005))}
    for side, sign in (("left", 1), ("right", -1)):
        eye = body.groups[f"helper-{side[0]}-eye"]
        across = sign * x[eye]
        corner = vertices[rows["nose"][0]] + _MOUTH_FROM_NOSE_M * [sign, 1, 1]
        rows |= {
            f"{side} eye": list(eye),
            f"{side} eye inner": [eye[across.argmin()]],
            f"{side} eye outer": [eye[across.argmax()]],
            f"{side} ear": extreme("head", sign * x),
            f"mouth {side}": extreme("head", -np.linalg.norm(vertices - corner, axis=1)),
            f"{side} toe": extreme("foot", -y - 100 * (sign * x < 0)),
            f"{side} heel": extreme("foot", y - z - 100 * (sign * x < 0)),
        }
    matrix = sp.lil_matrix((COUNT, len(vertices)))
    for name, columns in rows.items():
        matrix[NAMES.index(name), columns] = 1 / len(columns)
    for side in ("left", "right"):
        for name, bone in _BONES.items():
            matrix[NAMES.index(f"{side} {name}")] = body.head_rows[body.bone[f"{bone}.{side[0].upper()}"]]
        shoulder = NAMES.index(f"{side} shoulder")
        joint = body.template.heads[body.bone[f"upperarm01.{side[0].upper()}"]]
        above = np.where(skin & (np.linalg.norm(vertices[:, :2] - joint[:2], axis=1) < 0.02), z, -np.inf)
        matrix[shoulder] = matrix[shoulder] / 2
        matrix[shoulder, int(above.argmax())] += 0.5
    return matrix.tocsr()


class Landmarks:
    """Where images of people show their keypoints."""

    def __init__(self, body: Body) -> None:
        self._rows = landmark_rows(body)
        self._template = self._rows @ body.template.vertices
        face = np.arange(COUNT) < NAMES.index("left shoulder")
        trunk = np.array([name.endswith(("shoulder", "hip")) for name in NAMES])
        # How far from a keypoint the surface may be that is seen in its place, metres on the template.
        self._reach = np.select([face, trunk], [0.04, 0.2], 0.12)

    def projected(self, vertices: np.ndarray, camera: Camera) -> np.ndarray:
        """Where the image shows the keypoints of a body with `vertices` [V, 3]: [33, 2], pixel k covers [k, k + 1). NaN
        behind the camera."""
        at, depth = camera.projected(self._rows @ vertices)
        return np.where(depth[:, None] > _NEAR_M, at + 0.5, np.nan)

    def seen(self, at: np.ndarray, number: int, label: np.ndarray, point: np.ndarray) -> np.ndarray:
        """Keypoints [33, 3] of person `number`, as `export.shards.Record` has them.

        at: as of `projected`; label: uint8 [H, W, 4]; point [H, W, 3] of the template's surface. A keypoint is shown
        (1) where the image shows the person's surface near it, else hidden (0) by others, things or the own body.
        """
        height, width = label.shape[:2]
        x, y = np.nan_to_num(np.floor(at), nan=-1).astype(int).T
        inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
        row, column = np.clip(y, 0, height - 1), np.clip(x, 0, width - 1)
        own = inside & (label[row, column, 3] == number)
        near = np.linalg.norm(point[row, column] - self._template, axis=1) < self._reach
        # A point behind the camera is hidden as one outside of the image is.
        return np.column_stack([np.nan_to_num(at, nan=-1), own & near]).astype(np.float32)
