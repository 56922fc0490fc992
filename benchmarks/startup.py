"""What an app pays before its first picture: libraries that are loaded, their size, and the CPU time of a start.

    python -m benchmarks --only start     a few seconds; `make bench` builds what is needed

Measured by a small C program, benchmarks/native/measure_startup.c, in a process of its own each time.
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

METRICS = ("library_mb", "files_library_mb", "libraries_context", "libraries_densepose", "context_cpu_ms",
           "first_result_cpu_ms")  # fmt: skip
PROGRAM = Path("build/release/benchmarks/native/measure_startup")
STARTS = 15
NAMES = {"context": "a context alone", "densepose": "a dense pose model, to the first result"}


def library_files() -> dict[str, Path]:
    """What is shipped: libmaquette, and the part that reads files and clips, which is loaded when one is opened."""
    library = library_path().resolve()
    return {"library": library, "files_library": library.parent / "maquette/libmaquette_files.so"}


def needed(library: Path) -> list[str]:
    """The shared libraries that a library names (NEEDED). Raises FileNotFoundError, CalledProcessError."""
    shown = subprocess.run(["readelf", "--dynamic", "--wide", str(library)], check=True, capture_output=True, text=True)
    return re.findall(r"\(NEEDED\).*\[(.+)\]", shown.stdout)


def start(kind: str) -> dict:
    """`libraries` and `cpu_ms` of one process. Raises FileNotFoundError, CalledProcessError."""
    if not PROGRAM.exists():
        raise FileNotFoundError(f"{PROGRAM} is not there: make bench builds it")
    ran = subprocess.run([str(PROGRAM), kind], check=True, stdout=subprocess.PIPE, text=True)
    return json.loads(ran.stdout)


def measure(quick: bool) -> tuple[dict, dict[str, float]]:
    """What was measured, and the metrics that are targets."""
    others = OthersFraction()
    starts: dict[str, list[dict]] = {kind: [] for kind in NAMES}
    for _ in tqdm(range(3 if quick else STARTS), desc="starts", unit="round", disable=None):
        for kind, runs in starts.items():
            runs.append(start(kind))
    busy = others.now()
    document = {
        "processes": {kind: {"libraries": runs[-1]["libraries"], "cpu_ms": [run["cpu_ms"] for run in runs]}
                      for kind, runs in starts.items()},
        "files": {name: {"name": path.name, "bytes": path.stat().st_size, "needed": needed(path)}
                  for name, path in library_files().items()},
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
    """Title and parts, as benchmarks.report has them, of what `measure` returned."""
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
        "A small C program. Shared libraries: all that are loaded, without the program and what the kernel maps. CPU "
        "time: of all threads since the process began, the loading of libraries included.",
        files,
        "libmaquette_files is loaded when a file or a clip is opened, with what it needs; an app with a camera never "
        "loads it.",
    ]
