"""Compares the SDK with MediaPipe on the same photographs and clips: quality, times, sizes.

    python -m benchmarks.products --only quality    20 minutes on two cores
    python -m benchmarks.products --only times      half an hour; nothing else may run
    python -m benchmarks.products --publish --only  writes docs/research/products.md from what is measured

The first run installs MediaPipe into .data/products. Results: build/products/products.json, products.md, products.png.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
from pathlib import Path

import maquette

from benchmarks import provenance
from benchmarks.products import clips, figure, page, photographs, times
from benchmarks.products.install import InstallError, install
from benchmarks.products.protocol import ProductError
from benchmarks.products.running import BUNDLE, Product, cut_off, of_mediapipe, ours
from export.evaluation.machine import describe_machine
from export.people.clips.clip_file import ClipError, clip_paths
from export.photos.packages import PackageError

SCHEMA = "maquette-products-1"
QUALITY, SECTIONS = "quality", ("photographs", "clips", "times")
JSON, PAGE = "products.json", "products.md"
_DOCS, _IMAGES = Path("docs/research"), Path("docs/images")


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.products", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--only", nargs="*", choices=(QUALITY, *SECTIONS), metavar="SECTION",
        help="quality, or a part of it: photographs, clips; times; or nothing. What is not measured again is kept.",
    )  # fmt: skip
    parser.add_argument("--quick", action="store_true", help="a smoke test: few photographs and frames")
    parser.add_argument("--publish", action="store_true", help=f"copies page, figure and JSON to {_DOCS}")
    parser.add_argument("--data", type=Path, default=Path(".data"), metavar="DIR")
    parser.add_argument("--bundle", type=Path, default=BUNDLE, metavar="DIR", help="networks of the SDK")
    parser.add_argument("--out", type=Path, default=Path("build/products"), metavar="DIR")
    parser.add_argument("--rounds", type=int, default=4, help="of the times; default: 4")
    options = parser.parse_args(argv)
    asked = SECTIONS if options.only is None else options.only
    sections = tuple(name for name in SECTIONS if name in asked or (QUALITY in asked and name != "times"))
    try:
        document = measured(_before(options.out / JSON), sections, options)
    except (ClipError, InstallError, maquette.MaquetteError, OSError, PackageError, ProductError, ValueError) as error:
        print(f"The comparison stopped: {error}", file=sys.stderr)
        return 1
    write(document, options.out)
    print(f"Written: {options.out / PAGE}")
    return publish(document, options) if options.publish else 0


def _before(path: Path) -> dict:
    """The document of an earlier run, or {}."""
    document = json.loads(path.read_text()) if path.exists() else {}
    return document if document.get("schema") == SCHEMA else {}


def measured(document: dict, sections: tuple[str, ...], options: argparse.Namespace) -> dict:
    """The document with these sections measured. Each is written to the disk at once."""
    if not sections:
        if not document:
            raise ValueError(f"nothing is measured: {options.out / JSON} is not there. Run without --only first.")
        return document
    products = [*ours(options.bundle.resolve()), *of_mediapipe(install(options.data / "products"))]
    document |= {"schema": SCHEMA, "machine": describe_machine(), "network_cut_off": bool(cut_off()),
                 "products": {product.name: _about(product) for product in products}}  # fmt: skip
    library = maquette.build_info()["git_commit"]
    if differs := provenance.library_refusal(library):
        print(f"This run cannot be published. {differs}", file=sys.stderr)
    for section in sections:
        document[section] = _MEASURES[section](products, options)
        stamp = provenance.stamp_of_code() | {"quick": options.quick, "library": library}
        document.setdefault("provenance", {})[section] = stamp
        write(document, options.out)
    return document


def _about(product: Product) -> dict[str, object]:
    return {"version": product.version, "is_ours": product.is_ours, "has_people": product.has_people}


def _clip_paths(data: Path) -> list[Path]:
    return [path for split in ("val", "test") for path in clip_paths(data / "people-clips" / split)]


def _photographs(products: list[Product], options: argparse.Namespace) -> dict:
    chosen = photographs.Photographs.find(options.data, 3 if options.quick else None)
    return photographs.measure([own for own in products if own.has_masks], chosen, options.out / "log")


def _clips(products: list[Product], options: argparse.Namespace) -> dict:
    with_masks = [own for own in products if own.has_masks]
    return clips.measure(with_masks, _clip_paths(options.data), options.out / "log", 8 if options.quick else None)


def _times(products: list[Product], options: argparse.Namespace) -> dict:
    folder, log, paths = options.data / "photos/test", options.out / "log", _clip_paths(options.data)
    chosen = sorted(folder.glob("*.jpg"))
    if not chosen:
        raise ValueError(f"{folder} has no photographs. Fetch them: python -m export.photos fetch")
    if options.quick:
        return times.measure(products, paths[:1], chosen[:2], log, 1, 1)
    return times.measure(products, paths, chosen, log, options.rounds)


_MEASURES = {"photographs": _photographs, "clips": _clips, "times": _times}


def write(document: dict, folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / JSON).write_text(json.dumps(document, indent=1) + "\n")
    (folder / PAGE).write_text(page.page(document))
    figure.write(document, folder / page.FIGURE)


def publish(document: dict, options: argparse.Namespace) -> int:
    """Copies the page, with the sections that are measured, if these are of one commit."""
    stamps = document["provenance"]
    refused = provenance.refusal(stamps, stamps, "python -m benchmarks.products --only")
    if not refused and any(stamp["quick"] for stamp in stamps.values()):
        refused = "A run with --quick is not published. Measure without it."
    libraries = {stamp["library"] for stamp in stamps.values()}
    refused = refused or next(filter(None, map(provenance.library_refusal, sorted(libraries))), "")
    if refused:
        print(refused, file=sys.stderr)
        return 1
    for name in (JSON, PAGE):
        shutil.copy(options.out / name, _DOCS / name)
    if "times" in document:
        shutil.copy(options.out / page.FIGURE, _IMAGES / page.FIGURE)
    print(f"Published: {_DOCS / PAGE}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
