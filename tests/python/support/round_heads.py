"""Photos for the bundle of round heads (tests/native/generate/make_round_heads.py): all that is not black is a head."""

from pathlib import Path

import numpy as np

ROUND = Path(__file__).parents[2] / "native/data/round_heads/bundle"
GREY = np.full((240, 320, 3), (140, 130, 120), np.uint8)
BOX = (110, 60, 200, 180)
COARSE_M = 0.006  # of a mesh that is made quickly
