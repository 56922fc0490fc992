"""Measures edges: error of fields and curves of depth frames against run time, beside baselines.

    python -m benchmarks --only edges                        `make build` first
    python -m benchmarks --only edges --quick                a few views, a smoke test
    python -m benchmarks --only edges --edge-parts fields curves    an hour; other load does not matter
    python -m benchmarks --only edges --edge-parts times            minutes, on an idle machine

Errors are measured on whole views of solids whose families neither training nor the choice of thresholds saw. The
report names each target that could not be measured, with the reason.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from benchmarks.edges import (
    carton,
    curved_false_positives,
    curves,
    fused,
    plots,
    quality,
    speed,
    true_fields,
)  # fmt: skip
from benchmarks.edges.edges_api import Edges
from benchmarks.edges.methods import FLOAT, SHIPPED, Networks, opened, tuned_baselines
from benchmarks.edges.views import View, read_views
from benchmarks.frame_time import MAX_OTHERS, OthersFraction
from export.bundle import BundleInfo
from export.edges.bundle import write_manifest
from export.edges.export_onnx import export
from export.edges.weights import load_network
from export.solids.sensors import LEVELS

SOLIDS, BUNDLE, WEIGHTS = Path(".data/solids"), Path("sdk/models/edges-int8"), Path("export/weights/edges.pt")
SOLIDS_OF = {"val": 40, "test": 200}
WIDTH_PX = 320  # width of the views for errors
MIN_VIEWS = 200
SPEED_VIEWS, SAVING_FRAMES = 24, 40
CURVE_VIEWS = 100  # number of test views, spread evenly
QUICK_VIEWS, QUICK_FRAMES = 8, 4
CAD_PARTS = "kicad"  # the set of real CAD parts, compared with synthetic solids

PARTS = ("fields", "curves", "times")
FIELD_METRICS = (
    *(f"edges_rmse_{level}" for level in quality.LEVELS), "edges_rmse_by_baseline", "edges_rmse_by_solids",
    "edges_recall_r_clean", *(f"edges_recall_4r_{level}" for level in quality.LEVELS), "edges_int8_rmse_percent",
    "edges_int8_same_side", "edges_bundle_mb", "edges_memory_mb", "edges_allocations",
    "edges_own_allocations",
)  # fmt: skip
CURVE_METRICS = (
    true_fields.METRIC, *(f"edges_curves_{level}" for level in quality.LEVELS), "edges_box_mm_tof",
    "edges_box_mm_stereo", "edges_box_deviation_mm",
)  # fmt: skip
METRICS_OF = {
    "fields": (*FIELD_METRICS, curved_false_positives.METRIC),
    "curves": (*CURVE_METRICS, *fused.METRICS, *carton.METRICS),
    "times": ("edges_fps_320", "edges_fps_640", *(f"edges_fps_{scene}" for scene in speed.SCENES), fused.TIME_METRIC),
}
METRICS = tuple(figure for metrics in METRICS_OF.values() for figure in metrics)


@dataclass(frozen=True)
class Sources:
    """solids: folder with `val` and `test`. bundle: the shipped one; weights: the same network in float. others:
    further weights by name. bundles: further bundles by name. sets: further folders of whole views by name. views:
    maximum number of views of each set."""

    solids: Path
    bundle: Path
    weights: Path
    others: dict[str, Path]
    bundles: dict[str, Path]
    sets: dict[str, Path]
    views: int | None


@dataclass
class Found:
    """The result of one of PARTS: its entries of the document, its metrics with a target, and why others are
    missing."""

    document: dict
    metrics: dict[str, float]
    missing: dict[str, str]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds arguments for views and networks."""
    named = {"nargs": "+", "default": [], "type": _named}
    parser.add_argument("--solids", type=Path, default=SOLIDS, metavar="DIR",
                        help=f"rendered solids with val and test, made if missing; default: {SOLIDS}")  # fmt: skip
    parser.add_argument("--solid-views", type=int, metavar="N", help="views of each set, spread evenly; default: all")
    parser.add_argument("--edge-bundle", type=Path, default=BUNDLE, metavar="BUNDLE", help=f"default: {BUNDLE}")
    parser.add_argument("--edge-weights", type=Path, default=WEIGHTS, metavar="FILE",
                        help=f"the same network in float; default: {WEIGHTS}")  # fmt: skip
    parser.add_argument("--other-edge-weights", **named, metavar="NAME=FILE", help="float weights to compare: m=m.pt")
    parser.add_argument("--other-edge-bundles", **named, metavar="NAME=BUNDLE", help="bundles to compare: m-int8=DIR")
    default = f"{CAD_PARTS}={SOLIDS / CAD_PARTS} if there"
    parser.add_argument("--edge-parts", nargs="+", choices=PARTS, default=list(PARTS), metavar="PART",
                        help="fields, curves (both errors), times; the others are kept")  # fmt: skip
    parser.add_argument("--edge-sets", **named, metavar="NAME=DIR", help=f"further whole views; default: {default}")


