"""The body surface's naming: 24 parts, coarse groups, and what a mirror does to parts and chart axes.

Part numbers, coarse numbers and the direction of U and V follow the DensePose convention
(Guler et al., "DensePose: Dense Human Pose Estimation in the Wild", CVPR 2018). The charts
themselves are our own (see `export.people.atlas`). This module needs numpy only.
"""

from __future__ import annotations

import numpy as np

PART_NAMES = (  # as in sdk/src/densepose/body_parts.h
    "background", "torso, back", "torso, front", "right hand", "left hand", "left foot", "right foot",
    "right upper leg, back", "left upper leg, back", "right upper leg, front", "left upper leg, front",
    "right lower leg, back", "left lower leg, back", "right lower leg, front", "left lower leg, front",
    "left upper arm, inside", "right upper arm, inside", "left upper arm, outside", "right upper arm, outside",
    "left lower arm, inside", "right lower arm, inside", "left lower arm, outside", "right lower arm, outside",
    "head, right", "head, left",
)  # fmt: skip
PART_COUNT = 24

# Coarse classes: 1 torso, 2 R hand, 3 L hand, 4 L foot, 5 R foot, 6 upper leg R, 7 upper leg L,
# 8 lower leg R, 9 lower leg L, 10 upper arm L, 11 upper arm R, 12 lower arm L, 13 lower arm R, 14 head.
COARSE_COUNT = 14
PART_TO_COARSE = np.array(
    [0, 1, 1, 2, 3, 4, 5, 6, 7, 6, 7, 8, 9, 8, 9, 10, 11, 10, 11, 12, 13, 12, 13, 14, 14], np.uint8
)

# The part seen in a mirror, and the chart axes that run backwards there.
MIRROR_PART = np.array(
    [0, 1, 2, 4, 3, 6, 5, 8, 7, 10, 9, 12, 11, 14, 13, 16, 15, 18, 17, 20, 19, 22, 21, 24, 23], np.uint8
)
MIRROR_COARSE = np.array([0, 1, 3, 2, 5, 4, 7, 6, 9, 8, 11, 10, 13, 12, 14], np.uint8)
MIRROR_FLIPS_U = np.isin(np.arange(25), (5, 6, 23, 24))
MIRROR_FLIPS_V = np.isin(np.arange(25), (1, 2, *range(7, 23)))

# 1 for parts of left limbs, 2 for right ones, 0 for torso and head: a head's halves meet in the middle of a face, where
# a pixel more or less says nothing about left and right.
LIMB_SIDE = np.array(
    [0 if "head" in name else 1 if "left" in name else 2 if "right" in name else 0 for name in PART_NAMES], np.uint8
)
