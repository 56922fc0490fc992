"""A clip of people with its truth: `clip-SS-NNNNN.maqrec` (frames) and `.npz` (truth). Needs no renderer to be read."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import cv2
import numpy as np

from export.people.clips.recording import read_jpegs, write_recording

FORMAT = 1
_ARRAYS = ("time_ns", "visible_box", "visible_px", "full_box", "joints_px", "joints_m", "joint_visible", "intrinsics",
           "world_to_camera")  # fmt: skip


class ClipError(ValueError):
    """A file is not a clip of people, or not one of this format."""


@dataclass(frozen=True, eq=False)
class Truth:
    """Truth of T frames with P people. Person p has id p + 1 in every frame and in the label images.

    time_ns [T]. visible_box, full_box [T, P, 4]: left, top, right, bottom in pixels, the latter two exclusive; of the
    visible pixels (NaN: none), and of the whole body, which may reach out of the image (NaN: behind the camera).
    visible_px [T, P]. joints_px [T, P, 15, 2], NaN behind the camera; joints_m [T, P, 15, 3], in the world, metres;
    joint_visible [T, P, 15]: the image shows this person there. intrinsics [4]: fx, fy, cx, cy in pixels.
    world_to_camera [T, 3, 4]. facts: set, split, number, fps, joints (their names), and more.
    """

    time_ns: np.ndarray
    visible_box: np.ndarray
    visible_px: np.ndarray
    full_box: np.ndarray
    joints_px: np.ndarray
    joints_m: np.ndarray
    joint_visible: np.ndarray
    intrinsics: np.ndarray
    world_to_camera: np.ndarray
    facts: dict

    @property
    def frames(self) -> int:
        return len(self.time_ns)

    @property
    def people(self) -> int:
        return self.visible_px.shape[1]


@dataclass(frozen=True, eq=False)
class PeopleClip:
    """truth, and the coded label of each frame."""

    path: Path
    truth: Truth
    labels: Sequence[bytes]

    def label(self, frame: int) -> np.ndarray:
        """uint8 [H, W, 4]: part I, U * 255, V * 255, id of the person; 0 on background."""
        return cv2.imdecode(np.frombuffer(self.labels[frame], np.uint8), cv2.IMREAD_UNCHANGED)

    def image(self, frame: int) -> np.ndarray:
        """uint8 [H, W, 3] BGR."""
        return cv2.imdecode(np.frombuffer(self._jpegs[frame], np.uint8), cv2.IMREAD_COLOR)

    @property
    def recording(self) -> Path:
        """The frames, for `maquette.Source`."""
        return self.path.with_suffix(".maqrec")

    @cached_property
    def _jpegs(self) -> list[bytes]:
        return read_jpegs(self.recording)


def clip_paths(folder: Path) -> list[Path]:
    """The clips of a folder, by set and number. Raises ClipError where there are none."""
    paths = sorted(folder.glob("clip-??-?????.npz"))
    if not paths:
        raise ClipError(f"{folder} has no clip-*.npz. Make some: python -m export.people.clips.dataset --help")
    return paths


def write_clip(path: Path, jpegs: Sequence[bytes], labels: Sequence[np.ndarray], truth: Truth) -> None:
    """Writes both files; the one of the truth, `path`, last, so that a clip with truth is whole."""
    height, width = labels[0].shape[:2]
    write_recording(path.with_suffix(".maqrec"), jpegs, truth.time_ns, (width, height), float(truth.facts["fps"]))
    coded = [cv2.imencode(".png", label, [cv2.IMWRITE_PNG_COMPRESSION, 6])[1].tobytes() for label in labels]
    arrays = {name: getattr(truth, name) for name in _ARRAYS}
    arrays["label"] = np.frombuffer(b"".join(coded), np.uint8)
    arrays["label_end"] = np.cumsum([len(data) for data in coded], dtype=np.int64)
    arrays["facts"] = np.frombuffer(json.dumps({"format": FORMAT, **truth.facts}).encode(), np.uint8)
    partial = path.with_name(f".{path.name}.partial")
    with partial.open("wb") as file:
        np.savez(file, **arrays)
    partial.rename(path)


def read_clip(path: Path) -> PeopleClip:
    """Raises ClipError."""
    try:
        with np.load(path) as stored:
            facts = json.loads(stored["facts"].tobytes())
            if facts.get("format") != FORMAT:
                raise ClipError(
                    f"{path} has format {facts.get('format')}, this program reads {FORMAT}: render it again."
                )
            truth = Truth(**{name: stored[name] for name in _ARRAYS}, facts=facts)
            data, end = stored["label"].tobytes(), stored["label_end"]
    except (OSError, EOFError, KeyError, zipfile.BadZipFile) as error:
        raise ClipError(
            f"{path} cannot be read as a clip of people ({error}): delete it and render it again."
        ) from None
    start = [0, *end[:-1]]
    return PeopleClip(path, truth, [data[a:b] for a, b in zip(start, end, strict=True)])
