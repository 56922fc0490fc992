"""Measures how many events camera health finds in real films, by kind, and what it says in films without events.

    python -m benchmarks.camera_health      a table; build/benchmarks/camera_health.json

Events are put into parts of 66 frames of each film (events.py). A part counts as found where the event is named within
a second of its beginning; the baselines name no kinds, so any event of theirs counts. Frames without events are all
frames of all films.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from pathlib import Path

from tqdm import tqdm

from benchmarks.camera_health.detectors import DETECTORS
from benchmarks.camera_health.events import AFTER, BEFORE, KINDS, staged, window
from benchmarks.camera_health.films import FILMS, read_film

PARTS = 3  # of each film


def measure(folder: Path, names: list[str], detectors: list[str]) -> dict:
    """Returns, by detector, found parts by kind, and false events with the minutes by kind of camera."""
    films = {name: read_film(folder / name) for name in names}
    span = BEFORE + AFTER
    document: dict = {name: {"found": Counter(), "false": Counter(), "where": []} for name in detectors}
    parts: Counter[str] = Counter()
    minutes: Counter[str] = Counter()
    for number, (name, (film, fps)) in enumerate(tqdm(films.items(), desc="camera health", disable=None)):
        camera = FILMS[name]
        minutes[camera] += len(film) / fps / 60
        shown = window(film)
        for detector in detectors:
            events = DETECTORS[detector](shown, fps)
            document[detector]["false"][camera] += len(events)
            document[detector]["where"] += [f"{name} {frame / fps:.1f} s: {kind}" for frame, kind in events]
        others = [other for other in names if other != name]
        for part in range(PARTS):
            begin = int((len(film) - span) * (part + 0.5) / PARTS)
            for k, kind in enumerate(KINDS):
                other = films[others[(number + 3 * part + k) % len(others)]][0]
                other_begin = int((len(other) - span) * 0.37)
                made = staged(
                    kind, film[begin : begin + span], other[other_begin : other_begin + span],
                    1000 * number + 10 * part + k,
                )  # fmt: skip
                parts[kind] += 1
                for detector in detectors:
                    events = DETECTORS[detector](made.frames, fps)
                    named = [of for frame, of in events if made.at - 1 <= frame <= made.at + AFTER]
                    document[detector]["found"][kind] += kind in named or "event" in named
    return {"parts": parts, "minutes": minutes, "detectors": document, "films": names}


def table_of(document: dict) -> list[list[str]]:
    """Returns a header and a row for each detector: percent of each kind, and false events with those an hour."""
    minutes = document["minutes"]
    cameras = [camera for camera in ("static", "moving") if minutes.get(camera)]
    rows = [["", *KINDS, *(f"false, {camera} camera ({minutes[camera]:.1f} min)" for camera in cameras)]]
    for name, own in document["detectors"].items():
        found = [f"{100 * own['found'].get(kind, 0) / document['parts'][kind]:.0f} %" for kind in KINDS]
        false = [
            f"{own['false'].get(camera, 0)} ({60 * own['false'].get(camera, 0) / minutes[camera]:.0f} an hour)"
            for camera in cameras
        ]
        rows.append([name, *found, *false])
    return rows


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.camera_health",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--films", type=Path, default=Path(".data/films"), metavar="DIR")
    parser.add_argument("--only", nargs="+", default=list(FILMS), choices=list(FILMS), metavar="FILM")
    parser.add_argument("--detectors", nargs="+", default=list(DETECTORS), choices=list(DETECTORS))
    parser.add_argument("--out", type=Path, default=Path("build/benchmarks/camera_health.json"), metavar="FILE")
    options = parser.parse_args(argv)
    document = measure(options.films, options.only, options.detectors)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    options.out.write_text(json.dumps(document, indent=1) + "\n")
    for i, row in enumerate(table_of(document)):
        print("| " + " | ".join(row) + " |")
        if i == 0:
            print("|" + " --- |" * len(row))
    for name, own in document["detectors"].items():
        if name == "camera health":
            print("\n".join(own["where"]))
    print(f"Written: {options.out}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
