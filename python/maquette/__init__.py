"""Maquette: a camera into 3D on two CPU cores. Dense pose, scenes, edges, heads and prediction over numpy arrays.

    import maquette
    result = maquette.DensePose().run(rgb)          # uint8 [H, W, 3]

Errors of the SDK are MaquetteError. README.md of the package shows each system.
"""

from maquette.densepose import DensePose, DensePoseResult, Person, part_colours, part_name
from maquette.edges import Box, Curve, Curves, Edges, EdgesResult
from maquette.frames import Camera, Frame, Intrinsics, Origin, PixelFormat, Source, list_cameras
from maquette.fusion import EdgesFusion
from maquette.heads import (
    Head,
    HeadBuilder,
    HeadInfo,
    HeadLandmark,
    HeadMesh,
    HeadPhoto,
    HeadRenderer,
    MorphTarget,
)
from maquette.images import Image
from maquette.native import MaquetteError, library_path, native
from maquette.prediction import Concealer, Novelty, NoveltyScore, Predictor
from maquette.scenes import Capture, PinholeCamera, Scene, SceneRenderer, View

__all__ = [
    "Box", "Camera", "Capture", "Concealer", "Curve", "Curves", "DensePose", "DensePoseResult", "Edges", "EdgesFusion",
    "EdgesResult", "Frame", "Head", "HeadBuilder", "HeadInfo", "HeadLandmark", "HeadMesh", "HeadPhoto",
    "HeadRenderer", "Image", "Intrinsics", "MaquetteError", "MorphTarget", "Novelty", "NoveltyScore", "Origin",
    "Person", "PinholeCamera", "PixelFormat", "Predictor", "Scene", "SceneRenderer", "Source", "View",
    "library_path", "list_cameras", "part_colours", "part_name", "sdk_version",
]  # fmt: skip


def sdk_version() -> str:
    """The version of the library found at run time: "0.3.0"."""
    n = native()
    return n.ffi.string(n.lib.maq_get_sdk_version()).decode()
