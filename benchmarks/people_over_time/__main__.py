"""Measures ids of people over time: the library's, SORT's and ByteTrack's on the same boxes.

python -m benchmarks.people_over_time .data/people-clips/val
python -m benchmarks.people_over_time .data/people-clips/val --save build/people-over-time
python -m benchmarks.people_over_time .data/people-clips/val --detections build/people-over-time/every-1.json
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from tqdm import tqdm

from benchmarks.people_over_time import detections
from benchmarks.people_over_time.detections import Detections
from benchmarks.people_over_time.over_time import rated
from benchmarks.people_over_time.trackers import TRACKERS
from export.people.clips.clip_file import ClipError, Truth, clip_paths, read_clip

_PERCENT = ("HOTA", "DetA", "AssA", "IDF1", "MOTA", "recall", "precision")


def library_ids(found: Sequence[Detections]) -> list[np.ndarray]:
    return [one.ids for one in found]


def ids_of(name: str, found: Sequence[Detections]) -> list[np.ndarray]:
    """Ids that a new tracker gives to the boxes of one clip."""
    tracker, before, ids = TRACKERS[name](), None, []
    for one in found:
        seconds = 0.0 if before is None else (one.time_ns - before) / 1e9
        ids.append(tracker.update(one.boxes, one.scores, seconds))
        before = one.time_ns
    return ids


def measured(truths: dict[str, Truth], found: dict[str, list[Detections]]) -> dict[str, dict[str, float]]:
    """Scores by method. Raises ValueError for a clip that is missing."""
    missing = sorted(truths.keys() - found.keys())
    if missing:
        raise ValueError(f"There are no detections of {', '.join(missing)}.")
    clips = [(truth, found[name]) for name, truth in truths.items()]
    rows = {"library": rated(clips, library_ids)}
    return rows | {name: rated(clips, lambda own, name=name: ids_of(name, own)) for name in TRACKERS}


def show(console: Console, title: str, rows: dict[str, dict[str, float]]) -> None:
    table = Table(title=title)
    heads = (
        "method",
        *_PERCENT,
        "switches",
        "tracks of people",
        "recognised",
        "mistaken",
        "count changes a min (true)",
    )
    for head in heads:
        table.add_column(head, justify="left" if head == "method" else "right")
    for name, row in rows.items():
        table.add_row(
            name, *(f"{100 * row[key]:.1f}" for key in _PERCENT), str(row["switches"]),
            f"{row['tracks']} of {row['people']}", f"{row['recognised']} of {row['returns']}", str(row["mistaken"]),
            f"{row['count_changes_per_min']:.0f} ({row['true_count_changes_per_min']:.0f})",
        )  # fmt: skip
    console.print(table)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clips", type=Path, help="folder of clips (python -m export.people.clips.dataset)")
    parser.add_argument("--set", type=int, dest="own_set", help="only the clips of this set")
    parser.add_argument("--key-frames", type=int, nargs="+", default=[1, 4], metavar="N", help="default: 1 4")
    parser.add_argument("--bundle", type=Path, help="networks (default: the ones of the build)")
    parser.add_argument("--threads", type=int, default=0, help="default: chosen by the library")
    parser.add_argument("--detections", type=Path, nargs="+", help="files of --save, instead of running the library")
    parser.add_argument("--save", type=Path, metavar="FOLDER", help="keeps detections and scores")
    options = parser.parse_args()
    console = Console(width=160)
    try:
        paths = [p for p in clip_paths(options.clips) if options.own_set in (None, int(p.stem.split("-")[1]))]
        truths = {path.stem: read_clip(path).truth for path in paths}
        if options.detections:
            runs = {path.stem: detections.load(path) for path in options.detections}
        else:
            runs = {f"every-{n}": _detected(paths, n, options) for n in options.key_frames}
        report = {}
        for name, found in runs.items():
            report[name] = measured(truths, found)
            show(console, f"{name}: {len(truths)} clips, {sum(t.frames for t in truths.values())} frames", report[name])
            if options.save and not options.detections:
                detections.save(options.save / f"{name}.json", found)
        if options.save:
            options.save.mkdir(parents=True, exist_ok=True)
            (options.save / "scores.json").write_text(json.dumps(report, indent=1) + "\n")
    except (ClipError, ValueError, OSError, RuntimeError) as error:
        print(error, file=sys.stderr)
        return 1
    return 0


def _detected(paths: list[Path], key_frames: int, options: argparse.Namespace) -> dict[str, list[Detections]]:
    settings: dict[str, object] = {"key_frame_interval": key_frames, "threads": options.threads}
    if options.bundle:
        settings["bundle"] = options.bundle
    found = {}
    for path in tqdm(paths, desc=f"key frame every {key_frames}", unit="clip", disable=None):
        found[path.stem] = detections.detect(path.with_suffix(".maqrec"), **settings)
    return found


if __name__ == "__main__":
    sys.exit(main())
