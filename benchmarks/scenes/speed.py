"""Measures the time of a frame of a scene against points, pixels and threads; time and memory of building it.

The scene is a rendered capture whose cloud has exactly the wanted number of points: random pixels of its source photos
at their depth. Points that are visible in no photo are dropped, so a scene has fewer points than its cloud.
"""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from tqdm import tqdm

from benchmarks.scenes import command as scene_command
from benchmarks.scenes.command import Built, SceneCommandError
from export.places.place import Place, PlaceError, load_place
from export.point_cloud import write_ply

VIEWS, LONG_SIDE_PX = 24, 640
CLOUDS = (50_000, 100_000, 200_000, 250_000, 500_000, 700_000, 1_000_000)
QUICK_CLOUDS = (50_000, 200_000)
SIZES = ((160, 120), (320, 240), (640, 480), (1280, 960))
TARGET_SIZE, TARGET_POINTS = (640, 480), 500_000
SMALL_SIZE, SMALL_POINTS = (320, 240), 200_000


def dense_cloud(place: Place, points: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Returns `points` random pixels with depth of the source photos: float32 [P, 3] in the world, uint8 [P, 3].

    No pixel comes twice. Raises ValueError where there are fewer.
    """
    rng = np.random.default_rng(seed)
    places, colours, per_view = [], [], points // len(place.source) + 1
    for view in place.source:
        depth = place.depth[int(view)]
        rows, columns = np.nonzero(depth)
        if len(rows) < per_view:
            continue
        chosen = rng.choice(len(rows), per_view, replace=False)
        rows, columns = rows[chosen], columns[chosen]
        rays = np.linalg.inv(place.intrinsics[view]) @ np.stack([columns, rows, np.ones(len(rows))])
        pose = place.world_to_camera[view]
        places.append(((rays * depth[rows, columns]).T - pose[:, 3]) @ pose[:, :3])
        colours.append(place.images[int(view)][rows, columns])
    if len(places) * per_view < points:
        raise ValueError(f"{place.folder} has too few pixels with depth for {points} points")
    keep = rng.permutation(len(places) * per_view)[:points]
    return np.concatenate(places)[keep].astype(np.float32), np.concatenate(colours)[keep]


def chosen_place(folders: list[Path]) -> Place | None:
    """Returns the first capture with photos of 640 x 480, landscape or portrait, and enough source photos; a room if
    there is one."""
    found = []
    for folder in folders:
        try:
            place = load_place(folder)
        except PlaceError:
            continue  # quality.py reports the problem
        if is_size((place.images.width, place.images.height), TARGET_SIZE) and len(place.source) >= VIEWS:
            found.append(place)
    return min(found, key=lambda place: place.about.get("kind") != "room") if found else None


def is_size(size: Sequence[int], wanted: tuple[int, int]) -> bool:
    """Returns whether the size is the wanted one, landscape or portrait."""
    return tuple(sorted(size, reverse=True)) == wanted


def measure(folders: list[Path], networks: Path, threads: int, quick: bool) -> tuple[dict, str]:
    """Returns `built` and `frames`, rows each, `missing`, and `place`; and why there is nothing ("" if there is)."""
    place = chosen_place(folders)
    if place is None:
        return {}, f"no rendered place has photos of 640 x 480 and {VIEWS} of them to build from"
    if not networks.is_dir():
        return {}, f"no networks in {networks}"
    clouds = QUICK_CLOUDS if quick else CLOUDS
    upright = place.images.height > place.images.width
    view = [Path(place.images.files[int(place.held_out[0])]).relative_to(place.folder).as_posix()]
    result: dict = {"place": place.folder.name, "threads": threads, "built": [], "frames": [], "missing": {}}
    with tempfile.TemporaryDirectory() as name:
        work, scene = Path(name), Path(name) / "scene.maqs"
        shutil.copytree(place.folder / "images", work / "dense" / "images")
        shutil.copy(place.folder / "transforms.json", work / "dense")
        for points in tqdm(clouds, desc="scenes, time", unit="scene", disable=None):
            try:
                write_ply(work / "dense" / place_cloud(place), *dense_cloud(place, points))
                options = ("--views", str(VIEWS), "--points", str(points), "--long-side", str(LONG_SIDE_PX))
                built = scene_command.build(work / "dense", scene, networks, *options)
            except (SceneCommandError, ValueError) as error:
                result["missing"][f"{points:,} points"] = str(error)
                continue
            result["built"].append(built_row(points, built))
            for size, count in wanted_frames(points in clouds[-3:], threads):
                # all cores are the default of the command, so the option is left out
                options = () if count == threads else ("--threads", str(count))
                options += ("--size", "{}x{}".format(*(reversed(size) if upright else size)))
                options += ("--repeat", "5" if quick else "31")
                try:
                    made = scene_command.render(scene, networks, work / "dense", work / "pictures", view, *options)
                except SceneCommandError as error:
                    result["missing"]["{} x {}, threads: {}".format(*size, count)] = str(error)
                else:
                    row = {"points": built.points, "size_px": list(size), "threads": count, "ms": made.ms}
                    result["frames"].append(row)
    return (result, "") if result["frames"] else ({}, next(iter(result["missing"].values())))


def wanted_frames(all_sizes: bool, threads: int) -> list[tuple[tuple[int, int], int]]:
    """Returns sizes and threads of the timed frames."""
    wanted = [(size, threads) for size in (SIZES if all_sizes else (SMALL_SIZE, TARGET_SIZE))]
    return wanted + [(TARGET_SIZE, 1)] if threads != 1 else wanted


def place_cloud(place: Place) -> str:
    return json.loads((place.folder / "transforms.json").read_text())["ply_file_path"]


def built_row(asked: int, built: Built) -> dict:
    return {"cloud": asked, "points": built.points, "view_dependent_points": built.view_dependent_points,
            "build_s": built.wall_s, "stages_s": built.seconds, "peak_memory_mb": built.peak_memory_mb,
            "bytes_a_point": built.bytes / built.points}  # fmt: skip


def metrics_of(measured: dict) -> tuple[dict[str, float], dict[str, str]]:
    """Returns the metrics with a target, and why others are missing. Frame rates come from the smallest scene with at
    least as many points as the target names."""
    metrics, missing = {}, {}
    for name, size, least in (("scene_fps_500k", TARGET_SIZE, TARGET_POINTS), ("scene_fps_200k_small", SMALL_SIZE,
                                                                            SMALL_POINTS)):  # fmt: skip
        rows = [row for row in measured["frames"] if tuple(row["size_px"]) == size and row["points"] >= least
                and row["threads"] == measured["threads"]]  # fmt: skip
        if rows:
            metrics[name] = 1000 / min(rows, key=lambda row: row["points"])["ms"]["total"]
        else:
            missing[name] = f"no scene kept {least:,} points and was rendered at {size[0]} x {size[1]}"
    by_cloud = {row["cloud"]: row for row in measured["built"]}
    for name, cloud, key in (("scene_build_s", TARGET_POINTS, "build_s"), ("scene_peak_memory_mb", 1_000_000,
                                                                         "peak_memory_mb")):  # fmt: skip
        if cloud in by_cloud:
            metrics[name] = by_cloud[cloud][key]
        else:
            missing[name] = measured["missing"].get(f"{cloud:,} points", f"no cloud of {cloud:,} points was modelled")
    return metrics, missing


def memory_a_point(measured: dict) -> float | None:
    """Returns the bytes that each point of the cloud adds to the peak while building, from the smallest to the largest
    cloud."""
    rows = sorted(measured.get("built", []), key=lambda row: row["cloud"])
    if len(rows) < 2:
        return None
    first, last = rows[0], rows[-1]
    return 1e6 * (last["peak_memory_mb"] - first["peak_memory_mb"]) / (last["cloud"] - first["cloud"])
