"""Writes the report: images, a Markdown page and an HTML page, for readers who are new to the project."""

from __future__ import annotations

import base64
import html
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from benchmarks import camera_section, frame_budget, person_sizes, prediction, provenance, sizes, startup, ui_latency
from benchmarks.edges import plots as edge_plots
from benchmarks.edges import section as edge_section
from benchmarks.scenes import plots as scene_plots
from benchmarks.scenes import section as scene_section
from benchmarks.sweep import pareto

STAGES = ("capture", "preprocess", "trunk", "proposals", "box_head", "dense_head", "decode")
COLOURS = {"shipped": "black", "precision": "tab:red", "input size": "tab:blue", "proposals": "tab:green",
           "key frames": "tab:orange", "min. person": "tab:purple", "detail": "tab:brown",
           "together": "tab:cyan", "crops": "tab:pink"}  # fmt: skip


def write(document: dict, folder: Path) -> list[Path]:
    """Writes images, report.md and index.html of the measured sections into `folder`; returns their paths."""
    written = []
    for name, (draw, part) in PICTURES.items():
        if part in document:
            figure = draw(document)
            figure.savefig(folder / name, dpi=110, bbox_inches="tight")
            plt.close(figure)
            written.append(folder / name)
    if "scenes" in document:
        written += scene_plots.write(document["scenes"], folder)
    if "edges" in document:
        written += edge_plots.write(document["edges"], folder)
    sections = text_sections(document)
    (folder / "report.md").write_text(markdown(sections))
    (folder / "index.html").write_text(page(sections, folder))
    return [*written, folder / "report.md", folder / "index.html"]


def error_against_time(document: dict) -> plt.Figure:
    # Settings without U and V have no surface error.
    rows = [row for row in document["sweep"] if row["axis"] != "detail"]
    figure, axes = plt.subplots(1, 2, figsize=(15, 6))
    for axis, key, label in ((axes[0], "error", "1 - AP by GPS"), (axes[1], "error_cm", "median surface error, cm")):
        front = pareto([(row["ms"], row[key]) for row in rows])
        axis.plot([rows[k]["ms"] for k in front], [rows[k][key] for k in front], color="0.7", zorder=0,
                  label="Pareto front")  # fmt: skip
        for kind, colour in COLOURS.items():
            chosen = [row for row in rows if row["axis"] == kind]
            if chosen:
                axis.scatter([r["ms"] for r in chosen], [r[key] for r in chosen], color=colour, label=kind)
        for k in front:
            axis.annotate(rows[k]["setting"], (rows[k]["ms"], rows[k][key]), fontsize=7, rotation=20,
                          xytext=(3, 4), textcoords="offset points")  # fmt: skip
        axis.set(xlabel="milliseconds a frame (median)", ylabel=label, xscale="log")
        for direction in (axis.xaxis.set_major_formatter, axis.xaxis.set_minor_formatter):
            direction("{x:g}")
        axis.margins(y=0.2)
        axis.grid(alpha=0.3, which="both")
    axes[0].legend(fontsize=8)
    return figure


def scaling(document: dict) -> plt.Figure:
    frames = document["frames"]
    figure, axes = plt.subplots(1, 3, figsize=(15, 4))
    for name, label in (("people", f"{document['threads']} threads"), ("one_thread", "1 thread")):
        shown = [(case["people"], case["ms"]["frame"]["p50"]) for case in frames[name]["cases"]]
        axes[0].plot(*zip(*sorted(shown), strict=True), "o-", label=label)
    axes[0].set(xlabel="people found (mean)", ylabel="milliseconds a frame (p50)")
    axes[0].legend()
    sizes = frames["sizes"]["cases"]
    pixels = [case["size_px"][0] * case["size_px"][1] / 1e6 for case in sizes]
    axes[1].plot(pixels, [case["ms"]["frame"]["p50"] for case in sizes], "o-")
    axes[1].set(xlabel="megapixels of the source, one person", ylabel="milliseconds a frame (p50)")
    rows = [row for row in document.get("sweep", []) if row["axis"] == "input size"]
    axes[2].plot([int(row["setting"].split()[0]) for row in rows], [row["ms"] for row in rows], "o-")
    axes[2].set(xlabel="long side of the network's input, px", ylabel="milliseconds a frame (median)")
    for axis in axes:
        axis.set_ylim(bottom=0)
        axis.grid(alpha=0.3)
    figure.tight_layout()
    return figure


