"""The error of an int8 bundle, tensor by tensor.

Prints the worst tensors. Writes all of them to docs/research/quantization.json, tables to docs/research/quantization.md
and a plot to docs/images.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import tempfile
from collections import defaultdict
from dataclasses import asdict, replace
from pathlib import Path

import onnx
import onnxruntime
from maquette import MaquetteError
from rich.console import Console
from rich.table import Table

from export.densepose.graphs import Bundle, open_bundle
from export.evaluation.backends import fingerprint
from export.evaluation.json_values import plain
from export.shards import load_records
from quantization import agreement, check
from quantization.analysis.comparison import TensorError, activation_errors, weight_errors, worst_first
from quantization.analysis.errors import float_nodes_left
from quantization.analysis.saturation import Saturation, saturation
from quantization.report_files import write_image, write_markdown
from quantization.samples import Sample, collect, spread

SCHEMA = "maquette-quantization-1"
JSON = Path("docs/research/quantization.json")
MARKDOWN = Path("docs/research/quantization.md")
PICTURE = Path("docs/images/quantization.png")
SHOWN = 15
SATURATION_SAMPLES = 2

EPILOG = """\
examples:
  python -m quantization.report                      all of it; needs .data (renderings, fp32 bundle)
  python -m quantization.report --int8 build/quantized --out build/report
  python -m quantization.report --check              is every scale of the shipped bundle right? Needs no .data
  python -m quantization.report --check --int8 build/quantized

metrics, in dB (6 dB are one bit):
  here            this tensor alone: float against quantized and dequantized
  worst channel   the same of the worst output channel of a weight
  gathered        float graph against int8 graph, with all that came before
  jump            dB lost between the worst input of the node and its output
