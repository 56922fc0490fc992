"""Metrics as plain values for a JSON file."""

from __future__ import annotations

from dataclasses import asdict, is_dataclass

import numpy as np


def plain(value: object) -> object:
    """Dataclasses become dicts, NaN becomes None (JSON has no NaN), floats are rounded to 6 decimals."""
    if is_dataclass(value):
        value = asdict(value)
    if isinstance(value, dict):
        return {key: plain(v) for key, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if isinstance(value, float):
        return None if np.isnan(value) else round(float(value), 6)
    return value