def stages(document: dict) -> plt.Figure:
    cases = document["frames"]["people"]["cases"]
    figure, axis = plt.subplots(figsize=(10, 0.5 + 0.5 * len(cases)))
    for k, case in enumerate(cases):
        left = 0.0
        for stage, colour in zip(STAGES, plt.cm.tab10.colors, strict=False):
            width = case["ms"][stage]["p50"]
            axis.barh(k, width, left=left, color=colour, label=stage if k == 0 else None)
            left += width
    axis.set_yticks(range(len(cases)), [f"{case['people']:.1f} people" for case in cases])
    axis.set(xlabel="milliseconds (p50 of each stage)")
    axis.legend(fontsize=8, loc="lower right")
    axis.invert_yaxis()
    return figure


def runtimes(document: dict) -> plt.Figure:
    rows = [row for row in document["runtimes"]["runtimes"] if row["total_ms"]]
    figure, axis = plt.subplots(figsize=(10, 0.6 + 0.5 * len(rows)))
    for k, row in enumerate(rows):
        left = 0.0
        for (graph, ms), colour in zip(row["ms"].items(), plt.cm.tab10.colors, strict=False):
            axis.barh(k, ms, left=left, color=colour, label=graph if k == 0 else None)
            left += ms
    axis.set_yticks(range(len(rows)), [f"{row['name']} {row['precision']}" for row in rows])
    axis.set(xlabel="milliseconds, one person, same inputs")
    axis.legend(fontsize=8)
    axis.invert_yaxis()
    return figure


# Images, the function that draws each, and the section of the document that it needs.
PICTURES = {
    "error-against-run-time.png": (error_against_time, "sweep"),
    "people-at-any-size.png": (person_sizes.draw, "person_sizes"),
    "scaling.png": (scaling, "frames"),
    "stages.png": (stages, "frames"),
    "runtimes.png": (runtimes, "runtimes"),
}

Section = tuple[str, list]  # the title, then texts, images as (name, caption), and tables as lists of rows


def text_sections(document: dict) -> list[Section]:
    intro = (
        "Maquette finds people in camera images, maps each of their pixels to a body surface, measures edges, builds "
        "scenes and heads, and predicts frames, on two processor cores. This page has its speed, size and error."
    )
    sections = [
        ("Maquette: speed, size and error", [intro, *circumstances(document)]),
        targets_section(document),
    ]
    for name, section in SECTIONS.items():
        if name in document:
            sections.append(section(document[name]))
    return sections


def sweep_section(sweep: list[dict]) -> Section:
    rows = [["setting", "ms", "1 - AP by GPS", "surface error, cm", "box AP", "part accuracy", "front"]]
    front = set(pareto([(row["ms"], row["error"]) for row in sweep]))
    for k, row in enumerate(sweep):
        metrics = [f"{row['ms']:.1f}", f"{row['error']:.3f}", f"{row['error_cm']:.1f}", f"{row['box_ap']:.3f}"]
        metrics.append(f"{row['part_accuracy']:.3f}")
        rows.append([row["setting"], *metrics, "●" if k in front else ""])
    return "Error against run time", [
        ("error-against-run-time.png", "Each point is a setting; settings on the Pareto front are named."),
        "Rendered people that no training saw; all settings measured alternately on the same images. AP by GPS: "
        "average precision by geodesic point similarity (1 is perfect). With key frames the image moves by 1 % of "
        "its width a frame; the error is measured on the last frame before the next key frame.",
        rows,
    ]


