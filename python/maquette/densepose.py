"""Dense pose: the people in an image, and for each of their pixels the point of the body surface that it shows."""

from __future__ import annotations

import functools
import os
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from maquette.frames import ImageLike, as_frame
from maquette.native import Lender, LentResult, NativeObject, native, path_to_write

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from maquette.settings import DensePoseSettings, PartColours

PART_COUNT = 24
# Names of a person's keypoints, as MediaPipe Pose orders them. "Left" is the person's left.
KEYPOINTS = (
    "nose", "left_eye_inner", "left_eye", "left_eye_outer", "right_eye_inner", "right_eye", "right_eye_outer",
    "left_ear", "right_ear", "mouth_left", "mouth_right", "left_shoulder", "right_shoulder", "left_elbow",
    "right_elbow", "left_wrist", "right_wrist", "left_pinky", "right_pinky", "left_index", "right_index", "left_thumb",
    "right_thumb", "left_hip", "right_hip", "left_knee", "right_knee", "left_ankle", "right_ankle", "left_heel",
    "right_heel", "left_foot_index", "right_foot_index",
)  # fmt: skip
# COCO's keypoints among them, in COCO's order: `person.keypoints[COCO_KEYPOINTS]` is [17, 3].
COCO_KEYPOINTS = [0, 2, 5, 7, 8, 11, 12, 13, 14, 15, 16, 23, 24, 25, 26, 27, 28]


