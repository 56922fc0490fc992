"""Gives rendered places what a user's photos have: their faults, and a cloud computed from them.

    python -m export.captures.reconstruct .data/places/train --out .data/reconstructed/train

Of each place (`python -m export.places.dataset --exact`) 10 to 32 photos are taken; all others are held out. The photos
of some places differ in exposure and colour; noise, blur and JPEG strength differ from place to place, and cameras
point aside by hundredths of a degree. Corners of the photos with the depth there, some of them wrong, are the sparse
cloud, from which the SDK computes depth and a dense cloud. So networks learn to draw clouds with the faults that they
will meet. Held-out photos have neither faults nor errors of their cameras.
"""

from __future__ import annotations

import argparse
import json
import shutil
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial.transform import Rotation
from tqdm import tqdm

from export.camera import Camera
from export.captures.dense import dense_cloud
from export.captures.structure import CaptureError
from export.places.dataset import frame_entry
from export.places.place import Place, PlaceError, load_place
from export.point_cloud import write_ply

CORNERS = 400  # of a photo, at most
WRONG_CORNERS = 0.02
CORNER_NOISE = 0.003  # standard deviation along the ray, as a share of the depth


@dataclass(frozen=True)
class PhotoFaults:
    """exposure, colour: standard deviations of the logarithm of a photo's brightness, and of each of its channels.
    noise: of 255. blur_px: of a Gaussian. jpeg_quality: 0 to 100. aside_deg: error of a camera's direction about each
    axis."""

    exposure: float = 0.0
    colour: float = 0.0
    noise: float = 0.0
    blur_px: float = 0.0
    jpeg_quality: int = 92
    aside_deg: float = 0.0


def draw_photo_faults(rng: np.random.Generator) -> PhotoFaults:
    """Faults of one place. In half of the places no exposure changes."""
    changing = rng.random() < 0.5
    return PhotoFaults(
        exposure=float(rng.uniform(0.02, 0.1)) if changing else 0.0,
        colour=float(rng.uniform(0, 0.02)) if changing else 0.0,
        noise=float(rng.uniform(0, 4)),
        blur_px=float(rng.uniform(0, 0.8)),
        jpeg_quality=int(rng.integers(60, 96)),
        aside_deg=float(rng.uniform(0, 0.03)),
    )


def worn(image: np.ndarray, faults: PhotoFaults, rng: np.random.Generator) -> np.ndarray:
    """The image uint8 [H, W, 3] as a camera with these faults takes it."""
    image = image.astype(np.float32) * np.exp(faults.exposure * rng.normal() + faults.colour * rng.normal(size=3))
    if faults.blur_px > 0.1:
        image = cv2.GaussianBlur(image, (0, 0), faults.blur_px)
    image = image + rng.normal(0, faults.noise, image.shape) if faults.noise else image
    return np.rint(np.clip(image, 0, 255)).astype(np.uint8)


def corners(place: Place, photos: list[int], rng: np.random.Generator) -> np.ndarray:
    """A sparse cloud, float32 [N, 3], as a structure from motion finds it: corners that have depth."""
    found = []
    for k in photos:
        grey, depth = cv2.cvtColor(place.images[k], cv2.COLOR_RGB2GRAY), place.depth[k]
        pixels = cv2.goodFeaturesToTrack(grey, CORNERS, 0.01, 5)
        if pixels is None:
            continue
        pixels = pixels.reshape(-1, 2).astype(np.float64)
        there = depth[pixels[:, 1].astype(int), pixels[:, 0].astype(int)].astype(np.float64)
        there *= np.exp(CORNER_NOISE * rng.normal(size=len(there)))
        wrong = rng.random(len(there)) < WRONG_CORNERS
        there[wrong] *= np.exp(0.3 * rng.normal(size=wrong.sum()))
        seen = there > 0
        found.append(place.camera(k).lifted(pixels[seen], there[seen]))
    return np.concatenate(found or [np.zeros((0, 3))]).astype(np.float32)


def _aside(camera: Camera, degrees: float, rng: np.random.Generator) -> Camera:
    turn = Rotation.from_rotvec(np.radians(degrees) * rng.normal(size=3)).as_matrix()
    return Camera.of_intrinsics(
        camera.width_px, camera.height_px, camera.intrinsics, turn @ camera.rotation, camera.centre
    )


def reconstruct(place: Place, folder: Path, rng: np.random.Generator) -> None:
    """Writes the folder atomically: `transforms.json`, photos and `cloud.ply`. Raises CaptureError."""
    views = len(place.images)
    taken = np.sort(rng.permutation(views)[: rng.integers(min(10, views), min(32, views - 1) + 1)]).tolist()
    faults = draw_photo_faults(rng)
    cameras = {k: _aside(place.camera(k), faults.aside_deg, rng) for k in taken}
    photos = {k: worn(place.images[k], faults, rng)[..., ::-1] for k in taken}
    quality = [cv2.IMWRITE_JPEG_QUALITY, faults.jpeg_quality]
    encoded = {k: cv2.imencode(".jpg", photo, quality)[1] for k, photo in photos.items()}
    read = [cv2.imdecode(encoded[k], cv2.IMREAD_COLOR) for k in taken]
    everywhere = [np.ones(image.shape[:2], bool) for image in read]
    points = int(np.exp(rng.uniform(np.log(150_000), np.log(800_000))))
    sparse = corners(place, taken, rng)
    _, xyz, rgb = dense_cloud([cameras[k] for k in taken], read, everywhere, sparse, points)
    partial = folder.with_name(f".{folder.name}.partial")
    shutil.rmtree(partial, ignore_errors=True)
    (partial / "images").mkdir(parents=True)
    entries = [frame_entry(k, cameras.get(k) or place.camera(k)) for k in range(views)]
    for k, entry in enumerate(entries):
        del entry["depth_file_path"]
        data = encoded[k].tobytes() if k in encoded else place.images.files[k].read_bytes()
        (partial / entry["file_path"]).write_bytes(data)
    write_ply(partial / "cloud.ply", xyz, rgb)
    table = {
        "camera_model": "PINHOLE",
        "ply_file_path": "cloud.ply",
        "frames": entries,
        "train_filenames": [entries[k]["file_path"] for k in taken],
        "test_filenames": [entry["file_path"] for k, entry in enumerate(entries) if k not in encoded],
        "up": [float(x) for x in place.up],
        "maquette": place.about | {"up_axis": [float(x) for x in place.up], "photos": faults.__dict__},
    }
    (partial / "transforms.json").write_text(json.dumps(table, indent=1) + "\n")
    partial.rename(folder)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("places", type=Path, help="a folder of rendered places")
    parser.add_argument("--out", type=Path, default=Path(".data/reconstructed/train"))
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    folders = sorted(path.parent for path in options.places.glob("*/transforms.json"))
    if not folders:
        raise SystemExit(f"{options.places} has no rendered places; python -m export.places.dataset makes them.")
    options.out.mkdir(parents=True, exist_ok=True)
    for folder in tqdm(folders, unit="place"):
        out = options.out / folder.name
        if out.exists():
            continue
        try:
            place = load_place(folder)
            number = int(place.about["seed"])
            reconstruct(place, out, np.random.default_rng([options.seed, number]))
        except (CaptureError, PlaceError) as error:
            tqdm.write(f"{folder.name} is left out: {error}")


if __name__ == "__main__":
    main()
