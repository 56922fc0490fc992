"""From a teacher's landmarks and mask to labels that a dense network can learn from: which body region a pixel shows.

Landmarks do not tell front from back, so the labels are the 14 coarse regions of `export.surface`, and only where the
landmarks leave no doubt; the rest of the mask is known to be the person, but not which region.
"""

from __future__ import annotations

import numpy as np

from export.keypoints import NAMES

BACKGROUND, SOMEWHERE = 0, 255  # label values beside the coarse regions 1..14
_MIN_VISIBLE = 0.6
# Coarse region: (bones as pairs of landmarks, radius as a share of the torso's length)
_LEFT = {
    3: ((("left wrist", "left index finger"), ("left wrist", "left little finger")), 0.12),
    4: ((("left ankle", "left toe"), ("left heel", "left toe")), 0.12),
    7: ((("left hip", "left knee"),), 0.24),
    9: ((("left knee", "left ankle"),), 0.17),
    10: ((("left shoulder", "left elbow"),), 0.17),
    12: ((("left elbow", "left wrist"),), 0.13),
}
_MIRRORED = {3: 2, 4: 5, 7: 6, 9: 8, 10: 11, 12: 13}
_TORSO, _HEAD = 1, 14
# A pixel belongs to the region it is nearest to, measured in radii, if every other one is this much farther.
_CLEARLY = 0.35


def _bones() -> dict[int, tuple[list[tuple[int, int]], float]]:
    out = {}
    for region, (pairs, radius) in _LEFT.items():
        out[region] = [tuple(NAMES.index(n) for n in pair) for pair in pairs], radius
        right = [tuple(NAMES.index(n.replace("left", "right")) for n in pair) for pair in pairs]
        out[_MIRRORED[region]] = right, radius
    return out


BONES = _bones()
_SHOULDERS = [NAMES.index("left shoulder"), NAMES.index("right shoulder")]
_HIPS = [NAMES.index("left hip"), NAMES.index("right hip")]
_FACE = list(range(NAMES.index("left shoulder")))  # nose to mouth


def coarse_labels(point: np.ndarray, visible: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """point [33, 2] pixels, visible [33], mask bool [H, W]. uint8 [H, W]: BACKGROUND, a coarse region, or SOMEWHERE."""
    out = np.zeros(mask.shape, np.uint8)
    out[mask] = SOMEWHERE
    y, x = np.nonzero(mask)
    if not len(x):
        return out
    at = np.stack([x + 0.5, y + 0.5], 1).astype(np.float32)
    shoulders, hips = point[_SHOULDERS], point[_HIPS]
    # Seen from the side the shoulders are close together, from above the torso is short: the larger one counts.
    across = float(np.linalg.norm(shoulders[0] - shoulders[1]))
    length = max(float(np.linalg.norm(shoulders.mean(0) - hips.mean(0))), 1.2 * across)
    distance = {}
    for region, (pairs, radius) in BONES.items():
        shown = [pair for pair in pairs if (visible[list(pair)] >= _MIN_VISIBLE).all()]
        if shown:
            distance[region] = np.min([_to_segment(at, *point[list(pair)]) for pair in shown], 0) / (radius * length)
    if (visible[_SHOULDERS] >= _MIN_VISIBLE).all():
        # The torso is a band around the line from neck to hips, as wide as the shoulders (at least half its length).
        wide = max(across / 2, 0.22 * length)
        neck = shoulders.mean(0)
        distance[_TORSO] = _to_segment(at, neck + 0.25 * (hips.mean(0) - neck), hips.mean(0)) / wide
        distance[_HEAD] = np.linalg.norm(at - point[_FACE].mean(0), axis=1) / (0.3 * length)
    regions = np.array(list(distance))
    if len(regions) < 2:
        return out
    values = np.stack(list(distance.values()))
    order = np.sort(values, 0)
    sure = (order[0] < 1) & (order[1] - order[0] > _CLEARLY)
    out[y[sure], x[sure]] = regions[values.argmin(0)][sure]
    return out


def _to_segment(at: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Distance of points [K, 2] from the segment a-b."""
    along = b - a
    share = np.clip((at - a) @ along / max(float(along @ along), 1e-6), 0, 1)
    return np.linalg.norm(at - a - share[:, None] * along, axis=1)
