"""Measures how steady and how right the surface is in clips with truth: each frame alone, and as a stream.

python -m benchmarks.people_over_time.steadiness .data/people-clips/val
python -m benchmarks.people_over_time.steadiness .data/people-clips/val --steadiness -1 0.5 0.8 0.9 --preset photo
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from tqdm import tqdm

from benchmarks.people_over_time.over_time import counted
from benchmarks.people_over_time.surface_over_time import SurfaceScores, rate
from export.people.clips.clip_file import ClipError, PeopleClip, clip_paths, read_clip
from export.people.outfit import GRID
from export.surface_grid import SurfaceGrid


def painted(clip: PeopleClip, alone: bool, settings: dict[str, object]) -> Iterator[np.ndarray]:
    """Parts, U and V of each frame, uint8 [H, W, 3]. alone: the frames before do not count. Raises MaquetteError."""
    import maquette

    with maquette.DensePose(**settings) as dense, maquette.Source(clip.recording) as source:
        for frame in source:
            result = dense.run(np.asarray(frame) if alone else frame)
            yield np.stack([result.part, result.u, result.v], -1)


def measured(paths: list[Path], name: str, alone: bool, settings: dict[str, object]) -> dict[str, float]:
    scores, grid = SurfaceScores(), SurfaceGrid.load(GRID)
    for path in tqdm(paths, desc=name, unit="clip", disable=None):
        clip = read_clip(path)
        must = counted(clip.truth)
        images = painted(clip, alone, settings)
        frames = ((clip.label(t), iuv, must[t]) for t, iuv in enumerate(images))
        rate(scores, frames, float(clip.truth.facts["fps"]), grid)
    return scores.figures()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clips", type=Path, help="folder of clips (python -m export.people.clips.dataset)")
    parser.add_argument("--set", type=int, dest="own_set", help="only the clips of this set")
    parser.add_argument("--steadiness", type=float, nargs="+", default=[-1, 0], metavar="S", help="default: -1 0")
    parser.add_argument("--key-frames", type=int, default=1, metavar="N", help="default: 1")
    parser.add_argument("--preset", choices=("stream", "photo"), default="stream")
    parser.add_argument("--bundle", type=Path, help="networks (default: the ones of the build)")
    parser.add_argument("--threads", type=int, default=0, help="default: chosen by the library")
    options = parser.parse_args()
    common: dict[str, object] = {"threads": options.threads, "preset": options.preset}
    if options.bundle:
        common["bundle"] = options.bundle
    table = Table(title=str(options.clips))
    try:
        paths = [p for p in clip_paths(options.clips) if options.own_set in (None, int(p.stem.split("-")[1]))]
        rows = {"each frame alone": measured(paths, "each frame alone", True, common)}
        for steadiness in options.steadiness:
            name = f"stream, steadiness {steadiness:g}"
            own = {"key_frame_interval": options.key_frames, "steadiness": steadiness}
            rows[name] = measured(paths, name, False, common | own)
    except (ClipError, ValueError, OSError, RuntimeError) as error:
        print(error, file=sys.stderr)
        return 1
    for head in ("frames", *next(iter(rows.values()))):
        table.add_column(head, justify="left" if head == "frames" else "right")
    for name, row in rows.items():
        table.add_row(name, *(f"{value:.3f}" for value in row.values()))
    Console(width=140).print(table)
    return 0


if __name__ == "__main__":
    sys.exit(main())
