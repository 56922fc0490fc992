"""Keyword arguments of the classes: the configs of the C API. Written by python/write_settings.py."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Literal, TypedDict

PartColours = Literal["default", "detectron2", "magicanimate"]
HeadShading = Literal["colour", "shape", "normals", "template", "depth"]
PredictorMethod = Literal["auto", "last", "motion", "sampled"]
SourceControl = Literal[
    "auto_exposure", "exposure", "gain", "auto_focus", "focus", "auto_white_balance", "white_balance", "brightness"
]


class SourceSettings(TypedDict, total=False):
    """Fields of maq_source_config."""

    frame_pool_size: int
    """Frames the app may hold at once, 1 to 64; 0 (default): 4."""

    queue_length: int
    """Frames that wait for the app, 1 to 64; a new one replaces the oldest; 0 (default): 1."""

    stall_ms: int
    """A camera without a frame for this time counts as stalled, 50 to 60000; 0 (default): 2000."""

    reconnect_ms: int
    """How long to wait for a lost camera, 1 to 86400000; 0 (default): 30000; or MAQ_NO_RECONNECT."""

    real_time: int
    """1: clips, recordings and stubs play in real time like a camera (is_live), unless the URI has live=0. 0 (default):
    frames come as fast as they are acquired, unless the URI has live=1."""

    loop: int
    """1: a source that plays in real time starts again at its end, unless the URI has loop=0; default 0."""

    max_side_px: int
    """Larger images are scaled down to this longer side; 0 (default): no limit."""


class RecorderSettings(TypedDict, total=False):
    """Fields of maq_recorder_config."""

    jpeg_quality: int
    """1 to 100: compress images as JPEG of this quality. 0 (default): no compression, 18 MB a second at 640 x 480 YUYV
    and 30 frames a second. A camera's own JPEG images are never changed."""

    keep_predicted: int
    """1: record predicted frames, too, and mark them; 0 (default): refuse them."""


class ModelSettings(TypedDict, total=False):
    """Fields of maq_model_options."""

    threads: int
    """1 to 64; 0: the machine's large cores, at most 4; MAQ_THREADS_MEASURED: measured."""

    provider: Literal["cpu", "xnnpack", "nnapi"]
    """Default "cpu". The CPU replaces a provider that is missing or that takes less than half of the network; the log
    says why."""

    bundle_path: str | os.PathLike[str]
    """Folder with manifest.json; default None."""


class DensePoseSettings(ModelSettings, total=False):
    """Fields of maq_densepose_config."""

    preset: Literal["stream", "photo"]
    """Default "stream"."""

    long_side_px: int
    """Images are scaled to this long side, 32 to 2048. 0 (default): automatic. The bundle's value finds near people. If
    it shows small people or nobody, larger images are also searched at 480 pixels. In a stream (frames with a
    `sequence` above 0), earlier frames count, too."""

    score_threshold: float
    """Minimum score of a person, up to 1; 0 (default): the bundle's value. People who were in the previous frame of a
    stream stay down to 0.7 of it."""

    max_people: int
    """1 to 255, best scores first; 0 (default): the bundle's value."""

    max_proposals: int
    """Boxes that reach the box head, 1 to 1000; 0 (default): the bundle's value. Fewer boxes are faster and may miss
    people in a crowd."""

    key_frame_interval: int
    """0 (default) and 1: every frame is a key frame, in which people are detected. N, up to 1000: every N-th frame of a
    stream is one. In between, boxes are propagated and no new people are found; frames without people cost nothing. A
    frame of another size or of another roll is a key frame. If each person has a crop (`person_crops`), only the crops
    are computed in between."""

    min_person_height_px: int
    """People less tall than this in the frame may be missed, up to 100000; larger is faster; 0 (default): no limit."""

    detail: Literal["surface", "part"]
    """Default "surface"."""

    person_crops: Literal["default", "auto", "all", "off"]
    """Default "default"."""

    person_crop_px: int
    """Side of a crop, 64 to 512; 0 (default): 192, of photos 256. Smaller is faster."""

    result_pool_size: int
    """Results the app may hold at once, 1 to 64; 0 (default): 4."""

    has_keypoints: int
    """1: keypoints of each person are found (maq_densepose_result_get_keypoints), for about a millisecond a person; 0
    (default): they are not."""

    steadiness: float
    """In a stream: how much the frames before count for parts, U and V, up to 0.95; 0 (default): 0.9; -1: not at all.
    Larger values flicker less."""


class BodySettings(ModelSettings, total=False):
    """Fields of maq_body_config."""

    result_pool_size: int
    """Results the app may hold at once, 1 to 64; 0 (default): 4."""


class EdgesSettings(ModelSettings, total=False):
    """Fields of maq_edges_config."""

    result_pool_size: int
    """Results the app may hold at once, 1 to 64; 0 (default): 4."""

    skip_planes: int
    """1: run the network only where depth is not flat within the sensor's noise: on a part of the frame with half or
    all of each side. Elsewhere the distance is eps_r. This is faster and may miss flat creases in noise. 0 (default):
    run on the whole frame."""

    average_frames: int
    """2 to 64: average inverse depth over this number of frames, to reduce noise. The camera must not move. Blocks of
    32 x 32 px with motion, and pixels that jump, start a new average. Unknown depth stays unknown. 0 (default) and 1:
    no averaging."""


