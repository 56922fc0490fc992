"""Cameras of photos by COLMAP (pycolmap): mappers one after the other, and why a photo has no camera."""

from __future__ import annotations

import shutil
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from maquette.native import MaquetteError
from maquette.scene_making.matching import Matches, extract_features, match
from maquette.scene_making.photos import LeftOut, Photo

START_ANGLES_DEG = (16, 8, 4)  # between the first two photos; hand-held photos of something near need small ones
_ENOUGH = 0.95  # of the photos that connect
MIN_PHOTOS = 3
_MIN_ANGLE_DEG = 1.0  # median, between two cameras and a point: with less, depth is unknown
_FEW_KEYPOINTS = 100
_MANY_INLIERS = 60
_MOSTLY_TURNED = 0.7  # of the pairs
_ROTATION_ERROR = 0.02  # of R R^T - 1: 0.009 in a rendered film of a camera that turns


@dataclass(frozen=True, eq=False)
class Posed:
    """model: a pycolmap.Reconstruction. mapper: the one that made it, for the report."""

    model: Any
    left_out: list[LeftOut]
    mapper: str


def require_pycolmap() -> None:
    """Raises MaquetteError if pycolmap is not installed."""
    try:
        import pycolmap  # type: ignore[import-not-found,unused-ignore]
    except ImportError as error:
        raise MaquetteError(
            "A film or photos need pycolmap, which finds the cameras (Python 3.10 or newer, x86-64): pip install "
            f"'maquette[scenes]' ({error})",
            "MAQ_ERROR_NOT_FOUND",
        ) from None
    pycolmap.logging.minloglevel = pycolmap.logging.Level.FATAL.value
    pycolmap.set_random_seed(0)


def pose(
    folder: Path, photos: Sequence[Photo], ordered: bool, source: Path, threads: int,
    progress: Callable[[float, str], None],
) -> Posed:  # fmt: skip
    """folder/photos -> cameras. Leaves folder/database.db behind, where a stopped run goes on. Raises MaquetteError
    with advice where fewer than MIN_PHOTOS find their place."""
    if len(photos) < MIN_PHOTOS:
        raise MaquetteError(
            f"{source} gives {_count(len(photos))}; a scene needs at least {MIN_PHOTOS}, and 20 to 50 are better. "
            "Take them from places some steps apart, each showing most of what the one before shows.",
            "MAQ_ERROR_UNREADABLE",
        )
    database = folder / "database.db"
    images = folder / "photos"
    extract_features(database, images, photos, threads, lambda done: progress(0.4 * done, "finding features"))
    match(database, photos, ordered, threads, lambda done: progress(0.4 + 0.35 * done, "matching photos"))
    matches = Matches(database, photos)
    connected = len(matches.groups()[0])
    if connected >= MIN_PHOTOS and turns_on_the_spot(matches, photos):
        raise MaquetteError(_turned(source), "MAQ_ERROR_UNREADABLE")
    best, mapper = None, ""
    if connected >= MIN_PHOTOS:
        for name, run in _mappers(database, images, folder / "models", threads, len(photos), progress):
            model = _largest(run())
            if model is not None and (best is None or model.num_reg_images() > best.num_reg_images()):
                best, mapper = model, name
            if best is not None and best.num_reg_images() >= _ENOUGH * connected:
                break
    shutil.rmtree(folder / "models", ignore_errors=True)
    if best is None or best.num_reg_images() < MIN_PHOTOS:
        raise MaquetteError(_why_none(source, photos, matches, best), "MAQ_ERROR_UNREADABLE")
    angle = median_angle_deg(best)
    if angle < _MIN_ANGLE_DEG:
        raise MaquetteError(_turned(source), "MAQ_ERROR_UNREADABLE")
    return Posed(best, _reasons(photos, matches, best), mapper)


def turns_on_the_spot(matches: Matches, photos: Sequence[Photo]) -> bool:
    """Whether nearly all pairs are explained by rotations, x' = K R K^-1 x, with one focal length. A plane seen from
    several places has homographies, too, but of other matrices."""
    if len(matches.homographies) < _MOSTLY_TURNED * len(matches.inliers):
        return False
    worst = []
    for focal in np.geomspace(0.4, 3, 60):
        errors = []
        for k, homography in matches.homographies:
            width, height = photos[k].width, photos[k].height
            size = focal * max(width, height)
            camera = np.array([[size, 0, width / 2], [0, size, height / 2], [0, 0, 1.0]])
            turn = np.linalg.inv(camera) @ homography @ camera
            turn /= np.cbrt(np.linalg.det(turn))
            errors.append(np.linalg.norm(turn @ turn.T - np.eye(3)))
        worst.append(np.median(errors))
    return bool(min(worst) < _ROTATION_ERROR)


def _turned(source: Path) -> str:
    return (
        f"The camera of {source} turns on the spot, so that its photos show no depth. Walk sideways while you film; do "
        "not only turn."
    )


