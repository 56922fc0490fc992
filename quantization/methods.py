"""Which ranges and which corrections suit which graph: signal to noise of its outputs for each.

Everything is calibrated on the same few training images and measured on held-out ones; what stays float is as in the
settings. Writes the rows into docs/research/quantization.json; `python -m quantization.report` puts them into the page.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import onnxruntime
from rich.console import Console
from rich.table import Table

from export.densepose.bundle import GRAPHS
from export.densepose.graphs import open_bundle
from export.shards import load_records
from quantization.analysis.errors import output_sqnr
from quantization.graphs.prepare import prepare
from quantization.quantize import calibrate, correct, quantize_prepared
from quantization.report import JSON, compact
from quantization.samples import Sample, collect, options_of_calibration, spread
from quantization.settings import DensePoseSettings, GraphSettings, read_settings

RANGES = (("minmax", None), ("percentile", 99.99), ("percentile", 99.999), ("entropy", None))
EPILOG = """\
examples:
  python -m quantization.methods
  python -m quantization.methods --graphs box_head dense_head --calibration 40
Entropy is slow: minutes for the trunk.
"""


def variants(settings: GraphSettings) -> Iterator[tuple[str, GraphSettings]]:
    """Ways to find ranges, without corrections; then the graph's own with the corrections."""
    plain = replace(settings, bias_correction=False, round_together=False, depthwise_8_bit=False)
    for method, percentile in RANGES:
        name = method if percentile is None else f"{method} {percentile:g}"
        yield name, replace(plain, method=method, percentile=percentile or settings.percentile)
    own = f"{settings.method} {settings.percentile:g}" if settings.method == "percentile" else settings.method
    yield f"{own}, depthwise 8 bit", replace(plain, depthwise_8_bit=True)
    yield f"{own}, bias correction", replace(plain, bias_correction=True)
    yield f"{own}, rounded together", replace(plain, round_together=True)
    yield f"{own}, all", replace(plain, bias_correction=True, round_together=True, depthwise_8_bit=True)


def compare(
    name: str, source: Path, settings: GraphSettings, calibration: list[Sample], held_out: list[Sample]
) -> Iterator[dict]:
    """One row a variant: graph, method, lowest and mean output in dB."""
    with tempfile.TemporaryDirectory() as folder:
        prepared, target = Path(folder) / "prepared.onnx", Path(folder) / "int8.onnx"
        prepare(source, prepared)
        known = {}
        for label, variant in variants(settings):
            key = (variant.method, variant.percentile)
            if key not in known:
                known[key] = calibrate(prepared, calibration, variant)
            quantize_prepared(prepared, target, known[key], variant)
            correct(prepared, target, calibration, variant)
            values = list(output_sqnr(prepared, target, held_out).values())
            yield {
                "graph": name,
                "method": label,
                "lowest": round(min(values), 2),
                "mean": round(float(np.mean(values)), 2),
            }


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m quantization.methods", description=__doc__, epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter, parents=[options_of_calibration(photos=False)],
    )  # fmt: skip
    parser.add_argument("--calibration", type=int, default=16, metavar="N", help="calibration images (default 16)")
    parser.add_argument("--images", type=int, default=6, metavar="N", help="held-out images (default 6)")
    parser.add_argument("--graphs", nargs="+", default=list(GRAPHS), choices=GRAPHS)
    parser.add_argument("--json", type=Path, default=JSON, metavar="JSON", help="report whose rows are replaced")
    arguments = parser.parse_args(argv)
    onnxruntime.set_default_logger_severity(3)
    try:
        return run(arguments)
    except (FileNotFoundError, ValueError) as error:
        print(f"Nothing was compared: {error}", file=sys.stderr)
        return 1


def run(arguments: argparse.Namespace) -> int:
    console = Console(width=None if sys.stdout.isatty() else 140)
    source, settings = open_bundle(arguments.bundle), read_settings(arguments.settings, DensePoseSettings)
    document = json.loads(arguments.json.read_text())
    sets = [
        collect(source, spread(load_records(folder), count), settings.people_per_image)
        for folder, count in ((arguments.data, arguments.calibration), (arguments.held_out, arguments.images))
    ]
    table = Table(title=f"outputs, dB; {arguments.calibration} calibration images", title_justify="left")
    for column in ("graph", "ranges, correction", "lowest", "mean"):
        table.add_column(column)
    for name in arguments.graphs:
        rows = []
        path = source.folder / f"{name}.onnx"
        for row in compare(name, path, settings.graphs[name], sets[0][name], sets[1][name]):
            rows.append(row)
            table.add_row(row["graph"], row["method"], f"{row['lowest']:.1f}", f"{row['mean']:.1f}")
        kept = [row for row in document.get("methods", []) if row["graph"] != name]
        document["methods"] = sorted(kept + rows, key=lambda row: GRAPHS.index(row["graph"]))
        arguments.json.write_text(compact(document))
    console.print(table)
    console.print(f"Written: {arguments.json}; python -m quantization.report puts it into the page.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
