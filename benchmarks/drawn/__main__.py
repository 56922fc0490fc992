"""How near frames that are drawn are to the truth, what their uncertainty is worth, and how real they look.

    python -m benchmarks.drawn                   validation clips of pushing, 5 frames given, 11 made (10 minutes)
    python -m benchmarks.drawn --clips 4         fewer clips, to see that it runs
    python -m benchmarks.drawn --real            parts of real clips at 320 x 240 instead, with 4 samples
    python -m benchmarks.drawn --times           how long drawing takes, on a quiet machine; nothing else

Needs clips of `export.clips` (.data/clips/pushing/val; for the distance of real clips from one another, train too) and
the built library (`make build`).
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from benchmarks.drawn.measure import clips_of, filmed, measure_pictures, measure_times, real_clips
from benchmarks.drawn.tables import drawn_tables
from benchmarks.prediction import BUNDLE


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.drawn", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--bundle", type=Path, default=BUNDLE)
    parser.add_argument("--data", type=Path, default=Path(".data/clips"))
    parser.add_argument("--set", default="pushing", help="default %(default)s")
    parser.add_argument("--clips", type=int, help="at most so many; default: all")
    parser.add_argument("--real", action="store_true")
    parser.add_argument("--photos", type=Path, default=Path(".data/photos/clip"), help="folder of real clips")
    parser.add_argument(
        "--convolutional", type=Path, default=Path(".data/runs/prediction-convolutional/weights.pt"), metavar="WEIGHTS",
        help="of export.prediction.pictures.train_convolutional, to compare; left out where they are not there",
    )  # fmt: skip
    parser.add_argument("--times", action="store_true")
    parser.add_argument("--threads", type=int, default=1, help="with --times (default %(default)s)")
    options = parser.parse_args()
    clips = (
        filmed(options.photos, options.clips) if options.real else clips_of(options.data, options.set, options.clips)
    )
    if options.times:
        found, figures = measure_times(clips, options.bundle, options.threads)
        for name, own in found.items():
            print(f"{name} | {own:.1f} ms")
    else:
        weights = options.convolutional if options.convolutional.exists() else None
        if options.real:
            document, figures = measure_pictures(clips, np.empty(0), options.bundle, samples=4, weights=weights)
        else:
            others = real_clips(options.data, options.set, len(clips))
            document, figures = measure_pictures(clips, others, options.bundle, weights=weights)
        for part in drawn_tables(document):
            print(part if isinstance(part, str) else "\n".join(" | ".join(row) for row in part) + "\n")
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