def _named(text: str) -> tuple[str, Path]:
    name, separator, path = text.partition("=")
    if not (name and separator and path):
        raise argparse.ArgumentTypeError(f"{text} is not NAME=PATH")
    return name, Path(path)


def sources_of(options: argparse.Namespace) -> Sources:
    """Reads the arguments. Renders solids if there are none."""
    for split, count in SOLIDS_OF.items():
        if not list((options.solids / split).glob("solids-*.npz")):
            count = 10 if options.quick else count
            print(f"Rendering {count} solids into {options.solids / split}: some {-(-count // 10)} minutes")
            subprocess.run([sys.executable, "-m", "export.solids.dataset", split, "--whole", "--count", str(count),
                            "--out", str(options.solids / split)], check=True)  # fmt: skip
    sets = dict(options.edge_sets)
    if not sets and (options.solids / CAD_PARTS).is_dir():
        sets = {CAD_PARTS: options.solids / CAD_PARTS}
    return Sources(options.solids, options.edge_bundle, options.edge_weights, dict(options.other_edge_weights),
                   dict(options.other_edge_bundles), sets, options.solid_views)  # fmt: skip


def networks_of(given: Sources, folder: Path) -> Networks:
    """Returns bundles of all networks; weights are exported into `folder`."""
    bundles, histograms, missing = {SHIPPED: given.bundle}, {}, {}
    for name, path in {FLOAT: given.weights, **given.others}.items():
        if not path.exists():
            missing[name] = f"no weights {path}"
            continue
        network, config = load_network(path)
        if config.bins:
            histograms[name] = path
            continue
        label = name if name == FLOAT else f"{name}, fp32"
        target = folder / f"edges-{'shipped' if name == FLOAT else name}-fp32"
        export(network, target, config.multiple)
        write_manifest(target, BundleInfo(target.name, "fp32"), config.multiple)
        bundles[label] = target
    return Networks({**bundles, **given.bundles}, histograms, missing)


def measure(
    given: Sources, folder: Path, threads: int, quick: bool, parts: Sequence[str] = PARTS, last: Mapping | None = None
) -> tuple[dict, dict[str, float], dict[str, str]]:
    """Returns the document, the metrics with a target, and why others are missing. last: document of an earlier run,
    from which the other parts come. Writes the contact sheet into `folder`, because JSON holds no images."""
    document, networks = dict(last or {}), networks_of(given, folder)
    document.setdefault("warnings_of", {})
    metrics, missing = {}, {}
    measurements = {"fields": measure_fields, "curves": measure_curves, "times": measure_times}
    for part, measuring in measurements.items():
        if part not in parts:
            continue
        others = OthersFraction()
        found = measuring(given, networks, folder, threads, quick)
        fraction, warnings = others.now(), []
        if part == "fields" and found.document["views"]["test"] < MIN_VIEWS:
            warnings.append(f"{found.document['views']['test']} test views, {MIN_VIEWS} are wanted")
        if fraction > MAX_OTHERS:
            warnings.append(f"other processes used {fraction:.0%} of the CPU (edges, {part})")
        document |= found.document
        document["warnings_of"] = document["warnings_of"] | {part: warnings}
        metrics |= {name: round(value, 4) for name, value in found.metrics.items()}
        missing |= {name: why for name, why in found.missing.items() if name not in found.metrics}
    document["warnings"] = [text for warnings in document["warnings_of"].values() for text in warnings]
    return document, metrics, missing


def views_of(given: Sources, quick: bool) -> tuple[list[View], list[View]]:
    """Returns validation and test views, WIDTH_PX wide."""
    views = view_limit(given, quick)
    val, test = (read_views(given.solids / split, WIDTH_PX, views) for split in ("val", "test"))
    return val, test


def view_limit(given: Sources, quick: bool) -> int | None:
    return min(QUICK_VIEWS, given.views or QUICK_VIEWS) if quick else given.views


