"""The model of stereo (`sensors.Stereo`) beside real matching: rendered pairs with projected dots through SGBM.

    python -m export.solids.stereo_check --solids 24

Solids of `val` are seen by two cameras 5 cm apart and lit by a projector of random dots between them, as in RealSense
and OAK-D Pro; each image is rendered three times as large and averaged, with grey noise. A table says of OpenCV's
matching and of the model, on the same depth: the noise of disparity away from jumps (half of the range between its 16 %
and 84 % quantiles), how far neighbours share it, by how many pixels the foreground is fattened, and which part of the
known pixels is lost.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from rich.console import Console
from rich.table import Table
from tqdm import tqdm

from export.camera import Camera
from export.solids.brep import Solid
from export.solids.recipe import make
from export.solids.sensors import JUMP, Sensor, Stereo
from export.solids.views import Seen, View

SIZE_PX = 640, 480
BASELINE_M = 0.05
DISPARITIES_PX = 128
BLOCK_PX = 5
_FINER = 3  # images are rendered so many times as large
_DOTS_PX = 1400  # of the projector's square image
_DOT_RATIO = 0.06
_PROJECTED_SLOPE = 1.3  # from the middle to the border of that picture: sideways by depth
_GREY_NOISE = 2.5
_MARGIN_PX = 12  # from jumps, for noise
_RIM_PX = 8  # beside jumps, for fattening
FIGURES = ("noise, px", "shared with the next pixel", "with the fourth", "fattened by, px", "lost", "of these hidden")


@dataclass(frozen=True, eq=False)
class Pair:
    """Depth of the left camera, float64 [H, W] metres; grey images uint8 [H, W] of both cameras."""

    depth: np.ndarray
    left: np.ndarray
    right: np.ndarray
    focal_px: float


def _dots(rng: np.random.Generator) -> np.ndarray:
    dots = (rng.random((_DOTS_PX, _DOTS_PX)) < _DOT_RATIO).astype(np.float32)
    return np.clip(cv2.GaussianBlur(dots, (0, 0), 0.8) * 3, 0, 1)


def _picture(view: View, shift_m: float, dots: np.ndarray, grey: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """shift_m: of the camera from the projector, along x."""
    point = view.point
    z = np.where(view.depth > 0, view.depth, 1)
    scale = (_DOTS_PX - 1) / 2 / _PROJECTED_SLOPE
    at = [((p / z) * scale + (_DOTS_PX - 1) / 2).astype(np.float32) for p in (point[..., 0] + shift_m, point[..., 1])]
    lit = cv2.remap(dots, *at, cv2.INTER_LINEAR)
    bright = np.where(view.face >= 0, grey[view.face] * (50 + 150 * lit), 20)
    small = cv2.resize(bright.astype(np.float32), None, fx=1 / _FINER, fy=1 / _FINER, interpolation=cv2.INTER_AREA)
    return np.clip(small + rng.normal(0, _GREY_NOISE, small.shape), 0, 255).astype(np.uint8)


def pair_of(solid: Solid, camera: Camera, rng: np.random.Generator) -> Pair:
    frame = camera.resized(*SIZE_PX)
    fine = frame.resized(*(_FINER * side for side in SIZE_PX))
    other = replace(fine, centre=fine.centre + fine.rotation.T @ np.array([BASELINE_M, 0, 0]))
    left = Seen(solid, fine)
    grey = rng.uniform(0.35, 0.95, solid.face_count)
    dots = _dots(rng)
    pictures = [
        _picture(seen.rendered(own), side * BASELINE_M / 2, dots, grey, rng)
        for seen, own, side in ((left, fine, -1), (Seen(solid, other), other, 1))
    ]
    return Pair(left.rendered(frame).depth, *pictures, frame.fx_px)


def matched(pair: Pair) -> np.ndarray:
    """Disparity in pixels, float32 [H, W], 0 where unknown. The usual settings of OpenCV's stereo example."""
    matcher = cv2.StereoSGBM.create(
        minDisparity=0, numDisparities=DISPARITIES_PX, blockSize=BLOCK_PX, P1=8 * BLOCK_PX**2, P2=32 * BLOCK_PX**2,
        disp12MaxDiff=1, uniquenessRatio=10, speckleWindowSize=100, speckleRange=2, mode=cv2.StereoSGBM_MODE_SGBM_3WAY,
    )  # fmt: skip
    # Columns of which the matcher sees no whole range of disparities are unknown to it: give it a border.
    padded = [cv2.copyMakeBorder(p, 0, 0, DISPARITIES_PX, 0, cv2.BORDER_REPLICATE) for p in (pair.left, pair.right)]
    found = matcher.compute(*padded)[:, DISPARITIES_PX:].astype(np.float32) / 16
    return np.where(found > 0, found, 0)


