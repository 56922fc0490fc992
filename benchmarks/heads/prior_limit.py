"""Measures the best head that the prior can represent: codes fitted to the true distances of test heads, not to photos.

The metric is the distance of that surface from the true points. A fit to photos is not expected to be better.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path

import numpy as np
import torch

from benchmarks.heads.distances import MM_PER_DM
from benchmarks.heads.photos import TrueHead
from export.heads.field import bases_of, geometry
from export.heads.head_shards import HeadPoints
from export.heads.prior_file import read_prior
from export.heads.train_prior import HeadTensors, fitted_codes


def measure_prior(bundle: Path, points: Path, heads: Sequence[TrueHead], steps: int = 250) -> list[dict]:
    """points: folder of the test heads' points (`export.heads.points`). Returns for each head mean distances of the
    true points that count, mm, without alignment: with fitted codes, and `mean_...` for the mean head."""
    bases, stored = bases_of(read_prior(bundle / "prior.maqp")), []
    for head in heads:
        with np.load(points / f"{head.name}.npz") as file:
            stored.append(HeadPoints(**{f.name: file[f.name] for f in fields(HeadPoints)}))
    torch.manual_seed(0)
    z, c = fitted_codes(bases, HeadTensors(stored), steps)
    rows = []
    with torch.no_grad():
        for k, head in enumerate(heads):
            true = torch.from_numpy((head.true.points / MM_PER_DM).astype(np.float32))
            face, row = torch.from_numpy(head.true.is_face), {"head": head.name}
            for prefix, codes in (("", (z[k], c[k])), ("mean_", (torch.zeros_like(z[k]), torch.zeros_like(c[k])))):
                away = geometry(bases.shape, bases.combine(*codes), true)[:, 0].abs() * MM_PER_DM
                row |= {f"{prefix}head_mm": float(away.mean()), f"{prefix}face_mm": float(away[face].mean())}
            rows.append(row)
    return rows
