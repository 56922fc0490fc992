"""Heads from photos against the true ones: distances in mm by seconds of fitting, beside the mean head.

    python -m benchmarks.heads.quality --data .data/heads --heads 20 --seconds 0 0.5 1 2 5 10

In: `make build`, the bundle, pictures and points of test heads (`export.heads.view_shards test`, `export.heads.points
test`), what they are made from (`export.people.assets`), heads of another maker (`benchmarks.heads.other_heads`),
photos without people (`export.photos backgrounds`). Out: tables (Markdown) and all figures (JSON). The library is given
the head's box, and its focal length only with --known-focal.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
from tqdm import tqdm

from benchmarks.heads import report
from benchmarks.heads.distances import Distances, Triangles, measure
from benchmarks.heads.fitted import angle_deg, cameras_of, stored, triangles_of
from benchmarks.heads.mean_head import read_mean_head
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
from export.evaluation.heads_api import HeadBuilder, MaquetteError
from export.evaluation.machine import describe_machine
from export.heads.made_heads import make_maker

ONE, THREE, OTHER = "one photo", "three photos", "other maker's heads, one photo"
BUNDLE, DATA, BACKGROUNDS = Path("sdk/models/heads-int8"), Path(".data/heads"), Path(".data/backgrounds/test")
FIGURES = Path("build/benchmarks/heads.json")
SECONDS = (0.0, 0.5, 1.0, 2.0, 5.0, 10.0)


def photos_of(head: TrueHead, numbers: Iterable[int], backgrounds: PhotoBackgrounds) -> list[Photo]:
    return [photo_of(head.pictures, k, backgrounds, generator(head.name, k)) for k in numbers]


def measure_head(
    builder: HeadBuilder,
    head: TrueHead,
    photos: Sequence[Photo],
    mean: Distances,
    seconds: Sequence[float],
    known_focal: bool = False,
) -> list[dict]:
    """One row for each time of fitting. A row of a head that was not found has `missing`, which says why."""
    about = {
        "head": head.name,
        "yaw_deg": round(yaw_pitch_deg(photos[0].camera.rotation)[0], 1),
        "head_px": float(np.ptp(photos[0].box.reshape(2, 2), 0).max()),
        "mean_face_mm": mean.face_mm,
        "mean_head_mm": mean.head_mm,
        "mean_unaligned_mm": mean.unaligned_mm,
        "mean_normals_deg": mean.normals_deg,
    }
    try:
        builder.clear()
        for photo in photos:
            builder.add_photo(photo.rgb, photo.box, photo.camera.fx_px if known_focal else 0)
        return [about | {"asked_s": asked} | fitted(builder, head, photos, asked) for asked in seconds]
    except MaquetteError as error:
        return [about | {"asked_s": asked, "missing": str(error)} for asked in seconds]


def fitted(builder: HeadBuilder, head: TrueHead, photos: Sequence[Photo], asked_s: float) -> dict:
    """Figures of a fit to the photos that the builder has. Raises MaquetteError."""
    with builder.fit(asked_s) as result:
        start = time.perf_counter()
        mesh = result.mesh()
        mesh_ms = 1000 * (time.perf_counter() - start)
        cameras = cameras_of(stored(result))
    stats = builder.stats
    used = [photo for k, photo in enumerate(photos) if builder.photo(k).is_used]
    pairs = list(zip(cameras, used, strict=True))
    return asdict(measure(triangles_of(mesh), head.true)) | {
        "fit_s": stats.total_ms / 1000,
        "steps": stats.step_count,
        "encode_ms": stats.encode_ms,
        "mesh_ms": mesh_ms,
        "used_photos": stats.used_photo_count,
        "focal_ratio": float(np.median([camera.fx_px / photo.camera.fx_px for camera, photo in pairs])),
        # Frames of heads of another maker lie otherwise in their heads.
        "rotation_deg": float(np.median([angle_deg(camera.rotation, photo.camera.rotation) for camera, photo in pairs]))
        if head.true.normals is not None
        else None,
    }


def measure_set(
    builder: HeadBuilder,
    name: str,
    heads: Sequence[tuple[TrueHead, Sequence[int]]],
    backgrounds: PhotoBackgrounds,
    mean: Triangles,
    seconds: Sequence[float],
    known_focal: bool = False,
) -> list[dict]:
    """heads: each with the numbers of its pictures."""
    rows = []
    for head, numbers in tqdm(heads, desc=name, unit="head", disable=None):
        photos = photos_of(head, numbers, backgrounds)
        of_mean = measure(mean, head.true)
        rows += [{"set": name} | row for row in measure_head(builder, head, photos, of_mean, seconds, known_focal)]
    return rows


def sets_of(options: argparse.Namespace) -> dict[str, list[tuple[TrueHead, Sequence[int]]]]:
    """The sets that are asked for and there, with the pictures that each head is fitted to."""
    made, found = read_made_heads(options.data, options.heads, make_maker()), {}
    if "one" in options.sets:
        found[ONE] = [(head, [k]) for head in made if (k := head.front()) is not None]
    if "three" in options.sets:
        found[THREE] = [(head, three) for head in made if (three := head.front_and_sides()) is not None]
    if "other" in options.sets:
        others = read_other_heads(options.data, options.heads)
        found[OTHER] = [(head, [k]) for head in others if (k := head.front()) is not None]
    return {name: heads for name, heads in found.items() if heads}


def parser_of(description: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=DATA, help=f"views, points and other heads; default: {DATA}")
    parser.add_argument("--backgrounds", type=Path, default=BACKGROUNDS, help=f"default: {BACKGROUNDS}")
    parser.add_argument("--bundles", type=Path, nargs="+", default=[BUNDLE], metavar="BUNDLE",
                        help=f"the first is reported, others beside it; default: {BUNDLE}")  # fmt: skip
    parser.add_argument("--heads", type=int, default=20, help="of each set, at most")
    parser.add_argument("--seconds", type=float, nargs="+", default=SECONDS, help="times of fitting")
    parser.add_argument("--at", type=float, default=2.0, help="the time whose figures are compared with targets")
    parser.add_argument("--sets", nargs="+", choices=("one", "three", "other"), default=("one", "three", "other"))
    parser.add_argument("--known-focal", action="store_true", help="give the library the focal length")
    parser.add_argument("--threads", type=int, default=0, help="0: the library chooses")
    parser.add_argument("--out", type=Path, default=Path("build/benchmarks/heads.md"), help="the tables")
    parser.add_argument("--figures", type=Path, default=FIGURES, help=f"all figures; default: {FIGURES}")
    return parser


def parsed(arguments: Sequence[str] | None = None, parser: argparse.ArgumentParser | None = None) -> argparse.Namespace:
    options = (parser or parser_of(__doc__)).parse_args(arguments)
    if options.at not in options.seconds:
        options.at = min(options.seconds, key=lambda asked: abs(asked - options.at))
    return options


def run(options: argparse.Namespace) -> dict:
    """Measures all that `parsed` says, and writes the figures."""
    sets, backgrounds, rows = sets_of(options), PhotoBackgrounds(options.backgrounds), []
    for bundle in options.bundles:
        mean = read_mean_head(bundle)
        with HeadBuilder(bundle, threads=options.threads) as builder:
            for name, heads in sets.items():
                found = measure_set(
                    builder, name, heads, backgrounds, mean, sorted(options.seconds), options.known_focal
                )
                rows += [{"bundle": bundle.name} | row for row in found]
    measured = {
        "machine": describe_machine(),
        "bundles": [bundle.name for bundle in options.bundles],
        "at_s": options.at,
        "known_focal": options.known_focal,
        "rows": [{key: _short(value) for key, value in row.items()} for row in rows],
    }
    options.figures.parent.mkdir(parents=True, exist_ok=True)
    options.figures.write_text(json.dumps(measured, indent=1) + "\n")
    return measured


def _short(value: object) -> object:
    """Numbers with the digits that mean something."""
    return float(f"{value:.5g}") if isinstance(value, float) else value


def main(arguments: Sequence[str] | None = None) -> None:
    options = parsed(arguments)
    text = report.page(run(options))
    options.out.parent.mkdir(parents=True, exist_ok=True)
    options.out.write_text(text)
    print(text)


if __name__ == "__main__":
    main()