def measure_fields(given: Sources, networks: Networks, folder: Path, threads: int, quick: bool) -> Found:
    """Measures errors of fields, and memory; other load does not matter."""
    val, test = views_of(given, quick)
    levels = [level for level in LEVELS if level not in quality.LEVELS]
    with ExitStack() as stack:
        ways = opened(networks, threads, stack)
        errors = quality.measure(val, test, ways, levels[:1] if quick else levels)
        sets = {name: quality.of_set(read_views(path, WIDTH_PX, view_limit(given, quick)), ways[SHIPPED],
                                     cuts_of(errors.cuts)) for name, path in given.sets.items()}  # fmt: skip
    of_round, why_no_round = curved_false_positives.found_in(given.bundle, threads)
    document = {
        "views": {"val": len(val), "test": len(test), "solids": len({solid_of(view) for view in test})},
        "errors": errors.rows, "groups": errors.groups, "agreement": errors.agreement, "sets": sets, "round": of_round,
        "missing": {**networks.missing, **errors.missing},
        "sheet": plots.write_sheet(errors.shown, folder).name,
    }  # fmt: skip
    metrics = quality.metrics_from(errors.rows, errors.agreement)
    metrics["edges_bundle_mb"] = sum(path.stat().st_size for path in given.bundle.iterdir()) / 1e6
    metrics |= speed.stream_cost(given.bundle, threads, folder) | curved_false_positives.metrics_from(of_round)
    missing = {curved_false_positives.METRIC: why_no_round}
    missing |= dict.fromkeys(("edges_int8_rmse_percent", "edges_int8_same_side"), networks.missing.get(FLOAT, ""))
    if CAD_PARTS in sets:
        metrics["edges_rmse_by_solids"] = set_ratio(sets[CAD_PARTS], errors.rows)
    else:
        missing["edges_rmse_by_solids"] = f"no set of real parts: --edge-sets {CAD_PARTS}=DIR"
    return Found(document, metrics, missing)


def measure_curves(given: Sources, _: Networks, folder: Path, threads: int, quick: bool) -> Found:
    """Measures errors of curves and boxes, of one view and of fused views; other load does not matter."""
    _, test = views_of(given, quick)
    amounts = (2, 2, 5) if quick else (curves.BOX_SEEDS, curves.BOX_FRAMES, curves.STEADY_FRAMES)
    some = test[:: max(1, len(test) // CURVE_VIEWS)]
    with Edges(given.bundle, threads) as shipped:
        of_solids = curves.measure_solids(some, shipped)
        boxes = curves.measure_boxes(shipped, *amounts)
    of_true, why_no_true = true_fields.found_in(some, folder)
    of_carton, why_no_carton = carton.found_in(given.bundle)
    of_fusion, why_no_fusion = fused.found_by(lambda: fused.measure(given.bundle, threads, quick, folder))
    document = {"curves": of_solids, "curves_of_true_fields": of_true, "boxes": boxes, "fusion": of_fusion,
                "carton": of_carton}  # fmt: skip
    metrics, missing = curves.metrics_from(of_solids, boxes)
    metrics |= true_fields.metrics_from(of_true)
    metrics |= fused.metrics_from(of_fusion) | carton.metrics_from(of_carton)
    missing |= dict.fromkeys(carton.METRICS, why_no_carton or "too few edges of the real box were found")
    missing |= dict.fromkeys(fused.METRICS, why_no_fusion or "no solid could be made")
    missing[true_fields.METRIC] = why_no_true
    return Found(document, metrics, missing)


def measure_times(given: Sources, networks: Networks, folder: Path, threads: int, quick: bool) -> Found:
    """Measures error against run time, savings, frames a second, and seconds of a fusion. Needs an idle machine."""
    count = 2 if quick else min(SPEED_VIEWS, given.views or SPEED_VIEWS)
    val, test = (read_views(given.solids / split, speed.FULL_PX[0], count) for split in ("val", "test"))
    scene_frames = QUICK_FRAMES if quick else curves.SCENE_FRAMES
    # Metrics with a target come first.
    of_scenes = curves.measure_scenes(given.bundle, threads, scene_frames)
    saving_frames = QUICK_FRAMES if quick else SAVING_FRAMES
    savings = speed.measure_savings(given.bundle, threads, saving_frames)
    of_fusion, why_no_fusion = fused.found_by(lambda: fused.measure_times(given.bundle, threads, quick))
    rows = speed.measure(test, networks.bundles, baselines_of(val), threads)
    document = {"speed": rows, "savings": savings, "curves_of_scenes": of_scenes, "fusion_times": of_fusion}
    metrics = speed.metrics_from(rows) | curves.scene_metrics_from(of_scenes) | fused.metrics_from(of_fusion)
    return Found(document, metrics, {fused.TIME_METRIC: why_no_fusion or "no solid could be made"})


def cuts_of(cuts: dict[str, dict[float, int]]) -> dict[str, dict[float, int]]:
    return {level: cuts[level] for level in quality.LEVELS}


def baselines_of(val: Sequence[View]) -> dict[str, dict]:
    """Returns baselines tuned on views of the size for times."""
    return {level: tuned_baselines(val, [view.seen(level) for view in val])[0] for level in quality.LEVELS}


def solid_of(view: View) -> str:
    return "/".join(view.name.split("/")[:2])


def set_ratio(rows: Sequence[dict], own: Sequence[dict]) -> float:
    """Returns the largest ratio over levels of the RMSE on a set to that on synthetic solids."""
    ours = {row["level"]: row["rmse_r"] for row in own if row["way"] == SHIPPED}
    return max(row["rmse_r"] / ours[row["level"]] for row in rows if row["rmse_r"] is not None)
