"""Measures errors of fields on held-out views of simulated sensors, beside baselines tuned on validation views."""

from __future__ import annotations

import statistics
import warnings
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from tqdm import tqdm

from benchmarks.edges.baselines import BASELINES
from benchmarks.edges.methods import FLOAT, NOTHING, SHIPPED, Method, NoEdges, tuned_baselines
from benchmarks.edges.views import View
from export.edges.config import EPS_R, SHARP_R
from export.edges.metrics import STEPS, cuts, frame_metrics, summary

LEVELS = ("clean", "tof", "stereo")  # levels with targets and baselines
TUNING_VIEWS = 40  # number of validation views for tuning, spread evenly; thresholds of networks use all views
SHOWN = 5  # views in the contact sheet
MIN_PIXELS = 1000  # smaller groups are not reliable
# Baselines find edges with the threshold of the smallest RMSE; their distances are used directly.
OWN_CUTS = {sharp_r: int(sharp_r / EPS_R * STEPS) for sharp_r in SHARP_R}


@dataclass
class Errors:
    """rows: by level and method. groups: of the shipped network, by group of pixels. agreement: of int8 and fp32, by
    level. shown: for the contact sheet. cuts: thresholds of the shipped network, by level. baselines: tuned ones, by
    level. missing: why others are not measured."""

    rows: list[dict] = field(default_factory=list)
    groups: list[dict] = field(default_factory=list)
    agreement: list[dict] = field(default_factory=list)
    shown: list[dict] = field(default_factory=list)
    cuts: dict[str, dict[float, int]] = field(default_factory=dict)
    baselines: dict[str, dict[str, Method]] = field(default_factory=dict)
    missing: dict[str, str] = field(default_factory=dict)


def measure(
    val: Sequence[View], test: Sequence[View], networks: Mapping[str, Method], other_levels: Sequence[str]
) -> Errors:
    """Measures all methods on LEVELS, and the shipped network alone on `other_levels`."""
    errors = Errors()
    chosen = set(np.linspace(0, len(test) - 1, min(SHOWN, len(test))).round().astype(int).tolist())
    for level in tqdm([*LEVELS, *other_levels], desc="edges: errors", unit="level", disable=None):
        ways: dict[str, Method] = {SHIPPED: networks[SHIPPED]}
        seen_val = [view.seen(level) for view in val]
        if level in LEVELS:
            every = max(1, len(val) // TUNING_VIEWS)
            errors.baselines[level], errors.missing = tuned_baselines(val[::every], seen_val[::every])
            ways = {**networks, **errors.baselines[level], NOTHING: NoEdges()}
        at = {}
        for name, way in ways.items():
            pairs = () if name in BASELINES else zip(val, seen_val, strict=True)
            at[name] = cuts([metrics_of(way, *pair)[0] for pair in pairs]) if pairs else OWN_CUTS
        errors.cuts[level] = at[SHIPPED]
        of_way, of_group, same = defaultdict(list), defaultdict(list), []
        for number, view in enumerate(test):
            depth, fields = view.seen(level), {}
            counts = view.frame.counts & (depth > 0)
            for name, way in ways.items():
                metrics, fields[name] = metrics_of(way, view, depth)
                of_way[name].append(metrics)
            if FLOAT in fields:
                same.append(((fields[FLOAT] < 1) == (fields[SHIPPED] < 1))[depth > 0].mean())
            if level in LEVELS:
                for axis, masks in view.groups.items():
                    for name, mask in masks.items():
                        of_group[axis, name].append(of_pixels(fields[SHIPPED], view, counts & mask))
                if number in chosen:
                    errors.shown.append({"level": level, "view": view, "depth": depth, "fields": fields})
        for name, metrics in of_way.items():
            ms = statistics.median(row["ms"] for row in metrics)
            errors.rows.append({"level": level, "way": name, **summary(metrics, at[name]), "ms": round(ms, 3)})
        for (axis, name), metrics in of_group.items():
            pixels = sum(row["pixels"] for row in metrics)
            if pixels >= MIN_PIXELS:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore", RuntimeWarning)  # views without such pixels are left out
                    means = {k: _or_none(v) for k, v in summary(metrics, at[SHIPPED]).items()}
                errors.groups.append({"level": level, "axis": axis, "group": name, "pixels": pixels, **means})
        if same:
            errors.agreement.append({"level": level, "same_side": float(np.mean(same))})
    return errors


def metrics_of(way: Method, view: View, depth: np.ndarray) -> tuple[dict, np.ndarray]:
    """Returns the metrics of one view with the milliseconds, and the field."""
    distance, ms = way.run(depth, view.camera)
    return of_pixels(distance, view, view.frame.counts & (depth > 0)) | {"ms": ms}, distance


def of_pixels(distance: np.ndarray, view: View, counts: np.ndarray) -> dict:
    return frame_metrics(distance, view.frame.distance, counts) | {"pixels": int(counts.sum())}


def of_set(test: Sequence[View], way: Method, at: Mapping[str, Mapping[float, int]]) -> list[dict]:
    """Returns rows of one method on another set of views. at: thresholds of `measure`, by level."""
    rows = []
    for level, cut in at.items():
        metrics = [metrics_of(way, view, view.seen(level))[0] for view in test]
        rows.append({"level": level, **{k: _or_none(v) for k, v in summary(metrics, cut).items()}})
    return rows


def _or_none(value: float) -> float | None:
    """Replaces NaN, which JSON lacks."""
    return None if np.isnan(value) else value


def metrics_from(rows: Sequence[Mapping], agreement: Sequence[Mapping]) -> dict[str, float]:
    """Returns the metrics with a target."""
    found = {(row["level"], row["way"]): row for row in rows}
    metrics, by_baseline, by_float = {}, [], []
    for level in LEVELS:
        ours = found[level, SHIPPED]
        metrics[f"edges_rmse_{level}"] = ours["rmse_r"]
        metrics[f"edges_recall_4r_{level}"] = 100 * ours["recall_4r"]
        others = [row["rmse_r"] for (its, way), row in found.items() if its == level and way in BASELINES]
        by_baseline.append(ours["rmse_r"] / min(others))
        if (level, FLOAT) in found:
            by_float.append(100 * (ours["rmse_r"] / found[level, FLOAT]["rmse_r"] - 1))
    metrics["edges_recall_r_clean"] = 100 * found["clean", SHIPPED]["recall_1r"]
    metrics["edges_rmse_by_baseline"] = max(by_baseline)
    if by_float:
        metrics["edges_int8_rmse_percent"] = max(by_float)
        metrics["edges_int8_same_side"] = 100 * min(row["same_side"] for row in agreement)
    return metrics
