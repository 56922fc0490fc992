"""The room of the demo: laid out by hand, of CC0 models of the split `test` and textures drawn here.

    python -m export.places.music_room --out tests/media/room

Writes photos, cameras, a cloud and what everything is made of, small enough for git: no depth, and the cloud in whole
millimetres (9 bytes a point), which are the unit of the whole folder.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
from dataclasses import asdict, replace
from pathlib import Path

import cv2
import numpy as np

from export.camera import Camera
from export.places.cameras import Lens, looking
from export.places.cc0_assets import DRAWN, FreeStock, bricks, landscape, weave
from export.places.dataset import frame_entry
from export.places.furnish import Heights, placed, quad
from export.places.mesh import Material, part_of
from export.places.render import Lighting, Renderer
from export.places.rooms import RoomMaker, Staged, noise, planks
from export.point_cloud import evenly_spread, write_ply

SPLIT = "test"
LENS = Lens(640, 480, 72.0)
FRAMES, HELD_OUT_EVERY = 30, 6
POINTS = 320_000
JPEG_QUALITY = 88
EXPOSURE = 1.0
MM = 1000.0
NEAR_M = 0.03

_LEFT, _RIGHT, _FRONT, _BACK = (0, -1), (0, 1), (1, -1), (1, 1)  # walls: axis, side
_QUARTER = np.pi / 2
_WALK_MIDDLE = np.array([0.5, -0.3, 0.0])  # metres; the piano's corner is left out
# Name, x and y in metres, turn in radians (0: the front looks to -y), height of what it stands on.
_THINGS = (
    ("pianoAQueue", -1.35, 0.95, 0.35, 0.0),
    ("thonet", -0.62, -0.12, 2.75, 0.0),
    ("desk", 2.28, 0.45, -_QUARTER, 0.0),
    ("chairWithCushion", 1.55, 0.5, _QUARTER + 0.3, 0.0),
    ("designChair", 1.45, -1.3, -2.3, 0.0),
    ("antiqueChair", -2.1, -1.45, 2.3, 0.0),
    ("decorativePlant", 2.2, 1.75, 0.4, 0.0),
    ("decorativePlant", -2.25, -0.55, 2.0, 0.0),
    ("radiator3", 0.55, 2.05, 0.0, 0.0),
    ("crate", -1.2, -1.8, 0.12, 0.0),
    ("cactus", -1.28, -1.75, 0.0, 0.59),
    ("deer", -1.02, -1.9, 2.2, 0.59),
    ("caballito", 0.35, -1.55, 2.4, 0.0),
    ("stool2", 2.2, -0.75, 0.0, 0.0),
    ("cactus", 2.2, -0.75, 1.0, 0.78),
)


class MusicRoom(RoomMaker):
    """5.2 by 4.4 metres, z up, the middle of the floor at the origin."""

    def __init__(self, stock: FreeStock) -> None:
        super().__init__(stock, np.random.default_rng(7))
        self.size = np.array([5.2, 4.4, 2.7])
        self.ground = Heights.over(-self.size[:2] / 2, self.size[:2] / 2)

    def floor_material(self) -> tuple[Material, float]:
        return Material(planks(np.random.default_rng(6)), (1.0, 0.97, 0.92), specular=0.3, shininess=60.0), 0.8

    def wall_material(self) -> tuple[Material, float]:
        if not self.assets:  # the first wall asked for is the plain one, the second the one behind the piano
            self.assets.append(DRAWN)
            return Material(noise(self.rng, 1.5), (0.98, 0.94, 0.86), specular=0.02), 0.7
        return Material(bricks(np.random.default_rng(10)), (0.9, 0.86, 0.82), specular=0.02), 0.6

    def furnish(self) -> None:
        models = {m.name: m for m in self.stock.models}
        for name, x, y, turn, height in _THINGS:
            model = models[name]
            parts = [replace(p, material=_dull(p.material)) for p in self.stock.parts(model)]
            self.parts += placed(parts, (x, y, height), turn)
            self.assets.append(model.asset)
        lamp = models["wallLight"]
        for spot, along in ((_BACK, -2.2), (_BACK, -0.5), (_FRONT, 1.9)):
            at, inward = self.on_wall(spot, along, lamp.elevation, lamp.size[1] / 2)
            self.parts += placed(self.stock.parts(lamp), at, float(np.arctan2(inward[0], -inward[1])))
        self.assets.append(lamp.asset)

    def hang(self) -> None:
        views = [landscape(np.random.default_rng(seed)) for seed in (2, 11, 3, 6, 9, 13)]
        self.frame(views[0], _BACK, (0.85, 1.55), (1.5, 1.15), window=True)
        self.frame(views[1], _RIGHT, (-1.0, 1.5), (1.2, 1.15), window=True)
        self.frame(views[2], _BACK, (-1.35, 1.75), (0.9, 0.66), window=False)
        self.frame(views[3], _LEFT, (-0.7, 1.55), (0.8, 0.6), window=False)
        self.frame(views[4], _FRONT, (-1.2, 1.6), (1.0, 0.75), window=False)
        self.frame(views[5], _FRONT, (0.55, 1.55), (0.6, 0.8), window=False)
        texture = weave(np.random.default_rng(5))
        rug = quad((0.35, 0.1, 0.006), (1, 0, 0), (0, 1, 0), 2.0, 1.5)
        self.parts.append(part_of(rug, Material(texture), shades=False))

    def light(self) -> Lighting:
        around, _ = self.stock.panorama(self.rng)
        lamps = (
            (np.array([0.3, -0.4, 2.45, 1.0]), np.array([3.0, 2.75, 2.3])),
            (np.array([0.85, 1.7, 1.6, 1.0]), np.array([0.5, 0.6, 0.75])),
            (np.array([2.1, -1.0, 1.6, 1.0]), np.array([0.5, 0.6, 0.75])),
        )
        return Lighting(lamps, np.full(3, 0.42), np.full(3, 0.24), around, 0.6, plain=(0.0, 0.0, 0.0))

    def walk(self) -> list[Camera]:
        """One round before the piano, a little up and down, with a look across the room."""
        cameras = []
        for turn in np.arange(FRAMES) / FRAMES * 2 * np.pi:
            x, y = np.cos(turn), np.sin(turn)
            eye = np.array([1.5 * x, 1.25 * y, 1.45 + 0.22 * np.sin(3 * turn)]) + _WALK_MIDDLE
            target = np.array([-0.7 * x, -0.6 * y, 0.9]) + _WALK_MIDDLE
            cameras.append(looking(LENS, eye, target))
        return cameras


def _dull(material: Material) -> Material:
    """The models' own highlights would make everything plastic."""
    if material.opacity < 1:
        return replace(material, specular=0.5, shininess=120.0)
    return replace(material, specular=0.35 * material.specular, shininess=max(material.shininess, 30.0), mirror=0.0)