Which nodes should stay float: python -m quantization.choose --help
"""


def tensor_report(
    reference: dict[str, onnx.ModelProto], quantized: Path, samples: dict[str, list[Sample]]
) -> list[TensorError]:
    """Every tensor of every graph; graphs in the bundle's order, tensors in the graph's."""
    found = []
    for name, model in reference.items():
        graph = onnx.load(quantized / f"{name}.onnx")
        found += weight_errors(name, model, graph) + activation_errors(name, model, graph, samples[name])
    return found


def saturation_report(
    reference: dict[str, onnx.ModelProto], quantized: Path, samples: dict[str, list[Sample]], bits: int | None = None
) -> list[Saturation]:
    """Every int8 layer, with its own weights or with `bits` bits."""
    found = []
    for name, model in reference.items():
        graph = onnx.load(quantized / f"{name}.onnx")
        found += saturation(name, model, graph, samples[name][:SATURATION_SAMPLES], bits)
    return found


def document(
    source: Bundle, quantized: Path, samples: dict[str, list[Sample]], reference: dict[str, onnx.ModelProto]
) -> dict:
    """Everything that is measured, as JSON values; without agreement, which needs the SDK."""
    tensors = tensor_report(reference, quantized, samples)
    outputs: dict[str, dict[str, float]] = defaultdict(dict)
    for name, model in reference.items():
        there = {value.name for value in model.graph.output}
        outputs[name] = {t.name: t.gathered for t in tensors if t.graph == name and t.name in there}
    own = check.own_errors(reference, quantized, check.media_samples(source))
    return {
        "schema": SCHEMA,
        "bundle": quantized.name,
        "fingerprint": fingerprint(quantized),
        "images": len(samples["trunk"]),
        "tensors": [_row(tensor) for tensor in tensors],
        "outputs": {g: {n: check._finite(v) for n, v in values.items()} for g, values in outputs.items()},
        "float_nodes": {name: float_nodes_left(quantized / f"{name}.onnx") for name in reference},
        "saturation": [plain(asdict(layer)) for layer in saturation_report(reference, quantized, samples)],
        "saturation_8_bit": [plain(asdict(layer)) for layer in saturation_report(reference, quantized, samples, 8)],
        "check": check.metrics_of(own),
    }


def _row(tensor: TensorError) -> dict:
    """Rounded; infinite metrics (no error at all) and those that do not apply are null."""
    values = asdict(tensor)
    for key in ("here", "worst_channel", "gathered", "jump"):
        values[key] = check._finite(values[key])
    return values


def print_worst(tensors: list[TensorError], console: Console) -> None:
    table = Table(title=f"worst {SHOWN} tensors of {len(tensors)}, dB", title_justify="left")
    for column in ("graph", "tensor", "kind"):
        table.add_column(column, overflow="fold")
    for column in ("here", "worst channel", "gathered", "jump"):
        table.add_column(column, justify="right")
    for t in worst_first(tensors)[:SHOWN]:
        cells = [t.here, t.worst_channel, t.gathered, t.jump]
        table.add_row(t.graph, t.name, t.kind, *("" if c is None else f"{c:.1f}" for c in cells))
    console.print(table)


def print_saturation(title: str, layers: list[Saturation], console: Console) -> None:
    found = [layer for layer in layers if not layer.safe]
    if not found:
        largest = max((x.bound for x in layers if not x.exempt), default=0)
        console.print(f"{title}: none of {len(layers)} layers can overflow 16 bits (largest bound {largest} of 32767)")
        return
    table = Table(title=f"{title}: {len(found)} of {len(layers)} layers could overflow 16 bits", title_justify="left")
    for column in ("layer", "bound", "fraction of pairs", "worst error"):
        table.add_column(column, justify="left" if column == "layer" else "right")
    for layer in sorted(found, key=lambda x: -x.clamped / max(x.pairs, 1)):
        share = layer.clamped / max(layer.pairs, 1)
        table.add_row(f"{layer.graph}: {layer.layer}", str(layer.bound), f"{share:.2e}", f"{layer.worst_error:.3g}")
    console.print(table)


def run_check(int8: Path, expected: Path, console: Console) -> int:
    """0 if every scale is as the report says, else 1 with one sentence a tensor."""
    known = json.loads(expected.read_text())
    with tempfile.TemporaryDirectory() as folder:
        source = check.fp32_bundle(check.WEIGHTS, Path(folder) / "fp32")
        reference = check.prepared_graphs(source.folder, Path(folder) / "prepared")
        errors = check.own_errors(reference, int8, check.media_samples(source))
        layers = saturation_report(reference, int8, {name: [] for name in reference})
    found = check.complaints(known["check"], errors)
    found += [f"{x.graph}: {x.layer} can overflow 16 bits (bound {x.bound})" for x in layers if not x.safe]
    if fingerprint(int8) != known["fingerprint"]:
        console.print(
            f"{int8} is not the bundle that {expected} describes; python -m quantization.report writes it anew."
        )
    for sentence in found:
        console.print(sentence, soft_wrap=True, highlight=False)
    if not found:
        console.print(f"{len(errors)} tensors of {int8} are as {expected} says; no layer can overflow 16 bits.")
    return 1 if found else 0


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m quantization.report", description=__doc__, epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("--float", dest="reference", type=Path, default=agreement.FLOAT_BUNDLE, metavar="DIR")
    parser.add_argument("--int8", type=Path, default=agreement.INT8_BUNDLE, metavar="DIR")
    parser.add_argument("--data", type=Path, default=Path(".data/people/val"), metavar="DIR", help="held-out shards")
    parser.add_argument("--images", type=int, default=12, metavar="N", help="held-out images for tensors (default 12)")
    parser.add_argument("--agreement-images", type=int, metavar="N", help="for label agreement (default: all)")
    parser.add_argument("--out", type=Path, metavar="DIR", help="write there instead of docs/")
    parser.add_argument("--check", action="store_true", help="compare scales with the written report; exit status 1")
    arguments = parser.parse_args(argv)
    onnxruntime.set_default_logger_severity(3)  # constants left over by the quantizer are no news
    console = Console(width=None if sys.stdout.isatty() else 140)
    paths = (JSON, MARKDOWN, PICTURE)
    if arguments.out:
        arguments.out.mkdir(parents=True, exist_ok=True)
        paths = tuple(arguments.out / path.name for path in paths)
    try:
        if arguments.check:
            return run_check(arguments.int8, JSON, console)
        return _write(arguments, paths, console)
    except (FileNotFoundError, ValueError) as error:
        print(f"No report: {error}", file=sys.stderr)
        return 1


def _write(arguments: argparse.Namespace, paths: tuple[Path, Path, Path], console: Console) -> int:
    source = open_bundle(arguments.reference)
    samples = collect(source, spread(load_records(arguments.data), arguments.images), 4)
    with tempfile.TemporaryDirectory() as folder:
        reference = check.prepared_graphs(source.folder, Path(folder))
        found = document(source, arguments.int8, samples, reference)
    tensors = [TensorError(**row) for row in found["tensors"]]
    print_worst(
        [replace(t, here=math.inf if t.here is None and t.gathered is None else t.here) for t in tensors], console
    )
    for title, key in (("shipped weights", "saturation"), ("with 8-bit weights", "saturation_8_bit")):
        print_saturation(title, [Saturation(**row) for row in found[key]], console)
    if JSON.exists():  # what other commands measured
        found["methods"] = json.loads(JSON.read_text()).get("methods", [])
    try:
        images = agreement.load_images(arguments.data, arguments.agreement_images)
        metrics = agreement.agreement(arguments.reference, arguments.int8, images)
        agreement.print_metrics(metrics, f"labels, int8 against fp32, {arguments.data}", console)
        found["agreement"] = plain(asdict(metrics))
    except MaquetteError as error:
        console.print(f"Label agreement was not measured: {error}")
        found["agreement"] = None
    paths[0].parent.mkdir(parents=True, exist_ok=True)
    paths[2].parent.mkdir(parents=True, exist_ok=True)
    paths[0].write_text(compact(found))
    write_markdown(paths[1], found)
    write_image(paths[2], tensors)
    console.print("Written: " + ", ".join(str(path) for path in paths))
    return 0


def compact(found: dict) -> str:
    """JSON with one line a tensor or layer."""
    parts = []
    for key, value in found.items():
        if isinstance(value, list | dict) and value:
            rows = [json.dumps(row) for row in value] if isinstance(value, list) else [
                f"{json.dumps(name)}: {json.dumps(row)}" for name, row in value.items()
            ]  # fmt: skip
            left, right = "[]" if isinstance(value, list) else "{}"
            parts.append(f"{json.dumps(key)}: {left}\n " + ",\n ".join(rows) + f"\n{right}")
        else:
            parts.append(f"{json.dumps(key)}: {json.dumps(value)}")
    return "{\n" + ",\n".join(parts) + "\n}\n"


if __name__ == "__main__":
    sys.exit(main())
