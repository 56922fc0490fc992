"""Measures heads from photos against the true heads: distances in mm by seconds of fitting, beside the mean head.

    python -m benchmarks.heads.quality --data .data/heads --heads 20 --seconds 0 0.5 1 2 5 10

In: `make build`, the bundle, images and points of test heads (`export.heads.view_shards test`, `export.heads.points
test`), their assets (`export.people.assets`), heads of another source (`benchmarks.heads.other_heads`),
photos without people (`export.photos backgrounds`). Out: tables (Markdown) and all metrics (JSON). The library is given
the head's box, and its focal length only with --known-focal.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from maquette import HeadBuilder, MaquetteError
from tqdm import tqdm

from benchmarks.heads import report
from benchmarks.heads.distances import Similarity, Triangles, aligned, inner_face_mm, measure
from benchmarks.heads.drawing import DrawnMesh
from benchmarks.heads.face_mesh import FaceMeshes
from benchmarks.heads.fitted import angle_deg, cameras_of, triangles_of
from benchmarks.heads.linear_head import LinearHeads, read_visible
from benchmarks.heads.mean_head import read_mean_head
from benchmarks.heads.new_views import View, true_views, view_errors, with_photo
from benchmarks.heads.photos import (
    Photo,
    PhotoBackgrounds,
    TrueHead,
    generator,
    photo_of,
    read_made_heads,
    read_other_heads,
    yaw_pitch_deg,
)  # fmt: skip
from benchmarks.heads.targets import ONE, OTHER, THREE
from export.evaluation.machine import describe_machine
from export.heads.surface import HeadMaker
from export.heads.synthetic_heads import make_maker
from export.photos.packages import PackageError
from export.scenes.perceptual import Perceptual, load_perceptual

KNOWN, EIGHT = "one photo, focal length known", "eight photos"
BUNDLE, DATA, BACKGROUNDS = Path("sdk/models/heads-int8"), Path(".data/heads"), Path(".data/backgrounds/test")
METRICS = Path("build/benchmarks/heads.json")
PERCEPTUAL = Path(".data/teachers/backbone.pt")
TEXTURE_PX = 512  # pixels a side
SECONDS = (0.0, 0.5, 1.0, 2.0, 5.0, 10.0)


@dataclass(frozen=True, eq=False)
class HeadSet:
    """Heads, each with the numbers of its images for the fit, and the times of fitting."""

    name: str
    heads: Sequence[tuple[TrueHead, Sequence[int]]]
    seconds: Sequence[float]
    known_focal: bool = False


@dataclass(frozen=True, eq=False)
class Baselines:
    """Baselines besides the mean head; None is left out. maker draws new views, perceptual compares them."""

    linear: LinearHeads | None = None
    face: FaceMeshes | None = None
    maker: HeadMaker | None = None
    perceptual: Perceptual | None = None


NOTHING_ELSE = Baselines()


def photos_of(head: TrueHead, numbers: Iterable[int], backgrounds: PhotoBackgrounds) -> list[Photo]:
    return [photo_of(head.pictures, k, backgrounds, generator(head.name, k)) for k in numbers]


@dataclass(frozen=True, eq=False)
class Case:
    """Photos of a head, and its ground truth. seen: true points that the photos show; views: new views, which
    `perceptual` compares too."""

    head: TrueHead
    photos: Sequence[Photo]
    seen: np.ndarray | None = None
    views: Sequence[View] = ()
    perceptual: Perceptual | None = None

    @staticmethod
    def of(head: TrueHead, numbers: Sequence[int], backgrounds: PhotoBackgrounds, others: Baselines) -> Case:
        photos = photos_of(head, numbers, backgrounds)
        seen = head.seen_by([photo.camera for photo in photos])
        drawable = others.maker is not None and head.true.mesh is not None and len(photos) == 1
        views = true_views(others.maker, head.name, numbers[0], photos[0].camera) if drawable else ()
        return Case(head, photos, seen, views, others.perceptual)

    def view_errors(self, drawn: DrawnMesh, to_mesh: Similarity) -> dict[str, float]:
        """Returns `view_...` of a mesh."""
        found = view_errors(drawn, to_mesh, self.views, self.perceptual)
        return {f"view_{key}": value for key, value in found.items()}


def measure_baselines(case: Case, mean: Triangles, others: Baselines, known_focal: bool = False) -> dict:
    """Returns `mean_...` of the mean head; for one photo also `linear_...` and `face_mesh_inner_face_mm`."""
    true, photo = case.head.true, case.photos[0]
    found = {f"mean_{key}": value for key, value in asdict(measure(mesh=mean, true=true, seen=case.seen)).items()}
    if case.views:
        to_mean = aligned(mean, true.points)
        errors = case.view_errors(with_photo(mean, to_mean, photo), to_mean)
        found |= {f"mean_{key}": value for key, value in errors.items()}
    if len(case.photos) > 1:
        return found
    if others.linear:
        mesh = others.linear.mesh(photo, photo.camera.fx_px if known_focal else 0)
        if mesh:
            found |= {f"linear_{key}": value for key, value in asdict(measure(mesh, true, case.seen)).items()}
    if others.face and true.is_inner_face is not None:
        mesh = others.face.mesh(photo.rgb, photo.box)
        found["face_mesh_inner_face_mm"] = inner_face_mm(mesh, true) if mesh else None
    return found


def add_photos(builder: HeadBuilder, photos: Sequence[Photo], known_focal: bool) -> None:
    """Replaces the photos of the builder."""
    builder.clear()
    for photo in photos:
        builder.add_photo(photo.rgb, photo.box, focal_px=photo.camera.fx_px if known_focal else None)


def measure_head(
    builder: HeadBuilder, case: Case, baselines: dict, seconds: Sequence[float], known_focal: bool = False
) -> list[dict]:
    """Returns one row for each time of fitting. The row of a head that was not found has `missing` with the reason."""
    photos = case.photos
    about = {
        "head": case.head.name,
        "yaw_deg": round(yaw_pitch_deg(photos[0].camera.rotation)[0], 1),
        "head_px": float(np.ptp(photos[0].box.reshape(2, 2), 0).max()),
        **case.head.traits,
        **baselines,
    }
    try:
        add_photos(builder, photos, known_focal)
        return [about | {"asked_s": asked} | fitted(builder, case, asked) for asked in seconds]
    except MaquetteError as error:
        return [about | {"asked_s": asked, "missing": str(error)} for asked in seconds]


@dataclass(frozen=True, eq=False)
class Painter:
    """Draws new views: a builder that makes textures, and its time of fitting."""

    builder: HeadBuilder
    at_s: float


def measure_views(painter: Painter, case: Case, known_focal: bool = False) -> dict:
    """Returns `view_...` of the fitted head with its texture, and `coloured_view_...` without; nothing if no head is
    found."""
    try:
        add_photos(painter.builder, case.photos, known_focal)
        with painter.builder.fit(painter.at_s) as result:
            mesh = result.mesh("all")
    except MaquetteError:
        return {}
    to_mesh = aligned(triangles_of(mesh), case.head.true.points)
    coloured = case.view_errors(DrawnMesh.of(mesh, with_texture=False), to_mesh)
    return case.view_errors(DrawnMesh.of(mesh), to_mesh) | {f"coloured_{key}": value for key, value in coloured.items()}


def fitted(builder: HeadBuilder, case: Case, asked_s: float) -> dict:
    """Returns the metrics of a fit to the builder's photos. Raises MaquetteError."""
    true = case.head.true
    with builder.fit(asked_s) as result:
        start = time.perf_counter()
        mesh = result.mesh("all")
        mesh_ms = 1000 * (time.perf_counter() - start)
        cameras = cameras_of(result)
    stats = builder.stats
    used = [photo for photo, found in zip(case.photos, builder.photos, strict=True) if found.is_used]
    pairs = list(zip(cameras, used, strict=True))
    triangles = triangles_of(mesh)
    found = asdict(measure(triangles, true, case.seen))
    return found | {
        "fit_s": stats["total_ms"] / 1000,
        "steps": stats["step_count"],
        "encode_ms": stats["encode_ms"],
        "mesh_ms": mesh_ms,
        "used_photos": stats["used_photo_count"],
        "focal_ratio": float(np.median([camera.fx_px / photo.camera.fx_px for camera, photo in pairs])),
        # Heads of another source have another frame.
        "rotation_deg": float(np.median([angle_deg(camera.rotation, photo.camera.rotation) for camera, photo in pairs]))
        if true.normals is not None
        else None,
    }


