"""Writes the report of heads: distances by seconds of fitting beside baselines (`quality.py`), real photographs,
settings, the program, the field kernels beside PyTorch, and a contact sheet.

    python -m benchmarks.heads --out docs/benchmarks/heads.md        10 to 30 minutes with all heads and times
    python -m benchmarks.heads --heads 2 --seconds 0 1               a smoke test
    python -m benchmarks.heads --parts field_kernels program         some parts again; the others are kept

Each part records its commit and date. A page in docs/benchmarks is not written if its parts are of different commits.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from benchmarks import provenance
from benchmarks.heads import ablation, contact_sheet, field_kernels, prior_limit, program, quality, real_faces, report
from benchmarks.heads.photos import Photo, PhotoBackgrounds, TrueHead

PARTS = ("quality", "prior", "real", "ablation", "program", "field_kernels", "sheet")
PUBLISHED = Path("docs/benchmarks")


def front_photos(options: argparse.Namespace, count: int) -> list[tuple[TrueHead, Photo]]:
    """Returns one photo of each of the first test heads."""
    backgrounds, found = PhotoBackgrounds(options.backgrounds), []
    for head in quality.read_made_heads(options.data, min(count, options.heads), quality.make_maker()):
        number = head.front()
        if number is not None:
            found.append((head, quality.photos_of(head, [number], backgrounds)[0]))
    return found


def measured_parts(options: argparse.Namespace) -> dict[str, Callable[[], dict]]:
    """Returns a function for each part besides quality; its result is added to the metrics."""
    # --photos is the folder of the test split; the other splits lie beside it.
    bundle, faces = options.bundles[0], options.data / "photos"

    def of_program() -> dict:
        (_, photo), *_ = front_photos(options, 3)
        return {"program": program.measure_program(bundle, photo), "bundle_mb": program.bundle_mb(bundle)}

    def of_prior() -> dict:
        heads = quality.read_made_heads(options.data, options.heads, quality.make_maker())
        return {"prior": prior_limit.measure_prior(bundle, options.data / "points/test", heads)}

    return {
        "prior": of_prior,
        "real": lambda: {
            "real": real_faces.measure_real(
                bundle, options.photos.parent, faces, sorted(options.seconds), options.heads, options.threads
            )
        },
        "ablation": lambda: {
            "ablation": ablation.measure_settings(
                bundle, front_photos(options, options.setting_heads), options.at, options.threads
            )
        },
        "program": of_program,
        "field_kernels": lambda: {"field_kernels": field_kernels.measure_kernels()},
    }


def parser_of() -> argparse.ArgumentParser:
    parser = quality.parser_of(__doc__)
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=PARTS, help="default: all")
    parser.add_argument("--setting-heads", type=int, default=6, help="heads for comparing settings")
    contact_sheet.add_arguments(parser)
    return parser


def main(arguments: Sequence[str] | None = None) -> None:
    options = quality.parsed(arguments, parser_of())
    now = provenance.stamp()
    if "quality" in options.parts:
        measured = quality.run(options) | {"measured": {"quality": now}}
    elif options.metrics.exists():
        measured = json.loads(options.metrics.read_text())
        options.at = measured["at_s"]
    else:
        raise SystemExit(f"{options.metrics} does not exist yet. Measure the part quality first.")
    for name, part in measured_parts(options).items():
        if name in options.parts:
            try:
                measured |= quality.shortened(part())
                measured.setdefault("measured", {})[name] = now
            except OSError as error:  # the program is not built, or data are missing
                print(f"The part {name} is left out: {error}", file=sys.stderr)
    options.metrics.write_text(json.dumps(measured, indent=1) + "\n")
    stamps = measured.get("measured", {})
    if options.out.resolve().parent == PUBLISHED.resolve():
        names = [name for name in PARTS if name in stamps or name in measured]
        if refusal := provenance.refusal(stamps, names, f"python -m benchmarks.heads --out {options.out} --parts"):
            raise SystemExit(refusal)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    picture = options.out.with_name(f"{options.out.stem}-sheet.jpg")
    if "sheet" in options.parts:
        sources = contact_sheet.Sources(options.data, options.backgrounds, options.photos, options.photo_count)
        contact_sheet.draw(measured, options.bundles[0], sources, picture, options.threads)
    text = report.page(measured, picture.name if picture.exists() else "")
    options.out.write_text(text)
    print(text)


if __name__ == "__main__":
    main()
