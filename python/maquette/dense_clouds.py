"""Dense clouds: the depth of posed photos, fused, for scenes and other programs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from maquette.frames import Frame, ImageLike, as_frame
from maquette.native import NativeObject, ProgressCallback, native
from maquette.scenes import PinholeCamera, Progress

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from maquette.settings import DenseCloudSettings


class DenseCloud(NativeObject):
    """A dense cloud of posed photos and some points between them, such as an AR session or COLMAP finds.

        dense = maquette.DenseCloud(photos, cameras, points)
        builder = maquette.SceneBuilder(dense.points)

    photos: one of each camera. points: float32 [N, 3], in the world, relative to `origin`. masks: one of each photo, or
    None: no point is made of pixels where the mask is black. progress: called with the fraction done and the stage;
    returns False to cancel. settings: fields of maq_dense_cloud_config by their names. Raises MaquetteError.
    """

    def __init__(
        self,
        photos: Sequence[ImageLike],
        cameras: Sequence[PinholeCamera],
        points: np.ndarray,
        masks: Sequence[ImageLike | None] | None = None,
        origin: np.ndarray | tuple[float, float, float] = (0, 0, 0),
        progress: Progress | None = None,
        **settings: Unpack[DenseCloudSettings],
    ) -> None:
        n = native()
        masks = [None] * len(photos) if masks is None else masks
        if not len(photos) == len(cameras) == len(masks):
            raise ValueError(f"{len(photos)} photos, {len(cameras)} cameras and {len(masks)} masks; give one of each")
        xyz = np.ascontiguousarray(points, np.float32)
        if xyz.ndim != 2 or xyz.shape[1] != 3:
            raise ValueError(f"points are [N, 3], not {list(xyz.shape)}")
        sparse = n.sized("maq_point_cloud")
        sparse.point_count, sparse.xyz = len(xyz), n.ffi.cast("const float *", n.ffi.from_buffer(xyz))
        sparse.origin = [float(v) for v in origin]
        posed, kept = n.ffi.new("maq_posed_photo[]", max(len(photos), 1)), []
        for struct, photo, camera, mask in zip(posed, photos, cameras, masks, strict=False):
            struct.struct_size = n.ffi.sizeof("maq_posed_photo")
            frames = as_frame(photo), None if mask is None else as_frame(mask)
            kept.append(frames)
            struct.photo, struct.camera = frames[0].handle, camera.to_struct()[0]
            struct.mask = n.ffi.NULL if frames[1] is None else frames[1].handle
        callback = ProgressCallback(progress)
        config = n.config("maq_dense_cloud_config", {**settings, "progress_callback": callback.pointer})
        arguments = ("maq_dense_cloud", n.context, config, posed, len(photos), sparse)
        super().__init__(callback.run(lambda: n.create(*arguments)))
        cloud, colours = n.sized("maq_point_cloud"), n.ffi.new("const uint8_t **")
        n.call("maq_dense_cloud_get_points", self.handle, cloud, colours)
        count = cloud.point_count
        self.points = np.frombuffer(n.ffi.buffer(cloud.xyz, 12 * count), np.float32).reshape(-1, 3).copy()
        """float32 [P, 3], relative to the given origin."""
        self.rgb = np.frombuffer(n.ffi.buffer(colours[0], 3 * count), np.uint8).reshape(-1, 3).copy()
        """uint8 [P, 3]: colours of the points."""

    def depth(self, index: int) -> tuple[Frame, PinholeCamera]:
        """The depth image of a photo, float32 along the optical axis, 0: unknown; and its camera, without distortion.
        Raises MaquetteError."""
        n = native()
        camera = n.sized("maq_pinhole_camera")
        load, release = "maq_dense_cloud_load_depth", "maq_frame_release"
        frame = n.create("maq_frame", self.handle, index, camera, function=load, release=release)
        return Frame.of_handle(frame), PinholeCamera.of_struct(camera)

    def _about(self) -> str:
        return f"{len(self.points)} points"
