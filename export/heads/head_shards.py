"""Files of made heads, one a head: points for the prior (`points`) and images for the encoder (`view_shards`), read.

Making them takes geometry packages; reading them takes numpy alone.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

SPLITS = ("train", "val", "test")
SIDE = 512  # of an image, px
LABEL_STEP = 2  # template points and normals are stored for every second pixel of every second row
POINT_SCALE = 8000.0  # int16 a dm
NOSE_TIP = np.array([0.0, -1.24, -0.35])  # of the template, dm
FACE_RADIUS_DM = 0.95
FACE_SIDES = 1.3  # side of the encoder's closer look by the longer side of the face's box
CROP_SIDES = 1.6  # side of an image by the longer side of the head's box; a training cuts smaller ones out of it


def is_face(template: np.ndarray) -> np.ndarray:
    """Which points belong to the face, by their template points [..., 3]: what metrics of faces are about."""
    return np.linalg.norm(template - NOSE_TIP, axis=-1) < FACE_RADIUS_DM


@dataclass(frozen=True)
class HeadPoints:
    """surface, normal, template: float32 [S, 3], dm; colour: uint8 [S, 3], RGB under the head's light.
    near: float32 [N, 3] and near_distance [N], dm; far and far_distance the same. vertices: float32 [V, 3], dm; visible
    [V, 3]: those under hair replaced by the hair's surface above."""

    surface: np.ndarray
    normal: np.ndarray
    template: np.ndarray
    colour: np.ndarray
    near: np.ndarray
    near_distance: np.ndarray
    far: np.ndarray
    far_distance: np.ndarray
    vertices: np.ndarray
    visible: np.ndarray


@dataclass(frozen=True)
class HeadImages:
    """K images of a head. rgb uint8 [K, 512, 512, 3]; masks uint8 [K, 512, 512]: 255 head, 128 bust, 0 nothing;
    template int16 [K, 256, 256, 3], dm times 8,000; normal int8 [K, 256, 256, 3], camera's axes, times 127;
    rotation [K, 3, 3] and shift [K, 3] from the head's frame (dm) to the camera's; intrinsics [K, 3]: focal, cx,
    cy, px."""

    rgb: np.ndarray
    masks: np.ndarray
    template: np.ndarray
    normal: np.ndarray
    rotation: np.ndarray
    shift: np.ndarray
    intrinsics: np.ndarray


def head_path(folder: Path, split: str, number: int) -> Path:
    """Path of head `number` of a split."""
    return folder / split / f"head-{number:05}.npz"


def head_paths(folder: Path, split: str) -> list[Path]:
    """Paths of all existing heads of a split, in order."""
    return sorted((folder / split).glob("head-[0-9]*[0-9].npz"))


def read_points(folder: Path, split: str) -> list[HeadPoints]:
    """All heads of a split that are there, in their order. Raises FileNotFoundError where there are none."""
    paths = head_paths(folder, split)
    if not paths:
        raise FileNotFoundError(f"{folder / split} holds no heads: run `python -m export.heads.points {split}` first")
    out = []
    for path in paths:
        with np.load(path) as stored:
            out.append(HeadPoints(**{f.name: stored[f.name] for f in fields(HeadPoints)}))
    return out


def read_pictures(path: Path) -> HeadImages:
    with np.load(path) as stored:
        return HeadImages(**{f.name: stored[f.name] for f in fields(HeadImages)})
