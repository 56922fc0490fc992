"""Measures speed, size and error, checks them against benchmarks/targets.toml, and writes a report.

    python -m benchmarks                  all sections, 40 minutes; `make bench` builds first
    python -m benchmarks --quick          fewer rounds and images, as a smoke test
    python -m benchmarks --only runtimes  one section; the others are kept from the last run in --out
    python -m benchmarks --publish        also copies the report to docs/benchmarks; with --only alone, the last report

Sections: frames (people, pixels, threads; start, memory), startup (libraries, their size, CPU time), sizes (the
library without some systems), ui_latency (waits of an app with a window), sweep (error against run time), person_sizes
(the same for small, tilted and crowded people), frame_budget (a device that throttles), agreement (int8 against fp32),
runtimes (other runtimes and the roofline), cameras (capture), scenes (new views of captured scenes), edges (fields of
depth frames), prediction (next frames of clips).
Each section records its commit and date. --publish refuses sections of different commits, and uncommitted changes.
Exit status: 0 if every target is met, 1 if one is missed, 2 if a section could not be measured or published.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path

from maquette import MaquetteError

from benchmarks import (
    cameras,
    frame_budget,
    frame_time,
    prediction,
    provenance,
    report,
    sizes,
    startup,
    targets,
    ui_latency,
)
from benchmarks.edges import measure as edges
from benchmarks.scenes import measure as scenes
from benchmarks.scenes.command import SceneCommandError
from export.shards import read_images, shard_paths

SCHEMA = "maquette-benchmark-5"
SECTIONS = ("frames", "startup", "sizes", "ui_latency", "sweep", "person_sizes", "frame_budget", "agreement",
            "runtimes", "cameras", "scenes", "edges", "prediction")  # fmt: skip
RUNTIME_RATIOS = (("openvino_int8", "OpenVINO", "int8"), ("pytorch_fp32", "PyTorch", "fp32"))
INT8 = Path("sdk/models/densepose-b-int8")
CHECKPOINT = Path("export/weights/densepose-b.pt")
PUBLISHED = Path("docs/benchmarks")


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--out", type=Path, default=Path("build/benchmarks"), metavar="DIR", help="default: build/benchmarks"
    )
    parser.add_argument(
        "--data", type=Path, default=Path(".data/people/test"), metavar="DIR", help="rendered people, made if missing"
    )
    parser.add_argument("--images", type=int, default=150, help="number of these images (default 150)")
    parser.add_argument(
        "--wide-data", type=Path, default=Path(".data/people-wide/test"), metavar="DIR",
        help="rendered people of all sizes, tilted and in crowds, made if missing",
    )  # fmt: skip
    parser.add_argument(
        "--photos", type=Path, default=Path(".data/photos"), metavar="DIR",
        help="photographs of people (python -m export.photos people)",
    )  # fmt: skip
    parser.add_argument(
        "--labels", type=Path, default=Path(".data/teachers/labels"), metavar="DIR",
        help="labels of these photographs by other networks (python -m export.teachers)",
    )  # fmt: skip
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--only", nargs="*", choices=SECTIONS, default=list(SECTIONS), metavar="SECTION")
    parser.add_argument("--publish", action="store_true")
    parser.add_argument("--no-guest", action="store_true", help="cameras: without the virtual machine")
    scenes.add_arguments(parser)
    edges.add_arguments(parser)
    options = parser.parse_args(argv)
    options.out.mkdir(parents=True, exist_ok=True)
    try:
        document = measure(options)
    except (MaquetteError, SceneCommandError, FileNotFoundError, ValueError, subprocess.SubprocessError) as error:
        print(f"The benchmark stopped: {error}", file=sys.stderr)
        return 2
    metrics, missing = document["metrics"], document["missing"]
    whole = set(SECTIONS) <= document.keys()
    only = None if whole else metrics.keys() | missing.keys()
    verdicts = targets.check(metrics, document["machine"], missing, only=only)
    document["targets"] = [vars(verdict) for verdict in verdicts]
    path = options.out / "benchmark.json"
    path.write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n")
    written = [path, *report.write(document, options.out)]
    targets.print_verdicts(verdicts)
    print("Written: " + ", ".join(str(x) for x in written))
    if options.publish:
        refusal = publish(document, written)
        if refusal:
            print(refusal, file=sys.stderr)
            return 2
    states = [verdict.state for verdict in verdicts]
    return 1 if "missed" in states else 0


def publish(document: dict, written: Iterable[Path], target: Path = PUBLISHED) -> str:
    """Copies a report to `target`, without its HTML page. Returns "", or why nothing was copied: a quick run, or
    sections that are not all of one commit."""
    if document["quick"]:
        return "The report is not published, because it is of a quick run. Run without --quick."
    stamps = document["measured"]
    stamped = {name.split(".")[0] for name in stamps}
    names = [*stamps, *(name for name in SECTIONS if name in document and name not in stamped)]
    refusal = provenance.refusal(stamps, names, "python -m benchmarks --publish --only")
    if refusal:
        return refusal
    target.mkdir(parents=True, exist_ok=True)
    for path in written:
        if path.suffix == ".json":  # the published document does not name folders of this machine
            (target / path.name).write_text(path.read_text().replace(f"{Path.cwd()}/", ""))
        elif path.suffix != ".html":
            shutil.copy(path, target)
    print(f"Published: {target}")
    return ""


def measure(options: argparse.Namespace) -> dict:
    """Returns the document without its verdicts. Sections that are not asked for come from the last run."""
    previous = options.out / "benchmark.json"
    document = json.loads(previous.read_text()) if previous.exists() and set(options.only) != set(SECTIONS) else {}
    if document.get("schema", SCHEMA) != SCHEMA:
        document = {}
    document |= {"schema": SCHEMA, "threads": options.threads}
    stamps, now = document.setdefault("measured", {}), provenance.stamp() | {"quick": options.quick}
    for section in options.only:
        parts = [f"edges.{part}" for part in options.edge_parts] if section == "edges" else [section]
        stamps.update(dict.fromkeys(parts, now))
    document["quick"] = any(one["quick"] for one in stamps.values())
    metrics, missing = document.setdefault("metrics", {}), document.setdefault("missing", {})
    if "frames" in options.only:
        document["frames"], found, document["machine"] = frame_time.measure(options.out, options.threads, options.quick)
        metrics |= found
        metrics["bundle_mb"] = round(sum(p.stat().st_size for p in INT8.iterdir()) / 1e6, 3)
    elif "machine" not in document:
        document["machine"] = frame_time.machine()
    if "startup" in options.only:
        document["startup"], found = startup.measure(options.quick)
        replace(metrics, missing, startup.METRICS, found, {})
    if "sizes" in options.only:
        document["sizes"], found, why = sizes.measure(options.quick, options.out)
        replace(metrics, missing, sizes.METRICS, found, why)
    if "ui_latency" in options.only:
        document["ui_latency"], found, why = ui_latency.measure(options.quick)
        replace(metrics, missing, ui_latency.METRICS, found, why)
    if "sweep" in options.only:
        document["sweep"], found = sweep_section(options, float_bundle_in(options.out))
        metrics |= found
    if "person_sizes" in options.only:
        document["person_sizes"] = person_sizes_section(options)
    if "frame_budget" in options.only:
        document["frame_budget"] = frame_budget.measure(options.quick)
    if "agreement" in options.only:
        document["agreement"], found = agreement_section(options, float_bundle_in(options.out))
        metrics |= found
    if "runtimes" in options.only:
        document["runtimes"], found, why = runtimes_section(options, float_bundle_in(options.out))
        replace(metrics, missing, [f"time_by_{name}" for name, _, _ in RUNTIME_RATIOS], found, why)
    if "cameras" in options.only:
        document["cameras"], found, why = cameras.measure(options.quick, not options.no_guest)
        replace(metrics, missing, cameras.METRICS, found, why)
    if "scenes" in options.only:
        given = scenes.sources_of(options)
        document["scenes"], found, why = scenes.measure(given, options.out, options.threads, options.quick)
        replace(metrics, missing, scenes.METRICS, found, why)
    if "edges" in options.only:
        document["edges"], found, why = edges.measure(
            edges.sources_of(options), options.out, options.threads, options.quick, options.edge_parts,
            document.get("edges"),
        )  # fmt: skip
        replace(metrics, missing, [name for part in options.edge_parts for name in edges.METRICS_OF[part]], found, why)
    if "prediction" in options.only:
        document["prediction"], found, why = prediction.measure(options.quick, threads=options.threads)
        replace(metrics, missing, prediction.METRICS, found, why)
    return document


def replace(metrics: dict, missing: dict, names: Iterable[str], found: dict, why: dict) -> None:
    """Replaces the metrics `names` of one section by `found`, and their reasons in `missing` by `why`."""
    for name in names:
        metrics.pop(name, None)
        missing.pop(name, None)
    metrics |= found
    missing |= why


def float_bundle_in(folder: Path) -> Path:
    """Returns the fp32 bundle of the shipped weights; exports it when they or the exporter have changed."""
    from export import bundle, onnx_graphs
    from export.densepose import bundle as densepose_bundle
    from export.densepose import export_onnx, simplified
    from quantization.check import fp32_bundle

    target, stamp = folder / "densepose-b-fp32", folder / "densepose-b-fp32.made-from"
    modules = (export_onnx, simplified, onnx_graphs, densepose_bundle, bundle)
    sources = (CHECKPOINT, *(module.__file__ for module in modules))
    made_from = "".join(str(Path(path).stat().st_mtime_ns) for path in sources)
    if not (target / "manifest.json").exists() or not stamp.exists() or stamp.read_text() != made_from:
        print(f"Exporting {CHECKPOINT} as fp32 graphs")
        fp32_bundle(CHECKPOINT, target)
        stamp.write_text(made_from)
    return target


def rendered_people(folder: Path, images: int, *more: str) -> list:
    """Returns the first images of a test set and renders it if it is missing. more: options of the renderer."""
    if not list(folder.glob("shard-*.npz")):
        print(f"Rendering {images} images into {folder}")
        commands = [["export.people.assets"], ["export.photos", "fetch"]]
        commands.append(["export.people.dataset", "--split", "test", "--images", str(images), "--out",
                         str(folder.parent), "--per-shard", "150", *more])  # fmt: skip
        for command in commands:
            subprocess.run([sys.executable, "-m", *command], check=True)
    return list(read_images(shard_paths(folder), images))


def test_images(options: argparse.Namespace) -> list:
    return rendered_people(options.data, options.images)[: 30 if options.quick else options.images]


def sweep_section(options: argparse.Namespace, float_bundle: Path) -> tuple[list[dict], dict[str, float]]:
    from benchmarks import sweep
    from export.bundle import read_manifest
    from export.people.atlas import load_surface_table

    wanted = sweep.settings()
    threshold = read_manifest(INT8)["box_head"]["score_threshold"]
    bundles = {"int8": INT8, "fp32": float_bundle}
    measured = sweep.measure(
        test_images(options), bundles, load_surface_table(), wanted, threshold, threads=options.threads
    )
    rows = [vars(m) | {"setting": m.setting.name} | {"axis": m.setting.axis} for m in measured]
    by_name = {row["setting"]: row for row in rows}
    loss = 100 * (by_name["as shipped"]["error"] - by_name["fp32"]["error"])
    return rows, {"int8_gps_loss_points": round(loss, 2)}


def person_sizes_section(options: argparse.Namespace) -> list[dict]:
    from benchmarks import person_sizes
    from export.bundle import read_manifest
    from export.evaluation import views
    from export.evaluation.photos import PhotoSet
    from export.people.atlas import load_surface_table

    photos = options.photos
    chosen = PhotoSet.find([photos / "photo", photos / "test"], options.labels, [])
    moments = PhotoSet.find([photos / "views"], options.labels, [])
    images = 10 if options.quick else 100
    pictures = person_sizes.Pictures(
        rendered=rendered_people(options.wide_data, images, "--variety", "wide"),
        photographs=chosen,
        moments=moments,
        cameras=views.calibrated_cameras() if moments.photos else [],
    )
    threshold = read_manifest(INT8)["box_head"]["score_threshold"]
    return person_sizes.measure(pictures, INT8, load_surface_table(), threshold, threads=options.threads)


def agreement_section(options: argparse.Namespace, float_bundle: Path) -> tuple[dict, dict[str, float]]:
    from quantization.agreement import agreement

    found = agreement(float_bundle, INT8, [image.image for image in test_images(options)])
    return asdict(found), {"int8_label_agreement": round(100 * found.labels, 2)}


def runtimes_section(options: argparse.Namespace, float_bundle: Path) -> tuple[dict, dict[str, float], dict[str, str]]:
    """Runs in a process of its own, because another runtime may crash."""
    path = options.out / "runtimes.json"
    path.unlink(missing_ok=True)
    rounds = 3 if options.quick else 25
    command = [sys.executable, "-m", "benchmarks.runtimes", "--fp32", str(float_bundle), "--rounds", str(rounds),
               "--threads", str(options.threads), "--out", str(path)]  # fmt: skip
    # Some runtimes crash with AMX where a virtual machine hides the layout of its tiles.
    has_amx = "amx_bf16" in Path("/proc/cpuinfo").read_text().split()
    subprocess.run([*(["scripts/with-amx.sh"] if has_amx else []), *command], check=True)
    document = json.loads(path.read_text())
    metrics, missing = {"roofline_fraction": document["roofline"]["fraction"]}, {}
    for name, runtime, precision in RUNTIME_RATIOS:
        row = next(r for r in document["runtimes"] if (r["name"], r["precision"]) == (runtime, precision))
        if row["ours_int8_ratio"] is None:
            missing[f"time_by_{name}"] = row["missing"]
        else:
            metrics[f"time_by_{name}"] = row["ours_int8_ratio"]
    return document, metrics, missing


if __name__ == "__main__":
    sys.exit(main())
