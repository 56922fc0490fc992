"""Where photos were taken from: structure from motion by COLMAP (pycolmap), and which way is up there."""

from __future__ import annotations

import shutil
from pathlib import Path

import cv2
import numpy as np

from export.captures.originals import Photo

JPEG_QUALITY = 95
_LEVELLING = 0.002  # of the cameras' number; see `up_of_cameras`


class CaptureError(RuntimeError):
    """Photos could not be posed, or not made dense; the sentence says why."""


def write_photos(photos: list[Photo], folder: Path, alone: bool) -> list[str]:
    """Writes folder/images and folder/masks; gives the photos' names."""
    names = [f"{k:03d}.jpg" for k in range(len(photos))]
    for kind in ("images", "masks"):
        (folder / kind).mkdir(parents=True)
    for name, photo in zip(names, photos, strict=True):
        image = cv2.bitwise_and(photo.image, photo.image, mask=photo.mask) if alone else photo.image
        written = cv2.imwrite(str(folder / "images" / name), image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
        if not (written and cv2.imwrite(str(folder / "masks" / f"{name}.png"), photo.mask)):
            raise OSError(f"{folder / 'images' / name} or its mask could not be written: is the disk full?")
    return names


def pose(folder: Path, threads: int):
    """folder/images within folder/masks -> pycolmap.Reconstruction, also written to folder/sparse/0. One camera took
    all. Raises CaptureError where fewer than two thirds of the photos find their place."""
    import pycolmap  # of the extra `captures`

    pycolmap.logging.minloglevel = pycolmap.logging.Level.ERROR.value
    pycolmap.set_random_seed(0)
    database = folder / "database.db"
    extraction = pycolmap.FeatureExtractionOptions(num_threads=threads, use_gpu=False)
    extraction.sift.peak_threshold = 0.004  # finds twice as many as the default, for small and faint prints
    matching = pycolmap.FeatureMatchingOptions(num_threads=threads, use_gpu=False)
    mapping = pycolmap.IncrementalPipelineOptions(num_threads=threads, random_seed=0)
    masks = pycolmap.ImageReaderOptions(mask_path=folder / "masks")
    pycolmap.extract_features(
        database,
        folder / "images",
        camera_mode=pycolmap.CameraMode.SINGLE,
        reader_options=masks,
        extraction_options=extraction,
    )
    pycolmap.match_exhaustive(database, matching_options=matching)
    models = pycolmap.incremental_mapping(database, folder / "images", folder / "models", options=mapping)
    best = max(models.values(), key=lambda model: model.num_reg_images(), default=None)
    wanted = len(list((folder / "images").iterdir()))
    found = best.num_reg_images() if best else 0
    if found < wanted * 2 / 3:
        raise CaptureError(f"Only {found} of the {wanted} photos in {folder / 'images'} found their place.")
    sparse = folder / "sparse" / "0"
    sparse.mkdir(parents=True)
    best.write(sparse)
    shutil.rmtree(folder / "models")
    database.unlink()
    return best


def up_of_cameras(rotations: np.ndarray) -> np.ndarray:
    """The direction [3] of length 1 that is up for cameras with `rotations` [N, 3, 3], world to camera.

    Cameras are held level more than they are held horizontally: x of all of them is at right angles to up. The mean of
    what is up in the images, tilted where all look down from one side, is therefore turned to be so by least squares:
    (sum x x^T + small) up = mean up. The same as sdk/src/scene/capture/scene_up.cpp.
    """
    across, up = rotations[:, 0], -rotations[:, 1].sum(0)
    up = np.linalg.solve(across.T @ across + _LEVELLING * len(rotations) * np.eye(3), up)
    return up / np.linalg.norm(up)
