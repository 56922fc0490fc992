"""What averaging the frames of a camera at rest brings: errors of fields and boxes after 1, 4 and 16 frames.

    python -m benchmarks.edges.at_rest        minutes; needs `make build`, .data/solids and print_solids_truth

Each frame has noise of its own, as the models of depth cameras make it. Real noise repeats itself in part from frame to
frame, above all that of stereo, so that it falls by less.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from zlib import crc32

import numpy as np
from tqdm import tqdm

from benchmarks.edges.curves import frames_of, truth_of
from benchmarks.edges.edges_api import Edges, Pinhole
from benchmarks.edges.measure import BUNDLE, SOLIDS, WIDTH_PX
from export.edges.data import read_frames, seen_by
from export.edges.metrics import frame_figures
from export.solids.sensors import LEVELS

FRAMES = (1, 4, 16)
SENSORS = ("tof", "stereo")


def measure_fields(bundle: Path, views: int, level: str) -> dict[int, dict[str, float]]:
    """By frames averaged, means over validation views: RMSE of the field, median error of depth, both in r, and which
    fraction of what is known was averaged."""
    rows = {count: [] for count in FRAMES}
    for frame in tqdm(read_frames(SOLIDS / "val", WIDTH_PX, views), desc=level, unit="view", disable=None):
        rng = np.random.default_rng([crc32(level.encode()), frame.number])
        camera = Pinhole.centred(frame.depth.shape, frame.focal_px)
        with Edges(bundle, 1, average_frames=max(FRAMES)) as edges:
            for number in range(1, max(FRAMES) + 1):
                seen = seen_by(LEVELS[level], frame.depth, frame.focal_px, rng)
                if number not in rows:
                    edges.run(seen, camera)
                    continue
                result = edges.model.run_native(seen, camera.intrinsics(seen.shape))
                depth, found = _depth_of(result, seen.shape), edges.model.copied(result)
                counts = frame.counts & (seen > 0)
                off = np.abs(depth - frame.depth)[counts] / frame.depth[counts] * frame.focal_px
                rows[number].append((
                    frame_figures(found.distance_r, frame.distance, counts)["rmse_r"], np.median(off),
                    found.stats["averaged_pixel_count"] / max(1, (seen > 0).sum()),
                ))  # fmt: skip
    names = ("rmse_r", "depth_r", "averaged")
    return {count: dict(zip(names, np.mean(of, 0).round(3).tolist(), strict=True)) for count, of in rows.items()}


def _depth_of(result: object, shape: tuple[int, int]) -> np.ndarray:
    from maquette.native import native

    n = native()
    return n.plane("maq_edges_result_get_plane", result, n.lib.MAQ_EDGES_PLANE_DEPTH, shape, np.float32).copy()


def measure_boxes(bundle: Path, seeds: int, level: str) -> dict[int, dict[str, float]]:
    """By frames averaged, of cartons of stub:solids: which fraction has a box, median error of sides in mm, and what
    nine in ten are better than."""
    found, errors = ({count: [] for count in FRAMES} for _ in range(2))
    for seed in range(1, seeds + 1):
        true = np.sort(truth_of("box", seed, 0)["cartons_m"][0])[::-1]
        ((depth, camera),) = frames_of("box", "none", seed, 1)
        rng = np.random.default_rng([crc32(level.encode()), seed])
        with Edges(bundle, 1, average_frames=max(FRAMES)) as edges:
            for number in range(1, max(FRAMES) + 1):
                seen = seen_by(LEVELS[level], depth, camera.focal_px, rng)
                result = edges.run(seen, camera, curves=number in found)
                if number in found:
                    boxes = result.curves.boxes_m
                    found[number].append(bool(boxes))
                    errors[number] += list(1000 * np.abs(np.array(boxes[0]) - true)) if boxes else []
    return {
        count: {
            "with_box": float(np.mean(found[count])),
            "median_mm": round(float(np.median(of)), 1) if of else None,
            "p90_mm": round(float(np.percentile(of, 90)), 1) if of else None,
        }
        for count, of in errors.items()
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bundle", type=Path, default=BUNDLE)
    parser.add_argument("--views", type=int, default=24, help="of validation (default %(default)s)")
    parser.add_argument("--seeds", type=int, default=20, help="cartons (default %(default)s)")
    options = parser.parse_args()
    for level in SENSORS:
        for part, measure, amount in (
            ("fields", measure_fields, options.views), ("boxes", measure_boxes, options.seeds),
        ):  # fmt: skip
            for count, row in measure(options.bundle, amount, level).items():
                print(json.dumps({"sensor": level, "part": part, "frames": count, **row}), flush=True)


if __name__ == "__main__":
    main()
