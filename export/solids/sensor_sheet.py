"""Plots the output of the depth camera models for one solid, and their noise against range beside published values.

    python -m export.solids.sensor_sheet --data .data/solids/val --out docs/images

`sensors.jpg`: a column a level; depth, normals of the depth as colours, and its error: grey none, red too near, blue
too far, 4 r at full colour; black is unknown. `sensor-noise.png`: standard deviation of the depth of a wall that faces
the camera, focal length 333 px.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from zlib import crc32

import cv2
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from export.solids.records import Record, RecordError, read_records
from export.solids.sensors import LEVELS, Sensor
from export.solids.sheet import painted_depth, shaded

FOCAL_PX = 333.0
WALL_PX = 240, 320
RANGES_M = np.geomspace(0.3, 6, 14)
_FULL_R = 4.0
_COLUMNS = 8

# Metrics that others measured or state: label, ranges in metres, standard deviations in metres.
PUBLISHED: tuple[tuple[str, np.ndarray, np.ndarray], ...] = (
    (
        "Kinect v1, Nguyen, Izadi and Lovell 2012: 1.2 mm + 1.9 mm (z - 0.4)²",
        np.linspace(0.5, 3, 20),
        0.0012 + 0.0019 * (np.linspace(0.5, 3, 20) - 0.4) ** 2,
    ),
    (
        "Kinect v1, Khoshelham and Oude Elberink 2012: 1.425e-5 z² (cm), 4 cm at 5 m",
        np.linspace(0.5, 5, 20),
        1.425e-3 * np.linspace(0.5, 5, 20) ** 2,
    ),
    ("RealSense D435 at 1 m: 2.5 to 5 mm (librealsense #10133)", np.array([1.0, 1.0]), np.array([0.0025, 0.005])),
    ("Azure Kinect DK, specification: at most 17 mm", np.array([0.5, 3.86]), np.array([0.017, 0.017])),
    (
        "stereo by formula (Intel, tuning guide): z² 0.08 px / (333 px · 5 cm)",
        np.array(RANGES_M),
        RANGES_M**2 * 0.08 / (FOCAL_PX * 0.05),
    ),
)
PLOTTED = ("stereo", "stereo-coarse", "tof", "tof-dim", "structured-light", "phone", "steps-1mm")


def noise_m(sensor: Sensor, at_m: float, seed: int = 0) -> float:
    """Standard deviation of a wall's depth, NaN where the sensor reports less than a tenth of it."""
    # A little slanted, so that steps of depth are met in all their places.
    wall = at_m * np.linspace(0.99, 1.01, WALL_PX[1], dtype=np.float32)[None].repeat(WALL_PX[0], 0)
    seen = np.asarray(sensor(wall, FOCAL_PX, np.random.default_rng(seed)), np.float64)
    error = (seen - wall)[seen > 0]
    return float(error.std()) if error.size >= 0.1 * wall.size else float("nan")


def noise_plot(path: Path) -> None:
    figure, axes = plt.subplots(figsize=(9, 6), dpi=80)
    for name in PLOTTED:
        noise = [noise_m(LEVELS[name], at) for at in RANGES_M]
        axes.plot(RANGES_M, 1000 * np.array(noise), marker="o", markersize=3, label=f"model: {name}")
    for label, ranges, noise in PUBLISHED:
        axes.plot(ranges, 1000 * noise, linestyle="--", linewidth=2.5, alpha=0.6, label=label)
    axes.plot(RANGES_M, 1000 * RANGES_M / FOCAL_PX, color="black", linewidth=0.8, label="1 r at 333 px")
    axes.set(xscale="log", yscale="log", xlabel="range, m", ylabel="standard deviation of depth, mm", ylim=(0.02, 400))
    axes.grid(which="both", alpha=0.25)
    axes.legend(fontsize=6.5, loc="lower right")
    figure.tight_layout()
    figure.savefig(path)
    plt.close(figure)


def painted_error(seen: np.ndarray, depth: np.ndarray, focal_px: float) -> np.ndarray:
    """uint8 [H, W, 3]: error in r, red where too near, blue where too far, black where nothing is reported."""
    off = (seen - depth) * focal_px / np.maximum(depth, 1e-9) / _FULL_R
    colours = (matplotlib.colormaps["coolwarm_r"](np.clip(off, -1, 1) / 2 + 0.5)[..., :3] * 255).astype(np.uint8)
    return np.where(((seen > 0) & (depth > 0))[..., None], colours, 0).astype(np.uint8)


def sheet(record: Record, levels: Sequence[str]) -> np.ndarray:
    """uint8, RGB: a column a level, their names above, _COLUMNS beside each other."""
    depth, focal_px = record.decoded()["depth"], record.intrinsics[0]
    columns = []
    for name in levels:
        seen = LEVELS[name](depth, focal_px, np.random.default_rng(crc32(name.encode())))
        title = np.full((18, depth.shape[1], 3), 255, np.uint8)
        cv2.putText(title, name, (4, 13), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (0, 0, 0), 1, cv2.LINE_AA)
        cells = [title, painted_depth(seen), shaded(seen, record.intrinsics), painted_error(seen, depth, focal_px)]
        columns.append(np.pad(np.concatenate(cells), ((0, 0), (0, 2), (0, 0))))
    columns += [np.zeros_like(columns[0])] * (-len(columns) % _COLUMNS)
    return np.concatenate([np.concatenate(columns[k : k + _COLUMNS], 1) for k in range(0, len(columns), _COLUMNS)])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=Path(".data/solids/val"), help="whole views")
    parser.add_argument("--view", type=int, default=38, help="which of those 320 px wide (default %(default)s)")
    parser.add_argument("--out", type=Path, default=Path("docs/images"))
    options = parser.parse_args()
    try:
        records = [r for r in read_records(options.data) if r.width == 320]
    except RecordError as error:
        print(error, file=sys.stderr)
        return 1
    if not 0 <= options.view < len(records):
        print(f"--view must be 0 to {len(records) - 1}", file=sys.stderr)
        return 1
    options.out.mkdir(parents=True, exist_ok=True)
    made = sheet(records[options.view], list(LEVELS))
    half = cv2.resize(made, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    cv2.imwrite(str(options.out / "sensors.jpg"), half[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 72])
    noise_plot(options.out / "sensor-noise.png")
    print(f"wrote {options.out / 'sensors.jpg'} and {options.out / 'sensor-noise.png'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