def _mappers(
    database: Path, images: Path, out: Path, threads: int, count: int, progress: Callable[[float, str], None]
) -> list[tuple[str, Callable[[], dict[int, Any]]]]:  # fmt: skip
    def incremental(angle_deg: int) -> dict[int, Any]:
        import pycolmap

        options = pycolmap.IncrementalPipelineOptions(num_threads=threads, random_seed=0, min_model_size=MIN_PHOTOS)
        options.mapper.init_min_tri_angle = angle_deg
        posed = 2
        token, stopped = pycolmap.CancellationToken(), []

        def one_more() -> None:
            nonlocal posed
            posed += 1
            try:
                progress(0.75 + 0.25 * min(1.0, posed / count), "finding cameras")
            except BaseException as error:  # Ctrl-C, too: no exception may pass through the mapper
                stopped.append(error)
                token.cancel()

        folder = _fresh(out)
        try:
            models = pycolmap.incremental_mapping(
                database, images, folder, options=options, next_image_callback=one_more, cancellation_token=token
            )
        except InterruptedError:  # by the token
            models = {}
        if stopped:
            raise stopped[0]
        return models

    def global_mapper() -> dict[int, Any]:
        import pycolmap

        options = pycolmap.GlobalPipelineOptions(num_threads=threads, random_seed=0)
        folder = _fresh(out)
        return _in_thread(
            lambda: pycolmap.global_mapping(database, images, folder, options=options),
            lambda: progress(0.9, "finding cameras"),
        )

    def at(angle: int) -> Callable[[], dict[int, Any]]:
        return lambda: incremental(angle)

    by_angle = [(f"incremental, start angle {angle} degrees", at(angle)) for angle in START_ANGLES_DEG]
    return [*by_angle, ("global", global_mapper)]


def _in_thread(work: Callable[[], Any], wait: Callable[[], None]) -> Any:
    """Runs a long call that cannot be cancelled; Ctrl-C does not wait for its end."""
    results: list[Any] = []
    errors: list[BaseException] = []

    def run() -> None:
        try:
            results.append(work())
        except BaseException as error:
            errors.append(error)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    while thread.is_alive():
        thread.join(0.1)
        wait()
    if errors:
        raise errors[0]
    return results[0]


def _fresh(folder: Path) -> Path:
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    return folder


def _largest(models: dict[int, Any]) -> Any:
    return max(models.values(), key=lambda model: model.num_reg_images(), default=None)


def median_angle_deg(model: Any) -> float:
    """Median over points of the largest angle between two of their cameras, degrees."""
    centres = {k: image.projection_center() for k, image in model.images.items() if image.has_pose}
    points = list(model.points3D.values())
    angles = []
    for point in points[:: max(1, len(points) // 500)]:
        rays = np.array([centres[e.image_id] - point.xyz for e in point.track.elements if e.image_id in centres])
        rays /= np.maximum(np.linalg.norm(rays, axis=1, keepdims=True), 1e-12)
        angles.append(np.degrees(np.arccos(np.clip((rays @ rays.T).min(), -1, 1))))
    return float(np.median(angles)) if angles else 0.0


def _count(photos: int) -> str:
    return {0: "no photo", 1: "1 photo"}.get(photos, f"{photos} photos")


def _why_none(source: Path, photos: Sequence[Photo], matches: Matches, best: Any) -> str:
    group = matches.groups()[0]
    if max(matches.keypoints) < _FEW_KEYPOINTS:
        return (
            f"The photos of {source} show too little to recognise: at most {max(matches.keypoints)} features in one. "
            "Film something with texture, in sharp focus and even light."
        )
    if len(group) < MIN_PHOTOS:
        return (
            f"No {MIN_PHOTOS} of the {len(photos)} photos of {source} show the same thing. Take photos that overlap by "
            "two thirds, a step apart."
        )
    found = best.num_reg_images() if best is not None else 0
    return (
        f"Only {found} of the {len(photos)} photos of {source} find their place. Move slowly around one thing or "
        "through one room, with even light, so that neighbouring photos overlap by two thirds."
    )


def _reasons(photos: Sequence[Photo], matches: Matches, model: Any) -> list[LeftOut]:
    """Why photos are not in the model."""
    posed = {image.name for image in model.images.values() if image.has_pose}
    placed = {k for k, photo in enumerate(photos) if photo.file in posed}
    groups = matches.groups()
    left_out = []
    for k, photo in enumerate(photos):
        if k in placed:
            continue
        group = next(group for group in groups if k in group)
        inliers = matches.best_partner(k)
        if matches.keypoints[k] < _FEW_KEYPOINTS:
            reason = f"shows too little to recognise ({matches.keypoints[k]} features): blurred, dark or plain"
        elif len(group) == 1:
            reason = "shows nothing that another photo shows: blurred, or from too far away from the others"
        elif not placed & set(group):
            reason = f"one of {len(group)} photos that show another place than the rest, or the same after a cut"
        elif inliers < _MANY_INLIERS:
            reason = f"shares only {inliers} points with the photo that fits best: take one more in between"
        else:
            reason = "contradicts the others: moving things, a changed zoom, or a mirror"
        left_out.append(LeftOut(photo.origin, reason))
    return left_out