def measure_set(
    builder: HeadBuilder, own: HeadSet, backgrounds: PhotoBackgrounds, mean: Triangles,
    others: Baselines = NOTHING_ELSE, painter: Painter | None = None,
) -> list[dict]:  # fmt: skip
    """Returns the rows of a set; rows at the painter's time have new views if they can be drawn."""
    rows = []
    for head, numbers in tqdm(own.heads, desc=own.name, unit="head", disable=None):
        case = Case.of(head, numbers, backgrounds, others)
        beside = measure_baselines(case, mean, others, own.known_focal)
        of_head = measure_head(builder, case, beside, own.seconds, own.known_focal)
        views = measure_views(painter, case, own.known_focal) if painter and case.views else {}
        for row in of_head:
            if painter and row["asked_s"] == painter.at_s and "missing" not in row:
                row |= views
            rows.append({"set": own.name} | row)
    return rows


def sets_of(options: argparse.Namespace, maker: HeadMaker | None = None) -> list[HeadSet]:
    """Returns the requested sets that exist, with the images for each head's fit."""
    made, seconds = read_made_heads(options.data, options.heads, maker), sorted(options.seconds)
    front = [(head, [k]) for head in made if (k := head.front()) is not None]
    found = []
    if "one" in options.sets:
        found.append(HeadSet(ONE, front, seconds, options.known_focal))
        if not options.known_focal:
            found.append(HeadSet(KNOWN, front, [options.at], True))
    if "three" in options.sets:
        three = [(head, numbers) for head in made if (numbers := head.front_and_sides()) is not None]
        eight = [(head, numbers) for head in made if (numbers := head.all_around(8)) is not None]
        found += [HeadSet(THREE, three, seconds, options.known_focal), HeadSet(EIGHT, eight, [options.at])]
    if "other" in options.sets:
        others = read_other_heads(options.data, options.heads)
        heads = [(head, [k]) for head in others if (k := head.front()) is not None]
        found.append(HeadSet(OTHER, heads, seconds, options.known_focal))
    return [own for own in found if own.heads]


