"""Compares the edges that `maquette edges` finds on this processor with those on others, which qemu emulates.

The same bundle and the same depth frames on x86-64 with AVX2 but without VNNI, and on aarch64 without and with the dot
product and matrix instructions. Needs both builds and Debian's qemu-user; `make test-isa` makes them and runs this.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.processors.emulated import ROOT, Processor, add_arguments, compared, run_maquette, write_junit

SOURCES = tuple(
    f"stub:solids?scene={scene}&noise={noise}&size=320x240&seed=5"
    for scene, noise in (("shelf", "none"), ("shelf", "tof"), ("box", "tof"))
)
STEPS_OF_R = 1000  # scale of the 16-bit PNG
SHARP_R = 1.0
BAR = 0.99  # fraction of pixels on the same side of SHARP_R

EPILOG = """\
examples:
  python -m benchmarks.processors.field_agreement                                    three stub frames, all processors
  python -m benchmarks.processors.field_agreement --only avx2 'image:depth.png?depth_unit=0.001&fov=60'
"""


@dataclass(frozen=True)
class FieldAgreement:
    """Agreement of the fields of two folders of results, over all frames."""

    pixels: int  # pixels with a distance in either
    same_side: float  # fraction of pixels on the same side of SHARP_R
    rms_r: float  # root mean square of the difference, in r

    def passes(self, bar: float) -> bool:
        return self.same_side >= bar


def read_field(path: Path) -> np.ndarray:
    """Reads the distance in r, float32 [H, W]. Raises ValueError if it cannot be read."""
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if image is None or image.dtype != np.uint16:
        raise ValueError(f"{path} cannot be read as 16 bits; run maquette edges again.")
    return image.astype(np.float32) / STEPS_OF_R


def compare(reference: Path, other: Path) -> FieldAgreement:
    """Compares two folders of results of the same frames. Raises ValueError if they are not of the same frames, or if
    the reference has no edge at all."""
    names, others = (sorted(path.name for path in folder.glob("*_distance.png")) for folder in (reference, other))
    if names != others:
        raise ValueError(f"{reference} has fields of {len(names)} frames, but {other} of {len(others)} or others.")
    ours, theirs = ([read_field(folder / name) for name in names] for folder in (reference, other))
    for name, a, b in zip(names, ours, theirs, strict=True):
        if a.shape != b.shape:
            raise ValueError(f"{name} is {a.shape} in {reference}, but {b.shape} in {other}.")
    a, b = (np.concatenate([field.ravel() for field in fields] or [np.zeros(0)]) for fields in (ours, theirs))
    if not np.any(a < SHARP_R):
        raise ValueError(f"{reference} shows no edge, so there is nothing to compare. Take frames with edges.")
    return FieldAgreement(a.size, float(np.mean((a < SHARP_R) == (b < SHARP_R))), float(np.sqrt(np.mean((a - b) ** 2))))


def run(processor: Processor, bundle: Path, sources: Sequence[str], out: Path) -> None:
    """Writes the fields of a frame of each source into `out`, which is emptied first. Raises ValueError with the
    failure."""
    shutil.rmtree(out, ignore_errors=True)
    for k, source in enumerate(sources):
        settings = ["--bundle", str(bundle), "--threads", "1", "--max-frames", "1"]
        run_maquette(processor, ["edges", source, "--out", str(out / f"{k}"), *settings])
        for path in (out / f"{k}").glob("*_distance.png"):
            path.rename(out / f"{k}_distance.png")


def print_table(bundle: Path, results: dict[str, FieldAgreement | str], bar: float) -> None:
    table = Table(title=f"Fields of {bundle.name} against those on this processor", title_justify="left")
    table.add_column("processor", no_wrap=True)
    for column in ("pixels", "same side of r, %", "difference, r (RMS)", "bar"):
        table.add_column(column, justify="right")
    for name, found in results.items():
        if isinstance(found, str):
            table.add_row(name, *["-"] * 3, "failed")
            continue
        verdict = "held" if found.passes(bar) else "missed"
        table.add_row(name, str(found.pixels), f"{100 * found.same_side:.3f}", f"{found.rms_r:.4f}", verdict)
    Console(width=110).print(table)


def failure_of(found: FieldAgreement | str, bar: float) -> str | None:
    """Returns the failure as a sentence; None if there is none."""
    if isinstance(found, str) or found.passes(bar):
        return found if isinstance(found, str) else None
    return (
        f"{100 * found.same_side:.3f} % of the pixels are on the same side of r, where {100 * bar:g} % are asked for."
    )


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.processors.field_agreement",
        description=__doc__,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("sources", nargs="*", default=SOURCES, help="depth frames; default: three of stub:solids")
    parser.add_argument("--bundle", type=Path, default=ROOT / "sdk/models/edges-int8")
    parser.add_argument(
        "--bar", type=float, default=BAR, help="min. fraction of pixels on the same side of r (default %(default)s)"
    )
    add_arguments(parser, ROOT / "build/field-agreement")
    options = parser.parse_args(argv)
    try:
        results = compared(
            options, lambda processor, out: run(processor, options.bundle, options.sources, out), compare
        )
    except (ValueError, OSError, subprocess.CalledProcessError) as error:
        print(f"field_agreement: {error}", file=sys.stderr)
        return 1
    print_table(options.bundle, results, options.bar)
    failures = {title: failure_of(found, options.bar) for title, found in results.items()}
    if options.junit:
        write_junit(options.junit, "field_agreement", failures)
    return 1 if any(failures.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
