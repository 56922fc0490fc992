"""Writes data/rendered_views: pictures that torch makes of the points of data/tiny_scene (make_tiny_scene.py).

`views.json`: cameras (world to camera), held at different angles, one in the cloud, one with pixels that are not
square, one with a principal point beside the picture, and the name of each one's picture by export/scenes/fitting.py.

    python -m tests.native.generate.make_rendered_views
"""

from __future__ import annotations

import json
import math
import tempfile
from pathlib import Path

import cv2
import numpy as np
import torch

from export.camera import Camera
from export.scenes.captures import read_capture
from export.scenes.config import BASIS, FEATURES, ROTATED_MULTIPLE
from export.scenes.descriptors import FittedDescriptors
from export.scenes.fitting import FittedPoints, Options, render
from export.scenes.geometry.cameras import upright
from export.scenes.geometry.raster import NOTHING, depths_of, visible
from export.scenes.networks.system import Networks
from tests.native.generate.make_tiny_scene import FOLDER as SCENE
from tests.native.generate.make_tiny_scene import pose, write_bundle

FOLDER = Path(__file__).parents[1] / "data" / "rendered_views"
UP = (0.0, 0.0, 1.0)


def networks_of_the_bundle() -> Networks:
    """In torch. Raises ValueError where this machine makes other random weights."""
    torch.manual_seed(11)
    with tempfile.TemporaryDirectory() as folder:
        networks = write_bundle(Path(folder))
        for name in ("refiner.onnx", "basis.bin"):
            if (Path(folder) / name).read_bytes() != (SCENE / "bundle" / name).read_bytes():
                raise ValueError(
                    f"{SCENE}/bundle/{name} has other weights; run tests.native.generate.make_tiny_scene first"
                )
    return networks


def model() -> FittedPoints:
    """Reads `looks.bin`, which make_tiny_scene.py describes."""
    numbers = FEATURES + BASIS * FEATURES + 1
    row = np.dtype([("index", "<u4"), ("views", "<u4"), ("look", "<f4", numbers)])
    table = np.fromfile(SCENE / "looks.bin", row)
    look = torch.from_numpy(table["look"].copy())
    places = torch.from_numpy(read_capture(SCENE / "capture").cloud.positions[table["index"]])
    slope = look[:, FEATURES:-1].reshape(-1, BASIS, FEATURES)
    views, singular = torch.from_numpy(table["views"].astype(np.float32)), torch.zeros(len(look), dtype=torch.bool)
    background = torch.from_numpy(np.fromfile(SCENE / "background.bin", "<f4"))
    return FittedPoints(places, FittedDescriptors(look[:, :FEATURES], slope, views, singular), background)


def camera(
    size: tuple[int, int], focal: tuple[float, float], centre: tuple[float, float, float], roll: float
) -> Camera:
    """FittedDescriptors at the world's origin, turned by `roll`; the principal point is right and low of the middle."""
    to_world = pose(np.array(centre), roll) * [1, -1, -1, 1]
    return Camera(*size, *focal, 0.55 * size[0], 0.6 * size[1], to_world[:3, :3].T, np.array(centre))


def cameras() -> list[Camera]:
    beside = camera((80, 64), (90.0, 90.0), (2.203, -0.409, 0.613), 0.3)
    return [
        camera((96, 80), (110.0, 110.0), (2.013, 1.019, 0.517), 0.0),
        camera((75, 91), (100.0, 120.0), (-1.511, 1.203, -0.707), 0.5),
        camera((100, 60), (95.0, 95.0), (0.307, -2.411, 1.103), math.pi / 2),
        camera((64, 64), (20.0, 20.0), (0.103, 0.211, 0.057), -2.5),
        Camera(**{**vars(beside), "cx_px": -20.0}),
    ]


def check_depths(scene: FittedPoints, view: Camera) -> None:
    """Raises ValueError where two points are equally deep: who wins depends on their order, and a scene has its own."""
    keys = visible(scene.positions, upright(view, np.asarray(UP), ROTATED_MULTIPLE))
    depths = depths_of(keys[keys != NOTHING]).numpy()
    if len(np.unique(depths)) < len(depths):
        raise ValueError(f"Two points have the same depth as seen from {view.centre}; move the camera a little.")


def main() -> None:
    FOLDER.mkdir(parents=True, exist_ok=True)
    networks, scene, views = networks_of_the_bundle(), model(), []
    for k, view in enumerate(cameras()):
        check_depths(scene, view)
        picture = render(scene, view, networks, Options(up=UP))
        name = f"{k}.png"
        cv2.imwrite(str(FOLDER / name), np.round(255 * picture[..., ::-1]).astype(np.uint8))
        views.append({key: value.tolist() if hasattr(value, "tolist") else value for key, value in vars(view).items()})
        views[-1]["picture"] = name
        print(f"{name}: {view.width_px} x {view.height_px}, colours {picture.mean():.2f} +- {picture.std():.3f}")
    (FOLDER / "views.json").write_text(json.dumps(views, indent=1) + "\n")


if __name__ == "__main__":
    main()
