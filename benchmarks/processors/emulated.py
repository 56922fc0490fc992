"""Runs programs on other kinds of processors, emulated by qemu.

The programs are those of the builds `release` and `aarch64`, which `scripts/test-isa.sh` makes.
"""

from __future__ import annotations

import argparse
import concurrent.futures
import os
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from tqdm import tqdm

ROOT = Path(__file__).parents[2]
SYSROOT = ROOT / ".deps/aarch64-sysroot"

T = TypeVar("T")


@dataclass(frozen=True)
class Processor:
    """A processor, the command to run programs on it, and the features (Linux names) that it must and must not have."""

    name: str
    title: str
    build: str
    emulator: tuple[str, ...] = ()
    has: frozenset[str] = frozenset()
    lacks: frozenset[str] = frozenset()

    def command(self, program: str) -> list[str]:
        """Returns the command that runs a program of the build folder on this processor."""
        return [*self.emulator, str(ROOT / "build" / self.build / program)]


def _arm(name: str, title: str, cpu: str, has: set[str], lacks: set[str]) -> Processor:
    emulator = ("qemu-aarch64", "-L", str(SYSROOT), "-cpu", cpu)
    return Processor(name, title, "aarch64", emulator, frozenset(has), frozenset(lacks))


HERE = Processor("here", "this processor", "release")
VNNI = {"avx512f", "avx512_vnni", "avx_vnni", "amx_int8"}
OTHERS = (
    Processor(
        "avx2",
        "x86-64, AVX2 without VNNI",
        "release",
        ("qemu-x86_64", "-cpu", "Haswell"),
        frozenset({"avx2", "fma"}),
        frozenset(VNNI),
    ),
    _arm("asimd", "aarch64 without dot product", "cortex-a72", {"asimd"}, {"asimddp", "i8mm"}),
    _arm("asimddp", "aarch64 with dot product", "neoverse-n1", {"asimd", "asimddp"}, {"i8mm"}),
    _arm("i8mm", "aarch64 with 8-bit matrix product", "max,sve=off,sme=off", {"asimd", "asimddp", "i8mm"}, set()),
)


def check_features(processor: Processor) -> list[str]:
    """Returns the features that programs see on this processor. Raises ValueError if they are not the expected ones."""
    done = subprocess.run(
        processor.command("benchmarks/native/processor_features"), capture_output=True, text=True, check=True
    )
    seen = set(done.stdout.split())
    if not processor.has <= seen or processor.lacks & seen:
        raise ValueError(
            f"{processor.title} should offer {', '.join(sorted(processor.has))} and not "
            f"{', '.join(sorted(processor.lacks))}, but offers {', '.join(sorted(seen)) or 'nothing'}. "
            f"Check that {processor.emulator[0]} is version 7.2 or newer."
        )
    return sorted(seen)


def add_arguments(parser: argparse.ArgumentParser, out: Path) -> None:
    """Adds the options that `compared` reads."""
    parser.add_argument("--out", type=Path, default=out, help="folder for the results (default %(default)s)")
    parser.add_argument("--only", action="append", choices=[processor.name for processor in OTHERS])
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processors at a time (default: the cores)")
    parser.add_argument("--junit", type=Path, help="also write the outcome as JUnit XML")


def compared(
    options: argparse.Namespace, run: Callable[[Processor, Path], None], compare: Callable[[Path, Path], T]
) -> dict[str, T | str]:
    """Runs on this processor and on each other one, into a folder each, and compares the folders.

    Returns what `compare` says of (folder of here, of the other), or as text what went wrong there, by title. Prints
    what programs see of each processor. Raises ValueError, OSError or CalledProcessError when it fails here.
    """
    features = {HERE.title: check_features(HERE)}
    run(HERE, options.out / HERE.name)

    def work(processor: Processor) -> T:
        features[processor.title] = check_features(processor)
        run(processor, options.out / processor.name)
        return compare(options.out / HERE.name, options.out / processor.name)

    others = [processor for processor in OTHERS if not options.only or processor.name in options.only]
    found: dict[str, T | str] = {}
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        running = {pool.submit(work, processor): processor for processor in others}
        done = concurrent.futures.as_completed(running)
        for future in tqdm(done, total=len(running), desc="emulating", unit="processor", disable=None):
            try:
                found[running[future].title] = future.result()
            except (ValueError, OSError, subprocess.CalledProcessError) as error:
                found[running[future].title] = str(error)
    print("Programs see these features:")
    for title, seen in features.items():
        print(f"  {title}: {' '.join(seen) or 'none of those asked about'}")
    for title, result in found.items():
        if isinstance(result, str):
            print(f"{title}: {result}", file=sys.stderr)
    return {processor.title: found[processor.title] for processor in others}


def run_maquette(processor: Processor, arguments: Sequence[str]) -> str:
    """Runs the command line of a processor's build and returns its output. Raises ValueError with the failure."""
    done = subprocess.run([*processor.command("stage/bin/maquette"), *arguments], capture_output=True, text=True)
    if done.returncode:
        raise ValueError(
            f"{processor.title}: maquette {arguments[0]} failed ({done.returncode}).\n{done.stderr.strip()}"
        )
    return done.stdout


def write_junit(path: Path, suite_name: str, failures: Mapping[str, str | None]) -> None:
    """Writes one test case for each processor by title, for scripts/sum_test_results.py. A failure is a sentence."""
    suite = ElementTree.Element("testsuite", name=suite_name, tests=str(len(failures)))
    for title, failure in failures.items():
        case = ElementTree.SubElement(suite, "testcase", name=title, classname=suite_name)
        if failure is not None:
            ElementTree.SubElement(case, "failure", message=failure)
    path.parent.mkdir(parents=True, exist_ok=True)
    ElementTree.ElementTree(suite).write(path, encoding="unicode")