class CurvesSettings(TypedDict, total=False):
    """Fields of maq_edges_curves_config."""

    min_length_px: float
    """Shorter curves are dropped, 4 to 1e6; 0 (default): 10."""

    skip_boxes: int
    """1: do not search for boxes; default 0."""

    focal_tolerance: float
    """Two standard deviations of the focal lengths of the frame's intrinsics, as a fraction: 0.01 is 1 %. At most 0.5;
    0 (default): unknown. The tolerance of boxes includes it."""


class EdgesFusionSettings(TypedDict, total=False):
    """Fields of maq_edges_fusion_config."""

    threads: int
    """1 to 64; 0 (default): the machine's large cores, at most 4."""

    cell_m: float
    """Approximate distance between points; 0 (default): the footprint of the median pixel."""

    max_points: int
    """Limit for points, about 240 bytes each at the peak; 0 (default): 4,000,000."""

    min_views: int
    """With three or more views, drop curves that fewer views have seen, 1 to 1000; 0 (default): 2."""


class PredictorSettings(ModelSettings, total=False):
    """Fields of maq_predictor_config."""

    frame_pool_size: int
    """Predicted frames the app may hold at once, 1 to 64; 0 (default): 4."""

    temperature: float
    """SAMPLED: 0 (default) takes the likeliest code; 1 samples by the probabilities; larger values vary more."""

    seed: int
    """SAMPLED: equal seeds give equal frames on one processor; default 0."""


class ConcealerSettings(TypedDict, total=False):
    """Fields of maq_concealer_config."""

    threads: int
    """1 to 64; 0 (default): the machine's large cores, at most 4."""

    frame_pool_size: int
    """Frames the app may hold at once, 1 to 64; 0 (default): 3. The concealer itself holds one frame of the source's
    pool."""


class SceneBuildSettings(ModelSettings, total=False):
    """Fields of maq_scene_build_config."""

    long_side_px: int
    """Larger photos are scaled down to this long side. 0: 640; MAQ_SCENE_LONG_SIDE_FULL: never."""

    coefficient_bits: int
    """Size of a descriptor's numbers: 8, 16, or 32 (floats, then also positions). 0: 8."""

    min_variation: float
    """Fraction of a photo's resolution at which visibility is tested, 1/16 to 1. A smaller fraction lets each point
    hide * more of the points behind it; use it for sparse clouds. 0: 1."""

    visibility_scale: float

    near_depth: float
    """A camera does not see points nearer than this along its axis; units of the scene. 0: all."""

    max_points: int
    """Larger clouds are thinned out evenly. 0: no limit."""

    max_memory_bytes: int

    max_views: int
    """If there are more photos, an even selection is used. 0: no limit."""

    use_held_out: int
    """1: also use photos that the capture holds out for comparison; 0: do not."""

    splat_fit_s: float


class DenseCloudSettings(TypedDict, total=False):
    """Fields of maq_dense_cloud_config."""

    threads: int
    """1 to 64. 0: the large cores, at most 4. The result is the same for any number."""

    max_points: int
    """If there are more points, a random selection is kept. 0: 1.5 million."""


class SceneRendererSettings(ModelSettings, total=False):
    """Fields of maq_scene_renderer_config."""

    near_depth: float
    """Points nearer to the camera along its axis are not drawn; units of the scene. Splats also not if they reach
    behind the camera: if their standard deviation is above their depth."""

    use_background: int
    """1: images are composed over `background` by their alpha. 0: pixels without points have the mean colour of the
    photos where they show no point; splats are composed over black."""

    background: Sequence[int]
    """Red, green, blue; with use_background."""

    image_pool_size: int
    """Images the app may hold at once, 1 to 64. 0: 4."""


class HeadBuilderSettings(ModelSettings, total=False):
    """Fields of maq_head_builder_config."""

    texture_px: int
    """Pixels a side of the texture, 256 to 2048; 0: 1024. Not with "off"."""

    delight_texture: int
    """1: directional light of the photos is removed from the texture, as far as it can be estimated. An app can then
    relight the head. 0: it stays."""


class HeadRendererSettings(TypedDict, total=False):
    """Fields of maq_head_renderer_config."""

    threads: int
    """1 to 64; 0: the machine's large cores, at most 4."""

    near_m: float
    """Points nearer to the camera along its axis are not drawn, 1e-6 to 1e6. 0: 0.01."""

    shading_strength: float
    """Darkening of surfaces that face away from the light, up to 1 (black). 0: 0.35; MAQ_HEAD_SHADING_STRENGTH_OFF:
    none."""

    disable_antialiasing: int
    """1: one sample a pixel, which is faster; 0: four samples."""

    image_pool_size: int
    """Images the app may hold at once, 1 to 64. 0: 4."""


class PipelineSettings(TypedDict, total=False):
    """Fields of maq_pipeline_config."""

    result_pool_size: int
    """Results that the app may hold at once, 1 to 64; 0 (default): 4."""

    nice: int
    """Added to the niceness of the threads of pipeline and model, 0 (default) to 19. Threads that draw have priority
    then. Linux and Android; no effect elsewhere."""
