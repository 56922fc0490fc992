"""Chooses which nodes stay float: what gains most for its bytes, until int8 labels agree with fp32 ones.

Candidates are blocks of nodes whose names begin alike. Each alone is left float, on top of what the settings already
leave float; its gain is the drop of the outputs' noise relative to their signal (mean over the graph's outputs), its
cost the bytes that the graph grows by, and the multiply-adds that are done in float. The candidates with the most gain
a byte are then taken one by one, the bundle is made and compared with the fp32 one (quantization.agreement) after each,
until the gate holds or nothing that fits is left. Ranges are found once: they do not depend on the choice.
"""

from __future__ import annotations

import argparse
import re
import shutil
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import onnxruntime
from maquette import MaquetteError
from rich.console import Console
from rich.table import Table
from tqdm import tqdm

from export.bundle import BundleInfo, bytes_of
from export.densepose import bundle as bundle_format
from export.densepose.graphs import Bundle, open_bundle
from export.shards import load_records
from quantization import agreement
from quantization.blocks import Candidate, Workpiece, candidates
from quantization.graphs.prepare import prepare
from quantization.quantize import calibrate
from quantization.samples import calibration_records, collect, options_of_calibration, spread
from quantization.settings import DensePoseSettings, read_settings

BUDGET_MB = 3.6
EPILOG = """\
examples:
  python -m quantization.choose --out build/chosen.toml
  python -m quantization.choose --graphs trunk dense_head --budget 3.2 --out quantization/densepose.toml
  python -m quantization.quantize --settings build/chosen.toml --out build/quantized
The exit status is 1 when the budget is spent before the gate holds; the settings are written all the same.
"""


def pick(
    ranked: list[Candidate], size: int, budget: int, measure: Callable[[list[Candidate]], float], gate: float
) -> tuple[list[Candidate], list[float]]:
    """Takes candidates that gain and fit, in order, until `measure` of those taken reaches `gate`.

    size, budget: bytes of the bundle now, and at most. Returns what was taken, and the measurements: first without any,
    then after each.
    """
    taken: list[Candidate] = []
    measured = [measure(taken)]
    for candidate in ranked:
        if measured[-1] >= gate:
            break
        if candidate.gain <= 0 or size + candidate.bytes > budget:
            continue
        taken.append(candidate)
        size += candidate.bytes
        measured.append(measure(taken))
    return taken, measured


def with_float_nodes(text: str, chosen: dict[str, tuple[str, ...]]) -> str:
    """A settings file with other `float_nodes` for the graphs named; everything else, comments too, stays.

    Raises ValueError for a graph whose section does not set `float_nodes`.
    """
    for graph, patterns in chosen.items():
        section = re.search(rf"^\[{re.escape(graph)}\]\n(.*?)(?=^\[|\Z)", text, re.M | re.S)
        setting = section and re.search(r"^float_nodes\s*=\s*\[[^\]]*\]", section[1], re.M)
        if not setting:
            raise ValueError(f"the settings have no float_nodes in [{graph}] to write to: add `float_nodes = []`")
        lines = "".join(f'    "{pattern}",\n' for pattern in patterns)
        value = f"float_nodes = [\n{lines}]" if patterns else "float_nodes = []"
        start = section.start(1) + setting.start()
        text = text[:start] + value + text[section.start(1) + setting.end() :]
    return text


def write_bundle(target: Path, source: Bundle, graphs: Callable[[str, Path], None]) -> Path:
    """A bundle whose graphs `graphs(name, path)` writes; the rest is that of `source`."""
    target.mkdir(parents=True, exist_ok=True)
    shutil.copy(source.folder / bundle_format.CHARTS, target)
    for name in bundle_format.GRAPHS:
        graphs(name, target / f"{name}.onnx")
    bundle_format.write_manifest(target, BundleInfo(target.name, "int8"), source.network, source.decode)
    return target