def frames_section(frames: dict) -> Section:
    rows = [["case", "people found", "p50 ms", "p90", "p99", "frames a second", "CPU ms"]]
    for name in ("people", "sizes", "one_thread"):
        for case in frames[name]["cases"]:
            ms = case["ms"]["frame"]
            label = case["source"] + (", 1 thread" if name == "one_thread" else "")
            rows.append([label, f"{case['people']:.1f}", *(f"{ms[p]:.1f}" for p in ("p50", "p90", "p99")),
                         f"{case['fps']:.0f}", f"{case['cpu_ms']:.1f}"])  # fmt: skip
    return "Time of a frame", [
        ("scaling.png", "Time against people in view, pixels of the source, and size of the network's input."),
        ("stages.png", "Time of each stage."),
        "Time from the request of an image to the result; walking people of the stub source. CPU ms: CPU time of all "
        "threads for a frame, a measure of its energy on every machine.",
        rows,
    ]


def runtimes_section(measured: dict) -> Section:
    graphs = list(measured["roofline"]["graphs"])
    rows = [["runtime", *graphs, "all, ms", "Maquette int8 by it"]]
    for row in measured["runtimes"]:
        name = f"{row['name']} {row['version']} {row['precision']}"
        if row["total_ms"] is None:
            rows.append([name, row["missing"], *[""] * (len(graphs) + 1)])
        else:
            rows.append([name, *(f"{row['ms'][g]:.2f}" for g in graphs), f"{row['total_ms']:.2f}",
                         f"{row['ours_int8_ratio']:.2f}"])  # fmt: skip
    line = measured["roofline"]
    line_rows = [["graph", "million multiply-adds", "of these int8", "min. ms", "fraction reached"]]
    for name, graph in line["graphs"].items():
        line_rows.append([name, f"{graph['macs'] / 1e6:.1f}", f"{graph['int8_macs'] / max(graph['macs'], 1):.0%}",
                          f"{graph['min_ms']:.2f}", f"{graph['fraction']:.0%}"])  # fmt: skip
    return "Other runtimes on the same graphs", [
        ("runtimes.png", "The five networks for an image with one person."),
        rows,
        f"Roofline: this machine reached {line['float32_macs_s'] / 1e9:.0f} billion float32 and "
        f"{line['int8_macs_s'] / 1e9:.0f} billion int8 multiply-adds a second in large matrix products, and copied "
        f"{line['bytes_s'] / 1e9:.0f} GB/s within its caches. The minimum time of a layer follows from its "
        f"multiply-adds or its bytes, whichever takes longer; the networks reach {line['fraction']:.0%} of the sum.",
        line_rows,
    ]


def agreement_section(agreement: dict) -> Section:
    return "int8 against fp32", [
        f"{agreement['labels']:.1%} of the person pixels of fp32 have the same part in int8, and "
        f"{agreement['parts']:.1%} of the pixels that are a person in both. The silhouettes have an IoU of "
        f"{agreement['mask_iou']:.1%}; {agreement['same_count']:.0%} of {agreement['images']} images have the same "
        "number of people."
    ]


SECTIONS = {
    "sweep": sweep_section,
    "person_sizes": person_sizes.section,
    "frame_budget": frame_budget.section,
    "frames": frames_section,
    "startup": startup.section,
    "sizes": sizes.section,
    "ui_latency": ui_latency.section,
    "runtimes": runtimes_section,
    "agreement": agreement_section,
    "cameras": camera_section.section,
    "scenes": scene_section.section,
    "edges": edge_section.section,
    "prediction": prediction.section,
}


def warnings_of(document: dict) -> set[str]:
    """Returns why metrics of the measured sections are unreliable."""
    frames = document.get("frames", {})
    runs = [frames[name] for name in ("people", "sizes", "one_thread") if name in frames]
    found = {text for run in runs for text in run["warnings"]}
    found |= {text for run in runs for case in run["cases"] for text in case["warnings"]}
    others = ("startup", "ui_latency", "cameras", "scenes", "edges", "prediction")
    return found.union(*(document[name]["warnings"] for name in others if name in document))