def figures(depth: np.ndarray, seen: np.ndarray, focal_px: float) -> dict[str, tuple[float, float]]:
    """depth, seen: disparities [H, W] in pixels, true and reported, 0 where nothing is. Sums and counts of FIGURES."""
    known, reported = depth > 0, seen > 0
    wide = cv2.dilate(depth.astype(np.float32), np.ones((3, 3), np.uint8))
    jumps = known & (wide > depth * (1 + JUMP) + 0.5)  # the far side of a jump
    edge = jumps | ~known
    apart = cv2.distanceTransform((~edge).astype(np.uint8), cv2.DIST_L2, 5)
    inside = known & reported & (apart > _MARGIN_PX)
    error = np.where(inside, seen - depth, 0)
    inside &= np.abs(error) < 1
    out = {}
    if inside.sum() > 500 and error[inside].std() > 0:
        low, high = np.quantile(error[inside], (0.159, 0.841))
        out["noise, px"] = (float(high - low) / 2, 1.0)
        for name, lag in (("shared with the next pixel", 1), ("with the fourth", 4)):
            both = inside[:, lag:] & inside[:, :-lag]
            a, b = error[:, lag:][both], error[:, :-lag][both]
            out[name] = (float(np.corrcoef(a, b)[0, 1]), 1.0)
    # On the far side of jumps, as far as the near side's disparity is reported there.
    near = cv2.dilate(depth.astype(np.float32), np.ones((2 * _RIM_PX + 1,) * 2, np.uint8))
    rim = (
        known & (cv2.distanceTransform((~jumps).astype(np.uint8), cv2.DIST_L2, 5) < _RIM_PX) & (near > depth * 1.05 + 1)
    )
    fat = rim & reported & (np.abs(seen - near) < np.abs(seen - depth))
    out["fattened by, px"] = (float(fat.sum()), float(max((jumps & rim).sum(), 1)))
    x = np.arange(depth.shape[1]) - depth
    hidden = known & (x > np.minimum.accumulate(np.where(known, x, np.inf)[:, ::-1], 1)[:, ::-1] + 1)
    matchable = known & (depth < DISPARITIES_PX) & (x > 0)
    lost = matchable & ~reported
    out["lost"] = (float(lost.sum()), float(matchable.sum()))
    out["of these hidden"] = (float((lost & hidden).sum()), float(max(lost.sum(), 1)))
    return out


def compared(solids: Sequence[int], sensors: dict[str, Sensor]) -> dict[str, dict[str, float]]:
    """FIGURES of SGBM and of each sensor, pixels of all solids together; noise as the mean over solids."""
    sums: dict[str, dict[str, np.ndarray]] = {}
    for seed in tqdm(solids, unit="solid"):
        made = make("val", seed, 1, magnified=SIZE_PX[0] / 320)
        pair = pair_of(made.solid, made.cameras[0], np.random.default_rng([seed, 5]))
        strength = pair.focal_px * BASELINE_M
        true = np.where(pair.depth > 0, strength / np.where(pair.depth > 0, pair.depth, 1), 0)
        found = {"SGBM, projected dots": matched(pair)}
        for name, sensor in sensors.items():
            depth = sensor(pair.depth.astype(np.float32), pair.focal_px, np.random.default_rng([seed, 6]))
            found[name] = np.where(depth > 0, strength / np.where(depth > 0, depth, 1), 0)
        if np.median(true[true > 0]) > DISPARITIES_PX / 2 or (true > 0).mean() < 0.1:
            continue  # nearer than a camera of this baseline can see
        for name, seen in found.items():
            for figure, pair_of_sums in figures(true, seen, pair.focal_px).items():
                own = sums.setdefault(name, {}).setdefault(figure, np.zeros(2))
                own += pair_of_sums
    return {name: {k: float(v[0] / v[1]) for k, v in own.items()} for name, own in sums.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--solids", type=int, default=24)
    options = parser.parse_args()
    sensors = {"model, stereo": Stereo(), "model, stereo-coarse": Stereo(0.15, 9, step_px=1 / 8, holes=0.04)}
    rows = compared(range(options.solids), sensors)
    table = Table("", *FIGURES)
    for name, row in rows.items():
        table.add_row(name, *(f"{row[f]:.3f}" for f in FIGURES))
    Console(width=140).print(table)


if __name__ == "__main__":
    main()
