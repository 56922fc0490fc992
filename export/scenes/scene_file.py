"""Scene files (.maqs) in numpy: read, checked, and written again with other descriptors.

The layout is that of sdk/src/scene/format/scene_file_format.h and scene.h, version 1. Points, blocks and kinds of
numbers stay as `maquette scene build` chose them: what is written differs in coefficients, their steps, and the
networks' identity. Checks are 64-bit XXH3 hashes (export/xxh3.py).
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from export.scenes.config import BASIS, FEATURES
from export.xxh3 import xxh3

MAGIC, VERSION, ALIGNMENT = b"MAQSCN\r\n", 1, 64
MAX_POINTS, MAX_BLOCK_POINTS = 30_000_000, 1024
LARGEST_STORED = 2e30
SLOPES = BASIS * FEATURES
PLACES = {0: np.dtype("<f4"), 1: np.dtype("<u2")}
COEFFICIENTS = {0: np.dtype("<f4"), 1: np.dtype("<i2"), 2: np.dtype("i1")}

SPAN = np.dtype([("offset", "<u8"), ("bytes", "<u8"), ("check", "<u8")])
HEAD = np.dtype(
    [
        ("magic", "S8"),
        ("version", "<u4"),
        ("head_bytes", "<u4"),
        ("head_check", "<u8"),
        ("file_bytes", "<u8"),
        ("origin", "<f8", 3),
        ("up", "<f8", 3),
        ("points", "<u4"),
        ("varying", "<u4"),
        ("blocks", "<u4"),
        ("position_kind", "u1"),
        ("coefficient_kind", "u1"),
        ("zero", "u1", 2),
        ("networks_sha256", "u1", 32),
        ("background", "<f4", 3),
        ("more_zeros", "u1", 20),
        ("sections", SPAN, 4),
    ]
)
BLOCK = np.dtype(
    [
        ("first", "<u4"),
        ("count", "<u4"),
        ("varying", "<u4"),
        ("first_varying", "<u4"),
        ("low", "<f4", 3),
        ("high", "<f4", 3),
        ("place_step", "<f4", 3),
        ("mean_middle", "<f4", FEATURES),
        ("mean_step", "<f4", FEATURES),
        ("slope_step", "<f4", SLOPES),
    ]
)
CHECKED = HEAD.fields["file_bytes"][1]  # from there on the head's check covers it


class SceneFileError(ValueError):
    """A file is not a scene that can be read; the sentence says why."""


@dataclass(frozen=True, eq=False)
class SceneFile:
    """head: one HEAD. blocks: BLOCK [B]. stored_positions: [3 P] as stored, block by block x of all, then y, then z.
    means: [P, 8] and slopes: [V, 48] as stored."""

    head: np.ndarray
    blocks: np.ndarray
    stored_positions: np.ndarray
    means: np.ndarray
    slopes: np.ndarray

    @property
    def up(self) -> tuple[float, float, float]:
        """The upward direction of the world."""
        return tuple(float(x) for x in self.head["up"])

    @property
    def networks_sha256(self) -> str:
        """Identity of the networks of the descriptors (`identity` of export.scenes.bundle)."""
        return self.head["networks_sha256"].tobytes().hex()

    def positions(self) -> np.ndarray:
        """Where the points are in the world, float64 [P, 3]."""
        found = np.empty((len(self.means), 3), np.float32)
        quantized = self.head["position_kind"] == 1
        for block in self.blocks:
            first, count = int(block["first"]), int(block["count"])
            stored = self.stored_positions[3 * first : 3 * (first + count)].reshape(3, count).T.astype(np.float32)
            found[first : first + count] = block["low"] + stored * block["place_step"] if quantized else stored
        return found + self.head["origin"]

    def background(self) -> np.ndarray:
        """Red, green, blue of what has no points, float32 [3] in 0..1."""
        return self.head["background"].copy()

    def slope_rows(self) -> np.ndarray:
        """For each point, int64 [P], which row of the slopes is its own; -1 for those whose descriptor is the same from
        all sides."""
        block = np.repeat(np.arange(len(self.blocks)), self.blocks["count"])
        own = np.arange(len(self.means)) - self.blocks["first"][block]
        return np.where(own < self.blocks["varying"][block], self.blocks["first_varying"][block] + own, -1)

    def descriptors(self) -> tuple[np.ndarray, np.ndarray]:
        """Means [P, 8] and slopes [V, 48], float32."""
        if self.head["coefficient_kind"] == 0:
            return self.means.astype(np.float32), self.slopes.astype(np.float32)
        of_point = np.repeat(self.blocks, self.blocks["count"])
        means = of_point["mean_middle"] + self.means.astype(np.float32) * of_point["mean_step"]
        steps = np.repeat(self.blocks["slope_step"], self.blocks["varying"], axis=0)
        return means, self.slopes.astype(np.float32) * steps

    def with_descriptors(self, means: np.ndarray, slopes: np.ndarray) -> SceneFile:
        """The same points with other means [P, 8] and slopes [V, 48], stored in the same kind of numbers. Raises
        ValueError for other shapes or numbers too large."""
        if means.shape != self.means.shape or slopes.shape != self.slopes.shape:
            raise ValueError(f"descriptors of shapes {means.shape} and {slopes.shape} are not of this scene's points")
        if not all(_sound(values) for values in (means, slopes)):
            raise ValueError("the descriptors are not finite, or too large for a scene file")
        blocks, head = self.blocks.copy(), self.head.copy()
        kind = COEFFICIENTS[int(head["coefficient_kind"])]
        if kind.kind == "f":
            return SceneFile(head, blocks, self.stored_positions, means.astype(kind), slopes.astype(kind))
        most = np.iinfo(kind).max
        low, high = (f.reduceat(means.astype(np.float64), blocks["first"], axis=0) for f in (np.minimum, np.maximum))
        blocks["mean_middle"] = (low + high) / 2
        blocks["mean_step"] = (high - low) / 2 / most
        blocks["slope_step"] = 0
        varies = blocks["varying"] > 0
        if varies.any():
            reach = np.maximum.reduceat(np.abs(slopes.astype(np.float64)), blocks["first_varying"][varies], axis=0)
            blocks["slope_step"][varies] = reach / most
        of_point = np.repeat(blocks, blocks["count"])
        steps = np.repeat(blocks["slope_step"], blocks["varying"], axis=0)
        stored = (
            _in_steps(means.astype(np.float64) - of_point["mean_middle"], of_point["mean_step"], most),
            _in_steps(slopes, steps, most),
        )
        return SceneFile(head, blocks, self.stored_positions, *(values.astype(kind) for values in stored))

    def with_networks(self, sha256: str) -> SceneFile:
        """The same scene, said to be made with the networks of that identity."""
        head = self.head.copy()
        head["networks_sha256"] = np.frombuffer(bytes.fromhex(sha256), np.uint8)
        return replace(self, head=head)


def _in_steps(values: np.ndarray, steps: np.ndarray, most: int) -> np.ndarray:
    found = np.divide(values, steps, out=np.zeros(values.shape), where=steps > 0)
    return np.clip(np.trunc(found + np.copysign(0.5, found)), -most, most)


def _sound(values: np.ndarray) -> bool:
    return bool((np.abs(values) <= LARGEST_STORED).all())  # false for NaN


def read_scene_file(path: Path) -> SceneFile:
    """Raises SceneFileError for what is damaged or no scene, OSError for what cannot be read."""
    with path.open("rb") as file:
        size = os.fstat(file.fileno()).st_size
        raw = file.read(HEAD.itemsize)
        head = _checked_head(raw, size, path)
        sections = [file.read(_filled_up(int(span["bytes"]))) for span in head["sections"]]
    for k, (data, span) in enumerate(zip(sections, head["sections"], strict=True)):
        if xxh3(data) != span["check"]:
            raise SceneFileError(f"{path}, section {k}, is damaged at byte {span['offset']} or behind; copy it again.")
    sections = [data[: int(span["bytes"])] for data, span in zip(sections, head["sections"], strict=True)]
    coefficient = COEFFICIENTS[int(head["coefficient_kind"])]
    scene = SceneFile(
        head,
        np.frombuffer(sections[0], BLOCK),
        np.frombuffer(sections[1], PLACES[int(head["position_kind"])]),
        np.frombuffer(sections[2], coefficient).reshape(-1, FEATURES),
        np.frombuffer(sections[3], coefficient).reshape(-1, SLOPES),
    )
    _check_blocks(scene, path)
    return scene


def write_scene_file(scene: SceneFile, path: Path) -> None:
    """Beside its place first: a crash leaves the old file whole."""
    head = scene.head.copy()
    arrays = (scene.blocks, scene.stored_positions, scene.means, scene.slopes)
    sections, offset = [np.ascontiguousarray(x).tobytes() for x in arrays], HEAD.itemsize
    for k, data in enumerate(sections):
        sections[k] = data + bytes(_filled_up(len(data)) - len(data))
        head["sections"][k] = (offset, len(data), xxh3(sections[k]))
        offset += len(sections[k])
    head["file_bytes"] = offset
    head["head_check"] = xxh3(head.tobytes()[CHECKED:])
    beside = path.with_name(f"{path.name}.tmp")
    with beside.open("wb") as file:
        file.write(head.tobytes())
        file.writelines(sections)
        file.flush()
        os.fsync(file.fileno())
    beside.replace(path)


def _filled_up(size: int) -> int:
    return -(-size // ALIGNMENT) * ALIGNMENT


def _checked_head(raw: bytes, size: int, path: Path) -> np.ndarray:
    if len(raw) < HEAD.itemsize or not raw.startswith(MAGIC):
        raise SceneFileError(f"{path} is not a scene (.maqs).")
    head = np.frombuffer(raw, HEAD)[0].copy()
    if head["version"] != VERSION:
        raise SceneFileError(f"{path} is a scene of version {head['version']}; version {VERSION} is read here.")
    if head["head_bytes"] != HEAD.itemsize or head["head_check"] != xxh3(raw[CHECKED:]):
        raise SceneFileError(f"{path} is damaged in its first {HEAD.itemsize} bytes; copy it again.")
    if head["file_bytes"] != size:
        raise SceneFileError(f"{path} has {size} bytes, but should have {head['file_bytes']}: it is cut off; copy it.")
    kinds = int(head["position_kind"]), int(head["coefficient_kind"])
    if kinds[0] not in PLACES or kinds[1] not in COEFFICIENTS:
        raise SceneFileError(f"{path} stores its numbers in kinds {kinds}, which version {VERSION} does not have.")
    points, varying, blocks = (int(head[name]) for name in ("points", "varying", "blocks"))
    if not (0 < blocks <= points <= MAX_POINTS and varying <= points):
        raise SceneFileError(f"{path} claims {points} points, {varying} that vary, in {blocks} blocks: that cannot be.")
    if not ((head["background"] >= 0) & (head["background"] <= 1)).all():
        raise SceneFileError(f"{path} has a background colour of {head['background']}, which is not 0 to 1.")
    if not all(np.isfinite(head[name]).all() for name in ("origin", "up")):
        raise SceneFileError(f"{path} has an origin or a direction of up that is not finite.")
    coefficient = COEFFICIENTS[kinds[1]].itemsize
    sizes = (
        blocks * BLOCK.itemsize,
        3 * points * PLACES[kinds[0]].itemsize,
        points * FEATURES * coefficient,
        varying * SLOPES * coefficient,
    )
    offset = HEAD.itemsize
    for k, expected in enumerate(sizes):
        if tuple(head["sections"][k])[:2] != (offset, expected):
            raise SceneFileError(f"{path}, section {k}, should have {expected} bytes from {offset} on and has not.")
        offset += _filled_up(expected)
    if offset != size:
        raise SceneFileError(f"{path} has {size - offset} bytes that belong to nothing.")
    return head


def _check_blocks(scene: SceneFile, path: Path) -> None:
    blocks, head = scene.blocks, scene.head
    for first, count, whole in (("first", "count", "points"), ("first_varying", "varying", "varying")):
        ends = np.cumsum(blocks[count], dtype=np.int64)
        if ends[-1] != head[whole] or (blocks[first] != ends - blocks[count]).any():
            raise SceneFileError(f"{path}: its blocks do not follow each other, or do not hold {head[whole]} points.")
    counts = blocks["count"]
    if (counts < 1).any() or (counts > MAX_BLOCK_POINTS).any() or (blocks["varying"] > counts).any():
        raise SceneFileError(f"{path} has a block of 0, or of over {MAX_BLOCK_POINTS} points, or more that vary.")
    floats = [blocks[n] for n in ("low", "high", "place_step", "mean_middle", "mean_step", "slope_step")]
    floats += [x for x in (scene.stored_positions, scene.means, scene.slopes) if x.dtype.kind == "f"]
    if not all(_sound(values) for values in floats):
        raise SceneFileError(f"{path} has positions or descriptors that are not finite; build the scene again.")
