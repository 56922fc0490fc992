"""Edges: from a depth image to its sharp feature curves, corners and boxes."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from maquette.frames import Frame, ImageLike, Intrinsics, as_depth
from maquette.native import Lender, LentResult, MaquetteError, NativeObject, native, path_to_write

if TYPE_CHECKING:
    from collections.abc import Sequence

    from typing_extensions import Unpack

    from maquette.settings import CurvesSettings, EdgesSettings


@dataclass(frozen=True, eq=False)
class Curve:
    """points_m: float64 [n, 3], a polyline along the curve, in the camera's coordinates. type: "line", "arc" or
    "spline". kind: "crease" or "boundary". convexity: "convex", "concave" or "unknown", for a crease. corners: indices
    of the corners at its start and its end, -1 for a free end. rms_footprints: root mean square distance of the
    measured points from the curve, in footprints r."""

    points_m: np.ndarray
    type: str
    kind: str
    convexity: str
    corners: tuple[int, int]
    length_m: float
    rms_footprints: float

    def __repr__(self) -> str:
        return f"<Curve {self.type}, {self.kind}, {self.length_m:.3f} m>"


@dataclass(frozen=True, eq=False)
class Box:
    """size_m: float64 [3], lengths of the sides, the longest first. size_tolerance_m: float64 [3], two standard
    deviations of each length. axes: float64 [3, 3], one row for each side. centre_m: float64 [3]. corner_count: visible
    corners, at most 8. includes_focal_tolerance: whether size_tolerance_m includes the setting focal_tolerance and
    does not take the focal length as exact."""

    size_m: np.ndarray
    size_tolerance_m: np.ndarray
    axes: np.ndarray
    centre_m: np.ndarray
    corner_count: int
    includes_focal_tolerance: bool = False

    def __repr__(self) -> str:
        sides = (f"{1000 * s:.0f} ± {1000 * t:.0f}" for s, t in zip(self.size_m, self.size_tolerance_m))  # noqa: B905
        return f"<Box {' x '.join(sides)} mm>"


class Curves(NativeObject):
    """The curves of a depth image: `curves`, `corners_m` float64 [n, 3], and `boxes`, the largest first. curves_ms,
    boxes_ms: times for finding them. Hold no more than 16 at once (result_pool_size)."""

    def __init__(self, handle: Any) -> None:
        n = native()
        super().__init__(handle)
        found = n.indexed("maq_edges_curves_get_curve", handle, "maq_edges_curve",
                          n.lib.maq_edges_curves_get_curve_count(handle))  # fmt: skip
        self.curves = [
            Curve(
                _doubles(c.points_m, c.point_count, 3), n.name_of("maq_edges_curve_type", c.type),
                n.name_of("maq_edges_kind", c.kind), n.name_of("maq_edges_convexity", c.convexity),
                tuple(c.corners), c.length_m, c.rms_footprints,
            )
            for c in found
        ]  # fmt: skip
        found = n.indexed("maq_edges_curves_get_corner", handle, "maq_edges_corner",
                          n.lib.maq_edges_curves_get_corner_count(handle))  # fmt: skip
        self.corners_m = np.array([list(c.point_m) for c in found], np.float64).reshape(-1, 3)
        found = n.indexed("maq_edges_curves_get_box", handle, "maq_edges_box",
                          n.lib.maq_edges_curves_get_box_count(handle))  # fmt: skip
        self.boxes = [
            Box(
                np.array(list(b.size_m)), np.array(list(b.size_tolerance_m)), np.array([list(a) for a in b.axes]),
                np.array(list(b.centre_m)), b.corner_count, bool(b.includes_focal_tolerance),
            )
            for b in found
        ]  # fmt: skip

        stats = n.stats("maq_edges_curves_stats", "maq_edges_curves_get_stats", handle)
        self.curves_ms, self.boxes_ms = stats["curves_ms"], stats["boxes_ms"]

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes .json, .obj, .ply, .dxf or .step. Raises MaquetteError."""
        native().call("maq_edges_curves_save", self.handle, path_to_write(path))

    def snap(self, x_px: float, y_px: float, radius_px: float = 8) -> tuple[str, np.ndarray] | None:
        """Finds the target at a pixel of the depth image: the nearest corner within the radius, or else the nearest
        curve, or else an adjacent plane. Returns its kind ("corner", "curve", "plane") and its point, float64 [3] in
        metres; None without a target."""
        return self._snapped("maq_edges_curves_snap_to_pixel", x_px, y_px, radius_px)

    def snap_to_ray(
        self, origin_m: Sequence[float], direction: Sequence[float], max_angle_rad: float = 0.02
    ) -> tuple[str, np.ndarray] | None:
        """Finds the target of a ray, in the coordinates of the curves: the nearest corner within the angle seen from
        the origin, or else the nearest curve, or else the first plane. Returns the same as `snap`."""
        ray = [float(v) for v in origin_m], [float(v) for v in direction]
        return self._snapped("maq_edges_curves_snap_to_ray", *ray, max_angle_rad)

    def _snapped(self, function: str, *position: Any) -> tuple[str, np.ndarray] | None:
        n = native()
        found = n.sized("maq_edges_snap")
        n.call(function, self.handle, *position, found)
        target = n.name_of("maq_edges_snap_target", found.target)
        return (target, np.array(list(found.point_m))) if found.target else None

    def _about(self) -> str:
        return f"{len(self.curves)} curves, {len(self.corners_m)} corners, {len(self.boxes)} boxes"

    def __reduce__(self) -> Any:  # a copy, or in another process, has arrays alone
        return _closed_curves, (self.__dict__ | {"_handle": None},)


