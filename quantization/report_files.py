"""The quantization report as Markdown and as an image."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import numpy as np
from matplotlib import pyplot

from quantization.agreement import GATE, STRETCH
from quantization.analysis.comparison import TensorError

BEGIN, END = "<!-- begin: written by python -m quantization.report -->", "<!-- end -->"
SHOWN = 15
NAMED = 3  # tensors named in each graph of the image, if they lose more than 1 dB


def write_markdown(path: Path, document: dict) -> None:
    """Replaces what is between the markers; appends it to a file without them."""
    text = path.read_text() if path.exists() else "# Quantization\n"
    part = f"{BEGIN}\n\n{markdown(document)}\n{END}"
    if BEGIN in text:
        before, rest = text.split(BEGIN, 1)
        text = before + part + rest.split(END, 1)[1]
    else:
        text = f"{text.rstrip()}\n\n{part}\n"
    path.write_text(text)


def markdown(document: dict) -> str:
    """The generated part."""
    lines = [
        f"Bundle `{document['bundle']}` (manifest {document['fingerprint']}), {document['images']} held-out images for "
        "tensors.", "",
    ]  # fmt: skip
    metrics = document.get("agreement")
    if metrics:
        lines += ["### Labels", ""]
        lines += _table(
            ("figure", "int8 against fp32"),
            [
                (f"label agreement on person pixels (gate {100 * GATE:.0f} %, stretch {100 * STRETCH:.0f} %)",
                 f"{100 * metrics['labels']:.2f} %"),
                ("where both paint", f"{100 * metrics['parts']:.2f} %"),
                ("mask IoU", f"{100 * metrics['mask_iou']:.2f} %"),
                ("people, fp32 / int8", f"{metrics['people'][0]} / {metrics['people'][1]}"),
                ("images with as many people", f"{100 * metrics['same_count']:.1f} % of {metrics['images']}"),
            ],
        )  # fmt: skip
    lines += ["### Outputs", ""]
    rows = [(g, n, _db(v)) for g, values in document["outputs"].items() for n, v in values.items()]
    lines += _table(("graph", "output", "dB"), rows)
    lines += [f"### Worst {SHOWN} tensors of {len(document['tensors'])}", ""]
    worst = sorted(document["tensors"], key=_lowest)[:SHOWN]
    lines += _table(
        ("graph", "tensor", "kind", "here", "worst channel", "gathered", "jump"),
        [(t["graph"], f"`{t['name']}`", t["kind"], *(_db(t[k]) for k in ("here", "worst_channel", "gathered", "jump")))
         for t in worst],
    )  # fmt: skip
    jumps = sorted((t for t in document["tensors"] if t["jump"] is not None), key=lambda t: -t["jump"])[:SHOWN]
    lines += [f"### Largest {SHOWN} jumps", ""]
    lines += _table(
        ("graph", "node", "jump", "gathered"),
        [(t["graph"], f"`{t['node']}`", _db(t["jump"]), _db(t["gathered"])) for t in jumps],
    )
    lines += ["### Saturation of 16-bit sums (AVX2 without VNNI)", ""]
    lines += [_saturation_sentence("The bundle's weights", document["saturation"]), ""]
    lines += [_saturation_sentence("With 8-bit weights everywhere", document["saturation_8_bit"]), ""]
    unsafe = [x for x in document["saturation_8_bit"] if not x["exempt"] and x["bound"] > 32767]
    lines += _table(
        ("layer, with 8-bit weights", "bound", "fraction of pairs", "worst error of an output"),
        [(f"{x['graph']}: `{x['layer']}`", x["bound"], f"{x['clamped'] / max(x['pairs'], 1):.1e}",
          f"{x['worst_error']:.3g}") for x in sorted(unsafe, key=lambda x: -x["clamped"] / max(x["pairs"], 1))],
    )  # fmt: skip
    if document.get("methods"):
        lines += ["### Ranges and corrections compared", ""]
        lines += _table(
            ("graph", "ranges, correction", "lowest output, dB", "mean of outputs, dB"),
            [(r["graph"], r["method"], _db(r["lowest"]), _db(r["mean"])) for r in document["methods"]],
        )
    return "\n".join(lines)


def _saturation_sentence(what: str, layers: list[dict]) -> str:
    counted = [x for x in layers if not x["exempt"]]
    unsafe = [x for x in counted if x["bound"] > 32767]
    exempt = len(layers) - len(counted)
    largest = max((x["bound"] for x in counted), default=0)
    return (
        f"{what}: {len(unsafe)} of {len(counted)} layers could overflow (largest bound {largest}, limit 32767); "
        f"{exempt} depthwise layers add in 32 bits."
    )


def _lowest(row: dict) -> float:
    metrics = [row["here"], row["gathered"], None if row["kind"] == "bias" else row["worst_channel"]]
    return min((f for f in metrics if f is not None), default=np.inf)


def _table(head: tuple[str, ...], rows: list[tuple]) -> list[str]:
    lines = ["| " + " | ".join(head) + " |", "|" + " --- |" * len(head)]
    return lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows] + [""]


def _db(value: float | None) -> str:
    return "" if value is None else f"{value:.1f}"


def write_image(path: Path, tensors: list[TensorError]) -> None:
    """Own and gathered error along each graph, the worst activations named."""
    graphs = list(dict.fromkeys(tensor.graph for tensor in tensors))
    heights = [2.2 if graph == "trunk" else 1 for graph in graphs]
    figure, axes = pyplot.subplots(
        len(graphs), 1, figsize=(14, 4 * sum(heights) / 1.6), layout="constrained", height_ratios=heights, squeeze=False
    )
    for axis, graph in zip(axes[:, 0], graphs, strict=True):
        rows = [t for t in tensors if t.graph == graph and t.kind == "activation"]
        place = np.arange(len(rows))
        for field, style, label in (("here", "o", "this tensor alone"), ("gathered", "-", "gathered")):
            values = [getattr(t, field) if getattr(t, field) is not None else np.nan for t in rows]
            axis.plot(place, values, style, markersize=4, label=label)
        known = [k for k, t in enumerate(rows) if t.jump is not None and t.jump > 1]
        for k in sorted(known, key=lambda k: -rows[k].jump)[:NAMED]:
            text = f"{rows[k].name} (-{rows[k].jump:.1f} dB)"
            left = k < len(rows) / 2
            axis.annotate(
                text, (k, rows[k].gathered), xytext=(8 if left else -8, -14), textcoords="offset points", fontsize=8,
                ha="left" if left else "right", arrowprops={"arrowstyle": "-", "color": "0.6"},
            )  # fmt: skip
        axis.set(title=graph, ylabel="signal to noise, dB", xlim=(-1, len(rows)))
        axis.grid(alpha=0.3)
        axis.legend(fontsize=8, loc="upper right")
    axes[-1, 0].set_xlabel("activations in the order of the graph; named: where most is lost")
    figure.savefig(path, dpi=80)
    pyplot.close(figure)
