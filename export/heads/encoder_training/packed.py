"""The file of `export.heads.encoder_training.pack`, read: it takes neither the assets nor geometry packages."""

from __future__ import annotations

import cv2
import numpy as np
import torch

from export.heads.encoder_training.crops import RealFaces
from export.heads.encoder_training.generator import PackedHeads

QUALITY = 78


def jpegs(images: list[np.ndarray]) -> dict[str, np.ndarray]:
    """RGB images as one array of bytes and where each ends."""
    coded = [cv2.imencode(".jpg", i[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, QUALITY])[1].reshape(-1) for i in images]
    return {"bytes": np.concatenate(coded), "ends": np.cumsum([len(c) for c in coded])}


def read_jpegs(coded: np.ndarray, ends: np.ndarray) -> list[np.ndarray]:
    """RGB images of `jpegs`."""
    parts = np.split(coded, ends[:-1])
    return [np.ascontiguousarray(cv2.imdecode(part, cv2.IMREAD_COLOR)[..., ::-1]) for part in parts]


def read_heads(stored: dict[str, np.ndarray]) -> PackedHeads:
    values = {name: np.asarray(stored[name]) for name in PackedHeads.__dataclass_fields__ if name != "loops"}
    for name, value in values.items():
        values[name] = value.astype(np.int64 if "faces" in name else np.float64)
    loops = np.split(stored["loops"].astype(np.int64), stored["loop_ends"][:-1])
    return PackedHeads(loops=loops, **values)


def read_real_faces(stored: dict[str, np.ndarray]) -> RealFaces:
    rgb = np.stack(read_jpegs(stored["photo_bytes"], stored["photo_ends"]))
    known = np.stack([np.unpackbits(stored[f"photo_{name}"], -1) for name in ("head", "nothing")], -1)
    return RealFaces.of(
        torch.from_numpy(rgb), torch.from_numpy(known), torch.from_numpy(stored["photo_pixel"]).float(),
        torch.from_numpy(stored["photo_weight"].astype(np.float32)), torch.from_numpy(stored["photo_template"]).float(),
    )  # fmt: skip