def _closed_curves(state: dict[str, Any]) -> Curves:
    curves = Curves.__new__(Curves)
    curves.__dict__.update(state)
    return curves


@dataclass(frozen=True, eq=False)
class EdgesResult:
    """Planes [H, W] of a depth image. distance_r: float32, distance to the nearest sharp curve in footprints r; eps_r
    where no curve is nearer. expected_error_r: float32, predicted mean absolute error of distance_r. kind: uint8 (0
    none, 1 crease, 2 boundary). distance_m: float32, 0 where depth is unknown. stats: the fields of
    maq_edges_stats."""

    distance_r: np.ndarray
    expected_error_r: np.ndarray
    kind: np.ndarray
    distance_m: np.ndarray
    eps_r: float
    stats: dict[str, Any]
    _lent: LentResult = field(repr=False)
    _curves: Curves | None = None

    @property
    def curves(self) -> Curves:
        """Curves, corners and boxes. Raises AttributeError if they were not requested."""
        if self._curves is None:
            raise AttributeError("This result has no curves: Edges.run(..., curves=True) or EdgesModel(curves=True).")
        return self._curves

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes <path>_distance.png, <path>_kind.png and <path>_edges.json (docs/reference/formats.md). Works for the
        latest 16 results of an `Edges`. Raises MaquetteError."""
        native().call("maq_edges_result_save", self._lent.handle, path_to_write(path))

    def __repr__(self) -> str:
        height, width = self.kind.shape
        curves = "" if self._curves is None else f", {self._curves._about()}"
        return f"<EdgesResult {width} x {height}{curves}>"


class Edges(NativeObject):
    """The network, loaded once and used for many depth images.

        result = maquette.Edges().run(depth_m, maquette.Intrinsics.centred(640, 480, fov_deg=60), curves=True)
        print(result.curves.boxes[0].size_m)

    bundle: a folder with manifest.json (default: the bundle in the package). settings: fields of maq_edges_config and
    of its model by their names: skip_planes, threads, ... Raises MaquetteError.
    """

    def __init__(self, bundle: str | os.PathLike[str] | None = None, **settings: Unpack[EdgesSettings]) -> None:
        n = native()
        config = edges_config(bundle, settings)
        self._lender = Lender(config.result_pool_size)
        super().__init__(n.create("maq_edges", n.context, config))

    def run(
        self,
        depth: ImageLike,
        intrinsics: Intrinsics | None = None,
        curves: bool = False,
        **curve_settings: Unpack[CurvesSettings],
    ) -> EdgesResult:
        """depth: a Frame with its intrinsics, float32 [H, W] in metres, uint16 [H, W] in millimetres, or the path of a
        depth image in millimetres. intrinsics: of the camera, unless the Frame has them. curves: also find curves,
        corners and boxes. curve_settings: fields of maq_edges_curves_config. One call at a time. Raises MaquetteError;
        ValueError for a Frame with other intrinsics."""
        config = curves_config(curves, curve_settings)
        result = self.run_native(depth, intrinsics)
        found = None
        if config is not None:
            n = native()
            find, release = "maq_edges_result_find_curves", "maq_edges_curves_release"
            found = Curves(n.create("maq_edges_curves", result, config, function=find, release=release))
        return edges_result(result, self._lender.lend(result), found)

    def run_native(self, depth: ImageLike, intrinsics: Intrinsics | None = None) -> Any:
        """Returns the library's own result (maq_edges_result), for calls of the C API that this package does not have.
        It goes back to its pool when the object is freed."""
        if isinstance(depth, Frame) and intrinsics is not None and depth.intrinsics != intrinsics:
            if depth.intrinsics is not None:
                problem = "The frame has its own intrinsics; wrap an array as Frame(depth, intrinsics=...) instead."
                raise ValueError(problem)
            depth = Frame(depth.depth(), timestamp_ns=depth.timestamp_ns, intrinsics=intrinsics)
        frame = as_depth(depth, intrinsics)
        self._lender.make_room()
        run, release = "maq_edges_run", "maq_edges_result_release"
        try:
            return native().create("maq_edges_result", self.handle, frame.handle, function=run, release=release)
        except MaquetteError as error:
            if "does not carry the intrinsics" not in error.text:
                raise
            height_px, width_px = frame.shape
            problem = (
                "Edges need the intrinsics of the camera: run(depth, intrinsics), with a maquette.Intrinsics such as "
                f"Intrinsics.centred({width_px}, {height_px}, fov_deg=60) or focal_px=600."
            )
            raise MaquetteError(problem, error.status) from None

    def copied(self, result: Any) -> EdgesResult:
        """Copies a result of `run_native` to arrays."""
        return edges_result(result, self._lender.lend(result))

    def cancel(self) -> None:
        """Ends the running `run`, or else the next one, with MAQ_CANCELLED. Any thread may call it."""
        native().call("maq_edges_cancel", self.handle)


def edges_config(bundle: str | os.PathLike[str] | None, settings: EdgesSettings) -> Any:
    """A maq_edges_config."""
    own = {} if bundle is None else {"bundle_path": bundle}
    return native().config("maq_edges_config", {"result_pool_size": 16, **settings, **own})


def curves_config(curves: bool, settings: CurvesSettings) -> Any:
    """A maq_edges_curves_config; None without curves. Raises TypeError for settings without curves."""
    config = native().config("maq_edges_curves_config", settings, ("curves", "intrinsics"))
    if settings and not curves:
        raise TypeError(f"{next(iter(settings))} is a setting of curves: add curves=True.")
    return config if curves else None


def edges_result(result: Any, lent: LentResult, curves: Curves | None = None) -> EdgesResult:
    """Copies a maq_edges_result to arrays."""
    n = native()
    about = n.sized("maq_edges_field")
    n.call("maq_edges_result_get_field", result, about)
    shape = about.height_px, about.width_px
    wanted = (
        (n.lib.MAQ_EDGES_PLANE_DISTANCE, np.float32), (n.lib.MAQ_EDGES_PLANE_EXPECTED_ERROR, np.float32),
        (n.lib.MAQ_EDGES_PLANE_KIND, np.uint8),
    )  # fmt: skip
    distance, error, kinds = (
        n.plane("maq_edges_result_get_plane", result, plane, shape, kind) for plane, kind in wanted
    )
    metres = np.empty(shape, np.float32)
    n.call("maq_edges_result_copy_distance_m", result, n.ffi.from_buffer("float[]", metres), metres.size)
    stats = n.stats("maq_edges_stats", "maq_edges_result_get_stats", result)
    return EdgesResult(distance, error, kinds, metres, about.eps_r, stats, lent, curves)


def _doubles(pointer: Any, *shape: int) -> np.ndarray:
    data = native().ffi.buffer(pointer, 8 * int(np.prod(shape)))
    return np.frombuffer(data, np.float64).reshape(shape).copy()
