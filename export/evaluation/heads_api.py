"""Heads from photos through the C API (maquette/head.h), for reports: photos and meshes as arrays."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Self

import numpy as np
from maquette.frames import Frame
from maquette.native import MaquetteError, NativeObject, native

__all__ = ["FittedHead", "HeadBuilder", "HeadMesh", "MaquetteError", "NoHeads", "has_heads"]


ALL_TRIANGLES = 0xFFFFFFFF  # MAQ_HEAD_ALL_TRIANGLES


class NoHeads(RuntimeError):
    """The library was built without heads."""


def has_heads() -> bool:
    """Whether the library that is there has the functions of maquette/head.h."""
    n = native()
    try:
        return bool(n.lib.maq_head_builder_create)
    except AttributeError:
        return False


@dataclass(frozen=True, eq=False)
class HeadMesh:
    """positions_m, normals, template_points_m: float32 [V, 3]; colours: uint8 RGB [V, 3]; triangles: uint32 [F, 3],
    counter-clockwise from outside. x to the person's left, y to the back, z up."""

    positions_m: np.ndarray
    normals: np.ndarray
    colours: np.ndarray
    template_points_m: np.ndarray
    triangles: np.ndarray


class FittedHead(NativeObject):
    """One head; free it with close() or a `with` statement."""

    @staticmethod
    def open(path: Path) -> FittedHead:
        """A `.maqh` file. Raises MaquetteError."""
        n = native()
        opened = n.create("maq_head", n.context, str(path).encode(), function="maq_head_open")
        return FittedHead(opened)

    @property
    def info(self) -> Any:
        """The fields of maq_head_info."""
        return SimpleNamespace(**native().stats("maq_head_info", "maq_head_get_info", self.handle))

    def mesh(self, **options: Any) -> HeadMesh:
        """options: fields of maq_head_mesh_options by their names; by default all triangles. Raises MaquetteError."""
        n = native()
        mesh = n.sized("maq_head_mesh")
        n.call("maq_head_get_mesh", self.handle, self._mesh_options(options), mesh)

        def copied(pointer: Any, count: int, kind: type) -> np.ndarray:
            size = count * 3 * np.dtype(kind).itemsize
            return np.frombuffer(n.ffi.buffer(pointer, size), kind).reshape(count, 3).copy()

        vertices, triangles = mesh.vertex_count, mesh.triangle_count
        return HeadMesh(
            copied(mesh.positions_m, vertices, np.float32),
            copied(mesh.normals, vertices, np.float32),
            copied(mesh.colours_rgb, vertices, np.uint8),
            copied(mesh.template_points_m, vertices, np.float32),
            copied(mesh.triangles, triangles, np.uint32),
        )

    def landmarks(self) -> dict[str, np.ndarray]:
        """Places by their names, float64 [3] in metres."""
        n = native()
        found, landmark = {}, n.sized("maq_head_landmark")
        for index in range(self.info.landmark_count):
            name = n.ffi.string(n.lib.maq_head_get_landmark_name(self.handle, index)).decode()
            n.call("maq_head_get_landmark", self.handle, name.encode(), landmark)
            found[name] = np.array(list(landmark.point_m))
        return found

    def save(self, path: Path) -> None:
        """Writes a `.maqh` file. Raises MaquetteError."""
        native().call("maq_head_save", self.handle, str(path).encode())

    def export(self, path: Path, **options: Any) -> None:
        """Writes .glb, .obj or .ply. options: as of mesh(). Raises MaquetteError."""
        native().call("maq_head_export", self.handle, str(path).encode(), self._mesh_options(options))

    @staticmethod
    def _mesh_options(options: dict[str, Any]) -> Any:
        return native().config("maq_head_mesh_options", {"triangle_count": ALL_TRIANGLES, **options})


class HeadBuilder(NativeObject):
    """The networks of one bundle, loaded once; photos of one person at a time.

    bundle: folder with manifest.json; None: the one installed with the library. settings: further fields of
    maq_head_config by their names. Raises MaquetteError, NoHeads.
    """

    def __init__(self, bundle: Path | None = None, **settings: Any) -> None:
        if not has_heads():
            raise NoHeads("The library has no heads: build this version's (`make build`).")
        n = native()
        if bundle is not None:
            settings["bundle_path"] = Path(bundle)
        super().__init__(n.create("maq_head_builder", n.context, n.config("maq_head_config", settings)))
        self._photos = 0

    def __enter__(self) -> Self:
        return self

    def add_photo(
        self, rgb: np.ndarray, box: np.ndarray | None = None, focal_px: float = 0, roll_rad: float = 0
    ) -> int:
        """rgb: uint8 [H, W, 3]; box: left, top, right, bottom of the head, None: it is looked for; focal_px: 0 where it
        is not known. Returns the photo's index. Raises MaquetteError: MAQ_ERROR_NOT_FOUND where there is no head."""
        n = native()
        settings: dict[str, Any] = {"focal_px": focal_px, "roll_rad": roll_rad}
        if box is not None:
            settings["box_px"] = [float(side) for side in box]
        with Frame(np.ascontiguousarray(rgb)) as frame:
            photo = n.config("maq_head_photo", settings)
            n.call("maq_head_builder_add_photo", self.handle, frame.handle, photo)
        self._photos += 1
        return self._photos - 1

    def clear(self) -> None:
        """Forgets the photos."""
        native().call("maq_head_builder_clear", self.handle)
        self._photos = 0

    def fit(self, seconds: float, progress: Callable[[float], bool | None] | None = None) -> FittedHead:
        """Fits one head to the photos. progress gets the fraction that is done; False cancels. Raises MaquetteError."""
        n = native()

        def told(_: Any, done: float) -> int:
            return 0 if progress(done) is False else 1

        callback = n.ffi.callback("maq_head_progress_callback", told, error=0) if progress else n.ffi.NULL
        fit = ("maq_head", self.handle, float(seconds), callback, n.ffi.NULL)
        return FittedHead(n.create(*fit, function="maq_head_builder_fit"))

    def cancel(self) -> None:
        """Ends the call that runs, or else the next."""
        native().call("maq_head_builder_cancel", self.handle)

    def photo(self, index: int) -> Any:
        """The fields of maq_head_photo_info: what was found of a photo, and by the latest fit."""
        n = native()
        info = n.sized("maq_head_photo_info")
        n.call("maq_head_builder_get_photo", self.handle, index, info)
        box = np.array(list(info.box_px))
        names = [
            name for name, _ in n.ffi.typeof("maq_head_photo_info").fields if name not in ("struct_size", "box_px")
        ]
        return SimpleNamespace(box_px=box, **{name: getattr(info, name) for name in names})

    @property
    def stats(self) -> Any:
        """The fields of maq_head_stats: times of stages and counts of the latest fit."""
        return SimpleNamespace(**native().stats("maq_head_stats", "maq_head_builder_get_stats", self.handle))