def circumstances(document: dict) -> list[str]:
    machine, warnings = document["machine"], warnings_of(document)
    return [
        f"Measured on: {machine['processor']}, {machine['cores']} cores, {machine['memory_mib'] / 1024:.0f} GiB, "
        f"{machine['system']}; instruction sets: {', '.join(machine['instruction_sets'])}.",
        provenance.sentence(document.get("measured", {})),
        *(["This is a quick run, a smoke test. Do not quote it."] if document["quick"] else []),
        *([f"Warnings of the measurement: {'; '.join(sorted(warnings))}."] if warnings else []),
    ]


def targets_section(document: dict) -> Section:
    rows = [["metric", "value", "threshold", "goal", "state"]]
    for target in document["targets"]:
        value = "" if target["value"] is None else f"{target['value']:.4g}"
        why = f": {target['why']}" if target["why"] else ""
        rows.append([target["description"], value, target["threshold"], target["goal"], target["state"] + why])
    tried = [f"Missed: {target['description']}. {target['tried']}" for target in document["targets"] if target["tried"]]
    return "Targets", [rows, *tried]


def markdown(sections: list[Section]) -> str:
    lines = []
    for level, (title, parts) in enumerate(sections):
        lines += ["#" * (1 if level == 0 else 2) + " " + title, ""]
        for part in parts:
            if isinstance(part, str):
                lines += [part, ""]
            elif isinstance(part, tuple):
                lines += [f"![{part[1]}]({part[0]})", "", f"*{part[1]}*", ""]
            else:
                head, *rows = part
                lines += ["| " + " | ".join(head) + " |", "| " + " | ".join(["---"] * len(head)) + " |"]
                lines += ["| " + " | ".join(row) + " |" for row in rows] + [""]
    return "\n".join(lines)


STYLE = """body { font: 16px/1.5 system-ui, sans-serif; max-width: 70rem; margin: 2rem auto; padding: 0 1rem; }
img { max-width: 100%; } table { border-collapse: collapse; font-size: 0.85rem; margin: 1rem 0; }
td, th { border-bottom: 1px solid #ddd; padding: 0.2rem 0.6rem; text-align: right; }
td:first-child, th:first-child { text-align: left; } figcaption { color: #555; font-size: 0.85rem; }
.missed { color: #b00020; font-weight: bold; } .met, .goal { color: #176f2c; }"""


def page(sections: list[Section], folder: Path) -> str:
    """Returns one HTML file with its images inside."""
    body = []
    for level, (title, parts) in enumerate(sections):
        body.append(f"<h{min(level, 1) + 1}>{html.escape(title)}</h{min(level, 1) + 1}>")
        for part in parts:
            if isinstance(part, str):
                body.append(f"<p>{html.escape(part)}</p>")
            elif isinstance(part, tuple):
                data = base64.b64encode((folder / part[0]).read_bytes()).decode()
                kind = "jpeg" if part[0].endswith(".jpg") else "png"
                body.append(f'<figure><img alt="{html.escape(part[1])}" src="data:image/{kind};base64,{data}">'
                            f"<figcaption>{html.escape(part[1])}</figcaption></figure>")  # fmt: skip
            else:
                body.append(table(part))
    return (f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{html.escape(sections[0][0])}</title>'
            f"<style>{STYLE}</style></head><body>\n" + "\n".join(body) + "\n</body></html>\n")  # fmt: skip


def table(rows: list[list[str]]) -> str:
    head, *rest = rows
    lines = ["<tr>" + "".join(f"<th>{html.escape(cell)}</th>" for cell in head) + "</tr>"]
    for row in rest:
        state = row[-1].split(":")[0]
        mark = f' class="{state}"' if state in ("met", "missed", "goal") else ""
        cells = "".join(f"<td>{html.escape(cell)}</td>" for cell in row[:-1])
        lines.append(f"<tr>{cells}<td{mark}>{html.escape(row[-1])}</td></tr>")
    return "<table>" + "\n".join(lines) + "</table>"
