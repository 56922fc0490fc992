"""Exactness of motion, and SSIM of what is predicted by it, of sets of clips at 320 x 240.

    python -m benchmarks.foreseen pushing people flights    some minutes
    python -m benchmarks.foreseen pushing --clips 2         to see that it runs

Needs validation clips of `export.clips`, the built library and the program find_motion.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from benchmarks.foreseen import motion_error
from benchmarks.foreseen.structure import structure_of
from benchmarks.prediction import BUNDLE, HORIZONS, clip_films


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.foreseen", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("sets", nargs="+", metavar="SET", help="of export.clips")
    parser.add_argument("--data", type=Path, default=Path(".data/clips"))
    parser.add_argument("--clips", type=int, default=24, help="at most so many (default %(default)s)")
    options = parser.parse_args()
    for kind in options.sets:
        folder = options.data / kind / "val"
        found = motion_error.measure(sorted(folder.glob("clip-*.npz"))[: options.clips])
        for name, says in motion_error.METHODS.items():
            if name in found:
                print(f"{kind}, {found['clips']} clips | {says} | mean {found[name][0]:.2f} px, "
                      f"median {found[name][1]:.2f} px", flush=True)  # fmt: skip
        rows = [structure_of(film.bgr, film.fps, HORIZONS, BUNDLE) for film in clip_films(folder, options.clips)]
        for name in rows[0] if rows else ():
            means = np.mean([own[name] for own in rows], 0)
            print(f"{kind} | SSIM, {name} | " + " | ".join(f"{value:.4f}" for value in means), flush=True)


if __name__ == "__main__":
    main()
