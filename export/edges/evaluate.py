"""Figures of fields on held-out solids, beside rivals without a network, as a table and JSON.

    python -m export.edges.evaluate --data .data/solids --weights RUN/weights.pt --onnx sdk/models/edges-int8 \\
        --json build/edges.json

Where distances are cut to call a pixel sharp, and the thresholds of the rivals, are chosen on `val`; figures come from
`test`, whose families of solids neither training nor `val` has. RMSE is in r = depth / focal length.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from tqdm import tqdm

from export.densepose.graphs import session
from export.edges import baselines
from export.edges.config import EPS_R
from export.edges.data import Frame, RecordError, read_frames
from export.edges.graph_field import field_of_planes, slopes_of
from export.edges.losses import DECODINGS
from export.edges.metrics import cuts, summary
from export.edges.validation import Field, field_of, figures_of
from export.edges.weights import load_network
from export.solids.sensors import LEVELS

COLUMNS = ("rmse_r", "rmse_near_r", "q95_r", "recall_1r", "fpr_1r", "recall_4r", "fpr_4r")
THRESHOLDS = 24  # of a rival, tried between quantiles of its strength


def no_edges(depth: np.ndarray, focal_px: float) -> np.ndarray:
    """The field of a frame without edges: what any method must beat."""
    return np.full(depth.shape, EPS_R, np.float32)


def graph_field(path: Path) -> Field:
    """The field of `field.onnx` in a bundle of any precision."""
    graph = session(path / "field.onnx")
    return lambda depth, focal_px: field_of_planes(graph.run(None, {"slopes": slopes_of(depth, focal_px)})[0])


def tuned(name: str, frames: Sequence[Frame], level: str) -> Field:
    """A rival with the threshold that gives the smallest RMSE on these frames."""
    strength = baselines.STRENGTHS[name]

    def at(threshold: float) -> Field:
        return lambda depth, focal_px: baselines.field(strength(depth, focal_px), threshold)

    sample = np.concatenate([strength(frame.depth, frame.focal_px).ravel()[::97] for frame in frames[::4]])
    candidates = np.unique(np.quantile(sample[sample > 0], np.linspace(0.3, 0.995, THRESHOLDS)))
    rmse = [np.nanmean([row["rmse_r"] for row in figures_of(at(t), frames[::3], level)]) for t in candidates]
    return at(float(candidates[int(np.argmin(rmse))]))


def _untuned(field: Field, frames: Sequence[Frame], level: str) -> Field:
    return field


def methods(options: argparse.Namespace) -> dict[str, Callable[[Sequence[Frame], str], Field]]:
    """By name: from validation frames and a level to a field."""
    found: dict[str, Callable[[Sequence[Frame], str], Field]] = {"no edges": lambda frames, level: no_edges}
    for name in baselines.STRENGTHS:
        found[name] = partial(tuned, name)
    for path in options.weights:
        network, config = load_network(path)
        for decoding in DECODINGS if config.bins else ("expectation",):
            made = field_of(network, config.bins, decoding)
            found[f"{path.parent.name} {decoding}" if config.bins else path.parent.name] = partial(_untuned, made)
    for path in options.onnx:
        found[path.name] = partial(_untuned, graph_field(path))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=Path(".data/solids"), help="with val and test")
    parser.add_argument("--weights", type=Path, nargs="*", default=[], help="weights.pt of export.edges.train")
    parser.add_argument("--onnx", type=Path, nargs="*", default=[], help="bundles")
    parser.add_argument("--levels", nargs="*", choices=LEVELS, default=["clean", "tof", "stereo"])
    parser.add_argument("--width", type=int, default=320, help="of the views, pixels (default %(default)s)")
    parser.add_argument("--frames", type=int, help="of each split, evenly (default: all)")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    try:
        val, test = (read_frames(options.data / split, options.width, options.frames) for split in ("val", "test"))
    except RecordError as error:
        raise SystemExit(str(error)) from None
    rows = []
    work = [(level, *method) for level in options.levels for method in methods(options).items()]
    for level, name, make in tqdm(work, unit="method", leave=False):
        field = make(val, level)
        at = cuts(figures_of(field, val, level))
        start = time.perf_counter()
        figures = figures_of(field, test, level)
        ms = 1000 * (time.perf_counter() - start) / len(test)
        rows.append({"level": level, "method": name, **summary(figures, at), "ms": ms, "frames": len(test)})
    table = Table("level", "method", *COLUMNS, "ms with sensor")
    for row in rows:
        table.add_row(row["level"], row["method"], *(f"{row[c]:.3f}" for c in COLUMNS), f"{row['ms']:.0f}")
    Console(width=140).print(table)
    if options.json:
        options.json.parent.mkdir(parents=True, exist_ok=True)
        options.json.write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
