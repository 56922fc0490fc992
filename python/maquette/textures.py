"""Textures of people: the colours of a person on the body surface, from many frames."""

from __future__ import annotations

import os

import numpy as np

from maquette.densepose import DensePoseResult
from maquette.frames import ImageLike, as_frame
from maquette.native import NativeObject, native, path_to_write


class DensePoseTexture(NativeObject):
    """The colours of one person: a tile for each of the 24 parts, in 4 columns of 6.

        texture = maquette.DensePoseTexture()
        for frame in maquette.Source("clip.mp4"):
            result = densepose.run(frame)
            for index, person in enumerate(result.people):
                if person.id == 1:
                    texture.add_person(result, index, frame)
        texture.save("person.png")

    tile_px: width and height of a tile, 8 to 512; 0: 64. Raises MaquetteError.
    """

    def __init__(self, tile_px: int = 0) -> None:
        n = native()
        config = n.config("maq_densepose_texture_config", {"tile_px": tile_px})
        super().__init__(n.create("maq_densepose_texture", n.context, config))

    def add_person(self, result: DensePoseResult, index: int, image: ImageLike) -> None:
        """Adds what an image shows of the person at `index` of its result. image: what `DensePose.run` was given. Works
        for the latest 8 results of a `DensePose`. Raises MaquetteError."""
        frame = as_frame(image)
        native().call("maq_densepose_texture_add_person", self.handle, result._lent.handle, index, frame.handle)

    def draw(self) -> np.ndarray:
        """uint8 [6 tiles, 4 tiles, 4], RGBA. The tile of part p is in column (p - 1) // 6 and row (p - 1) % 6. In a
        tile, U grows to the right and V upwards. A is the confidence of the colour, 0 where no image showed the
        surface."""
        n = native()
        size = n.ffi.new("int32_t *"), n.ffi.new("int32_t *")
        n.call("maq_densepose_texture_get_size", self.handle, *size)
        out = np.empty((size[1][0], size[0][0], 4), np.uint8)
        n.call("maq_densepose_texture_draw", self.handle, n.ffi.from_buffer("uint8_t[]", out), 0, out.nbytes)
        return out

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the image of `draw` to a .png file. Raises MaquetteError."""
        native().call("maq_densepose_texture_save", self.handle, path_to_write(path))
