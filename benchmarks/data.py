"""Makes all data that the benchmark measures on: fetched photographs and scans, rendered people, places and solids.

    python -m benchmarks.data          makes missing data below .data; `make bench-data` installs what this needs
    python -m benchmarks.data --list   says what exists, what is missing, and how long it takes

Nothing here is training data of a shipped network. Commands that succeeded are noted in `.data/bench-data.json` and not
run again. Exit status: 0 if all data exists, 1 if a command failed (the others still run).
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

DATA, DONE = Path(".data"), "bench-data.json"


@dataclass(frozen=True)
class Set:
    """Data below `.data`. folder: where it lies. commands: module and arguments; each continues where it was stopped.
    minutes: time on two cores. use: the sections that read it."""

    folder: str
    commands: tuple[str, ...]
    minutes: float
    use: str


SETS = (
    Set("photos", ("export.photos fetch",), 2, "all"),
    Set("assets", ("export.people.assets",), 2, "all rendered people"),
    Set("people/test", ("export.people.dataset --split test --images 150 --per-shard 150",), 1,
        "sweep, agreement"),
    Set("people-wide/test",
        ("export.people.dataset --split test --images 100 --per-shard 150 --variety wide --out .data/people-wide",), 1,
        "person_sizes"),
    Set("teachers/labels",
        ("export.teachers --photos .data/photos/photo .data/photos/test .data/photos/views",), 2, "person_sizes"),
    Set("teachers/backbone.pt", ("export.teachers.backbone",), 0.2, "scenes: distance by features"),
    Set("clips/pushing/val", ("export.clips.dataset pushing --split val --clips 16",), 3, "prediction"),
    Set("places/test",
        ("export.places.assets", "export.places.dataset --split test --scenes 8"), 11, "scenes"),
    Set("places/real", ("export.captures fetch",), 4, "scenes, edges of a real box"),
    Set("bundles/scenes-fp32",
        ("export.scenes.export_onnx --checkpoint export/weights/scenes.pt",), 0.5, "scenes: error of int8"),
    Set("solids/val", ("export.solids.dataset val --whole --count 40 --out .data/solids/val",), 2,
        "edges"),
    Set("solids/test", ("export.solids.dataset test --whole --count 200 --out .data/solids/test",), 4,
        "edges"),
    Set("solids/real", ("export.depth_frames fetch --out .data/solids/real",), 1, "edges: scans of toys"),
    Set("solids/kicad", ("benchmarks.edges.cad_parts --out .data/solids/kicad",), 3,
        "edges: real CAD parts"),
)  # fmt: skip


def read_done(data: Path = DATA) -> list[str]:
    """Returns the commands that succeeded before."""
    path = data / DONE
    return json.loads(path.read_text()) if path.exists() else []


def make(commands: tuple[str, ...], data: Path = DATA) -> bool:
    """Runs those commands that did not succeed before, in order. Returns whether all of them succeeded."""
    for command in commands:
        done = read_done(data)
        if command in done:
            continue
        if subprocess.run([sys.executable, "-m", *command.split()]).returncode:
            return False
        data.mkdir(parents=True, exist_ok=True)
        (data / DONE).write_text(json.dumps([*done, command], indent=1) + "\n")
    return True


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.data", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--list", action="store_true", help="make nothing")
    options = parser.parse_args(argv)
    failed = []
    for number, one in enumerate(SETS, 1):
        is_done = set(one.commands) <= set(read_done())
        state = "exists" if is_done else f"missing, {one.minutes:g} minutes"
        print(f"[{number}/{len(SETS)}] {DATA / one.folder}: {state} ({one.use})", flush=True)
        if options.list or is_done:
            continue
        start = time.monotonic()
        if not make(one.commands):
            failed.append(one.folder)
        print(f"    {time.monotonic() - start:.0f} s", flush=True)
    if failed:
        print(f"Not made: {', '.join(failed)}. The benchmark leaves their figures out.", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
