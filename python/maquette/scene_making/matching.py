"""Features of photos, and which photos show the same things, in COLMAP's database. A stopped run goes on there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from maquette.scene_making.photos import Photo

_NEIGHBOURS = 8
_EXHAUSTIVE = 60  # photos without an order: above this number each is matched like a frame of a film
_LONG_SIDE_PX = 640  # of the image that features are found in: cameras as exact as at 960, in half of the time
_FEATURES = 2500
_PEAK = 0.004  # COLMAP's default of 0.0067 finds half as many, too few on plain walls
_FOCAL = 0.9  # of the long side, where the file does not say it: between films and photos of phones
_PHOTOS_AT_A_TIME, _PAIRS_AT_A_TIME = 4, 40  # Ctrl-C and progress wait for the end of these


def pairs_to_match(count: int, ordered: bool) -> list[tuple[int, int]]:
    """Ordered photos: the next eight, and those at distances of powers of two. Otherwise all pairs."""
    if not ordered and count <= _EXHAUSTIVE:
        return [(a, b) for a in range(count) for b in range(a + 1, count)]
    steps = list(range(1, _NEIGHBOURS + 1))
    while 2 * steps[-1] < count:
        steps.append(2 * steps[-1])
    return [(a, a + step) for a in range(count) for step in steps if a + step < count]


def extract_features(
    database: Path, folder: Path, photos: Sequence[Photo], threads: int, progress: Callable[[float], None]
) -> None:
    """Raises OSError where the disk is full."""
    import pycolmap  # type: ignore[import-not-found,unused-ignore]

    options = pycolmap.FeatureExtractionOptions(num_threads=threads, use_gpu=False, max_image_size=_LONG_SIDE_PX)
    options.sift.max_num_features = _FEATURES
    options.sift.peak_threshold = _PEAK
    groups: dict[str, list[Photo]] = {}
    for photo in photos:
        groups.setdefault(photo.camera, []).append(photo)
    done = 0
    for group in groups.values():
        camera_id = -1
        for start in range(0, len(group), _PHOTOS_AT_A_TIME):
            progress(done / len(photos))
            part = group[start : start + _PHOTOS_AT_A_TIME]
            reader = pycolmap.ImageReaderOptions(default_focal_length_factor=_FOCAL)
            reader.existing_camera_id = camera_id
            pycolmap.extract_features(
                database,
                folder,
                image_names=[photo.file for photo in part],
                camera_mode=pycolmap.CameraMode.SINGLE,
                reader_options=reader,
                extraction_options=options,
            )
            camera_id = _camera_of(database, group[0])
            done += len(part)


def _camera_of(database: Path, photo: Photo) -> int:
    """The camera of a photo, with the focal length that its file says."""
    import pycolmap

    opened = pycolmap.Database.open(database)
    try:
        image = opened.read_image_with_name(photo.file)
        assert image is not None  # its features have been found
        camera_id = image.camera_id
        camera = opened.read_camera(camera_id)
        if photo.focal_px > 0 and not camera.has_prior_focal_length:
            camera.focal_length = photo.focal_px
            camera.has_prior_focal_length = True
            opened.update_camera(camera)
        return camera_id
    finally:
        opened.close()


def match(
    database: Path, photos: Sequence[Photo], ordered: bool, threads: int, progress: Callable[[float], None]
) -> None:
    """Matches pairs and checks them by two-view geometry."""
    import pycolmap

    options = pycolmap.FeatureMatchingOptions(num_threads=threads, use_gpu=False)
    pairs = pairs_to_match(len(photos), ordered)
    names = database.with_name("pairs.txt")
    for start in range(0, len(pairs), _PAIRS_AT_A_TIME):
        progress(start / len(pairs))
        part = pairs[start : start + _PAIRS_AT_A_TIME]
        names.write_text("".join(f"{photos[a].file} {photos[b].file}\n" for a, b in part))
        pairing = pycolmap.ImportedPairingOptions(match_list_path=names)
        pycolmap.match_image_pairs(database, matching_options=options, pairing_options=pairing)


class Matches:
    """Content of the database: keypoints of each photo, inliers of each pair, and homographies."""

    def __init__(self, database: Path, photos: Sequence[Photo]) -> None:
        import pycolmap

        opened = pycolmap.Database.open(database)
        try:
            files = {image.image_id: image.name for image in opened.read_all_images()}
            number = {photo.file: k for k, photo in enumerate(photos)}
            self.keypoints = [0] * len(photos)
            for image_id, file in files.items():
                self.keypoints[number[file]] = opened.num_keypoints_for_image(image_id)
            self.inliers: dict[tuple[int, int], int] = {}
            # The first photo and H, x' = H x in pixels, of pairs that show a plane, or anything from one place.
            self.homographies: list[tuple[int, np.ndarray]] = []
            panoramic = pycolmap.TwoViewGeometryConfiguration.PANORAMIC
            either = pycolmap.TwoViewGeometryConfiguration.PLANAR_OR_PANORAMIC
            for pair_id, geometry in _geometries(opened):
                if len(geometry.inlier_matches) == 0:
                    continue
                a, b = (number[files[k]] for k in pycolmap.pair_id_to_image_pair(pair_id))
                self.inliers[a, b] = len(geometry.inlier_matches)
                if geometry.config in (panoramic, either):
                    self.homographies.append((a, geometry.H))
        finally:
            opened.close()

    def groups(self) -> list[list[int]]:
        """Photos that connect by pairs, the largest group first."""
        group = list(range(len(self.keypoints)))
        for a, b in self.inliers:
            old, new = group[b], group[a]
            group = [new if g == old else g for g in group]
        found: dict[int, list[int]] = {}
        for k, g in enumerate(group):
            found.setdefault(g, []).append(k)
        return sorted(found.values(), key=len, reverse=True)

    def best_partner(self, k: int) -> int:
        """Inliers of the pair of photo k with most of them."""
        return max((count for pair, count in self.inliers.items() if k in pair), default=0)


def _geometries(database: Any) -> list[tuple[int, Any]]:
    ids, geometries = database.read_two_view_geometries()
    return list(zip(ids, geometries))  # noqa: B905
