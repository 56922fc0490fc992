"""Whether equal points of the surface are the same points of a body: one performance before four calibrated cameras.

    python -m export.photos people && python -m export.teachers --photos .data/photos/views
    python -m export.evaluation.views --backends torch=.data/runs/crops/weights.pt,torch

Two pixels of two cameras with the same part, U and V show one point of the body, if the network is right, and then
each lies on the other's epipolar line. The median distance from it needs no label: the calibration is the truth. It is
compared with that of the same pixels paired at random within their part, which is what U and V add. Masks, parts and
sides are judged as in `export.evaluation.photos`. Nothing of the package is trained on (`photographs.toml`).
"""

from __future__ import annotations

import argparse
import itertools
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import cv2
import numpy as np
from scipy.spatial import cKDTree
from tqdm import tqdm

from export.evaluation.backends import Backend, Prediction, open_backend
from export.evaluation.photos import PhotoSet, Tally, print_metrics, read_photo
from export.photos.packages import PackageReader, fetch, load_packages
from export.teachers.label import PhotoLabels

PACKAGE = "pose2sim"
CALIBRATION = "Pose2Sim/Demo_SinglePerson/calibration/Calib.qca.txt"
SAMPLES = 1500  # pixels of an image
MAX_UV_DISTANCE = 0.03  # between pixels that count as one point, of U and V in 0..1
MIN_PIXELS = 300  # of a person


@dataclass(frozen=True)
class CalibratedCamera:
    """intrinsics [3, 3] and distortion (k1, k2, p1, p2) of images of size_px (width, height); rotation [3, 3] and
    shift [3], metres, from the world to the camera (x right, y down, z forward)."""

    intrinsics: np.ndarray
    distortion: np.ndarray
    size_px: tuple[int, int]
    rotation: np.ndarray
    shift: np.ndarray

    def rays(self, pixels: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
        """Undistorted x / z, y / z [N, 2] of the centres of `pixels` [N, 2] of an image of shape (height, width)."""
        if not len(pixels):
            return np.zeros((0, 2))
        scale = np.array(self.size_px) / shape[::-1]
        points = ((pixels + 0.5) * scale - 0.5)[:, None]
        return cv2.undistortPoints(points, self.intrinsics, self.distortion)[:, 0]

    def focal_px(self, shape: tuple[int, int]) -> float:
        """Focal length of an image of that shape."""
        return float(self.intrinsics[0, 0] * shape[1] / self.size_px[0])


def read_cameras(text: str) -> list[CalibratedCamera]:
    """The cameras of a Qualisys calibration in their order: lengths in mm, pixels in 1/64; a camera looks along -z of
    its own axes, y up."""
    cameras = []
    for camera in ElementTree.fromstring(text).iter("camera"):
        inner, pose, frame = (camera.find(name) for name in ("intrinsic", "transform", "fov_video"))

        def number(element: ElementTree.Element, name: str) -> float:
            return float(element.get(name))

        left, top, right, bottom = (number(frame, name) for name in ("left", "top", "right", "bottom"))
        fx, fy, cx, cy = (
            number(inner, name) / 64 for name in ("focalLengthU", "focalLengthV", "centerPointU", "centerPointV")
        )
        own = np.array([[number(pose, f"r{i}{k}") for k in (1, 2, 3)] for i in (1, 2, 3)])
        centre = np.array([number(pose, axis) for axis in "xyz"]) / 1000
        rotation = np.diag([1.0, -1.0, -1.0]) @ own
        names = ("radialDistortion1", "radialDistortion2", "tangentalDistortion1", "tangentalDistortion2")
        cameras.append(
            CalibratedCamera(
                np.array([[fx, 0, cx - left], [0, fy, cy - top], [0, 0, 1]]),
                np.array([number(inner, name) for name in names]),
                (int(right - left) + 1, int(bottom - top) + 1), rotation, -rotation @ centre,
            )
        )  # fmt: skip
    return cameras


def epipolar_distance(
    a: CalibratedCamera, b: CalibratedCamera, in_a: np.ndarray, in_b: np.ndarray, focal_px: float
) -> np.ndarray:
    """Distance [N] of each point from the epipolar line of its partner, the mean of both directions, in pixels of focal
    length `focal_px`. in_a, in_b: [N, 2] of `CalibratedCamera.rays`."""
    rotation = b.rotation @ a.rotation.T
    x, y, z = b.shift - rotation @ a.shift
    essential = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) @ rotation
    one = np.ones((len(in_a), 1))
    points_a, points_b = np.concatenate([in_a, one], 1), np.concatenate([in_b, one], 1)
    lines_b, lines_a = points_a @ essential.T, points_b @ essential
    off = np.abs((points_b * lines_b).sum(1))
    return focal_px * off * (1 / np.hypot(*lines_b[:, :2].T) + 1 / np.hypot(*lines_a[:, :2].T)) / 2


def largest_person(found: Prediction) -> np.ndarray:
    """Labels uint8 [H, W, 3] of the person with most pixels alone."""
    count = np.bincount(found.inds.reshape(-1), minlength=2)
    return found.iuv * (found.inds == 1 + count[1:].argmax())[..., None]