def print_candidates(ranked: list[Candidate], taken: list[Candidate], console: Console) -> None:
    table = Table(title="candidates, best first", title_justify="left")
    for column in ("graph", "stays float"):
        table.add_column(column, overflow="fold")
    for column in ("outputs, dB", "kB", "M multiply-adds", "gain a kB", "taken"):
        table.add_column(column, justify="right")
    for c in ranked:
        decibels = f"{c.sqnr[0]:.2f} -> {c.sqnr[1]:.2f}"
        cells = (decibels, f"{c.bytes / 1e3:.1f}", f"{c.macs / 1e6:.1f}", f"{1e3 * c.rank:.1e}")
        table.add_row(c.graph, c.pattern, *cells, "yes" if c in taken else "")
    console.print(table)


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m quantization.choose", description=__doc__, epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter, parents=[options_of_calibration()],
    )  # fmt: skip
    parser.add_argument("--out", type=Path, required=True, metavar="TOML", help="where the settings go")
    parser.add_argument("--graphs", nargs="+", default=list(bundle_format.GRAPHS), choices=bundle_format.GRAPHS)
    parser.add_argument("--budget", type=float, default=BUDGET_MB, metavar="MB", help=f"bundle (default {BUDGET_MB})")
    parser.add_argument("--gate", type=float, default=agreement.GATE, metavar="FRACTION", help="label agreement wanted")
    parser.add_argument("--samples", type=int, default=6, metavar="N", help="images a candidate is judged by")
    parser.add_argument("--images", type=int, metavar="N", help="images labels are compared on (default: all)")
    parser.add_argument("--backend", choices=("capi", "onnx"), default="capi", help="default: capi")
    arguments = parser.parse_args(argv)
    onnxruntime.set_default_logger_severity(3)
    try:
        return run(arguments)
    except (MaquetteError, FileNotFoundError, ValueError) as error:
        print(f"Nothing was chosen: {error}", file=sys.stderr)
        return 1


def workpieces(arguments: argparse.Namespace, source: Bundle, folder: Path) -> dict[str, Workpiece]:
    """Prepared and calibrated graphs of the bundle, written to `folder`."""
    settings = read_settings(arguments.settings, DensePoseSettings)
    records = calibration_records(settings, arguments.data, arguments.photos)
    calibration = collect(source, records, settings.people_per_image)
    held_out = collect(source, spread(load_records(arguments.held_out), arguments.samples), 4)
    pieces = {}
    for name in tqdm(bundle_format.GRAPHS, desc="calibrating", unit="graph", disable=None):
        graph_settings = settings.graphs[name]
        path = folder / f"{name}.onnx"
        prepare(source.folder / f"{name}.onnx", path)
        ranges = calibrate(path, calibration[name], graph_settings)
        pieces[name] = Workpiece(name, path, ranges, graph_settings, calibration[name], held_out[name])
    return pieces


def run(arguments: argparse.Namespace) -> int:
    console = Console(width=None if sys.stdout.isatty() else 140)
    source = open_bundle(arguments.bundle)
    text = arguments.settings.read_text()
    images = agreement.load_images(arguments.held_out, arguments.images)
    backend = agreement.open_bundle(arguments.bundle, arguments.backend)
    expected = list(agreement.predictions(backend, images))
    with tempfile.TemporaryDirectory() as folder:
        pieces = workpieces(arguments, source, Path(folder))
        ranked = [c for name in arguments.graphs for c in candidates(pieces[name])]
        ranked.sort(key=lambda c: -c.rank)

        def made(taken: list[Candidate]) -> Path:
            def graph(name: str, path: Path) -> None:
                pieces[name].quantize(path, tuple(c.pattern for c in taken if c.graph == name))

            return write_bundle(Path(folder) / "bundle", source, graph)

        def measure(taken: list[Candidate]) -> float:
            target = made(taken)
            found = agreement.open_bundle(target, arguments.backend)
            metrics = agreement.compare(expected, agreement.predictions(found, images))
            last = f"{taken[-1].graph}: {taken[-1].pattern}" if taken else "as the settings are"
            megabytes = bytes_of(target) / 1e6
            console.print(f"{100 * metrics.labels:6.2f} %  {megabytes:.2f} MB  {last}", highlight=False)
            return metrics.labels

        size = bytes_of(made([]))
        taken, measured = pick(ranked, size, int(1e6 * arguments.budget), measure, arguments.gate)
    print_candidates(ranked, taken, console)
    chosen = {}
    for name in dict.fromkeys(c.graph for c in taken):
        chosen[name] = pieces[name].settings.float_nodes + tuple(c.pattern for c in taken if c.graph == name)
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    arguments.out.write_text(with_float_nodes(text, chosen))
    reached = measured[-1] >= arguments.gate
    verdict = "The gate holds" if reached else "The gate does not hold within the budget"
    console.print(
        f"{verdict}: {100 * measured[-1]:.2f} %, {len(taken)} blocks more stay float. Written: {arguments.out}"
    )
    return 0 if reached else 1


if __name__ == "__main__":
    sys.exit(main())
