"""Several labelled views of one solid with their cameras, and its curves that any of them sees, to judge fusion.

    python -m export.solids.multiview val 3 --views 24 --out .data/solids/scan    # for `maquette edges build`

A view's own label knows the curves that this view sees. Fused, a point also knows those that are hidden from it in one
view and seen in another, so that it has a second label.
"""

from __future__ import annotations

import argparse
import json
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import cv2
import numpy as np

from export.camera import Camera
from export.solids.labels import Labeller, Labels, Piece
from export.solids.recipe import FRAME_PX, SPLITS, make, without_crashes
from export.solids.views import Seen, View

_AMBIGUOUS_R = 0.25


@dataclass(frozen=True, eq=False)
class PosedView:
    """Planes [H, W]: depth float32 in metres, 0 where nothing is; distance, distance_of_all float32 in r to the nearest
    sharp curve that this view, or any of the views, sees; counts bool: both labels are known."""

    camera: Camera
    depth: np.ndarray
    distance: np.ndarray
    distance_of_all: np.ndarray
    counts: np.ndarray


@dataclass(frozen=True, eq=False)
class MultiView:
    """curves: polylines [n, 3] in the world, of sharp curves that a view sees. family, stage: as of `recipe.Made`."""

    views: list[PosedView]
    curves: list[np.ndarray]
    family: str
    stage: str


def multiview(split: str, seed: int, count: int, size_px: tuple[int, int] = (320, 240)) -> MultiView:
    """The solid of a seed from `count` places. Raises export.solids.recipe.RecipeError. Blocks for some seconds."""
    return without_crashes(partial(_multiview, split, seed, count, size_px))


def _multiview(split: str, seed: int, count: int, size_px: tuple[int, int], again: int) -> MultiView:
    made = make(split, seed, count, again, max(1.0, size_px[0] / FRAME_PX[0]))
    labellers = [Labeller(Seen(made.solid, camera)) for camera in made.cameras]
    views = [one.seen.rendered(one.seen.camera.resized(*size_px)) for one in labellers]
    labels = [labeller.of(view) for labeller, view in zip(labellers, views, strict=True)]
    pieces = _merged([piece for one in labels for piece in one.pieces if piece.sure])
    posed = [_posed(*of_view, pieces) for of_view in zip(labellers, views, labels, strict=True)]
    camera = labellers[0].seen.camera
    curves = [labellers[0].outline(piece) @ camera.rotation + camera.centre for piece in pieces]
    return MultiView(posed, curves, made.family, made.stage)


def _merged(pieces: Sequence[Piece]) -> list[Piece]:
    """The parts of each edge that are in any piece; their kind is that of a view."""
    spans: dict[int, list[Piece]] = defaultdict(list)
    for piece in sorted(pieces, key=lambda piece: (piece.edge, piece.start)):
        own = spans[piece.edge]
        if own and piece.start <= own[-1].end:
            own[-1] = replace(own[-1], end=max(own[-1].end, piece.end))
        else:
            own.append(piece)
    return [piece for own in spans.values() for piece in own]


def _posed(labeller: Labeller, view: View, labels: Labels, pieces: Sequence[Piece]) -> PosedView:
    # A rounding that another view, from farther away, takes for sharp may be smooth from here.
    sharp = len(labeller.seen.solid.edges)
    own = {piece.edge for piece in labels.pieces if piece.sure}
    surely = labeller.field(view, [piece for piece in pieces if piece.edge < sharp or piece.edge in own])
    counts = (view.face >= 0) & ~labels.ignore
    if any(piece.edge >= sharp and piece.edge not in own for piece in pieces):
        counts &= np.abs(surely - labeller.field(view, list(pieces))) <= _AMBIGUOUS_R
    depth, distance, of_all = (p.astype(np.float32) for p in (view.depth, labels.distance, surely))
    return PosedView(view.camera, depth, distance, np.minimum(of_all, distance), counts)


def write_capture(solid: MultiView, folder: Path, depths: Sequence[np.ndarray] | None = None) -> None:
    """A folder that `maquette edges build` reads: transforms.json, depth as TIFF in metres, photos of slopes, and
    curves.json, {"curves": polylines in the world}. depths: float32 [H, W] instead of the exact ones."""
    folder.mkdir(parents=True, exist_ok=True)
    frames = []
    for k, view in enumerate(solid.views):
        c, depth = view.camera, view.depth if depths is None else depths[k]
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = c.rotation.T * [1, -1, -1], c.centre
        slopes = np.stack([np.gradient(np.log(np.maximum(depth, 1e-6)), axis=a) * c.fx_px for a in (0, 1)])
        shade = (255 / (1 + np.abs(slopes).sum(0)) * (depth > 0)).astype(np.uint8)
        cv2.imwrite(str(folder / f"{k:03d}.png"), shade)
        cv2.imwrite(str(folder / f"{k:03d}_depth.tiff"), depth.astype(np.float32))
        frames.append({
            "file_path": f"{k:03d}.png", "depth_file_path": f"{k:03d}_depth.tiff", "transform_matrix": pose.tolist(),
            "w": c.width_px, "h": c.height_px, "fl_x": c.fx_px, "fl_y": c.fy_px, "cx": c.cx_px + 0.5,
            "cy": c.cy_px + 0.5,
        })  # fmt: skip
    (folder / "transforms.json").write_text(json.dumps({"frames": frames}, indent=1) + "\n")
    (folder / "curves.json").write_text(json.dumps({"curves": [curve.tolist() for curve in solid.curves]}) + "\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("split", choices=SPLITS)
    parser.add_argument("seed", type=int)
    parser.add_argument("--views", type=int, default=12, help="(default %(default)s)")
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    write_capture(multiview(options.split, options.seed, options.views), options.out)


if __name__ == "__main__":
    main()