def staged() -> Staged:
    maker = MusicRoom(FreeStock(SPLIT))
    maker.shell()
    maker.furnish()
    maker.hang()
    return Staged("room", maker.parts, maker.light(), maker.walk(), maker.assets, NEAR_M)


def write(folder: Path) -> int:
    """The room as a capture, written atomically; what was there goes. Returns the number of points."""
    room = staged()
    partial = folder.with_name(f".{folder.name}.partial")
    shutil.rmtree(partial, ignore_errors=True)
    (partial / "images").mkdir(parents=True)
    entries, places, colours = [], [], []
    with Renderer(room.parts, room.lighting, room.near) as renderer:
        for k, camera in enumerate(room.cameras):
            image, depth = renderer.colour(camera, EXPOSURE), renderer.depth(camera)
            entry = frame_entry(k, camera)
            del entry["depth_file_path"]
            entry["transform_matrix"] = (np.array(entry["transform_matrix"]) * [[1, 1, 1, MM]]).tolist()
            entries.append(entry)
            file = partial / entry["file_path"]
            options = [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY, cv2.IMWRITE_JPEG_OPTIMIZE, 1]
            if not cv2.imwrite(str(file), np.ascontiguousarray(image[..., ::-1]), options):
                raise OSError(f"{file} could not be written: is the disk full?")
            if k % HELD_OUT_EVERY != HELD_OUT_EVERY // 2:
                y, x = np.nonzero(depth > 0)
                places.append(camera.lifted(np.stack([x, y], 1), depth[y, x]) * MM)
                colours.append(image[y, x])
    xyz, rgb = evenly_spread(np.concatenate(places), np.concatenate(colours), POINTS, np.random.default_rng(1))
    write_ply(partial / "cloud.ply", np.round(xyz).astype(np.int16), rgb)
    held_out = [e["file_path"] for k, e in enumerate(entries) if k % HELD_OUT_EVERY == HELD_OUT_EVERY // 2]
    table = {
        "camera_model": "PINHOLE",
        "ply_file_path": "cloud.ply",
        "up": [0, 0, 1],
        "frames": entries,
        "train_filenames": [e["file_path"] for e in entries if e["file_path"] not in held_out],
        "test_filenames": held_out,
        "licence": "CC0-1.0",
        "assets": [asdict(asset) for asset in sorted(set(room.assets), key=lambda a: a.name)],
    }
    (partial / "transforms.json").write_text(json.dumps(table, indent=1) + "\n")
    shutil.rmtree(folder, ignore_errors=True)
    partial.rename(folder)
    return len(xyz)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("tests/media/room"), help="default: %(default)s")
    folder = parser.parse_args().out
    folder.parent.mkdir(parents=True, exist_ok=True)
    try:
        points = write(folder)
    except FileNotFoundError as error:
        print(error, file=sys.stderr)
        return 1
    size = sum(f.stat().st_size for f in folder.rglob("*") if f.is_file())
    print(f"wrote {folder}: {FRAMES} photos, {points} points, {size / 1e6:.1f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
