"""Runs `maquette scene build`, `render` and `info`, and checks their JSON.

Fields of build: `cloud_points`, `points`, `view_dependent_points`, `bytes`, `seconds` (`total` and each stage) and
`peak_memory_mib`. Fields of render: `views`, a list of `name` and `ms` (a table of medians over the repeats: `total`,
`project`, `shade`, `refine`, `resample`). The commands write their files themselves.
"""

from __future__ import annotations

import json
import math
import statistics
import subprocess
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from benchmarks import frame_time

STAGES = ("project", "shade", "refine", "resample")
LONGEST_S = 900  # longest time of a command; after it, the command hangs


class SceneCommandError(RuntimeError):
    """A command failed or its JSON lacks a field; the message says which."""


@dataclass(frozen=True)
class Built:
    """cloud_points: points read; points: points in the file; view_dependent_points: those with a view-dependent
    descriptor. seconds: by stage, with `total`. wall_s: of the whole process."""

    cloud_points: int
    points: int
    view_dependent_points: int
    bytes: int
    seconds: dict[str, float]
    peak_memory_mb: float
    wall_s: float


@dataclass(frozen=True)
class Rendered:
    """ms: median over views by stage, with `total`. images: RGB float32 [H, W, 3] in 0..1 by the photo's name.
    wall_s: of the whole process."""

    ms: dict[str, float]
    pictures: dict[str, np.ndarray]
    wall_s: float


def build(capture: Path, scene: Path, networks: Path, *options: str) -> Built:
    """Builds a scene file from the source photos of a capture. Raises SceneCommandError, FileNotFoundError without the
    program."""
    said, wall_s = _run("build", str(capture), "--out", str(scene), "--bundle", str(networks), *options)
    try:
        seconds = {str(stage): _number(value) for stage, value in said["seconds"].items()}
        names = ("cloud_points", "points", "view_dependent_points", "bytes")
        cloud, points, view_dependent, size = (int(_number(said[name])) for name in names)
        found = Built(cloud, points, view_dependent, size, seconds, _number(said["peak_memory_mib"]) * 1.048576, wall_s)
        if "total" not in seconds or not 0 <= view_dependent <= points <= cloud or not points or not scene.exists():
            raise ValueError(f"{view_dependent} of {points} of {cloud} points, stages {', '.join(seconds)}")
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise SceneCommandError(f"maquette scene build: its JSON is not what it should be ({error!r})") from None
    return found


def render(
    scene: Path, networks: Path, capture: Path, folder: Path, views: Sequence[str] | str = "held-out", *options: str
) -> Rendered:
    """Renders images of a scene from cameras of a capture into `folder`. views: names of photos, "held-out" or "all".

    Raises SceneCommandError, FileNotFoundError without the program.
    """
    names = views if isinstance(views, str) else ",".join(views)
    folder.mkdir(parents=True, exist_ok=True)
    said, wall_s = _run("render", str(scene), "--bundle", str(networks), "--capture", str(capture), "--views", names,
                        "--out", str(folder), "--no-alpha", *options)  # fmt: skip
    try:
        times = [{stage: _number(view["ms"][stage]) for stage in ("total", *STAGES)} for view in said["views"]]
        ms = {stage: statistics.median(view[stage] for view in times) for stage in times[0]}
        names = [str(view["name"]) for view in said["views"]]
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise SceneCommandError(f"maquette scene render: its JSON is not what it should be ({error!r})") from None
    return Rendered(ms, {name: _picture(folder / f"{Path(name).stem}.png") for name in names}, wall_s)


def info(scene: Path) -> dict:
    """Returns the information of a scene file. Raises SceneCommandError, FileNotFoundError without the program."""
    return _run("info", str(scene))[0]


def _run(command: str, first: str, *arguments: str) -> tuple[dict, float]:
    if not frame_time.PROGRAM.exists():
        raise FileNotFoundError(f"{frame_time.PROGRAM} is not there: make build")
    # Arguments beside the subject: the scene, or the output folder.
    path = Path(arguments[arguments.index("--out") + 1] if "--out" in arguments else first)
    path = path.with_name(f"{path.name}-{command}.json")
    path.unlink(missing_ok=True)
    whole = [str(frame_time.PROGRAM), "scene", command, first, *arguments, "--json", str(path)]
    begin_s = time.monotonic()
    try:
        run = subprocess.run(whole, capture_output=True, text=True, check=False, timeout=LONGEST_S)
    except subprocess.TimeoutExpired:
        raise SceneCommandError(f"maquette scene {command} did not end within {LONGEST_S} seconds") from None
    wall_s = time.monotonic() - begin_s
    if run.returncode:
        last = (run.stderr.strip().splitlines() or ["it said nothing"])[-1]
        raise SceneCommandError(f"maquette scene {command} ended with status {run.returncode}: {last}")
    try:
        said = json.loads(path.read_text())
    except (OSError, ValueError) as error:
        raise SceneCommandError(f"maquette scene {command} wrote no JSON that can be read: {error}") from None
    if not isinstance(said, dict):
        raise SceneCommandError(f"maquette scene {command} wrote JSON that is no table")
    return said, wall_s


def _number(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError(f"{value!r} is no number")
    return float(value)


def _picture(path: Path) -> np.ndarray:
    image = cv2.imread(str(path), cv2.IMREAD_COLOR)
    if image is None:
        raise SceneCommandError(f"maquette scene render wrote no image {path.name}")
    return np.ascontiguousarray(image[..., ::-1], np.float32) / 255
