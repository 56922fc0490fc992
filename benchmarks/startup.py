"""Measures the start of an app before its first image: loaded libraries, their size, and the CPU time of a process.

    python -m benchmarks --only startup     a few seconds; `make bench` builds the program

The C program benchmarks/native/measure_startup.c runs in a new process each time.
"""

from __future__ import annotations

import json
import re
import statistics
import subprocess
from pathlib import Path

from maquette import library_path
from tqdm import tqdm

from benchmarks.frame_time import MAX_OTHERS, OthersFraction

METRICS = ("library_mb", "libraries_context", "libraries_densepose", "context_cpu_ms",
           "first_result_cpu_ms")  # fmt: skip
PROGRAM = Path("build/release/benchmarks/native/measure_startup")
STARTS = 15
NAMES = {"context": "a context alone", "densepose": "a dense pose model, to the first result"}


def needed(library: Path) -> list[str]:
    """Returns the shared libraries that a library names (NEEDED). Raises FileNotFoundError, CalledProcessError."""
    shown = subprocess.run(["readelf", "--dynamic", "--wide", str(library)], check=True, capture_output=True, text=True)
    return re.findall(r"\(NEEDED\).*\[(.+)\]", shown.stdout)


def start(kind: str) -> dict:
    """Returns `libraries` and `cpu_ms` of one process. Raises FileNotFoundError, CalledProcessError."""
    if not PROGRAM.exists():
        raise FileNotFoundError(f"{PROGRAM} is not there: make bench builds it")
    ran = subprocess.run([str(PROGRAM), kind], check=True, stdout=subprocess.PIPE, text=True)
    return json.loads(ran.stdout)


def measure(quick: bool) -> tuple[dict, dict[str, float]]:
    """Returns the document, and the metrics with a target."""
    others = OthersFraction()
    starts: dict[str, list[dict]] = {kind: [] for kind in NAMES}
    for _ in tqdm(range(3 if quick else STARTS), desc="starts", unit="round", disable=None):
        for kind, runs in starts.items():
            runs.append(start(kind))
    busy = others.now()
    library = library_path().resolve()
    document = {
        "processes": {kind: {"libraries": runs[-1]["libraries"], "cpu_ms": [run["cpu_ms"] for run in runs]}
                      for kind, runs in starts.items()},
        "files": {"library": {"name": library.name, "bytes": library.stat().st_size, "needed": needed(library)}},
        "warnings": [f"other processes used {busy:.0%} of the CPU (start)"] if busy > MAX_OTHERS else [],
    }  # fmt: skip
    return document, metrics_of(document)


def metrics_of(document: dict) -> dict[str, float]:
    cpu_ms = {kind: statistics.median(process["cpu_ms"]) for kind, process in document["processes"].items()}
    metrics = {f"{name}_mb": round(file["bytes"] / 1e6, 3) for name, file in document["files"].items()}
    metrics |= {f"libraries_{kind}": len(process["libraries"]) for kind, process in document["processes"].items()}
    return metrics | {"context_cpu_ms": round(cpu_ms["context"], 2),
                      "first_result_cpu_ms": round(cpu_ms["densepose"], 1)}  # fmt: skip


def section(measured: dict) -> tuple[str, list]:
    """Returns the title and the parts of the section, from a document of `measure`."""
    processes = [["process with", "shared libraries", "CPU time, ms (median)", "worst", "runs", "names"]]
    for kind, name in NAMES.items():
        process = measured["processes"][kind]
        cpu_ms = process["cpu_ms"]
        processes.append([name, str(len(process["libraries"])), f"{statistics.median(cpu_ms):.1f}",
                          f"{max(cpu_ms):.1f}", str(len(cpu_ms)), ", ".join(process["libraries"])])  # fmt: skip
    files = [["file", "MB", "needs"]]
    for file in measured["files"].values():
        files.append([file["name"], f"{file['bytes'] / 1e6:.3f}", ", ".join(file["needed"])])
    return "Start of an app", [
        processes,
        "A small C program. Shared libraries: all loaded ones, without the program and the kernel's object. CPU time: "
        "all threads since the process began, including the loading of libraries.",
        files,
    ]