@dataclass(frozen=True)
class Person:
    """box_px: left, top, right, bottom in pixels of the image, the latter two exclusive. score: 0 to 1. head_box_px:
    around the pixels that show the head, for `HeadBuilder.add_photo`; None where none does. id: from 1; in a
    stream (frames of a `Source`) the same for one person while seen. keypoints: float32 [33, 3], x and y in pixels of
    the image and a confidence of 0 to 1, in the order of `KEYPOINTS`; None unless `DensePose(has_keypoints=True)`."""

    box_px: tuple[float, float, float, float]
    score: float
    head_box_px: tuple[float, float, float, float] | None
    id: int
    keypoints: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class DensePoseResult:
    """Result for an image of H x W pixels. people: best score first. part: uint8 [H, W], body part 1 to 24
    (DensePose's numbering), 0 for background. u, v: uint8 [H, W], the coordinate on the part times 255. person:
    uint8 [H, W], index in `people` plus 1. stats: times and counts, the fields of maq_densepose_stats."""

    people: list[Person]
    part: np.ndarray
    u: np.ndarray
    v: np.ndarray
    person: np.ndarray
    stats: dict[str, Any]
    _lent: LentResult = field(repr=False)

    @property
    def iuv(self) -> np.ndarray:
        """uint8 [H, W, 3]: part, u, v; the channels that DensePose's tools expect."""
        return np.stack([self.part, self.u, self.v], axis=-1)

    def draw(
        self,
        image: ImageLike | None = None,
        opacity: int = 180,
        colours: PartColours = "default",
        is_mirrored: bool = False,
    ) -> np.ndarray:
        """Draws the people in the colours of their parts: uint8 [H, W, 4], RGBA. image: under the people; None:
        transparent, and colours are multiplied by their opacity. opacity: 1 to 255. colours: "default", "detectron2"
        or "magicanimate" (`maquette.adapters.detectron2`). Works for the latest 8 results of a `DensePose`. Raises
        MaquetteError."""
        n = native()
        settings = {"opacity": opacity, "colours": colours, "is_mirrored": is_mirrored}
        drawing = n.config("maq_densepose_drawing", settings)
        frame = n.ffi.NULL if image is None else as_frame(image).handle
        out = np.empty((*self.part.shape, 4), np.uint8)
        into = n.ffi.from_buffer("uint8_t[]", out)
        n.call("maq_densepose_result_draw", self._lent.handle, frame, drawing, into, 0, out.nbytes)
        return out

    def painted(self, image: ImageLike, opacity: float = 0.7) -> np.ndarray:
        """A copy of the image, uint8 [H, W, 3] RGB, with the people in the colours of their parts. Raises ValueError
        for an image of another size."""
        out = as_frame(image).pixels()
        if out.shape[:2] != self.part.shape:
            sizes = [f"{width} x {height}" for height, width in (out.shape[:2], self.part.shape)]
            raise ValueError(
                f"The image has {sizes[0]} pixels, but the result {sizes[1]}; pass the image of the result."
            )
        body = self.part > 0
        colours = part_colours()[self.part[body]]
        out[body] = np.round((1 - opacity) * out[body] + opacity * colours).astype(np.uint8)
        return out

    def find_pixel(self, index: int, part: int, u: float, v: float) -> tuple[float, float, float] | None:
        """The pixel of the person at `index` that shows a point of the body surface: x and y, where (0.5, 0.5) is the
        middle of the first pixel, and how far its point is from the wanted point, in U and V. None if no pixel shows
        the part. Works for the latest 8 results of a `DensePose`. Raises MaquetteError."""
        pixel, distance = native().ffi.new("float[2]"), native().ffi.new("float *")
        arguments = self._lent.handle, index, part, u, v, pixel, distance
        return (pixel[0], pixel[1], distance[0]) if _finds("maq_densepose_result_find_pixel", *arguments) else None

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes <path>_IUV.png, <path>_INDS.png and <path>.json in the DensePose convention
        (docs/reference/formats.md). Works for the latest 8 results of a `DensePose`. Raises MaquetteError."""
        native().call("maq_densepose_result_save", self._lent.handle, path_to_write(path))

    def __repr__(self) -> str:
        height, width = self.part.shape
        count = len(self.people)
        return f"<DensePoseResult {width} x {height}, {count} {'person' if count == 1 else 'people'}>"


class DensePose(NativeObject):
    """The networks, loaded once and used for many images.

        result = maquette.DensePose().run("photo.jpg")

    bundle: a folder with manifest.json (default: the one that comes with the package). settings: fields of
    maq_densepose_config by their names: long_side_px, person_crops, key_frame_interval, threads, score_threshold, ...
    (docs/guide/dense-pose.md says what they gain and cost). Raises MaquetteError.
    """

    def __init__(self, bundle: str | os.PathLike[str] | None = None, **settings: Unpack[DensePoseSettings]) -> None:
        n = native()
        config = densepose_config(bundle, settings)
        self._lender = Lender(config.result_pool_size)
        super().__init__(n.create("maq_densepose", n.context, config))

    def run(self, image: ImageLike) -> DensePoseResult:
        """image: a Frame, uint8 [H, W, 3] RGB, an image of Pillow, or the path of an image file. One call at a time.
        Raises MaquetteError."""
        frame = as_frame(image)
        self._lender.make_room()
        result = native().create("maq_densepose_result", self.handle, frame.handle, function="maq_densepose_run",
                                 release="maq_densepose_result_release")  # fmt: skip
        return densepose_result(result, self._lender.lend(result))

    def cancel(self) -> None:
        """Ends the running `run`, or else the next one, with MAQ_CANCELLED. Any thread may call it."""
        native().call("maq_densepose_cancel", self.handle)

    def set_roll(self, roll_rad: float) -> None:
        """The next images show the world rotated clockwise by this many radians (-7 to 7), as of a camera that is held
        askew: the networks see them rotated upright. Raises MaquetteError."""
        native().call("maq_densepose_set_roll", self.handle, roll_rad)

    def reset(self) -> None:
        """The next image starts a new stream; needed only with key_frame_interval above 1."""
        native().call("maq_densepose_reset", self.handle)

    def surface(self) -> np.ndarray:
        """float32 [24, nodes, nodes, 3]: the point of the body at rest for each part, U and V, in metres: x to the
        body's left, y to its back, z up. NaN where the part's chart does not reach. Raises MaquetteError."""
        return surface_points("maq_densepose_get_surface", self.handle)


def densepose_config(bundle: str | os.PathLike[str] | None, settings: DensePoseSettings) -> Any:
    """A maq_densepose_config."""
    own = {} if bundle is None else {"bundle_path": bundle}
    return native().config("maq_densepose_config", {"result_pool_size": 8, **settings, **own})


def densepose_result(result: Any, lent: LentResult) -> DensePoseResult:
    """Copies a maq_densepose_result to arrays."""
    n = native()
    size = n.ffi.new("int32_t *"), n.ffi.new("int32_t *")
    n.call("maq_densepose_result_get_size", result, *size)
    shape = size[1][0], size[0][0]
    count = n.lib.maq_densepose_result_get_person_count(result)
    found = n.indexed("maq_densepose_result_get_person", result, "maq_densepose_person", count)
    people = [
        Person(tuple(p.box_px), p.score, _head_box_px(result, index), p.id, _keypoints(result, index))
        for index, p in enumerate(found)
    ]
    part, u, v, person = (
        n.plane("maq_densepose_result_get_plane", result, plane, shape, np.uint8)
        for plane in (
            n.lib.MAQ_DENSEPOSE_PLANE_PART, n.lib.MAQ_DENSEPOSE_PLANE_U, n.lib.MAQ_DENSEPOSE_PLANE_V,
            n.lib.MAQ_DENSEPOSE_PLANE_PERSON,
        )
    )  # fmt: skip
    stats = n.stats("maq_densepose_stats", "maq_densepose_result_get_stats", result)
    return DensePoseResult(people, part, u, v, person, stats, lent)


def surface_points(function: str, handle: Any) -> np.ndarray:
    """The surface that `function`, maq_…_get_surface, gives."""
    n = native()
    struct = n.sized("maq_densepose_surface")
    n.call(function, handle, struct)
    shape = (PART_COUNT, struct.nodes, struct.nodes, 3)
    data = n.ffi.buffer(struct.points_m, 4 * int(np.prod(shape)))
    return np.frombuffer(data, np.float32).reshape(shape).copy()


def _finds(function: str, *arguments: Any) -> bool:
    """Calls a function of the C API; False if it finds nothing. Raises MaquetteError."""
    n = native()
    status = n.ask(function, *arguments)
    if status and status != n.lib.MAQ_ERROR_NOT_FOUND:
        n.fail(function, status)
    return status == 0


def _head_box_px(result: Any, index: int) -> tuple[float, float, float, float] | None:
    box_px = native().ffi.new("float[4]")
    if not _finds("maq_densepose_result_get_head_box", result, index, box_px):
        return None
    left, top, right, bottom = box_px
    return left, top, right, bottom


def _keypoints(result: Any, index: int) -> np.ndarray | None:
    keypoints = np.empty((len(KEYPOINTS), 3), np.float32)
    into = native().ffi.from_buffer("float[]", keypoints)
    return keypoints if _finds("maq_densepose_result_get_keypoints", result, index, into) else None


def part_name(part: int) -> str:
    """The name of a body part: "left upper arm, outside"; 0 is "background"."""
    n = native()
    return n.ffi.string(n.lib.maq_densepose_get_part_name(part)).decode()


@functools.cache
def part_colours() -> np.ndarray:
    """uint8 [25, 3] RGB, by part; 0 is black."""
    n = native()
    colour = n.ffi.new("uint8_t[3]")
    out = np.zeros((PART_COUNT + 1, 3), np.uint8)
    for part in range(PART_COUNT + 1):
        n.lib.maq_densepose_get_part_colour(part, colour)
        out[part] = list(colour)
    return out
