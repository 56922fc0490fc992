"""Labels of one photo, stored as one file."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Self

import numpy as np


class Stored:
    """A dataclass of arrays that is kept as a compressed .npz file, one entry a field."""

    def save(self, path: Path) -> None:
        """Writes it atomically (temporary name, then rename); folders are made."""
        path.parent.mkdir(parents=True, exist_ok=True)
        partial = path.with_name(path.name + ".partial")
        with open(partial, "wb") as file:
            np.savez_compressed(file, **self.__dict__)
        partial.replace(path)

    @classmethod
    def load(cls, path: Path) -> Self:
        """ValueError if the file was written when there was less to keep."""
        with np.load(path) as data:
            if missing := {field.name for field in fields(cls)} - set(data):
                raise ValueError(f"{path} lacks {', '.join(sorted(missing))}: make it again with --force.")
            return cls(**data)
