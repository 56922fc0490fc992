"""Measures scenes: error of new views against the time to the first image; time of frames; memory; bytes.

    python -m benchmarks --only scenes            `make build` first
    python -m benchmarks --only scenes --quick    two captures, two photos of each, a smoke test

`maquette scene` runs on rendered captures that no training saw and on real ones, beside baselines without a network.
The report names each target that could not be measured, with the reason.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

from benchmarks.frame_time import MAX_OTHERS, OthersFraction
from benchmarks.scenes import plots as scene_plots
from benchmarks.scenes import quality as scene_quality
from benchmarks.scenes import speed as scene_speed
from benchmarks.scenes.settings import SHIPPED, Sources, settings, sources
from export.scenes.perceptual import load_perceptual

METRICS = ("scene_fps_500k", "scene_fps_200k_small", "scene_build_s", "scene_bytes_a_point", "scene_gain_db",
           "scene_int8_loss_db", "scene_peak_memory_mb", "scene_bundle_mb")  # fmt: skip
MIN_PLACES, MIN_REAL = 8, 2
PERCEPTUAL = Path(".data/teachers/backbone.pt")
PLACES, REAL = Path(".data/places/test"), Path(".data/places/real")
NETWORKS, FP32 = Path("sdk/models/scenes-int8"), Path(".data/bundles/scenes-fp32")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds arguments for captures and networks."""
    parser.add_argument("--places", type=Path, default=PLACES, metavar="DIR",
                        help=f"rendered captures, made if missing; default: {PLACES}")  # fmt: skip
    parser.add_argument("--real", type=Path, nargs="+", metavar="DIR",
                        help=f"real captures, folders with transforms.json each; default: all in {REAL}")  # fmt: skip
    parser.add_argument("--networks", type=Path, default=NETWORKS, metavar="BUNDLE", help=f"default: {NETWORKS}")
    parser.add_argument("--fp32", type=Path, default=FP32, metavar="BUNDLE", help=f"the same in fp32; default: {FP32}")
    parser.add_argument("--other-networks", type=Path, nargs="+", default=[], metavar="BUNDLE",
                        help="bundles to compare, such as other widths")  # fmt: skip
    parser.add_argument("--fine-tuned", type=Path, metavar="DIR", help="scenes DIR/PLACE/{10s,60s,600s}.maqs")


def sources_of(options: argparse.Namespace) -> Sources:
    """Reads the arguments. Renders captures if there are none."""
    if not list(options.places.glob("*/transforms.json")):
        print(f"Rendering {MIN_PLACES} places into {options.places}: a quarter of an hour")
        for module in (["export.places.assets"], ["export.photos", "fetch"], ["export.people.assets"],
                       ["export.places.dataset", "--split", "test", "--scenes", str(MIN_PLACES), "--out",
                        str(options.places.parent)]):  # fmt: skip
            subprocess.run([sys.executable, "-m", *module], check=True)
    real = options.real if options.real is not None else [p.parent for p in sorted(REAL.glob("*/transforms.json"))]
    return sources(options.places, real, options.networks, options.fp32, options.other_networks, options.fine_tuned)


def measure(given: Sources, folder: Path, threads: int, quick: bool) -> tuple[dict, dict[str, float], dict[str, str]]:
    """Returns the document, the metrics with a target, and why others are missing. Writes the contact sheet into
    `folder`, because JSON holds no images."""
    few = Sources(given.places[:2], given.real[:1], given.bundles, given.tuned) if quick else given
    others = OthersFraction()
    perceptual = load_perceptual(PERCEPTUAL) if PERCEPTUAL.exists() else None
    wanted = settings(list(given.bundles))
    rows, places, shown = scene_quality.measure(few, wanted, perceptual, quick)
    speed, why = scene_speed.measure(given.places, given.bundles[SHIPPED], threads, quick)
    fraction = others.now()
    warnings = warnings_of(places, perceptual is not None)
    if fraction > MAX_OTHERS:
        warnings.append(f"other processes used {fraction:.0%} of the CPU (scenes)")
    sheet = scene_plots.write_sheet(shown, rows, folder)
    document = {"rows": rows, "places": places, "speed": speed, "speed_missing": why, "warnings": warnings,
                "sheet": sheet.name if sheet else ""}  # fmt: skip
    metrics, missing = quality_figures(rows, given)
    found, lost = scene_speed.metrics_of(speed) if speed else ({}, {})
    missing = dict.fromkeys(METRICS, why) | missing | lost
    metrics = {name: round(value, 4) for name, value in (metrics | found).items()}
    return document, metrics, {name: reason for name, reason in missing.items() if name not in metrics}


def warnings_of(places: list[dict], has_distance: bool) -> list[str]:
    """Returns warnings about missing captures."""
    warnings = [f"{place['name']} was left out: {place['missing']}" for place in places if "missing" in place]
    for real, wanted, kind in ((False, MIN_PLACES, "rendered"), (True, MIN_REAL, "real")):
        count = sum(place["real"] == real and "missing" not in place for place in places)
        if count < wanted:
            warnings.append(f"{count} {kind} places, {wanted} are wanted")
    if not has_distance:
        warnings.append(f"no distance by features: {PERCEPTUAL} is not there (python -m export.teachers.backbone)")
    return warnings


def quality_figures(rows: list[dict], given: Sources) -> tuple[dict[str, float], dict[str, str]]:
    """Returns the metrics with a target from the rows of rendered captures, and why others are missing."""
    found = {row["setting"]: row["rendered"] for row in rows}
    said = {row["setting"]: next(iter(row["missing"].values()), "there is no rendered place") for row in rows}
    metrics, missing = {}, {}
    shipped, plain, exact = "as shipped", "plain points", "fp32 networks and descriptors, all varying"
    if found[shipped]:
        metrics["scene_bytes_a_point"] = found[shipped]["bytes_a_point"]
    else:
        missing["scene_bytes_a_point"] = said[shipped]
    for name, better, worse in (("scene_gain_db", shipped, plain), ("scene_int8_loss_db", exact, shipped)):
        lost = [setting for setting in (better, worse) if not found[setting]]
        if lost:
            missing[name] = said[lost[0]]
        else:
            metrics[name] = found[better]["psnr_db"] - found[worse]["psnr_db"]
    bundle = given.bundles[SHIPPED]
    if bundle.is_dir():
        metrics["scene_bundle_mb"] = sum(path.stat().st_size for path in bundle.iterdir() if path.is_file()) / 1e6
    else:
        missing["scene_bundle_mb"] = f"no networks in {bundle}"
    return metrics, missing
