"""Renders clips: frames with the exact motion of every pixel, one file a clip.

    python -m export.clips.dataset pushing --split train --clips 600 --processes 1 --out .data/clips

Each clip is a function of (set, split, number) alone, and its file (docs/reference/formats.md) appears atomically.
Existing files are kept, so a stopped run continues. Val and test clips have frames of 320 x 240 as well. Look at
some with `python -m export.clips.sheet` before you train on them.
"""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import time
from pathlib import Path

import cv2
from tqdm import tqdm

from export.clips.clip import SPLITS, write_clip
from export.jobs import Workers

# Where each set's function lies; imported in the process that renders: pushing needs PyBullet, shapes does not.
MAKERS = {
    "shapes": "export.clips.shapes:shapes_clip",
    "pushing": "export.clips.pushing:pushing_clip",
    "collages": "export.clips.collages:collages_clip",
}
_MAX_S = 600


def render(job: tuple[str, str, int, Path, bool]) -> float:
    """Writes one clip, with frames of 320 x 240 or without; returns the seconds that it took."""
    kind, split, number, path, large = job
    cv2.setNumThreads(1)
    begun = time.perf_counter()
    module, name = MAKERS[kind].split(":")
    make = getattr(importlib.import_module(module), name)
    write_clip(make(split, number, large), path)
    return time.perf_counter() - begun


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", choices=MAKERS, metavar="SET", help=" or ".join(MAKERS))
    parser.add_argument("--split", choices=SPLITS, default="train")
    parser.add_argument("--clips", type=int, default=100, help="default %(default)s")
    parser.add_argument("--first", type=int, default=0, help="number of the first clip (default %(default)s)")
    parser.add_argument("--out", type=Path, default=Path(".data/clips"))
    parser.add_argument("--large", action="store_true", help="frames of 320 x 240 in clips to train on, too")
    Workers.add_arguments(parser)
    options = parser.parse_args()
    if options.clips < 1:
        parser.error("--clips must be at least 1")
    if importlib.util.find_spec("pybullet") is None and options.kind == "pushing":
        parser.error("pushing needs PyBullet: scripts/make-venv.sh train,clips")
    folder = options.out / options.kind / options.split
    folder.mkdir(parents=True, exist_ok=True)
    numbers = range(options.first, options.first + options.clips)
    large = options.large or options.split != "train"
    jobs = [(options.kind, options.split, k, folder / f"clip-{k:05d}.npz", large) for k in numbers]
    missing = [job for job in jobs if not job[3].exists()]
    seconds, lost = 0.0, 0
    with tqdm(total=len(jobs), initial=len(jobs) - len(missing), unit="clip") as bar:
        for done in Workers.of(options, _MAX_S).run(render, missing):
            bar.update()
            if done.error is not None:
                lost += 1
                tqdm.write(f"{done.job[3].name} is left out: {done.error}")
                continue
            seconds += done.value
            bar.set_postfix(
                s_a_clip=f"{seconds / max(1, bar.n - (len(jobs) - len(missing)) - lost):.2f}", refresh=False
            )
    if lost == len(missing) > 0:
        raise SystemExit(f"None of {lost} clips could be rendered; the lines above say why.")


if __name__ == "__main__":
    main()
