"""How much each parameter of curve extraction matters: the F-score of curves with half and with double of it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import maquette
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from maquette.native import native
from tqdm import tqdm

from benchmarks.edges.curve_scores import view_score
from benchmarks.edges.curves import with_curves
from benchmarks.edges.edges_api import Curves, Edges
from benchmarks.edges.quality import LEVELS
from benchmarks.edges.views import View

VIEWS = 24  # of validation, evenly
FACTORS = (0.5, 1.0, 2.0)
PICTURE = "edges-sensitivity.png"
PARAMETERS = {"select_px": "px from an edge that say where it is", "min_votes": "votes that an edge needs",
              "smear_px": "px of smeared depth", "support_px": "px of the band for surfaces",
              "break_deg": "degrees that part a curve", "min_length_px": "px of the shortest curve",
              "tolerance_r": "r of the simplest type", "gap_r": "r between surfaces of a crease",
              "join_px": "px to a corner", "max_curves": "curves of a frame"}  # fmt: skip


def defaults() -> dict[str, float]:
    """Of maq_edges_curves_config."""
    config = native().config("maq_edges_curves_config", {})
    return {name: getattr(config, name) for name in PARAMETERS}


def measure(val: Sequence[View], edges: Edges) -> list[dict]:
    """Rows by parameter, as its value with each of FACTORS and mean F-scores by level: {"parameter", "values": [3],
    "f_score": {level: [3]}}. Other parameters have their defaults. Fields are found once."""
    wanted = with_curves(val)
    wanted = wanted[:: max(1, len(wanted) // VIEWS)][:VIEWS]
    own = defaults()
    kind = {name: int if name == "max_curves" else float for name in PARAMETERS}
    settings = {(name, factor): {name: kind[name](factor * own[name])}
                for name in PARAMETERS for factor in FACTORS if factor != 1}  # fmt: skip
    settings["", 1.0] = {}
    rows = [{"parameter": name, "values": [kind[name](factor * own[name]) for factor in FACTORS], "f_score": {}}
            for name in PARAMETERS]  # fmt: skip
    for level in tqdm(LEVELS if wanted else (), desc="edges: sensitivity", unit="level", disable=None):
        scores = {setting: [] for setting in settings}
        for view in wanted:
            depth = view.seen(level)
            result = edges.model.run_native(depth, view.camera.intrinsics(depth.shape))
            for setting, options in settings.items():
                scores[setting].append(view_score(_curves(result, options), view)["f_score"])
        means = {setting: float(np.mean(of)) for setting, of in scores.items()}
        for row in rows:
            row["f_score"][level] = [means[("", 1.0) if factor == 1 else (row["parameter"], factor)]
                                     for factor in FACTORS]  # fmt: skip
    return rows


def _curves(result: object, options: dict[str, float]) -> Curves:
    n = native()
    config = n.config("maq_edges_curves_config", {"find_boxes": 0, **options})
    find, release = "maq_edges_result_find_curves", "maq_edges_curves_release"
    return Curves.of(maquette.Curves(n.create("maq_edges_curves", result, config, function=find, release=release)))


def draw(rows: Sequence[dict], folder: Path) -> Path:
    """A row a parameter, a column a level: F-score with half of it, as shipped, and double."""
    figure, axes = plt.subplots(len(rows), len(LEVELS), figsize=(9, 1.05 * len(rows)), sharex=True, squeeze=False,
                                layout="constrained")  # fmt: skip
    for line, row in zip(axes, rows, strict=True):
        for axis, level in zip(line, LEVELS, strict=True):
            values = row["f_score"][level]
            axis.plot(FACTORS, values, "o-", markersize=4)
            for factor, value in zip(FACTORS, values, strict=True):
                axis.annotate(f"{value:.3f}", (factor, value), fontsize=6, xytext=(0, 4), textcoords="offset points",
                              ha="center")  # fmt: skip
            # One scale for all parameters of a level.
            every = [value for other in rows for value in other["f_score"][level]]
            margin = 0.25 * (max(every) - min(every)) + 1e-3
            axis.set(xscale="log", xlim=(0.42, 2.4), ylim=(min(every) - margin, max(every) + margin))
            axis.set_xticks(FACTORS, ["half", "shipped", "double"], fontsize=7)
            axis.minorticks_off()
            axis.tick_params(axis="y", labelsize=6)
            axis.grid(alpha=0.3)
        line[0].set_ylabel(f"{row['parameter']}\n{row['values'][1]:g}", fontsize=7, rotation=0, ha="right", va="center")
    for axis, level in zip(axes[0], LEVELS, strict=True):
        axis.set_title(f"F-score, {level}", fontsize=8)
    figure.savefig(folder / PICTURE, dpi=100)
    plt.close(figure)
    return folder / PICTURE
