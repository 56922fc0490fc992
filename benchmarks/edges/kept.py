"""What keeping the field of areas that do not change saves, and its error, with a camera at rest.

    python -m benchmarks.edges.kept           minutes; needs `make build` and .data/solids

Each frame has noise of its own, as the models of depth cameras make it.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from pathlib import Path
from zlib import crc32

import numpy as np
from tqdm import tqdm

from export.edges.data import read_frames, seen_by
from export.edges.metrics import frame_figures
from export.evaluation.edges_api import Edges, Pinhole, depth_frames
from export.solids.sensors import LEVELS

KEEP_FRAMES = 8
OPTION = f"field kept for {KEEP_FRAMES} frames"
SCENES = ("wall", "box", "shelf")
NOISES = {"none": "clean", "tof": "tof", "stereo": "stereo"}  # of stub:solids, and the level of each
PLATE_PX, STEP_PX, NEARER = 40, 4, 0.85  # of a plate that moves before a scene; by its depth


def frames_at_rest(
    scene: str, noise: str, size_px: tuple[int, int], count: int, moving: bool
) -> Iterator[tuple[np.ndarray, Pinhole]]:
    """Depth [H, W] of one moment of the simulated camera, with new noise each time. moving: a plate goes to and fro in
    its upper left quarter."""
    ((exact, camera),) = depth_frames(f"stub:solids?scene={scene}&noise=none&size={size_px[0]}x{size_px[1]}", 1)
    rng = np.random.default_rng(crc32(f"{scene} {noise}".encode()))
    height, width = (side // 2 for side in exact.shape)
    at, step = 8, STEP_PX
    for _ in range(count):
        depth = exact.copy()
        if moving:
            top = (height - PLATE_PX) // 2
            area = depth[top : top + PLATE_PX, at : at + PLATE_PX]
            area[:] = NEARER * depth[depth > 0].min()
            if not 8 <= at + step <= width - PLATE_PX - 8:
                step = -step
            at += step
        yield seen_by(LEVELS[NOISES[noise]], depth, camera.focal_px, rng), camera


def measure_savings(
    bundle: Path,
    threads: int,
    size_px: tuple[int, int],
    frames: int,
    scenes: Iterable[str] = SCENES,
    noises: Iterable[str] = tuple(NOISES),
) -> list[dict]:
    """For each scene, noise, at rest and with a moving plate: rows as speed.measure_savings has them. Times are means,
    because every so many frames the whole is found again."""
    rows = []
    for scene in tqdm(scenes, desc="edges: kept fields", unit="scene", disable=None):
        for noise in noises:
            for moving in (False, True):
                tally = {"without": [], "with": [], "square": [], "side": [], "share": []}
                with ExitStack() as stack:
                    plain = stack.enter_context(Edges(bundle, threads))
                    keeping = stack.enter_context(Edges(bundle, threads, keep_frames=KEEP_FRAMES))
                    for number, (depth, camera) in enumerate(frames_at_rest(scene, noise, size_px, frames + 1, moving)):
                        whole, kept = plain.run(depth, camera), keeping.run(depth, camera)
                        if not number:  # the first frame prepares the network
                            continue
                        known = depth > 0
                        tally["without"].append(whole.stats.total_ms)
                        tally["with"].append(kept.stats.total_ms)
                        tally["square"].append(np.mean((whole.distance - kept.distance)[known] ** 2))
                        tally["side"].append(((whole.distance < 1) != (kept.distance < 1))[known].mean())
                        tally["share"].append(kept.stats.network_pixel_count / max(whole.stats.network_pixel_count, 1))
                means = {name: float(np.mean(values)) for name, values in tally.items()}
                rows.append({"scene": scene, "noise": noise,
                             "option": f"{OPTION}, {'a plate moves' if moving else 'at rest'}",
                             "ms_without": means["without"], "ms": means["with"],
                             "difference_r": float(np.sqrt(means["square"])), "other_side": means["side"],
                             "network_fraction": means["share"]})  # fmt: skip
    return rows


def measure_errors(bundle: Path, folder: Path, width_px: int, views: int, level: str) -> dict[str, float]:
    """Means over validation views at rest and 2 * KEEP_FRAMES frames: RMSE of the field in r without and with this, and
    the share of frames' pixels that the network ran on."""
    plain, kept, share = [], [], []
    for frame in read_frames(folder, width_px, views):
        rng = np.random.default_rng([crc32(level.encode()), frame.number])
        camera = Pinhole.centred(frame.depth.shape, frame.focal_px)
        with Edges(bundle, 1) as whole, Edges(bundle, 1, keep_frames=KEEP_FRAMES) as keeping:
            for _ in range(2 * KEEP_FRAMES):
                seen = seen_by(LEVELS[level], frame.depth, frame.focal_px, rng)
                counts = frame.counts & (seen > 0)
                for edges, errors in ((whole, plain), (keeping, kept)):
                    found = edges.run(seen, camera)
                    errors.append(frame_figures(found.distance, frame.distance, counts)["rmse_r"])
                share.append(found.stats.network_pixel_count / seen.size)
    return {"rmse_without_r": float(np.mean(plain)), "rmse_r": float(np.mean(kept)), "network": float(np.mean(share))}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bundle", type=Path, default=Path("sdk/models/edges-int8"))
    parser.add_argument("--data", type=Path, default=Path(".data/solids/val"), help="default: %(default)s")
    parser.add_argument("--views", type=int, default=12, help="of validation (default %(default)s)")
    parser.add_argument("--frames", type=int, default=40, help="of each scene (default %(default)s)")
    options = parser.parse_args()
    for level in NOISES.values():
        row = measure_errors(options.bundle, options.data, 320, options.views, level)
        print(json.dumps({"sensor": level, "views": options.views, **row}), flush=True)
    for row in measure_savings(options.bundle, 2, (320, 240), options.frames):
        print(json.dumps(row), flush=True)


if __name__ == "__main__":
    main()
