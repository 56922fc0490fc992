"""Images that the library renders, of heads and of scenes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from maquette.native import Native


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
    normals: np.ndarray | None = None
    template_points: np.ndarray | None = None
    stats: dict[str, float] = field(default_factory=dict)


def rendered(n: Native, renderer: Any, camera: Any, function: str, of_head: bool) -> Image:
    """Calls the `function` of the C API that renders, and copies its image. camera: a maq_pinhole_camera."""
    image = n.create("maq_image", renderer, camera, function=function, release="maq_image_release")
    shape = camera.intrinsics.height_px, camera.intrinsics.width_px

    def plane(name: str, channels: tuple[int, ...], kind: type) -> np.ndarray:
        which = getattr(n.lib, f"MAQ_IMAGE_PLANE_{name}")
        return n.plane("maq_image_get_plane", image, which, (*shape, *channels), kind)

    made = Image(
        np.ascontiguousarray(plane("BGR", (3,), np.uint8)[..., ::-1]),
        plane("ALPHA", (), np.uint8),
        plane("DEPTH", (), np.float32),
        plane("NORMALS", (3,), np.float32) if of_head else None,
        plane("TEMPLATE_POINTS", (3,), np.float32) if of_head else None,
        {} if of_head else n.stats("maq_scene_render_stats", "maq_image_get_scene_stats", image),
    )
    n.ffi.release(image)
    return made
