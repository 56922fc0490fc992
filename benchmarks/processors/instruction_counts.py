"""Counts the instructions of a frame of dense pose, stage by stage, on emulated processors: a metric without a phone.

    python -m benchmarks.processors.instruction_counts             the bundled photo, all processors; writes a table

Runs `maquette bench` of the builds `release` and `aarch64` (scripts/test-isa.sh makes them) on one thread, with a clock
that counts instructions: a plugin of qemu counts, and a library preloaded into the program tells its count as the time.
Counts repeat to a thousandth. How long an instruction takes is another question.
"""

from __future__ import annotations

import argparse
import concurrent.futures
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from tqdm import tqdm

from benchmarks.processors.emulated import OTHERS, ROOT, Processor, check_features

BUILD = ROOT / "build/instruction-counts"
PLUGIN = BUILD / "count_instructions.so"
SOURCES = (str(ROOT / "tests/media/photo.jpg"), "stub:people?count=2&size=640x480")
COMPILERS = {"release": "cc", "aarch64": "aarch64-linux-gnu-gcc"}
STAGES = {
    "preprocess": "resize and normalise",
    "trunk": "trunk",
    "proposals": "RPN, top-k, NMS",
    "box_head": "RoIAlign, box head, NMS",
    "dense_head": "RoIAlign, dense head",
    "decode": "decode",
}
"""Stages of `maquette bench`, and what is done there."""


def compile_library(source: str, compiler: str, out: Path) -> None:
    """Compiles a file. Raises ValueError with the compiler's message."""
    out.parent.mkdir(parents=True, exist_ok=True)
    command = [compiler, "-O2", "-Wall", "-Wextra", "-shared", "-fPIC", "-o", str(out), str(ROOT / source)]
    try:
        done = subprocess.run(command, capture_output=True, text=True)
    except FileNotFoundError:
        raise ValueError(f"{compiler} is missing: scripts/install-packages.sh isa installs it.") from None
    if done.returncode:
        raise ValueError(f"{source} cannot be compiled:\n{done.stderr.strip()}")


def clock_of(build: str) -> Path:
    """Returns the library to preload into programs of a build."""
    return BUILD / f"instruction_clock-{build}.so"


def prepare(processors: Sequence[Processor]) -> None:
    """Compiles the plugin and the clocks. Raises ValueError."""
    compile_library("benchmarks/native/count_instructions.c", "cc", PLUGIN)
    for build in {processor.build for processor in processors}:
        compile_library("benchmarks/native/instruction_clock.c", COMPILERS[build], clock_of(build))


def emulated(processor: Processor, counter: Path) -> list[str]:
    """Returns the command that emulates the processor and counts; the clock of the program returns the count."""
    emulator, *options = processor.emulator
    return [
        emulator, *options, "-plugin", f"{PLUGIN},counter={counter}",
        "-E", f"LD_PRELOAD={clock_of(processor.build)}", "-E", f"MAQ_INSTRUCTION_COUNTER={counter}",
    ]  # fmt: skip


def counted(processor: Processor, sources: Sequence[str], bundle: Path) -> dict:
    """Returns the document of `maquette bench`, with an instruction as a nanosecond. Raises ValueError with the
    failure."""
    with tempfile.TemporaryDirectory() as folder:
        counter, document = Path(folder) / "counter", Path(folder) / "bench.json"
        # An emulator does not follow into other programs, so the program behind `maquette bench` is started directly.
        program = ROOT / "build" / processor.build / "stage/bin/maquette-bench"
        command = [
            *emulated(processor, counter), str(program), *sources, "--bundle", str(bundle), "--threads", "1",
            "--warm-up", "0", "--runs", "1", "--seconds", "0", "--json", str(document),
        ]  # fmt: skip
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode or not document.exists():
            raise ValueError(f"{processor.title}: maquette bench failed ({done.returncode}).\n{done.stderr.strip()}")
        return json.loads(document.read_text())


def millions(case: dict) -> dict[str, float]:
    """Returns millions of instructions of each stage and of all stages, for one source; the median of its frames.

    Raises ValueError when the clock did not count.
    """
    counts = {stage: case["ms"][stage]["p50"] for stage in STAGES}
    if not all(counts.values()):
        raise ValueError("The clock of the emulated program did not count instructions; qemu 7.2 is known to work.")
    return counts | {"all": sum(counts.values())}


def lines_of(counts: dict[str, dict[str, float]]) -> list[str]:
    """Returns a table in Markdown: a line for each stage, a column for each processor, from `millions` by title."""
    lines = ["| stage | " + " | ".join(counts) + " |", "| --- |" + " --- |" * len(counts)]
    for stage, title in (STAGES | {"all": "all"}).items():
        lines.append(f"| {title} | " + " | ".join(f"{found[stage]:.1f}" for found in counts.values()) + " |")
    return lines


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.processors.instruction_counts",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("source", nargs="*", default=SOURCES, help="default: the bundled photo, and stub:people")
    parser.add_argument("--bundle", type=Path, default=ROOT / "sdk/models/densepose-b-int8")
    parser.add_argument("--only", action="append", choices=[processor.name for processor in OTHERS])
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processors at a time (default: the cores)")
    options = parser.parse_args(argv)
    processors = [processor for processor in OTHERS if not options.only or processor.name in options.only]
    try:
        prepare(processors)
        for processor in processors:
            check_features(processor)
        with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
            measured = pool.map(lambda processor: counted(processor, options.source, options.bundle), processors)
            documents = list(tqdm(measured, total=len(processors), desc="counting", unit="processor", disable=None))
        for k, source in enumerate(options.source):
            print(
                f"\n{Path(source).name}, {documents[0]['cases'][k]['people']:.0f} people, millions of instructions:\n"
            )
            titles = [processor.title for processor in processors]
            found = [millions(document["cases"][k]) for document in documents]
            print("\n".join(lines_of(dict(zip(titles, found, strict=True)))))
    except (ValueError, OSError, subprocess.CalledProcessError) as error:
        print(f"instruction_counts: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
