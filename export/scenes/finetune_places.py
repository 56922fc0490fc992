"""Builds and fine-tunes the scenes of several places, for `python -m benchmarks --fine-tuned`.

    python -m export.scenes.finetune_places .data/places/test/* --networks sdk/models/scenes-int8 \\
        --weights RUN/weights.pt --save-at 10 60 --out .data/tuned

Writes OUT/PLACE/10s.maqs and so on, with 10s-networks beside where the refiner is tuned too. Places whose last file is
there are left as they are.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

PROGRAM = Path("build/release/stage/bin/maquette")


def tune_place(place: Path, options: argparse.Namespace) -> None:
    """Raises subprocess.CalledProcessError where a command fails; it has said why."""
    networks = ("--networks", options.networks)
    with tempfile.TemporaryDirectory() as work:
        scene = Path(work) / "scene.maqs"
        subprocess.run([options.program, "scene", "build", place, *networks, "--out", scene], check=True)
        tuning = [sys.executable, "-m", "export.scenes.finetune", place, *networks, "--weights", options.weights]
        tuning += ["--scene", scene, "--out", options.out / place.resolve().name]
        tuning += ["--save-at", *(f"{x:g}" for x in options.save_at), *(["--refiner"] if options.refiner else [])]
        subprocess.run(tuning, check=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("places", type=Path, nargs="+", help="folders with transforms.json")
    parser.add_argument("--networks", type=Path, required=True, help="bundle")
    parser.add_argument("--weights", type=Path, required=True, help="weights.pt that the bundle was exported from")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--save-at", type=float, nargs="+", default=[10.0, 60.0, 600.0], metavar="SECONDS")
    parser.add_argument("--refiner", action="store_true", help="tune the refiner too")
    parser.add_argument("--program", type=Path, default=PROGRAM, help="maquette")
    options = parser.parse_args()
    places = [place for place in options.places if (place / "transforms.json").exists()]
    if not places:
        raise SystemExit("None of these folders has a transforms.json in it.")
    for k, place in enumerate(places):
        if (options.out / place.resolve().name / f"{options.save_at[-1]:g}s.maqs").exists():
            print(f"{place}: is there")
            continue
        print(f"{place}: {k + 1} of {len(places)}", flush=True)
        try:
            tune_place(place, options)
        except (OSError, subprocess.CalledProcessError) as error:
            raise SystemExit(f"{place} was not tuned: {error}") from None


if __name__ == "__main__":
    main()
