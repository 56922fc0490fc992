"""The pixels of a view that fusion is judged on: where they are, what the view says of them, and what is true."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from export.edges.fusion import FieldView, Targets, targets_of

if TYPE_CHECKING:
    from export.solids.multiview import PosedView  # needs OpenCascade, of the extra `solids`

STEP_PX = 4  # between the rows and columns that are judged


@dataclass(frozen=True, eq=False)
class JudgedPixels:
    """Every STEP_PX-th pixel of known depth in rows and columns, N of them: which of [H', W'] these are, their places,
    and distances [N] in r: own, by the view; true_own and true, to the nearest sharp curve that this view, or any of
    the views, sees. counts: both are known."""

    known: np.ndarray
    targets: Targets
    own: np.ndarray
    true_own: np.ndarray
    true: np.ndarray
    counts: np.ndarray

    def rmse(self, error: np.ndarray, among: np.ndarray | None = None) -> float:
        """Root mean square of an error [N] over what counts, or the part of it that is `among`."""
        counts = self.counts if among is None else self.counts & among
        return float(np.sqrt(np.mean(error[counts] ** 2)))


def judged_pixels(view: FieldView, posed: PosedView) -> JudgedPixels:
    part = np.s_[::STEP_PX, ::STEP_PX]
    known = view.depth[part] > 0

    def of(plane: np.ndarray) -> np.ndarray:
        return plane[part][known].astype(np.float64)

    distances = (of(plane) for plane in (view.distance, posed.distance, posed.distance_of_all))
    return JudgedPixels(known, targets_of(view, STEP_PX), *distances, posed.counts[part][known])
