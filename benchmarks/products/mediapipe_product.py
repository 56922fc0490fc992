"""MediaPipe's pose landmarker and selfie segmenter, for `worker.py`. Runs in MediaPipe's environment."""

from __future__ import annotations

import mediapipe
import numpy as np
from mediapipe.tasks.python import BaseOptions, vision

from benchmarks.products.masks import SHOWN, box_of, frontmost

MAX_PEOPLE = 10


def image_of(image: np.ndarray) -> mediapipe.Image:
    return mediapipe.Image(image_format=mediapipe.ImageFormat.SRGB, data=image)


class Clock:
    """Times in milliseconds that rise over all streams, as MediaPipe asks for."""

    def __init__(self) -> None:
        self._offset_ms = self._last_ms = 0

    def start(self) -> None:
        self._offset_ms = self._last_ms + 1000

    def ms(self, time_ns: int) -> int:
        self._last_ms = max(self._last_ms + 1, self._offset_ms + round(time_ns / 1e6))
        return self._last_ms


class PoseLandmarker:
    """task: a .task file. masks: whether masks are computed, too. min_detection: threshold of the detector; all others
    are the defaults. Photographs run in the mode for images, frames in the mode for video."""

    def __init__(self, task: str, masks: bool, min_detection: float = 0.5) -> None:
        self._task, self._masks, self._min_detection = task, masks, min_detection
        self._still: vision.PoseLandmarker | None = None
        self._video: vision.PoseLandmarker | None = None
        self._clock = Clock()

    def _opened(self, mode: vision.RunningMode) -> vision.PoseLandmarker:
        options = vision.PoseLandmarkerOptions(
            base_options=BaseOptions(model_asset_path=self._task),
            running_mode=mode,
            num_poses=MAX_PEOPLE,
            min_pose_detection_confidence=self._min_detection,
            output_segmentation_masks=self._masks,
        )
        return vision.PoseLandmarker.create_from_options(options)

    def start(self) -> None:
        """Opens the task anew: it has no other way to forget the people of the stream before."""
        if self._video is not None:
            self._video.close()
        self._video = self._opened(vision.RunningMode.VIDEO)
        self._clock.start()

    def photo(self, image: np.ndarray) -> vision.PoseLandmarkerResult:
        if self._still is None:
            self._still = self._opened(vision.RunningMode.IMAGE)
        return self._still.detect(image_of(image))

    def frame(self, image: np.ndarray, sequence: int, time_ns: int) -> vision.PoseLandmarkerResult:
        return self._video.detect_for_video(image_of(image), self._clock.ms(time_ns))

    def count(self, result: vision.PoseLandmarkerResult) -> int:
        return len(result.pose_landmarks)

    def found(self, result: vision.PoseLandmarkerResult, shape: tuple[int, int]) -> dict[str, np.ndarray]:
        height, width = shape
        people = result.pose_landmarks
        keypoint = np.array([[(p.x * width, p.y * height, p.visibility) for p in one] for one in people], np.float32)
        keypoint = keypoint.reshape(-1, 33, 3)
        masks = np.array([mask.numpy_view().reshape(shape) for mask in result.segmentation_masks or []], np.float32)
        box = [box_of(k, masks, keypoint[k], shape) for k in range(len(people))]
        return {
            "box": np.array(box, np.float32).reshape(-1, 4),
            "score": np.ones(len(people), np.float32),
            "inds": frontmost(masks, shape),
            "keypoint": keypoint,
            "id": np.arange(1, len(people) + 1),
        }


class SelfieSegmenter:
    """One mask of all people; it knows no persons."""

    def __init__(self, network: str) -> None:
        self._network = network
        self._still: vision.ImageSegmenter | None = None
        self._video: vision.ImageSegmenter | None = None
        self._clock = Clock()

    def _opened(self, mode: vision.RunningMode) -> vision.ImageSegmenter:
        options = vision.ImageSegmenterOptions(BaseOptions(model_asset_path=self._network), running_mode=mode)
        return vision.ImageSegmenter.create_from_options(options)

    def start(self) -> None:
        if self._video is not None:
            self._video.close()
        self._video = self._opened(vision.RunningMode.VIDEO)
        self._clock.start()

    def photo(self, image: np.ndarray) -> vision.ImageSegmenterResult:
        if self._still is None:
            self._still = self._opened(vision.RunningMode.IMAGE)
        return self._still.segment(image_of(image))

    def frame(self, image: np.ndarray, sequence: int, time_ns: int) -> vision.ImageSegmenterResult:
        return self._video.segment_for_video(image_of(image), self._clock.ms(time_ns))

    def count(self, result: vision.ImageSegmenterResult) -> int:
        return 0

    def found(self, result: vision.ImageSegmenterResult, shape: tuple[int, int]) -> dict[str, np.ndarray]:
        mask = result.confidence_masks[-1].numpy_view().reshape(shape)
        return {
            "box": np.zeros((0, 4), np.float32),
            "score": np.zeros(0, np.float32),
            "inds": (mask > SHOWN).astype(np.uint8),
            "keypoint": np.zeros((0, 33, 3), np.float32),
            "id": np.zeros(0, np.int64),
        }
