"""Measures the size of the library and of its bundles for each choice of systems (MAQ_WITH_DENSEPOSE, …).

python -m benchmarks --only sizes     builds eight configurations: minutes with a compiler cache, otherwise an hour
"""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

SCRIPT = Path("scripts/build-matrix.sh")
# Metric of each configuration with a target; `library_mb`, with all systems, belongs to the section startup.
METRICS = {
    "none": "library_sources_mb",
    "densepose": "library_densepose_mb",
    "scenes": "library_scenes_mb",
    "edges": "library_edges_mb",
    "heads": "library_heads_mb",
    "prediction": "library_prediction_mb",
    "densepose+edges": "library_densepose_edges_mb",
}


def measure(quick: bool, folder: Path) -> tuple[dict, dict[str, float], dict[str, str]]:
    """Returns the document, the metrics with a target, and why others are missing. Raises CalledProcessError if a
    configuration cannot be built."""
    if quick:
        why = "a quick run builds no further configurations"
        return {"missing": why}, {}, dict.fromkeys(METRICS.values(), why)
    path = folder / "sizes.json"
    subprocess.run([str(SCRIPT), "--no-tests", "--sizes", str(path)], check=True)
    document = {"configurations": json.loads(path.read_text())}
    return document, metrics_of(document), {}


def metrics_of(document: dict) -> dict[str, float]:
    found = document["configurations"]
    return {metric: round(found[name]["library_bytes"] / 1e6, 3) for name, metric in METRICS.items()}


def section(measured: dict) -> tuple[str, list]:
    """Returns the title and the parts of the section, from a document of `measure`."""
    title = "Size by configuration"
    if "missing" in measured:
        return title, [f"Not measured: {measured['missing']}."]
    rows = [["systems", "libmaquette.so, MB", "model bundles, MB"]]
    for name, own in measured["configurations"].items():
        rows.append([name, f"{own['library_bytes'] / 1e6:.3f}", f"{own['models_bytes'] / 1e6:.3f}"])
    return title, [rows, "Stripped release builds with all sources of frames and the listed systems."]
