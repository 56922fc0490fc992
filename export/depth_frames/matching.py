"""From two images to depth: rectified by what is known of the cameras, matched by OpenCV's SGBM."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

_BLOCK_PX = 5
_RATIO = 0.75  # of the best to the second best match of a feature (Lowe 2004)


class MatchingError(RuntimeError):
    """Two images could not be brought together; the sentence says why."""


@dataclass(frozen=True, eq=False)
class Rectified:
    """Grey images uint8 [H, W] whose rows belong together, left and right; focal_px; cx_px, cy_px of the left one;
    baseline: distance of the cameras in the unit of depth; right_cx_px."""

    left: np.ndarray
    right: np.ndarray
    focal_px: float
    cx_px: float
    cy_px: float
    right_cx_px: float
    baseline: float

    @property
    def intrinsics(self) -> tuple[float, float, float, float]:
        return self.focal_px, self.focal_px, self.cx_px, self.cy_px


def depth_of(pair: Rectified, max_px: int) -> np.ndarray:
    """float32 [H, W], 0 where nothing matches. max_px: disparity of what is nearest, a multiple of 16."""
    matcher = cv2.StereoSGBM.create(
        minDisparity=0, numDisparities=max_px, blockSize=_BLOCK_PX, P1=8 * _BLOCK_PX**2,
        P2=32 * _BLOCK_PX**2, disp12MaxDiff=1, uniquenessRatio=10, speckleWindowSize=150, speckleRange=2,
        mode=cv2.StereoSGBM_MODE_SGBM_3WAY,
    )  # fmt: skip
    border = (0, 0, max_px, 0)
    left, right = (cv2.copyMakeBorder(p, *border, cv2.BORDER_REPLICATE) for p in (pair.left, pair.right))
    found = matcher.compute(left, right)[:, border[2] :].astype(np.float32) / 16
    # The difference of the rectified images' principal points is no disparity.
    apart = found - (pair.cx_px - pair.right_cx_px)
    seen = (found > 0) & (apart > 0.5)
    return np.where(seen, pair.focal_px * pair.baseline / np.where(seen, apart, 1), 0).astype(np.float32)


def calibrated(
    corners: tuple[list[np.ndarray], list[np.ndarray]], board: np.ndarray, size_px: tuple[int, int]
) -> tuple[np.ndarray, ...]:
    """Cameras and lenses of two cameras, rotation and shift between them, from corners [n, 2] of one board [n, 3] in
    several images."""
    places = [board.astype(np.float32)] * len(corners[0])
    cameras = [cv2.calibrateCamera(places, own, size_px, None, None)[1:3] for own in corners]
    error, *found = cv2.stereoCalibrate(
        places, *corners, *cameras[0], *cameras[1], size_px, flags=cv2.CALIB_FIX_INTRINSIC
    )[:7]
    if error > 1:
        raise MatchingError(f"The corners of the board fit two cameras to {error:.1f} px only.")
    return tuple(found)


def rectified(left: np.ndarray, right: np.ndarray, cameras: tuple[np.ndarray, ...]) -> Rectified:
    """Grey images of cameras (as `calibrated` gives them) with rows that belong together."""
    size_px = left.shape[1], left.shape[0]
    a, lens_a, b, lens_b, rotation, shift = cameras
    turn_a, turn_b, place_a, place_b, *_ = cv2.stereoRectify(
        a, lens_a, b, lens_b, size_px, rotation, shift, flags=cv2.CALIB_ZERO_DISPARITY, alpha=0
    )
    if abs(place_b[0, 3]) < abs(place_b[1, 3]):
        raise MatchingError("One camera stood above the other: rows cannot be brought together.")
    pictures = [
        cv2.remap(p, *cv2.initUndistortRectifyMap(m, lens, turn, place, size_px, cv2.CV_32FC1), cv2.INTER_LINEAR)
        for p, m, lens, turn, place in ((left, a, lens_a, turn_a, place_a), (right, b, lens_b, turn_b, place_b))
    ]
    baseline = -float(place_b[0, 3] / place_b[0, 0])
    return Rectified(
        *pictures, float(place_a[0, 0]), float(place_a[0, 2]), float(place_a[1, 2]), float(place_b[0, 2]), baseline
    )


def uncalibrated(left: np.ndarray, right: np.ndarray, focal_px: float) -> Rectified:
    """Grey images of one camera of known focal length, moved by an unknown step, which becomes the unit of depth.
    Raises MatchingError."""
    height, width = left.shape
    camera = np.array([[focal_px, 0, (width - 1) / 2], [0, focal_px, (height - 1) / 2], [0, 0, 1]])
    sift = cv2.SIFT_create(4000)
    (points_a, features_a), (points_b, features_b) = (sift.detectAndCompute(p, None) for p in (left, right))
    pairs = [
        first for first, second in cv2.BFMatcher().knnMatch(features_a, features_b, 2)
        if first.distance < _RATIO * second.distance
    ]  # fmt: skip
    if len(pairs) < 50:
        raise MatchingError(f"Only {len(pairs)} features match between the two pictures.")
    a = np.array([points_a[m.queryIdx].pt for m in pairs])
    b = np.array([points_b[m.trainIdx].pt for m in pairs])
    cv2.setRNGSeed(0)
    essential, mask = cv2.findEssentialMat(a, b, camera, cv2.RANSAC, 0.999, 1.0)
    count, rotation, shift, _ = cv2.recoverPose(essential, a, b, camera, mask=mask)
    if count < 50:
        raise MatchingError(f"Only {count} features agree on how the camera moved.")
    none = np.zeros(5)
    return rectified(left, right, (camera, none, camera, none, rotation, shift))
