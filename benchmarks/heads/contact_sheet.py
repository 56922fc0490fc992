"""Draws a contact sheet of heads: photo, mesh in the photo's pose, its normals, two new views, and the same of the
truth.

    python -m benchmarks.heads.quality
    python -m benchmarks.heads.contact_sheet --out build/benchmarks/heads-sheet.jpg

Each set with one photo shows its best, median and worst head by the distance that `quality.py` measured (whole head,
ratio to the mean head). Real photographs of faces follow, which have no truth (`export.photos people`,
`export.heads.photos.faces test`). Needs the assets of synthetic heads: `python -m export.people.assets`.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from maquette import Frame, HeadBuilder, MaquetteError
from tqdm import tqdm

from benchmarks.heads import drawing
from benchmarks.heads.drawing import DrawnMesh, beside, framed
from benchmarks.heads.fitted import cameras_of
from benchmarks.heads.photos import PhotoBackgrounds, TrueHead, generator, photo_of, read_made_heads, read_other_heads
from benchmarks.heads.quality import BACKGROUNDS, BUNDLE, DATA, METRICS, ONE, OTHER
from export.camera import Camera
from export.evaluation.paint import labelled_tile, mosaic
from export.heads.head_shards import CROP_SIDES
from export.heads.synthetic_heads import make_maker

TILE_PX = 224
PHOTOS = Path(".data/photos/test")
COLUMNS = (
    "photo",
    "mesh over it",
    "normals",
    "45 deg to the left",
    "to the right",
    "true, to the left",
    "to the right",
)


@dataclass(frozen=True, eq=False)
class Case:
    """One row. truth: draws the true head from a camera; None if the true head is unknown."""

    label: str
    rgb: np.ndarray
    box: np.ndarray | None
    truth: Callable[[Camera], np.ndarray] | None = None


def chosen(rows: Sequence[Mapping], name: str, at_s: float) -> list[tuple[str, Mapping]]:
    """Returns the best, the median and the worst head of a set; fewer for a smaller set."""
    own = [row for row in rows if row["set"] == name and row["asked_s"] == at_s and "missing" not in row]
    own.sort(key=lambda row: row["head_mm"] / row["mean_head_mm"])
    if len(own) < 3:
        return list(zip(("best", "worst"), own, strict=False))
    return [("best", own[0]), ("median", own[(len(own) - 1) // 2]), ("worst", own[-1])]


def row_of(builder: HeadBuilder, case: Case, seconds: float) -> list[np.ndarray]:
    """Returns the tiles of one row, RGB; if the head is not found, only the photo and the reason."""
    empty = np.zeros((TILE_PX, TILE_PX, 3), np.uint8)
    try:
        builder.clear()
        builder.add_photo(case.rgb, case.box)
        box = builder.photos[0].box_px
        with builder.fit(seconds) as head:
            mesh, camera = head.mesh("all"), cameras_of(head)[0]
    except MaquetteError as error:
        tiles = [case.rgb, *[empty] * (len(COLUMNS) - 1)]
        return _labelled(tiles, [case.label, str(error)[:40]])
    drawn = DrawnMesh.of(mesh)
    near, to_picture = framed(camera, box, CROP_SIDES, TILE_PX)
    photo = cv2.warpAffine(
        case.rgb, to_picture, (TILE_PX, TILE_PX), flags=cv2.INTER_AREA | cv2.WARP_INVERSE_MAP, borderValue=(90,) * 3
    )
    views = [beside(camera, turn, TILE_PX) for turn in (drawing.TURN_DEG, -drawing.TURN_DEG)]
    tiles = [photo, drawn.colours(near, photo), drawn.normals(near), *(drawn.colours(view) for view in views)]
    tiles += [empty, empty] if case.truth is None else [case.truth(view) for view in views]
    return _labelled(tiles, [case.label])


def _labelled(tiles: Sequence[np.ndarray], labels: Sequence[str]) -> list[np.ndarray]:
    texts = [*labels, *COLUMNS[len(labels) :]]
    texts = [
        text if tile.any() or k < len(labels) else "" for k, (text, tile) in enumerate(zip(texts, tiles, strict=True))
    ]
    return [labelled_tile(tile, text, TILE_PX, TILE_PX + 16) for tile, text in zip(tiles, texts, strict=True)]


def rendered_cases(measured: Mapping, data: Path, backgrounds: PhotoBackgrounds, at_s: float) -> list[Case]:
    """Returns the best, median and worst synthetic heads and heads of another source."""
    rows = [row for row in measured["rows"] if row["bundle"] == measured["bundles"][0]]
    cases, maker = [], None
    for name, read in ((ONE, read_made_heads), (OTHER, read_other_heads)):
        picked = chosen(rows, name, at_s)
        heads = {head.name: head for head in read(data)} if picked else {}
        for which, row in picked:
            head: TrueHead = heads[row["head"]]
            number = head.front()
            photo = photo_of(head.pictures, number, backgrounds, generator(head.name, number))
            if name == ONE:
                maker = maker or make_maker()
                views, lamps = drawing.made_head(maker, head.name, number)
                scene = views.scene
            else:
                scene, lamps = drawing.other_head(data / "other", head.name), drawing.STUDIO
            label = f"{which}: face {row['face_mm']:.1f}, head {row['head_mm']:.1f} mm"
            cases.append(
                Case(label, photo.rgb, photo.box,
                     lambda view, scene=scene, lamps=lamps: drawing.seen_before_grey(scene.seen(view, lamps)))
            )  # fmt: skip
    return cases


def photo_cases(photos: Path, faces: Path, count: int) -> list[Case]:
    """Returns real photographs, with boxes around the faces that `export.heads.photos.faces` found."""
    cases = []
    for path in sorted(faces.glob("*.npz"))[:count]:
        picture = next((p for p in photos.glob(f"{path.stem}.*") if p.suffix in (".jpg", ".png")), None)
        if picture is None:
            continue
        with Frame.decode(picture.read_bytes()) as frame, np.load(path) as stored_faces:
            rgb, squares = frame.pixels(), stored_faces["square"]
        x, y, side = squares[np.argmax(squares[:, 2])]
        half = side / CROP_SIDES / 2
        cases.append(Case(path.stem.removeprefix("tabler-preview-")[:36], rgb,
                          np.array([x - half, y - half, x + half, y + half])))  # fmt: skip
    return cases


@dataclass(frozen=True)
class Sources:
    """data, backgrounds: as in quality.py. photos: real photographs, `count` at most."""

    data: Path = DATA
    backgrounds: Path = BACKGROUNDS
    photos: Path = PHOTOS
    count: int = 6


def draw(measured: Mapping, bundle: Path, sources: Sources, out: Path, threads: int = 0) -> int:
    """Draws measured and real heads into an image. Returns their number; without any, nothing is written."""
    at_s = measured["at_s"]
    cases = rendered_cases(measured, sources.data, PhotoBackgrounds(sources.backgrounds), at_s)
    cases += photo_cases(sources.photos, sources.data / "photos/test", sources.count)
    if cases:
        with HeadBuilder(bundle, texture=False, threads=threads) as builder:
            rows = [row_of(builder, case, at_s) for case in tqdm(cases, desc="sheet", unit="head", disable=None)]
        out.parent.mkdir(parents=True, exist_ok=True)
        cv2.imwrite(str(out), mosaic([tile for row in rows for tile in row], len(COLUMNS))[..., ::-1])
    return len(cases)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--photos", type=Path, default=PHOTOS, help=f"real photographs; default: {PHOTOS}")
    parser.add_argument("--photo-count", type=int, default=6, help="maximum number of photographs")


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--metrics", type=Path, default=METRICS, help=f"output of quality.py; default: {METRICS}")
    parser.add_argument("--data", type=Path, default=DATA, help=f"default: {DATA}")
    parser.add_argument("--backgrounds", type=Path, default=BACKGROUNDS, help=f"default: {BACKGROUNDS}")
    parser.add_argument("--bundle", type=Path, default=BUNDLE, help=f"default: {BUNDLE}")
    parser.add_argument("--threads", type=int, default=0, help="0: the library chooses")
    parser.add_argument("--out", type=Path, default=Path("build/benchmarks/heads-sheet.jpg"), help=".png or .jpg")
    add_arguments(parser)
    options = parser.parse_args(arguments)
    sources = Sources(options.data, options.backgrounds, options.photos, options.photo_count)
    count = draw(json.loads(options.metrics.read_text()), options.bundle, sources, options.out, options.threads)
    if not count:
        raise SystemExit("There are no heads to draw: run benchmarks.heads.quality, or fetch photographs.")
    print(f"{options.out}: {count} heads")


if __name__ == "__main__":
    main()
