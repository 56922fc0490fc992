"""Error of held-out photos against the density of a real capture's cloud: points, and depth maps that must agree.

    python -m benchmarks.scenes.capture_density            (after scripts/make-venv.sh captures, make build)

Photos are posed and swept once; each row fuses the same depth maps otherwise, builds a scene with the shipped networks,
and renders the held-out photos. The defaults of `export.captures` were chosen by this table (docs/scenes.md).
"""

from __future__ import annotations

import argparse
import tempfile
from itertools import product
from pathlib import Path

import cv2
import numpy as np
from tqdm import tqdm

from benchmarks.scenes import command as scene_command
from export.captures.dense import fused
from export.captures.folder import Sources, pose_and_sweep
from export.captures.originals import ORIGINALS
from export.scenes.picture_quality import psnr_db

NETWORKS = Path("sdk/models/scenes-int8")
POINTS = (50_000, 100_000, 200_000, 400_000, 800_000, 10_000_000)
WITNESSES = (1, 2, 3, 4)
COLUMNS = ("capture", "witnesses", "points", "PSNR dB", "build s", "render ms", "scene MB", "cloud MB")


def measured(folder: Path, sources: Sources, max_points: int, min_witnesses: int) -> list:
    """Points, PSNR in dB (mean over the held-out photos), seconds of the build, ms of a picture, MB of the scene and of
    the cloud."""
    xyz, rgb = fused(sources.cameras, sources.images, sources.depths, max_points, min_witnesses)
    sources.write_clouds(folder, xyz, rgb)
    scene = folder / "scene.maqs"
    built = scene_command.build(folder, scene, NETWORKS)
    rendered = scene_command.render(scene, NETWORKS, folder, folder / "pictures")
    errors = [
        psnr_db(picture, cv2.imread(str(folder / name))[..., ::-1] / 255) for name, picture in rendered.pictures.items()
    ]
    return [len(xyz), float(np.mean(errors)), built.seconds["total"], rendered.ms["total"], built.bytes / 1e6,
            (folder / "cloud.ply").stat().st_size / 1e6]  # fmt: skip


def main() -> None:
    names = [original.name for original in ORIGINALS]
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.scenes.capture_density", description=__doc__.split("\n")[0]
    )
    parser.add_argument("--only", nargs="+", choices=names, default=names, help="captures; default: all")
    parser.add_argument("--points", type=int, nargs="+", default=POINTS)
    parser.add_argument("--witnesses", type=int, nargs="+", default=WITNESSES)
    options = parser.parse_args()
    print("| " + " | ".join(COLUMNS) + " |\n" + "| --- " * len(COLUMNS) + "|")
    for original in ORIGINALS:
        if original.name not in options.only:
            continue
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name) / original.name
            sources = pose_and_sweep(original, folder)[2]
            before = {}
            for witnesses, points in tqdm([*product(options.witnesses, options.points)], leave=False):
                row = measured(folder, sources, points, witnesses)
                if before.get(witnesses) != row[0]:  # else all that agree are in the row before
                    tqdm.write("| {} | {} | {:,} | {:.2f} | {:.1f} | {:.0f} | {:.1f} | {:.1f} |".format(
                        original.name, witnesses, *row))  # fmt: skip
                before[witnesses] = row[0]


if __name__ == "__main__":
    main()
