"""Maquette: a camera into 3D on two CPU cores. Dense pose, bodies, scenes, edges, heads and prediction over numpy.

    import maquette
    result = maquette.DensePose().run(rgb)          # uint8 [H, W, 3]

Errors of the SDK are MaquetteError. README.md of the package shows each system.
"""

from __future__ import annotations

from typing import Any

from maquette.bodies import BODY_ANGLES, Body, BodyClip, BodyMesh, BodyPerson, BodyResult, BodySize, BodySizes
from maquette.dense_clouds import DenseCloud
from maquette.densepose import (
    COCO_KEYPOINTS,
    KEYPOINTS,
    DensePose,
    DensePoseResult,
    Person,
    part_colours,
    part_name,
)
from maquette.edges import Box, Curve, Curves, Edges, EdgesResult
from maquette.frames import Frame, Intrinsics, Origin, PixelFormat
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
from maquette.native import MaquetteError, library_path, native, sample
from maquette.pipeline import (
    DensePoseModel,
    EdgesModel,
    Model,
    Pipeline,
    PipelineInfo,
    PipelineResult,
    PredictionModel,
)
from maquette.prediction import CameraHealth, CameraHealthResult, Concealer, Predictor
from maquette.progress import ProgressLine
from maquette.scene_making.make import make_scene
from maquette.scene_making.report import SceneReport
from maquette.scenes import Capture, PinholeCamera, Scene, SceneBuilder, SceneRenderer, View
from maquette.sources import (
    Camera,
    CameraMode,
    ClipWriter,
    Control,
    Recorder,
    Source,
    SourceScheme,
    list_cameras,
    list_source_schemes,
)
from maquette.textures import DensePoseTexture

__all__ = [
    "BODY_ANGLES", "COCO_KEYPOINTS", "KEYPOINTS", "Body", "BodyClip", "BodyMesh", "BodyPerson", "BodyResult",
    "BodySize", "BodySizes", "Box", "Camera", "CameraHealth", "CameraHealthResult", "CameraMode", "Capture",
    "ClipWriter", "Concealer", "Control", "Curve", "Curves", "DenseCloud", "DensePose", "DensePoseModel",
    "DensePoseResult", "DensePoseTexture", "Edges", "EdgesFusion", "EdgesModel", "EdgesResult", "Frame", "Head",
    "HeadBuilder", "HeadInfo", "HeadLandmark", "HeadMesh", "HeadPhoto", "HeadRenderer", "Image", "Intrinsics",
    "MaquetteError", "Model", "MorphTarget", "Origin", "Person", "PinholeCamera", "Pipeline", "PipelineInfo",
    "PipelineResult", "PixelFormat", "PredictionModel", "Predictor", "ProgressLine", "Recorder", "Scene",
    "SceneBuilder", "SceneRenderer", "SceneReport", "Source", "SourceScheme", "View", "build_info", "library_path",
    "list_cameras", "list_source_schemes", "make_scene", "part_colours", "part_name", "sample",
]  # fmt: skip

__version__: str


def __getattr__(name: str) -> Any:
    if name != "__version__":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    n = native()
    return n.text(n.lib.maq_get_sdk_version())  # of the library found at run time: "0.3.0"


def build_info() -> dict[str, str]:
    """Version, git commit and build options of the library, and version and file of ONNX Runtime. Raises MaquetteError
    where ONNX Runtime is not found."""
    n = native()
    version, path = n.ffi.new("const char **"), n.ffi.new("const char **")
    n.call("maq_context_get_onnxruntime", n.context, version, path)
    return {
        "version": n.text(n.lib.maq_get_sdk_version()),
        "git_commit": n.text(n.lib.maq_get_git_commit()),
        "build_options": n.text(n.lib.maq_get_build_options()),
        "onnxruntime": n.text(version[0]),
        "onnxruntime_library": n.text(path[0]),
    }
