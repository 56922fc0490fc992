"""Dense pose: the people in an image, and for each of their pixels the point of the body surface that it shows."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from maquette.frames import Frame, as_frame
from maquette.native import NativeObject, native

PART_COUNT = 24


@dataclass(frozen=True)
class Person:
    """box_px: left, top, right, bottom in pixels of the image, the latter two exclusive. score: 0 to 1. head_box_px:
    around the pixels that show the head, for `HeadBuilder.add_photo`; None where none does."""

    box_px: tuple[float, float, float, float]
    score: float
    head_box_px: tuple[float, float, float, float] | None


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
    stats: dict[str, float]

    def painted(self, image: np.ndarray, opacity: float = 0.7) -> np.ndarray:
        """image: uint8 [H, W, 3] RGB. A copy with the people in the colours of their parts."""
        body = self.part > 0
        out = image.copy()
        colours = part_colours()[self.part[body]]
        out[body] = np.round((1 - opacity) * image[body] + opacity * colours).astype(np.uint8)
        return out


class DensePose(NativeObject):
    """The networks, loaded once and used for many images.

        result = maquette.DensePose().run(rgb)

    bundle: a folder with manifest.json (default: the one that comes with the package). settings: fields of
    maq_densepose_config by their names: long_side_px, person_crops, key_frame_interval, threads, score_threshold, ...
    (docs/guide/dense-pose.md says what they gain and cost). Raises MaquetteError.
    """

    def __init__(self, bundle: str | Path | None = None, **settings: Any) -> None:
        n = native()
        if bundle is not None:
            settings["bundle_path"] = Path(bundle)
        super().__init__(n.create("maq_densepose", n.context, n.config("maq_densepose_config", settings)))

    def run(self, image: Frame | np.ndarray) -> DensePoseResult:
        """image: a Frame, or uint8 [H, W, 3] RGB. One call at a time. Raises MaquetteError."""
        n = native()
        frame = as_frame(image)
        result = n.create("maq_densepose_result", self.handle, frame.handle, function="maq_densepose_run",
                          release="maq_densepose_result_release")  # fmt: skip
        count = n.lib.maq_densepose_result_get_person_count(result)
        found = n.indexed("maq_densepose_result_get_person", result, "maq_densepose_person", count)
        people = [Person(tuple(p.box_px), p.score, _head_box_px(result, index)) for index, p in enumerate(found)]
        planes = [
            n.plane("maq_densepose_result_get_plane", result, plane, frame.shape, np.uint8)
            for plane in (
                n.lib.MAQ_DENSEPOSE_PLANE_PART, n.lib.MAQ_DENSEPOSE_PLANE_U, n.lib.MAQ_DENSEPOSE_PLANE_V,
                n.lib.MAQ_DENSEPOSE_PLANE_PERSON,
            )
        ]  # fmt: skip
        stats = n.stats("maq_densepose_stats", "maq_densepose_result_get_stats", result)
        n.ffi.release(result)
        return DensePoseResult(people, *planes, stats)

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
        n = native()
        struct = n.sized("maq_densepose_surface")
        n.call("maq_densepose_get_surface", self.handle, struct)
        shape = (PART_COUNT, struct.nodes, struct.nodes, 3)
        data = n.ffi.buffer(struct.points_m, 4 * int(np.prod(shape)))
        return np.frombuffer(data, np.float32).reshape(shape).copy()


def _head_box_px(result: Any, index: int) -> tuple[float, ...] | None:
    n = native()
    box_px = n.ffi.new("float[4]")
    status = n.ask("maq_densepose_result_get_head_box", result, index, box_px)
    if status == n.lib.MAQ_ERROR_NOT_FOUND:
        return None
    if status:
        n.fail("maq_densepose_result_get_head_box", status)
    return tuple(box_px)


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
