"""How a hand moves a camera, and a pace varies: sums of slow waves."""

from __future__ import annotations

import numpy as np

_WAVES = 4
_HZ = (0.2, 2.5)


def sway(rng: np.random.Generator, seconds: np.ndarray, size: float, axes: int | None = None) -> np.ndarray:
    """At times [T], with that standard deviation: [T], or [T, axes]. Slow waves are the largest."""
    shape = (axes or 1, _WAVES)
    hertz = np.exp(rng.uniform(*np.log(_HZ), shape))
    phase = rng.uniform(0, 2 * np.pi, shape)
    strength = rng.normal(0, 1, shape) / np.sqrt(hertz)
    strength *= np.sqrt(2) * size / np.sqrt((strength**2).sum(1, keepdims=True) + 1e-12)
    found = (strength * np.sin(2 * np.pi * hertz * np.asarray(seconds)[:, None, None] + phase)).sum(2)
    return found if axes else found[:, 0]
