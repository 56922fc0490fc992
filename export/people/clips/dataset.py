"""Renders clips of people with exact truth: two files a clip (docs/reference/formats.md).

    python -m export.people.clips.dataset --split test --set 0 --clips 8

A clip is a function of (split, set, number) alone. Existing clips are kept, so a stopped run continues. Splits share no
body, motion clip, fabric, photo or panorama. Look at some first: `python -m export.people.clips.sheet`.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import cv2
from tqdm import tqdm

from export.jobs import Workers, results
from export.people.clips.clip_file import write_clip
from export.people.clips.film import Motions, plan_clip, shots_of, truth_of
from export.people.scene import SPLITS, Studio

SIZE = (640, 480)
_studios: dict[str, tuple[Studio, Motions]] = {}


def render(job: tuple[str, int, int, Path, Path]) -> tuple[int, float]:
    """Writes one clip; returns its frames and the seconds that it took."""
    split, own_set, number, path, places = job
    cv2.setNumThreads(1)
    begun = time.perf_counter()
    if split not in _studios:
        _studios[split] = Studio(split, *SIZE, places, points=False), Motions.of(split)
    studio, motions = _studios[split]
    plan = plan_clip(studio, motions, own_set, number)
    shots = list(shots_of(plan, studio, range(len(plan.seconds))))
    truth = truth_of(plan, shots)
    write_clip(path, [shot.jpeg for shot in shots], [shot.label for shot in shots], truth)
    return len(shots), time.perf_counter() - begun


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--split", choices=SPLITS, default="train")
    parser.add_argument("--set", type=int, default=0, dest="own_set", help="seed of the set (default %(default)s)")
    parser.add_argument("--clips", type=int, default=8, help="default %(default)s")
    parser.add_argument("--first", type=int, default=0, help="number of the first clip (default %(default)s)")
    parser.add_argument("--out", type=Path, default=Path(".data/people-clips"))
    parser.add_argument("--places", type=Path, default=Path(".data"), help="folder of backgrounds and panoramas")
    Workers.add_arguments(parser)
    options = parser.parse_args()
    folder = options.out / options.split
    folder.mkdir(parents=True, exist_ok=True)
    numbers = range(options.first, options.first + options.clips)
    jobs = [
        (options.split, options.own_set, k, folder / f"clip-{options.own_set:02}-{k:05}.npz", options.places)
        for k in numbers
    ]
    jobs = [job for job in jobs if not job[3].exists()]
    frames, seconds = 0, 0.0
    try:
        with tqdm(total=len(jobs), unit="clip") as bar:
            for _, (count, spent) in results(Workers.of(options).run(render, jobs)):
                frames, seconds = frames + count, seconds + spent
                bar.update()
                bar.set_postfix(s_a_frame=f"{seconds / frames:.2f}", refresh=False)
    except (OSError, RuntimeError, ValueError) as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