def equal_points(a: np.ndarray, b: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pixels (x, y) [N, 2] of labels a and b [H, W, 3] with the same part and nearly equal U and V: of up to `SAMPLES`
    of a those that have a partner in b; and for each of them any pixel of the part in b."""
    y, x = np.nonzero(a[..., 0])
    chosen = rng.permutation(len(x))[:SAMPLES]
    in_a, in_b, in_part = [], [], []
    for part in np.unique(a[y[chosen], x[chosen], 0]):
        own = chosen[a[y[chosen], x[chosen], 0] == part]
        there_y, there_x = np.nonzero(b[..., 0] == part)
        if len(there_x):
            tree = cKDTree(b[there_y, there_x, 1:] / 255.0)
            distance, nearest = tree.query(a[y[own], x[own], 1:] / 255.0)
            near = distance < MAX_UV_DISTANCE
            in_a.append(np.stack([x[own], y[own]], 1)[near])
            there = np.stack([there_x, there_y], 1)
            in_b.append(there[nearest[near]])
            in_part.append(there[rng.integers(len(there), size=int(near.sum()))])
    none = np.zeros((0, 2), np.int64)
    return tuple(np.concatenate([none, *found]) for found in (in_a, in_b, in_part))


@dataclass(frozen=True)
class ViewMetrics:
    """median_px: of equal points; random_px: of pixels paired at random within their part; gain: 1 - their ratio;
    pairs: of images; matched: fraction of the asked pixels with a partner."""

    median_px: float
    random_px: float
    gain: float
    pairs: int
    matched: float


def judge_views(labels: dict[str, dict[int, np.ndarray]], cameras: list[CalibratedCamera]) -> ViewMetrics:
    """labels: by moment and camera number (from 0), of one person."""
    rng = np.random.default_rng(0)
    equal, random, pairs, asked = [], [], 0, 0
    for views in labels.values():
        for i, j in itertools.permutations(sorted(views), 2):
            a, b = views[i], views[j]
            if min((a[..., 0] > 0).sum(), (b[..., 0] > 0).sum()) < MIN_PIXELS:
                continue
            in_a, *partners = equal_points(a, b, rng)
            pairs, asked = pairs + 1, asked + min(SAMPLES, int((a[..., 0] > 0).sum()))
            rays, focal = cameras[i].rays(in_a, a.shape[:2]), cameras[j].focal_px(b.shape[:2])
            for kept, in_b in zip((equal, random), partners, strict=True):
                there = cameras[j].rays(in_b, b.shape[:2])
                kept.append(epipolar_distance(cameras[i], cameras[j], rays, there, focal))
    if not asked or not sum(map(len, equal)):
        return ViewMetrics(float("nan"), float("nan"), float("nan"), pairs, 0.0)
    every, chance = np.concatenate(equal), np.concatenate(random)
    median, by_chance = float(np.median(every)), float(np.median(chance))
    return ViewMetrics(median, by_chance, 1 - median / by_chance, pairs, len(every) / asked)


def judge(
    predict: Callable[[Path], Prediction], threshold: float, chosen: PhotoSet, cameras: list[CalibratedCamera]
) -> tuple[ViewMetrics, Tally]:
    """predict: what is found in a photo of `chosen`; each is called once, in order."""
    tally, labels = Tally(threshold), {}
    for path in chosen.photos:
        found = predict(path)
        moment, _, camera = path.stem.rpartition("-cam")
        labels.setdefault(moment, {})[int(camera) - 1] = largest_person(found.above(threshold))
        tally.add(path.name, found, PhotoLabels.load(chosen.labels / f"{path.stem}.npz"))
    return judge_views(labels, cameras), tally


def calibrated_cameras() -> list[CalibratedCamera]:
    """Views of the package's take. Raises PackageError."""
    with PackageReader(fetch(load_packages()[PACKAGE])) as reader:
        return read_cameras(reader.read(CALIBRATION).decode())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--photos", type=Path, default=Path(".data/photos/views"), metavar="DIR")
    parser.add_argument("--labels", type=Path, default=Path(".data/teachers/labels"), metavar="DIR")
    parser.add_argument("--backends", default="capi", help="as for export.evaluation (default %(default)s)")
    parser.add_argument("--out", type=Path, default=Path("build/evaluation/views.json"), metavar="FILE")
    options = parser.parse_args()
    chosen = PhotoSet.find([options.photos], options.labels, [])
    if not chosen.photos:
        parser.error(
            f"no labels of {options.photos} in {options.labels}: python -m export.teachers --photos {options.photos}"
        )
    cameras = calibrated_cameras()
    results = {}
    for text in options.backends.split(","):
        backend = open_backend(text, 0.05)
        with tqdm(total=len(chosen.photos), desc=backend.kind, unit="photo", disable=None) as bar:

            def predict(path: Path, backend: Backend = backend, bar: tqdm = bar) -> Prediction:
                bar.update()
                return backend.predict(read_photo(path))

            views, tally = judge(predict, backend.threshold, chosen, cameras)
        metrics, name = tally.metrics(), f"{backend.precision} {backend.kind} {backend.path}"
        print_metrics(name, metrics)
        print(f"views: median {views.median_px:.1f} px, at random in a part {views.random_px:.1f} px, "
              f"gain {views.gain:.2f} ({views.pairs} pairs, {views.matched:.0%} of the points matched)")  # fmt: skip
        results[name] = {**vars(views), "mask_iou": metrics.mask_iou, "part_at_landmark": metrics.part_at_landmark,
                         "left_right": metrics.left_right, "chest_or_back": metrics.chest_or_back,
                         "people": metrics.people}  # fmt: skip
    options.out.parent.mkdir(parents=True, exist_ok=True)
    options.out.write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
