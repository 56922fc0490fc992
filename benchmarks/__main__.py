"""Measures what Maquette promises, checks it against benchmarks/targets.toml, and writes a report to read.

    python -m benchmarks                  everything, 20 minutes and about as long for scenes; `make bench` builds first
    python -m benchmarks --quick          fewer rounds and images, to see that it runs
    python -m benchmarks --only peers     one part; the others' figures are taken from the last run in --out
    python -m benchmarks --publish        also copies the report to docs/benchmarks

Parts: frames (people, pixels, threads; start, memory), start (libraries, their size, CPU time), window (what an app
with a window waits for), sweep (error against run time), person_sizes (the same for small, tilted and crowded people),
frame_budget (a device that throttles), agreement (int8 against fp32), peers (other runtimes and the roofline), cameras
(how frames get to the app), scenes (new views of captured scenes), edges (fields of depth frames), prediction
(what clips show next).
The report holds the parts that were measured, now or in the last run.
Exit status: 0 when every gate is met, 1 when one is missed, 2 when something could not be measured.
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

from benchmarks import cameras, frame_budget, frame_time, gates, prediction, report, start, window
from benchmarks.edges import measure as edges
from benchmarks.scenes import measure as scenes
from benchmarks.scenes.command import SceneCommandError
from export.shards import read_images, shard_paths

SCHEMA = "maquette-benchmark-4"
PARTS = ("frames", "start", "window", "sweep", "person_sizes", "frame_budget", "agreement", "peers", "cameras",
         "scenes", "edges", "prediction")  # fmt: skip
PEER_RATIOS = (("openvino_int8", "OpenVINO", "int8"), ("pytorch_fp32", "PyTorch", "fp32"))
INT8 = Path("sdk/models/densepose-b-int8")
CHECKPOINT = Path("export/weights/densepose-b.pt")


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--out", type=Path, default=Path("build/benchmarks"), metavar="DIR", help="default: build/benchmarks"
    )
    parser.add_argument(
        "--data", type=Path, default=Path(".data/people/test"), metavar="DIR", help="rendered people; made if not there"
    )
    parser.add_argument("--images", type=int, default=150, help="of them (default 150)")
    parser.add_argument(
        "--wide-data", type=Path, default=Path(".data/people-wide/test"), metavar="DIR",
        help="rendered people of all sizes, tilted and in crowds; made if not there",
    )  # fmt: skip
    parser.add_argument(
        "--photos", type=Path, default=Path(".data/photos"), metavar="DIR",
        help="photographs of people (python -m export.photos people)",
    )  # fmt: skip
    parser.add_argument(
        "--labels", type=Path, default=Path(".data/teachers/labels"), metavar="DIR",
        help="what other networks say of them (python -m export.teachers)",
    )  # fmt: skip
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--only", nargs="+", choices=PARTS, default=list(PARTS), metavar="PART")
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
    figures, missing = document["figures"], document["missing"]
    whole = set(PARTS) <= document.keys()
    only = None if whole else figures.keys() | missing.keys()
    verdicts = gates.check(figures, document["machine"], missing, only=only)
    document["gates"] = [vars(verdict) for verdict in verdicts]
    path = options.out / "benchmark.json"
    path.write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n")
    written = [path, *report.write(document, options.out)]
    gates.print_verdicts(verdicts)
    print("Written: " + ", ".join(str(x) for x in written))
    if options.publish:
        # What is published says nothing about where it was made.
        path.write_text(path.read_text().replace(f"{Path.cwd()}/", ""))
        target = Path("docs/benchmarks")
        target.mkdir(parents=True, exist_ok=True)
        for x in written:
            shutil.copy(x, target)
        print(f"Published: {target}")
    states = [verdict.state for verdict in verdicts]
    return 1 if "missed" in states else 0


def measure(options: argparse.Namespace) -> dict:
    """The document without its verdicts. Parts that are not asked for come from the last run."""
    previous = options.out / "benchmark.json"
    document = json.loads(previous.read_text()) if previous.exists() and set(options.only) != set(PARTS) else {}
    if document.get("schema", SCHEMA) != SCHEMA:
        document = {}
    document |= {"schema": SCHEMA, "quick": options.quick, "threads": options.threads}
    figures, missing = document.setdefault("figures", {}), document.setdefault("missing", {})
    if "frames" in options.only:
        document["frames"], found, document["machine"] = frame_time.measure(options.out, options.threads, options.quick)
        figures |= found
        figures["bundle_mb"] = round(sum(p.stat().st_size for p in INT8.iterdir()) / 1e6, 3)
    elif "machine" not in document:
        document["machine"] = frame_time.machine()
    if "start" in options.only:
        document["start"], found = start.measure(options.quick)
        replace(figures, missing, start.FIGURES, found, {})
    if "window" in options.only:
        document["window"], found, why = window.measure(options.quick)
        replace(figures, missing, window.FIGURES, found, why)
    if "sweep" in options.only:
        document["sweep"], found = sweep_part(options, float_bundle_in(options.out))
        figures |= found
    if "person_sizes" in options.only:
        document["person_sizes"] = person_sizes_part(options)
    if "frame_budget" in options.only:
        document["frame_budget"] = frame_budget.measure(options.quick)
    if "agreement" in options.only:
        document["agreement"], found = agreement_part(options, float_bundle_in(options.out))
        figures |= found
    if "peers" in options.only:
        document["peers"], found, why = peers_part(options, float_bundle_in(options.out))
        replace(figures, missing, [f"time_by_{name}" for name, _, _ in PEER_RATIOS], found, why)
    if "cameras" in options.only:
        document["cameras"], found, why = cameras.measure(options.quick, not options.no_guest)
        replace(figures, missing, cameras.FIGURES, found, why)
    if "scenes" in options.only:
        given = scenes.sources_of(options)
        document["scenes"], found, why = scenes.measure(given, options.out, options.threads, options.quick)
        replace(figures, missing, scenes.FIGURES, found, why)
    if "edges" in options.only:
        document["edges"], found, why = edges.measure(
            edges.sources_of(options), options.out, options.threads, options.quick, options.edge_parts,
            document.get("edges"),
        )  # fmt: skip
        replace(figures, missing, [name for part in options.edge_parts for name in edges.FIGURES_OF[part]], found, why)
    if "prediction" in options.only:
        document["prediction"], found, why = prediction.measure(options.quick, threads=options.threads)
        replace(figures, missing, prediction.FIGURES, found, why)
    return document


def replace(figures: dict, missing: dict, names: Iterable[str], found: dict, why: dict) -> None:
    """Of the figures `names`, which one part measures: what it found, or why not; nothing of a run before."""
    for name in names:
        figures.pop(name, None)
        missing.pop(name, None)
    figures |= found
    missing |= why


def float_bundle_in(folder: Path) -> Path:
    """The fp32 bundle of the shipped weights, exported once and again when these change."""
    from export import bundle, onnx_graphs
    from export.densepose import bundle as densepose_bundle
    from export.densepose import export_onnx, simplified
    from quantization.check import fp32_bundle

    target, stamp = folder / "densepose-b-fp32", folder / "densepose-b-fp32.made-from"
    # The exporter decides too what the graphs look like.
    modules = (export_onnx, simplified, onnx_graphs, densepose_bundle, bundle)
    sources = (CHECKPOINT, *(module.__file__ for module in modules))
    made_from = "".join(str(Path(path).stat().st_mtime_ns) for path in sources)
    if not (target / "manifest.json").exists() or not stamp.exists() or stamp.read_text() != made_from:
        print(f"Exporting {CHECKPOINT} as fp32 graphs")
        fp32_bundle(CHECKPOINT, target)
        stamp.write_text(made_from)
    return target


def rendered_people(folder: Path, images: int, *more: str) -> list:
    """The first images of a test set, which is rendered where it is not there. more: options of the renderer."""
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


def sweep_part(options: argparse.Namespace, float_bundle: Path) -> tuple[list[dict], dict[str, float]]:
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


def person_sizes_part(options: argparse.Namespace) -> list[dict]:
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


def agreement_part(options: argparse.Namespace, float_bundle: Path) -> tuple[dict, dict[str, float]]:
    from quantization.agreement import agreement

    found = agreement(float_bundle, INT8, [image.image for image in test_images(options)])
    return asdict(found), {"int8_label_agreement": round(100 * found.labels, 2)}


def peers_part(options: argparse.Namespace, float_bundle: Path) -> tuple[dict, dict[str, float], dict[str, str]]:
    """In a process of its own: another runtime may take this one down with it."""
    path = options.out / "peers.json"
    path.unlink(missing_ok=True)
    rounds = 3 if options.quick else 25
    command = [sys.executable, "-m", "benchmarks.peers", "--fp32", str(float_bundle), "--threads", str(options.threads),
               "--rounds", str(rounds), "--out", str(path)]  # fmt: skip
    # Some runtimes die of AMX where a virtual machine hides how its tiles look.
    has_amx = "amx_bf16" in Path("/proc/cpuinfo").read_text().split()
    subprocess.run([*(["scripts/with-amx.sh"] if has_amx else []), *command], check=True)
    document = json.loads(path.read_text())
    figures, missing = {"roofline_fraction": document["roofline"]["fraction"]}, {}
    for name, runtime, precision in PEER_RATIOS:
        row = next(r for r in document["runtimes"] if (r["name"], r["precision"]) == (runtime, precision))
        if row["ours_int8_ratio"] is None:
            missing[f"time_by_{name}"] = row["missing"]
        else:
            figures[f"time_by_{name}"] = row["ours_int8_ratio"]
    return document, figures, missing


if __name__ == "__main__":
    sys.exit(main())