def baselines_of(options: argparse.Namespace, bundle: Path, maker: HeadMaker) -> Baselines:
    """Returns the baselines with data; a warning names the others."""
    linear = face = None
    try:
        linear = LinearHeads(bundle, maker, read_visible(options.data / "points/train"))
    except (FileNotFoundError, ValueError) as error:
        print(f"No linear head: {error}", file=sys.stderr)
    try:
        face = FaceMeshes()
    except (ImportError, PackageError) as error:
        print(f"No mesh of MediaPipe's face network: {error} (scripts/make-venv.sh teachers)", file=sys.stderr)
    perceptual = load_perceptual(PERCEPTUAL) if PERCEPTUAL.exists() else None
    if not perceptual:
        print(f"No distance by features: {PERCEPTUAL} is missing (python -m export.teachers)", file=sys.stderr)
    return Baselines(linear, face, maker, perceptual)


def parser_of(description: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=DATA, help=f"views, points and other heads; default: {DATA}")
    parser.add_argument("--backgrounds", type=Path, default=BACKGROUNDS, help=f"default: {BACKGROUNDS}")
    parser.add_argument("--bundles", type=Path, nargs="+", default=[BUNDLE], metavar="BUNDLE",
                        help=f"the first is reported, the others are compared with it; default: {BUNDLE}")  # fmt: skip
    parser.add_argument("--heads", type=int, default=20, help="maximum number of heads of each set")
    parser.add_argument("--seconds", type=float, nargs="+", default=SECONDS, help="times of fitting")
    parser.add_argument("--at", type=float, default=2.0, help="the time whose metrics are compared with targets")
    parser.add_argument("--sets", nargs="+", choices=("one", "three", "other"), default=("one", "three", "other"))
    parser.add_argument("--known-focal", action="store_true", help="give the library the focal length")
    parser.add_argument("--threads", type=int, default=0, help="0: the library chooses")
    parser.add_argument("--out", type=Path, default=Path("build/benchmarks/heads.md"), help="the tables")
    parser.add_argument("--metrics", type=Path, default=METRICS, help=f"all metrics; default: {METRICS}")
    return parser


def parsed(arguments: Sequence[str] | None = None, parser: argparse.ArgumentParser | None = None) -> argparse.Namespace:
    options = (parser or parser_of(__doc__)).parse_args(arguments)
    if options.at not in options.seconds:
        options.at = min(options.seconds, key=lambda asked: abs(asked - options.at))
    return options


def run(options: argparse.Namespace) -> dict:
    """Measures with the options, and writes the metrics."""
    maker = make_maker()
    sets, backgrounds, rows = sets_of(options, maker), PhotoBackgrounds(options.backgrounds), []
    for number, bundle in enumerate(options.bundles):
        mean, others = read_mean_head(bundle), baselines_of(options, bundle, maker) if not number else NOTHING_ELSE
        with (
            HeadBuilder(bundle, texture=False, threads=options.threads) as builder,
            HeadBuilder(bundle, threads=options.threads, texture_px=TEXTURE_PX) as of_textures,
        ):
            painter = Painter(of_textures, options.at) if not number else None
            for own in sets:
                found = measure_set(builder, own, backgrounds, mean, others, painter)
                rows += [{"bundle": bundle.name} | row for row in found]
    measured = {
        "machine": describe_machine(),
        "bundles": [bundle.name for bundle in options.bundles],
        "at_s": options.at,
        "known_focal": options.known_focal,
        "rows": shortened(rows),
    }
    options.metrics.parent.mkdir(parents=True, exist_ok=True)
    options.metrics.write_text(json.dumps(measured, indent=1) + "\n")
    return measured


def shortened(value: Any) -> Any:
    """Rounds numbers to significant digits."""
    if isinstance(value, dict):
        return {key: shortened(part) for key, part in value.items()}
    if isinstance(value, list):
        return [shortened(part) for part in value]
    return float(f"{value:.5g}") if isinstance(value, float) else value


def main(arguments: Sequence[str] | None = None) -> None:
    options = parsed(arguments)
    text = report.page(run(options))
    options.out.parent.mkdir(parents=True, exist_ok=True)
    options.out.write_text(text)
    print(text)


if __name__ == "__main__":
    main()
