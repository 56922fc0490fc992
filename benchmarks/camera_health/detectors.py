"""Detectors of events: camera health, and two baselines that only say that something happened."""

from __future__ import annotations

from collections import deque

import cv2
import maquette
import numpy as np

Found = list[tuple[int, str]]  # frame, kind


def by_camera_health(frames: np.ndarray, fps: float) -> Found:
    health = maquette.CameraHealth()
    results = [health.push(np.ascontiguousarray(frame[..., ::-1]), time_s=i / fps) for i, frame in enumerate(frames)]
    return [(i, result.event) for i, result in enumerate(results) if result.event != "ok"]


def by_frame_difference(frames: np.ndarray, fps: float) -> Found:
    """The mean absolute difference to the frame before is 4 times its median of the 8 frames before, or a quarter."""
    before: deque[float] = deque(maxlen=8)
    found = []
    for i in range(1, len(frames)):
        now = float(cv2.absdiff(frames[i], frames[i - 1]).mean())
        if len(before) >= 4:
            ratio = (now + 0.3) / (float(np.median(before)) + 0.3)
            if ratio >= 4 or ratio <= 0.25:
                found.append((i, "event"))
        before.append(now)
    return found


def by_scene_detect(frames: np.ndarray, fps: float) -> Found:
    """PySceneDetect's ContentDetector at its default threshold (27): a frame whose content score reaches it. Its
    minimum length of a scene is left out, since events are short."""
    from scenedetect import ContentDetector, FrameTimecode  # an install of its own: pip install scenedetect

    detector = ContentDetector(threshold=27, min_scene_len=1)
    found: Found = []
    for i, frame in enumerate(frames):
        found += [(i, "event")] * bool(detector.process_frame(FrameTimecode(i, fps), frame))
    return found


DETECTORS = {
    "camera health": by_camera_health,
    "frame difference": by_frame_difference,
    "PySceneDetect": by_scene_detect,
}
