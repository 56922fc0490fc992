"""Several labelled views of one solid with their cameras, and its curves that any of them sees, to judge fusion.

A view's own label knows the curves that this view sees. Fused, a point also knows those that are hidden from it in one
view and seen in another, so that it has a second label.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from export.camera import Camera
from export.solids.labels import Labeller, Labels, Piece
from export.solids.recipe import FRAME_PX, make, without_crashes
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
