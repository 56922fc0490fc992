"""Compares camera health and the likeliest next frames of this processor with emulated ones (qemu).

It compares what motion leaves unexplained in the first frames of a stream, and images that the shipped networks decode
at temperature 0, on x86-64 with AVX2 but without VNNI, and on aarch64 without and with the dot product and matrix
instructions. Needs both builds and Debian's qemu-user; `make test-isa` makes them and runs this.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.processors.emulated import ROOT, Processor, add_arguments, compared, run_maquette, write_junit

SOURCE = "stub:people?count=2&seed=3&size=64x64&frames=8"
FROM, SAMPLED = 5, 2  # the last observed frame, and the frames predicted after it
CELLS = 16  # cells a side of a frame of codes
MAX_LEVELS = 1  # accepted difference of pixels in cells with equal codes
BAR = 0.99  # fraction of cells
MAX_UNEXPLAINED = 0.01  # accepted difference of the unexplained fraction of a frame


@dataclass(frozen=True)
class PredictionAgreement:
    """Agreement of two folders of results."""

    frames: int  # frames whose camera was checked
    worst: float  # largest difference of the unexplained fraction of a frame
    same_events: bool
    same_cells: float  # fraction of cells with the same codes

    def passes(self, bar: float) -> bool:
        return self.same_cells >= bar and self.worst <= MAX_UNEXPLAINED and self.same_events


def read_health(folder: Path) -> list[dict]:
    return [json.loads(line) for line in (folder / "health.json").read_text().splitlines()]


def same_cells(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Compares two images uint8 [H, W, 3] whose sides are multiples of CELLS: bool [CELLS, CELLS]."""
    worst = np.abs(one.astype(int) - other.astype(int)).max(-1)
    height, width = worst.shape
    return worst.reshape(CELLS, height // CELLS, CELLS, width // CELLS).max((1, 3)) <= MAX_LEVELS


def compare(reference: Path, other: Path) -> PredictionAgreement:
    """Compares two folders of results. Raises ValueError if they are not of the same frames, or have none."""
    ours, theirs = read_health(reference), read_health(other)
    names, others = (sorted(path.name for path in folder.glob("*.png")) for folder in (reference, other))
    if not ours or not names or len(ours) != len(theirs) or names != others:
        raise ValueError(
            f"{reference} has {len(ours)} frames and {len(names)} images, {other} {len(theirs)} and {len(others)}."
        )
    differences = [abs(a["unexplained"] - b["unexplained"]) for a, b in zip(ours, theirs, strict=True)]
    flags = [
        [frame[name] for frame in found for name in ("event", "state", "stream_start")] for found in (ours, theirs)
    ]
    cells = [same_cells(*(cv2.imread(str(folder / name)) for folder in (reference, other))) for name in names]
    return PredictionAgreement(len(ours), max(differences), flags[0] == flags[1], float(np.mean(cells)))


def run(processor: Processor, bundle: Path, out: Path) -> None:
    """Writes camera health and predicted frames into `out`, which is emptied first. Raises ValueError with the
    failure."""
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    settings = ["--bundle", str(bundle), "--threads", "1"]
    (out / "health.json").write_text(run_maquette(processor, ["health", SOURCE, "--json"]))
    sampling = ["--samples", "1", "--temperature", "0", "--from", str(FROM)]
    sampling += ["--frames", str(SAMPLED), "--out", str(out)]
    run_maquette(processor, ["predict", SOURCE, *sampling, *settings])


def print_table(bundle: Path, results: dict[str, PredictionAgreement | str], bar: float) -> None:
    table = Table(title=f"Prediction by {bundle.name} against that on this processor", title_justify="left")
    table.add_column("processor", no_wrap=True)
    for column in ("frames", "unexplained, worst, %", "events", "equal cells, %", "bar"):
        table.add_column(column, justify="right")
    for name, found in results.items():
        if isinstance(found, str):
            table.add_row(name, *["-"] * 4, "failed")
            continue
        events = "the same" if found.same_events else "others"
        metrics = (str(found.frames), f"{100 * found.worst:.3f}", events, f"{100 * found.same_cells:.2f}")
        table.add_row(name, *metrics, "held" if found.passes(bar) else "missed")
    Console(width=110).print(table)


def failure_of(found: PredictionAgreement | str, bar: float) -> str | None:
    """Returns the failure as a sentence; None if there is none."""
    if isinstance(found, str) or found.passes(bar):
        return found if isinstance(found, str) else None
    return (
        f"{100 * found.same_cells:.2f} % of the cells are equal; at least {100 * bar:g} % are required; "
        f"unexplained fractions differ by up to {100 * found.worst:.3f} %, where {100 * MAX_UNEXPLAINED:g} % "
        f"are allowed; events are {'the same' if found.same_events else 'others'}."
    )


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.processors.prediction_agreement",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--bundle", type=Path, default=ROOT / "sdk/models/prediction-int8")
    parser.add_argument("--bar", type=float, default=BAR, help="min. fraction of equal cells (default %(default)s)")
    add_arguments(parser, ROOT / "build/prediction-agreement")
    options = parser.parse_args(argv)
    try:
        results = compared(options, lambda processor, out: run(processor, options.bundle, out), compare)
    except (ValueError, OSError, subprocess.CalledProcessError) as error:
        print(f"prediction_agreement: {error}", file=sys.stderr)
        return 1
    print_table(options.bundle, results, options.bar)
    failures = {title: failure_of(found, options.bar) for title, found in results.items()}
    if options.junit:
        write_junit(options.junit, "prediction_agreement", failures)
    return 1 if any(failures.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
