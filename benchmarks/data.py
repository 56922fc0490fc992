"""Makes all data that the benchmark measures on: fetched photographs and scans, rendered people, places and solids.

    python -m benchmarks.data          makes missing data below .data; `make bench-data` installs what this needs
    python -m benchmarks.data --list   says what exists, what is missing, and how long it takes

Nothing here is training data of a shipped network. Data that exists is kept; delete its folder to make it again.
Exit status: 0 if all data exists, 1 if a command failed (the others still run).
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

DATA = Path(".data")


@dataclass(frozen=True)
class Set:
    """Data below `.data`. made: a pattern that its last command writes. commands: module and arguments.
    minutes: time on two cores. use: the sections that read it."""

    made: str
    commands: tuple[str, ...]
    minutes: float
    use: str

    def exists(self, folder: Path = DATA) -> bool:
        return any(folder.glob(self.made))


SETS = (
    Set("photos/*/*.jpg", ("export.photos fetch",), 4, "all"),
    Set("assets/*", ("export.people.assets",), 1, "all rendered people"),
    Set("people/test/shard-*.npz", ("export.people.dataset --split test --images 150 --per-shard 150",), 1,
        "sweep, agreement"),
    Set("people-wide/test/shard-*.npz",
        ("export.people.dataset --split test --images 100 --per-shard 150 --variety wide --out .data/people-wide",), 1,
        "person_sizes"),
    Set("teachers/labels/*.npz",
        ("export.teachers --photos .data/photos/photo .data/photos/test .data/photos/views",), 5, "person_sizes"),
    Set("teachers/backbone.pt", ("export.teachers.backbone",), 0.2, "scenes: distance by features"),
    Set("clips/pushing/val/*.npz", ("export.clips.dataset pushing --split val --clips 16",), 2, "prediction"),
    Set("places/test/*/transforms.json",
        ("export.places.assets", "export.places.dataset --split test --scenes 8"), 15, "scenes"),
    Set("places/real/house/transforms.json", ("export.captures fetch",), 5, "scenes, edges of a real box"),
    Set("bundles/scenes-fp32/manifest.json",
        ("export.scenes.export_onnx --checkpoint export/weights/scenes.pt",), 0.5, "scenes: error of int8"),
    Set("solids/val/solids-*.npz", ("export.solids.dataset val --whole --count 40 --out .data/solids/val",), 4,
        "edges"),
    Set("solids/test/solids-*.npz", ("export.solids.dataset test --whole --count 200 --out .data/solids/test",), 20,
        "edges"),
    Set("solids/real/solids-*.npz", ("export.depth_frames fetch --out .data/solids/real",), 2, "edges: scans of toys"),
    Set("solids/kicad/solids-*.npz", ("benchmarks.edges.cad_parts --out .data/solids/kicad",), 10,
        "edges: real CAD parts"),
)  # fmt: skip


def make(one: Set) -> bool:
    """Runs the commands of a set. Returns whether all of them succeeded."""
    return all(subprocess.run([sys.executable, "-m", *command.split()]).returncode == 0 for command in one.commands)


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.data", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--list", action="store_true", help="make nothing")
    options = parser.parse_args(argv)
    failed = []
    for number, one in enumerate(SETS, 1):
        state = "exists" if one.exists() else f"missing, some {one.minutes:g} minutes"
        print(f"[{number}/{len(SETS)}] {one.made}: {state} ({one.use})", flush=True)
        if options.list or one.exists():
            continue
        start = time.monotonic()
        if not make(one):
            failed.append(one.made)
        print(f"    {time.monotonic() - start:.0f} s", flush=True)
    if failed:
        print(f"Not made: {', '.join(failed)}. The benchmark leaves their figures out.", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
