"""Renders places: images from many cameras, their depth, a point cloud.

    python -m export.places.dataset --split train --scenes 100 --processes 2 --out .data/places

Each place is a function of (split, seed) alone, and its folder (docs/reference/formats.md) appears atomically: what is
there already is kept, so a stopped run goes on where it was. A place that fails, or never ends, is said and left out.
Splits share no model, texture, photo, panorama or person.
"""

from __future__ import annotations

import argparse
import json
import shutil
from dataclasses import asdict
from pathlib import Path

import cv2
import numpy as np
from tqdm import tqdm

from export.camera import Camera
from export.jobs import Workers
from export.places.assets import SPLITS
from export.places.clouds import CloudFaults, CloudMaker, draw_faults
from export.places.place import AXES, FORMAT
from export.places.recipe import FRAMES, NothingSeenError, choose_exposure, choose_views, draw_place, generator
from export.places.render import Renderer
from export.places.rooms import Staged
from export.point_cloud import write_ply

VERSION = "places-1"
JPEG_QUALITY = 92
DEPTH_UNIT_M = 0.001
_ATTEMPTS = 5
_BLOCK = 5  # of so many neighbours on the cameras' way, one is held out


def held_out_views(count: int, rng: np.random.Generator) -> np.ndarray:
    """One of every five neighbours: numbers, rising."""
    blocks = range(0, count - _BLOCK + 1, _BLOCK)
    return np.array([start + rng.integers(_BLOCK) for start in blocks], np.int64)


def frame_entry(k: int, camera: Camera) -> dict:
    """A camera as nerfstudio and instant-ngp write it: OpenGL axes, pixels counted from the first one's corner."""
    to_world = np.linalg.inv(np.concatenate([camera.world_to_camera, [[0, 0, 0, 1]]])) @ AXES
    intrinsics = camera.intrinsics
    return {
        "file_path": f"images/{k:03d}.jpg",
        "depth_file_path": f"depth/{k:03d}.png",
        "w": camera.width_px,
        "h": camera.height_px,
        "fl_x": float(intrinsics[0, 0]),
        "fl_y": float(intrinsics[1, 1]),
        "cx": float(intrinsics[0, 2]) + 0.5,
        "cy": float(intrinsics[1, 2]) + 0.5,
        "transform_matrix": to_world.tolist(),
    }


def render_place(stock, split: str, seed: int, folder: Path, small=False, exact=False, frames: int = FRAMES) -> None:
    """Draws one place and writes its folder atomically (temporary name, then rename). exact: a cloud without faults."""
    for attempt in range(_ATTEMPTS):
        staged, _ = draw_place(stock, split, seed, small, frames, attempt)
        try:
            _render(staged, split, seed, folder, small, exact)
            return
        except NothingSeenError:
            if attempt + 1 == _ATTEMPTS:
                raise


def _render(staged: Staged, split: str, seed: int, folder: Path, small: bool, exact: bool) -> None:
    rng = generator(split, seed, 2)
    with Renderer(staged.parts, staged.lighting, staged.near) as renderer:
        cameras = choose_views(renderer, staged, rng)
        exposure = choose_exposure(renderer, cameras, rng)
        held_out = held_out_views(len(cameras), rng)
        faults = CloudFaults(points=200_000) if exact else draw_faults(generator(split, seed, 3), small)
        cloud = CloudMaker(faults, len(cameras) - len(held_out), generator(split, seed, 4))
        partial = folder.with_name(f".{folder.name}.partial")
        shutil.rmtree(partial, ignore_errors=True)
        for name in ("images", "depth"):
            (partial / name).mkdir(parents=True)
        entries = []
        for k, camera in enumerate(cameras):
            depth, image = renderer.depth(camera), renderer.colour(camera, exposure)
            entries.append(frame_entry(k, camera))
            steps = np.round(depth / DEPTH_UNIT_M)
            stored = np.where(steps > 65535, 0, steps).astype(np.uint16)
            _write(partial / entries[k]["file_path"], image[..., ::-1], cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY)
            _write(partial / entries[k]["depth_file_path"], stored, cv2.IMWRITE_PNG_COMPRESSION, 4)
            if k not in held_out:
                cloud.add(camera, depth, image)
    xyz, rgb = cloud.cloud()
    write_ply(partial / "cloud.ply", xyz, rgb)
    assets = {asset.name: asdict(asset) for asset in staged.assets}
    table = {
        "camera_model": "PINHOLE",
        "ply_file_path": "cloud.ply",
        "frames": entries,
        "train_filenames": [e["file_path"] for k, e in enumerate(entries) if k not in held_out],
        "test_filenames": [entries[k]["file_path"] for k in held_out],
        "maquette": {
            "format": FORMAT,
            "generator": VERSION,
            "split": split,
            "seed": seed,
            "kind": staged.kind,
            "small": small,
            "up_axis": [0.0, 0.0, 1.0],
            "depth_unit_m": DEPTH_UNIT_M,
            "background_rgb": staged.lighting.plain,
            "cloud": faults.named() | {"stored": len(xyz)},
            "assets": [assets[name] for name in sorted(assets)],
        },
    }
    (partial / "transforms.json").write_text(json.dumps(table, indent=1) + "\n")
    partial.rename(folder)


