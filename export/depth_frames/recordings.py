"""Recordings of a depth camera (docs/reference/formats.md) with sizes measured by hand, as depth frames."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from export.depth_frames.frames import DepthFrame

_MAGIC = b"MAQREC\r\n"
_FRAME = struct.Struct("<4sIqQIiiiiIQQ")
_DEPTH16, _DEPTH32F = 7, 8
_MAX_PX = 1 << 26


class RecordingError(ValueError):
    """A recording, or the JSON beside it, is not what is needed; the sentence says what to do."""


def frames_of(recording: Path, every: int = 1, most: int | None = None) -> list[DepthFrame]:
    """Every so many frames of a recording, with the boxes of the JSON beside it (`box.maqrec`, `box.json`) where there
    is one. Raises RecordingError."""
    boxes = _boxes(recording.with_suffix(".json"))
    head, data = _opened(recording)
    intrinsics = _intrinsics(recording, head)
    chosen = []
    for number, depth in enumerate(_depths(data)):
        if number % every == 0 and (most is None or len(chosen) < most):
            if depth.shape != (head["calibration"]["height_px"], head["calibration"]["width_px"]):
                raise RecordingError(
                    f"{recording}: frame {number} has {depth.shape[1]} x {depth.shape[0]} pixels of depth, the "
                    "calibration another size: record the depth stream itself, not depth beside a picture."
                )
            name = f"own/{recording.stem}/{number:06d}"
            chosen.append(DepthFrame(name, depth, intrinsics, np.zeros(depth.shape, bool), boxes))
    if not chosen:
        raise RecordingError(f"{recording} has no frame of depth: record a depth stream (format=Z16, depthai:).")
    return chosen


def _opened(path: Path) -> tuple[dict, memoryview]:
    try:
        data = path.read_bytes()
    except OSError as error:
        raise RecordingError(f"{path} cannot be read: {error.strerror}.") from error
    if data[:8] != _MAGIC or len(data) < 24:
        raise RecordingError(f"{path} is no recording: make one with `maquette record SOURCE {path}`.")
    version, length = struct.unpack_from("<II", data, 8)
    if version != 1:
        raise RecordingError(f"{path} is of version {version} of the format; this reads version 1.")
    try:
        return json.loads(data[24 : 24 + length]), memoryview(data)[24 + length :]
    except ValueError as error:
        raise RecordingError(f"{path} is damaged at its beginning ({error}): record it again.") from error


def _intrinsics(path: Path, head: dict) -> tuple[float, float, float, float]:
    camera = head.get("calibration")
    if not camera:
        raise RecordingError(f"{path} has no calibration: record it with fov= or fx=, e.g. 'v4l2:/dev/video0?fov=87'.")
    if any(abs(v) > 1e-9 for v in camera.get("distortion", [])):
        raise RecordingError(f"{path} was taken through a lens with distortion: record rectified depth.")
    return tuple(float(camera[k]) for k in ("fx_px", "fy_px", "cx_px", "cy_px"))


def _depths(data: memoryview) -> Iterator[np.ndarray]:
    """Depth of each frame in metres. What is no frame ends the recording: the index, or a frame cut off. Checks of
    bytes are left to the SDK (`maquette play` says what is damaged)."""
    at = 0
    while at + _FRAME.size <= len(data):
        magic, _, _, _, encoding, width, height, depth_width, depth_height, _, size, _ = _FRAME.unpack_from(data, at)
        at += _FRAME.size
        if magic != b"MAQF" or not 0 < width * height <= _MAX_PX or depth_width * depth_height > _MAX_PX:
            return
        beside = 2 * max(depth_width, 0) * max(depth_height, 0)
        if at + size + beside > len(data):
            return
        picture, extra = data[at : at + size], data[at + size : at + size + beside]
        at += size + beside
        if encoding == _DEPTH16 and size == 2 * width * height:
            yield _metres(picture, width, height)
        elif encoding == _DEPTH32F and size == 4 * width * height:
            depth = np.frombuffer(picture, "<f4").reshape(height, width)
            yield np.where(np.isfinite(depth) & (depth > 0), depth, 0).astype(np.float32)
        elif beside:
            yield _metres(extra, depth_width, depth_height)


def _metres(raw: memoryview, width: int, height: int) -> np.ndarray:
    stored = np.frombuffer(raw, "<u2").reshape(height, width)
    return np.where(stored < 65535, stored * np.float32(0.001), 0).astype(np.float32)


def _boxes(path: Path) -> list[dict]:
    if not path.exists():
        return []
    try:
        given = json.loads(path.read_text())
        boxes = [
            {
                "name": str(box["name"]),
                "size_m": sorted((float(v) for v in box["size_m"]), reverse=True),
                "error_m": float(box.get("error_m", 0.001)),
            }
            for box in given["boxes"]
        ]
    except (ValueError, KeyError, TypeError) as error:
        raise RecordingError(
            f'{path} is not of the form {{"boxes": [{{"name": "carton", "size_m": [0.4, 0.3, 0.2]}}]}}: {error!r}.'
        ) from error
    for box in boxes:
        if len(box["size_m"]) != 3 or not all(0 < v < 100 for v in box["size_m"]) or not 0 <= box["error_m"] < 1:
            raise RecordingError(f"{path}: the size of {box['name']} must be three lengths in metres, not {box}.")
    return boxes
