"""Measures the size of the library and of its bundles for each choice of systems (MAQ_WITH_DENSEPOSE, …).

python -m benchmarks --only sizes     builds eight configurations: minutes with a compiler cache, otherwise an hour
"""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

SCRIPT = Path("scripts/build-matrix.sh")
METRICS = ("library_densepose_mb",)


def measure(quick: bool, folder: Path) -> tuple[dict, dict[str, float], dict[str, str]]:
    """Returns the document, the metrics with a target, and why others are missing. Raises CalledProcessError if a
    configuration cannot be built."""
    if quick:
        why = "a quick run builds no further configurations"
        return {"missing": why}, {}, dict.fromkeys(METRICS, why)
    path = folder / "sizes.json"
    subprocess.run([str(SCRIPT), "--no-tests", "--sizes", str(path)], check=True)
    document = {"configurations": json.loads(path.read_text())}
    return document, metrics_of(document), {}


def metrics_of(document: dict) -> dict[str, float]:
    return {"library_densepose_mb": round(document["configurations"]["densepose"]["library_bytes"] / 1e6, 3)}


def section(measured: dict) -> tuple[str, list]:
    """Returns the title and the parts of the section, from a document of `measure`."""
    title = "Size by configuration"
    if "missing" in measured:
        return title, [f"Not measured: {measured['missing']}."]
    rows = [["systems", "libmaquette.so, MB", "model bundles, MB"]]
    for name, own in measured["configurations"].items():
        rows.append([name, f"{own['library_bytes'] / 1e6:.3f}", f"{own['models_bytes'] / 1e6:.3f}"])
    return title, [rows, "Stripped release builds with all sources of frames and the listed systems."]
