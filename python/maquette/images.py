"""Images that the library renders, of heads and of scenes."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from maquette.native import Lender, LentResult, native, path_to_write


@dataclass(frozen=True, eq=False)
class Image:
    """A rendered image, H x W pixels. All planes are 0 where nothing is.

    rgb: uint8 [H, W, 3]. alpha: uint8 [H, W], coverage. depth: float32 [H, W], along the optical axis; in metres for
    heads, in units of the scene for scenes. For heads only, else None: normals: float32 [H, W, 3], outwards, in the
    camera (x right, y down, z forward), of length 1; template_points: float32 [H, W, 3], metres on the template head.
    stats: for scenes only, the fields of maq_scene_render_stats.
    """

    rgb: np.ndarray
    alpha: np.ndarray
    depth: np.ndarray
    normals: np.ndarray | None
    template_points: np.ndarray | None
    stats: dict[str, Any]
    _lent: LentResult = field(repr=False)

    def save(self, path: str | os.PathLike[str], alpha: bool = False) -> None:
        """Writes the colours as .png or .jpg. alpha: transparent where nothing is (.png). Works for the latest 4 images
        of a renderer. Raises MaquetteError."""
        n = native()
        which = n.lib.MAQ_IMAGE_ALPHA_ON if alpha else n.lib.MAQ_IMAGE_ALPHA_OFF
        n.call("maq_image_save", self._lent.handle, path_to_write(path), which)

    def __repr__(self) -> str:
        height, width = self.alpha.shape
        return f"<Image {width} x {height}, {np.count_nonzero(self.alpha) / max(self.alpha.size, 1):.0%} covered>"


def rendered(lender: Lender, renderer: Any, camera: Any, function: str, of_head: bool) -> Image:
    """Calls the `function` of the C API that renders, and copies its image. camera: a maq_pinhole_camera."""
    n = native()
    lender.make_room()
    image = n.create("maq_image", renderer, camera, function=function, release="maq_image_release")
    width, height = n.ffi.new("int32_t *"), n.ffi.new("int32_t *")
    n.call("maq_image_get_size", image, width, height)
    shape = height[0], width[0]

    def plane(name: str, channels: tuple[int, ...], kind: type) -> np.ndarray:
        which = getattr(n.lib, f"MAQ_IMAGE_PLANE_{name}")
        return n.plane("maq_image_get_plane", image, which, (*shape, *channels), kind)

    return Image(
        np.ascontiguousarray(plane("BGR", (3,), np.uint8)[..., ::-1]),
        plane("ALPHA", (), np.uint8),
        plane("DEPTH", (), np.float32),
        plane("NORMALS", (3,), np.float32) if of_head else None,
        plane("TEMPLATE_POINTS", (3,), np.float32) if of_head else None,
        {} if of_head else n.stats("maq_scene_render_stats", "maq_image_get_scene_stats", image),
        lender.lend(image),
    )
