"""Rendered views beside photos, and how far they differ."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from maquette.frames import Frame
from maquette.native import MaquetteError
from maquette.scenes import Capture, Scene, SceneRenderer

_GAP_PX = 6
_SHOWN = 3  # where no photo is held out


@dataclass(frozen=True)
class Compared:
    """A photo, and the PSNR of the scene's view from its camera. held_out: the scene was built without it."""

    name: str
    psnr_db: float
    held_out: bool


def psnr_db(image: np.ndarray, truth: np.ndarray) -> float:
    """Returns the PSNR of uint8 images, at most 100."""
    error = float(np.mean((image.astype(np.float64) - truth) ** 2))
    return min(100.0, 10 * math.log10(255**2 / error)) if error > 0 else 100.0


def write_preview(
    scene: Scene, capture: Capture, path: Path, threads: int, progress: Callable[[float], None]
) -> list[Compared]:  # fmt: skip
    """Writes a JPEG file: in each row a photo on the left, the scene from the same camera on the right. Photos are the
    held-out ones; without any, three that the scene was built from. Raises MaquetteError."""
    views = capture.views
    shown = [k for k, view in enumerate(views) if view.held_out]
    if not shown:
        shown = sorted({round((k + 0.5) * len(views) / _SHOWN - 0.5) for k in range(_SHOWN)})
    compared: list[Compared] = []
    rows: list[np.ndarray] = []
    with SceneRenderer(scene, threads=threads) as renderer:
        for k in shown:
            progress(len(rows) / len(shown))
            photo = np.asarray(capture.photo(k))
            rgb = renderer.run(views[k].camera).rgb
            compared.append(Compared(views[k].name, psnr_db(rgb, photo), views[k].held_out))
            gap = np.full((photo.shape[0], _GAP_PX, 3), 255, np.uint8)
            rows.append(np.concatenate([photo, gap, rgb], 1))
    width = max(row.shape[1] for row in rows)
    sheet = []
    for row in rows:
        sheet.append(np.pad(row, ((0, _GAP_PX), (0, width - row.shape[1]), (0, 0)), constant_values=255))
    partial = path.with_name(f".{path.stem}.partial.jpg")
    try:
        Frame(np.ascontiguousarray(np.concatenate(sheet)[:-_GAP_PX])).save(partial)
        partial.replace(path)
    except OSError as error:
        raise MaquetteError(f"{path} cannot be written: {error.strerror}", "MAQ_ERROR_UNWRITABLE") from None
    finally:
        partial.unlink(missing_ok=True)
    return compared
