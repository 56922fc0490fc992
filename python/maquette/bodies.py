"""Bodies: pose, shape and mesh of the people in a dense pose image, and files of their motion."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from maquette.densepose import KEYPOINTS, DensePoseResult
from maquette.frames import Intrinsics
from maquette.native import Lender, LentResult, NativeObject, native, path_to_write

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from maquette.settings import BodySettings

# Names of the angles of joints, in the order of maq_body_angle.
BODY_ANGLES = ("left_elbow", "right_elbow", "left_knee", "right_knee", "left_hip", "right_hip", "left_shoulder",
               "right_shoulder")  # fmt: skip


@dataclass(frozen=True, eq=False)
class BodyMesh:
    """The mesh and the skeleton of all bodies. triangles: uint32 [F, 3]. joint_parents: -1 for the first joint."""

    vertex_count: int
    triangles: np.ndarray
    joint_names: tuple[str, ...]
    joint_parents: tuple[int, ...]
    shape_count: int


@dataclass(frozen=True)
class BodySize:
    """A size in metres; 90 % of people have a true size between low_m and high_m (docs/research/body.md)."""

    value_m: float
    low_m: float
    high_m: float


@dataclass(frozen=True)
class BodySizes:
    """Sizes of a body without clothes. chest, waist and hip are girths. is_height_known: False where no height was
    given; the scale is that of the average person then, and all intervals are wide."""

    is_height_known: bool
    height: BodySize
    chest: BodySize
    waist: BodySize
    hip: BodySize
    inseam: BodySize


@dataclass(frozen=True, eq=False)
class BodyPerson:
    """The body of one person. fit: "fitted", "too_few_pixels" or "unreliable"; the rest is None, or empty, unless it is
    fitted. Positions are in metres in axes of the camera (x right, y down, z forward), from the pelvis.

    vertices_m: float32 [V, 3]. keypoints_m: float32 [33, 3], in the order of `KEYPOINTS`. joints_m: float32 [J, 3].
    joint_rotations: float32 [J, 3], rotation vectors relative to the parent, radians. orientation: float32 [3, 3], body
    axes (x left, y back, z up) to camera axes. shape: float32 [S]. angles_deg: by the names of `BODY_ANGLES`.
    pelvis_m: float32 [3], its place in the camera; None without intrinsics. pelvis_px, scale_px_per_m: where the image
    shows it. sizes: height, girths and inseam with intervals. seen_joints: bool [J], False for joints that follow the
    prior. inlier_fraction, error_px: quality.
    """

    id: int
    fit: str
    inlier_fraction: float = 0.0
    error_px: float = 0.0
    iteration_count: int = 0
    pelvis_m: np.ndarray | None = None
    pelvis_px: tuple[float, float] | None = None
    scale_px_per_m: float = 0.0
    orientation: np.ndarray | None = None
    angles_deg: dict[str, float] | None = None
    seen_joints: np.ndarray | None = None
    shape: np.ndarray | None = None
    joint_rotations: np.ndarray | None = None
    joints_m: np.ndarray | None = None
    keypoints_m: np.ndarray | None = None
    vertices_m: np.ndarray | None = None
    sizes: BodySizes | None = None


class BodyResult:
    """people: in the order of the dense pose result. Its newest results can be added to a `BodyClip`."""

    def __init__(self, people: list[BodyPerson], lent: LentResult) -> None:
        self.people = people
        self._lent = lent

    def __repr__(self) -> str:
        fitted = sum(person.fit == "fitted" for person in self.people)
        return f"<BodyResult, {fitted} of {len(self.people)} people fitted>"


class Body(NativeObject):
    """Fits bodies to people.

        people = maquette.DensePose(has_keypoints=True).run("photo.jpg")
        bodies = maquette.Body().run(people)

    bundle: a folder with manifest.json (default: the one that comes with the package). settings: fields of
    maq_body_config. Raises MaquetteError.
    """

    def __init__(self, bundle: str | os.PathLike[str] | None = None, **settings: Unpack[BodySettings]) -> None:
        n = native()
        own = {} if bundle is None else {"bundle_path": bundle}
        config = n.config("maq_body_config", {"result_pool_size": 8, **settings, **own}, ["bundle"])
        self._lender = Lender(config.result_pool_size)
        super().__init__(n.create("maq_body", n.context, config))
        mesh = n.sized("maq_body_mesh")
        n.call("maq_body_get_mesh", self.handle, mesh)
        self.mesh = BodyMesh(
            mesh.vertex_count,
            _array(mesh.triangles, (mesh.triangle_count, 3), np.uint32),
            tuple(n.text(mesh.joint_names[k]) for k in range(mesh.joint_count)),
            tuple(mesh.joint_parents[k] for k in range(mesh.joint_count)),
            mesh.shape_count,
        )

    def run(
        self,
        people: DensePoseResult,
        intrinsics: Intrinsics | None = None,
        timestamp_ns: int = 0,
        heights_m: Sequence[float] | None = None,
    ) -> BodyResult:
        """people: of `DensePose.run`. intrinsics: of the camera; None: unknown. timestamp_ns: of the frame; with it and
        the people's ids, each fit starts from the body in the frame before. heights_m: true height of each person, 0
        for unknown; it sets the scale of the mesh and of `sizes`. Raises MaquetteError, ValueError for another number
        of heights."""
        ids = [person.id for person in people.people]
        keypoints = [person.keypoints for person in people.people]
        known = None if not keypoints or any(k is None for k in keypoints) else np.stack(keypoints)  # type: ignore[arg-type]
        return self.run_planes(people.iuv, people.person, ids, known, intrinsics, timestamp_ns, heights_m)

    def run_planes(
        self,
        iuv: np.ndarray,
        person: np.ndarray,
        ids: Sequence[int],
        keypoints: np.ndarray | None = None,
        intrinsics: Intrinsics | None = None,
        timestamp_ns: int = 0,
        heights_m: Sequence[float] | None = None,
    ) -> BodyResult:
        """For dense pose images from elsewhere. iuv: uint8 [H, W, 3], part, U * 255, V * 255. person: uint8 [H, W],
        index in `ids` plus 1. ids: one for each person, 0 for unknown. keypoints: float32 [P, 33, 3] or None. Raises
        MaquetteError, ValueError for arrays of other shapes."""
        n = native()
        if iuv.ndim != 3 or iuv.shape[2] != 3 or person.shape != iuv.shape[:2]:
            raise ValueError(f"iuv has the shape {iuv.shape} and person {person.shape}; pass [H, W, 3] and [H, W].")
        if keypoints is not None and keypoints.shape != (len(ids), len(KEYPOINTS), 3):
            raise ValueError(
                f"keypoints have the shape {keypoints.shape}, but must be {(len(ids), len(KEYPOINTS), 3)}."
            )
        if heights_m is not None and len(heights_m) != len(ids):
            raise ValueError(f"heights_m has {len(heights_m)} numbers, but there are {len(ids)} people.")
        given = n.ffi.new("maq_body_input *")
        n.call("maq_body_input_init", given, n.ffi.sizeof("maq_body_input"))
        given.height_px, given.width_px = person.shape
        planes = [np.ascontiguousarray(plane, np.uint8) for plane in (*np.moveaxis(iuv, 2, 0), person)]
        kept: list[Any] = [n.ffi.from_buffer("uint8_t[]", plane) for plane in planes]
        given.part, given.u, given.v, given.person = kept
        given.person_count = len(ids)
        kept.append(n.ffi.new("int64_t[]", [int(number) for number in ids] or [0]))
        given.ids = kept[-1]
        if keypoints is not None:
            kept.append(n.ffi.from_buffer("float[]", np.ascontiguousarray(keypoints, np.float32)))
            given.keypoints = kept[-1]
        if intrinsics is not None:
            kept.append(n.ffi.new("maq_intrinsics *"))
            intrinsics.write_to(kept[-1])
            given.intrinsics = kept[-1]
        if heights_m is not None:
            kept.append(n.ffi.new("float[]", [float(height) for height in heights_m] or [0.0]))
            given.heights_m = kept[-1]
        given.timestamp_ns = timestamp_ns
        self._lender.make_room()
        result = n.create("maq_body_result", self.handle, given, function="maq_body_run",
                          release="maq_body_result_release")  # fmt: skip
        count = n.lib.maq_body_result_get_person_count(result)
        found = n.indexed("maq_body_result_get_person", result, "maq_body_person", count)
        people = [self._person(person, result, index) for index, person in enumerate(found)]
        return BodyResult(people, self._lender.lend(result))

    def reset(self) -> None:
        """The next frame starts a new stream. Raises MaquetteError."""
        native().call("maq_body_reset", self.handle)

    def _person(self, person: Any, result: Any, index: int) -> BodyPerson:
        fit = native().name_of("maq_body_fit", person.fit)
        if fit != "fitted":
            return BodyPerson(person.id, fit)
        joints = len(self.mesh.joint_names)
        return BodyPerson(
            person.id, fit, person.inlier_fraction, person.error_px, person.iteration_count,
            np.array(list(person.pelvis_m), np.float32) if person.is_metric else None,
            tuple(person.pelvis_px), person.scale_px_per_m,
            np.array(list(person.orientation), np.float32).reshape(3, 3),
            dict(zip(BODY_ANGLES, person.angles_deg)),  # noqa: B905
            np.array([bool(person.seen_joints >> k & 1) for k in range(joints)]),
            _array(person.shape, (self.mesh.shape_count,), np.float32),
            _array(person.joint_rotations, (joints, 3), np.float32), _array(person.joints_m, (joints, 3), np.float32),
            _array(person.keypoints_m, (len(KEYPOINTS), 3), np.float32),
            _array(person.vertices_m, (self.mesh.vertex_count, 3), np.float32), _sizes(result, index),
        )  # fmt: skip


class BodyClip(NativeObject):
    """The bodies of a clip, and their files. Raises MaquetteError.

    clip = maquette.BodyClip(body)
    for frame in source:
        clip.add(body.run(densepose.run(frame), timestamp_ns=frame.timestamp_ns))
    clip.save("dance.glb")
    """

    def __init__(self, body: Body) -> None:
        super().__init__(native().create("maq_body_clip", body.handle))

    @property
    def person_count(self) -> int:
        return native().lib.maq_body_clip_get_person_count(self.handle)

    def add(self, result: BodyResult) -> None:
        """Adds the fitted people of a result of the same `Body`. Raises MaquetteError."""
        native().call("maq_body_clip_add_result", self.handle, result._lent.handle)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes all people to a .glb file. Raises MaquetteError."""
        native().call("maq_body_clip_save", self.handle, path_to_write(path))

    def save_person(self, index: int, path: str | os.PathLike[str]) -> None:
        """Writes one person to a .glb or .bvh file; 0 has the most frames. Raises MaquetteError."""
        native().call("maq_body_clip_save_person", self.handle, index, path_to_write(path))


def _sizes(result: Any, index: int) -> BodySizes:
    sizes = native().sized("maq_body_sizes")
    native().call("maq_body_result_get_sizes", result, index, sizes)
    named = [getattr(sizes, name) for name in ("height", "chest", "waist", "hip", "inseam")]
    return BodySizes(bool(sizes.is_height_known), *(BodySize(size.value_m, size.low_m, size.high_m) for size in named))


def _array(pointer: Any, shape: tuple[int, ...], kind: type) -> np.ndarray:
    data = native().ffi.buffer(pointer, int(np.prod(shape)) * np.dtype(kind).itemsize)
    return np.frombuffer(data, kind).reshape(shape).copy()