def _write(path: Path, image: np.ndarray, *options: int) -> None:
    if not cv2.imwrite(str(path), np.ascontiguousarray(image), list(options)):
        raise OSError(f"{path} could not be written: is the disk full?")


_stocks: dict[tuple[str, Path, bool], object] = {}


def _work(job: tuple) -> str:
    split, seed, folder, data, options = job
    cv2.setNumThreads(1)
    plain = options.pop("plain")
    if (split, data, plain) not in _stocks:
        if plain:
            from export.places.geometry_only import PlainStock as Stock

            _stocks[split, data, plain] = Stock(split)
        else:
            from export.places.catalogue import Stock

            _stocks[split, data, plain] = Stock(split, data)
    render_place(_stocks[split, data, plain], split, seed, folder, **options)
    return folder.name


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--split", choices=SPLITS, default="train")
    parser.add_argument("--scenes", type=int, default=100, help="default %(default)s")
    parser.add_argument("--first-seed", type=int, default=0, help="of the first place (default %(default)s)")
    parser.add_argument("--frames", type=int, default=FRAMES, help="cameras of a place (default %(default)s)")
    parser.add_argument("--small", action="store_true", help="half the width and height, a quarter of the points")
    parser.add_argument("--exact", action="store_true", help="clouds without noise, holes or outliers")
    parser.add_argument("--plain", action="store_true", help="boxes instead of furniture: needs no package")
    Workers.add_arguments(parser)
    parser.add_argument(
        "--max-seconds", type=float, default=600, help="a place that takes longer is left out (default %(default)s)"
    )
    parser.add_argument("--out", type=Path, default=Path(".data/places"))
    parser.add_argument("--data", type=Path, default=Path(".data"), help="folder of backgrounds and panoramas")
    options = parser.parse_args()
    if options.scenes < 1 or options.frames < _BLOCK:
        parser.error(f"--scenes must be at least 1 and --frames at least {_BLOCK}")
    out = options.out / options.split
    out.mkdir(parents=True, exist_ok=True)
    how = {key: getattr(options, key) for key in ("small", "exact", "plain", "frames")}
    seeds = range(options.first_seed, options.first_seed + options.scenes)
    jobs = [(options.split, seed, out / f"place-{seed:05d}", options.data, dict(how)) for seed in seeds]
    missing = [job for job in jobs if not job[2].exists()]
    lost = 0
    with tqdm(total=len(jobs), initial=len(jobs) - len(missing), unit="place") as bar:
        for done in Workers.of(options, options.max_seconds).run(_work, missing):
            bar.update()
            if done.error is not None:
                lost += 1
                tqdm.write(f"{done.job[2].name} is left out: {done.error}")
    if lost == len(missing) > 0:
        raise SystemExit(f"None of {lost} places could be rendered; the lines above say why.")


if __name__ == "__main__":
    main()
