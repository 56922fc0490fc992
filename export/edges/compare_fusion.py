"""Which rule of fusion is nearest to the true field, by number of views, on held-out solids seen from 12 places.

    python -m export.edges.compare_fusion --solids 14 --onnx sdk/models/edges-int8 --json build/fusion.json

RMSE in r over pixels of every view, against the distance to the nearest sharp curve that any of the views sees, also
where fewer are fused. `damaged truth` is each view's true field with errors like a network's. Solids are of `val`.
"""

from __future__ import annotations

import argparse
import json
from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.ndimage import gaussian_filter
from tqdm import tqdm

from export.densepose.graphs import session
from export.edges.config import EPS_R
from export.edges.data import seen_by
from export.edges.fusion import RULES, FieldView, Values, fused, paper_values_of, values_of
from export.edges.graph_field import field_of_planes, slopes_of, spread_of_planes
from export.edges.judged_pixels import STEP_PX, judged_pixels
from export.solids.multiview import MultiView, PosedView, multiview
from export.solids.recipe import RecipeError
from export.solids.sensors import LEVELS

DAMAGED = "damaged truth"
VIEWS = 12
COUNTS = (1, 2, 4, 8, VIEWS)
PAPER = "published: 8 samples within 6 r, minimum"


def damaged(view: PosedView, rng: np.random.Generator) -> FieldView:
    """Errors that neighbours share, larger where edges are far, and edges that are missed or made up in places."""
    true = view.distance.astype(np.float64)
    shape = true.shape

    def smooth(sigma_px: float) -> np.ndarray:
        noise = gaussian_filter(rng.standard_normal(shape), sigma_px)
        return noise / noise.std()

    spread = 0.3 + 0.12 * true
    field = gaussian_filter(true, 1.0) + spread * smooth(3)
    missed, made_up = smooth(10) > 1.7, smooth(10) > 2.3
    field = np.where(missed, EPS_R, np.where(made_up, np.abs(smooth(6)) * 6, field))
    field = np.where(view.depth > 0, np.clip(field, 0, EPS_R), EPS_R)
    return FieldView(view.camera, view.depth.astype(np.float64), field, spread)


class NetworkView:
    """A view through the model of a depth camera and a bundle's network."""

    def __init__(self, bundle: Path) -> None:
        self._graph = session(bundle / "field.onnx")

    def __call__(self, view: PosedView, level: str, rng: np.random.Generator) -> FieldView:
        focal_px = view.camera.fx_px
        depth = seen_by(LEVELS[level], view.depth, focal_px, rng)
        planes = self._graph.run(None, {"slopes": slopes_of(depth, focal_px)})[0]
        distance = np.where(depth > 0, field_of_planes(planes), EPS_R).astype(np.float64)
        return FieldView(view.camera, depth.astype(np.float64), distance, spread_of_planes(planes).astype(np.float64))


def errors_of(solid: MultiView, views: Sequence[FieldView], with_paper: bool) -> Iterator[tuple[str, int, float]]:
    """(rule, number of views, RMSE in r), for each view as the target."""
    for k, (view, posed) in enumerate(zip(views, solid.views, strict=True)):
        pixels = judged_pixels(view, posed)
        if not pixels.counts.any():
            continue
        targets, true = pixels.targets, pixels.true
        yield "one view, against what it sees", 1, pixels.rmse(pixels.own - pixels.true_own)
        yield "one view", 1, pixels.rmse(pixels.own - true)
        order = [k, *(j for j in range(len(views)) if j != k)]
        values = values_of([views[j] for j in order], targets)
        # Its own view is copied: no neighbour may change that a pixel has been seen.
        spread = view.spread[::STEP_PX, ::STEP_PX][pixels.known]
        values.distance[0], values.spread[0] = pixels.own * targets.r_m, spread * targets.r_m
        for count in COUNTS[1:]:
            some = Values(values.distance[:count], values.spread[:count])
            for rule in RULES:
                yield rule, count, pixels.rmse(fused(some, rule) / targets.r_m - true)
        if with_paper:
            paper = paper_values_of([views[j] for j in order], targets)
            paper.distance[0] = values.distance[0]
            yield PAPER, VIEWS, pixels.rmse(fused(paper, "minimum") / targets.r_m - true)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--solids", type=int, default=14, help="of `val` (default %(default)s)")
    parser.add_argument("--onnx", type=Path, default=Path("sdk/models/edges-int8"), help="a bundle")
    parser.add_argument("--levels", nargs="*", choices=[DAMAGED, *LEVELS], default=[DAMAGED, "clean", "tof", "stereo"])
    parser.add_argument("--paper", type=int, default=3, help="solids fused as published as well (slow)")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    network = NetworkView(options.onnx)
    rows: dict[tuple[str, str, int], list[float]] = defaultdict(list)
    for seed in tqdm(range(options.solids), unit="solid"):
        try:
            solid = multiview("val", seed, VIEWS)
        except RecipeError as error:
            tqdm.write(f"val {seed} is left out: {error}")
            continue
        for level in options.levels:
            rng = np.random.default_rng([24, seed, len(level)])
            views = [damaged(v, rng) if level == DAMAGED else network(v, level, rng) for v in solid.views]
            for rule, count, rmse in errors_of(solid, views, seed < options.paper):
                rows[level, rule, count].append(rmse)
    for level in options.levels:
        table = Table(level, *(f"{count} views" for count in COUNTS))
        for rule in dict.fromkeys(rule for of, rule, _ in rows if of == level):
            cells = [np.mean(rows[level, rule, c]) if (level, rule, c) in rows else None for c in COUNTS]
            table.add_row(rule, *("" if cell is None else f"{cell:.2f}" for cell in cells))
        Console(width=120).print(table)
    if options.json:
        options.json.parent.mkdir(parents=True, exist_ok=True)
        found = [{"level": a, "rule": b, "views": c, "rmse_r": float(np.mean(v))} for (a, b, c), v in rows.items()]
        options.json.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
