"""The whole report of heads: distances by seconds of fitting beside baselines (`quality.py`), real photographs, what
settings cost, the program, the engine, and a sheet to look at.

python -m benchmarks.heads --out docs/benchmarks/heads.md        10 to 30 minutes with all heads and times
python -m benchmarks.heads --heads 2 --seconds 0 1               does it run?
python -m benchmarks.heads --parts engine program                some parts again: the others stay as they were
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Sequence

from benchmarks.heads import engine, prior_limit, program, quality, real_faces, report, savings, sheet
from benchmarks.heads.photos import Photo, PhotoBackgrounds, TrueHead

PARTS = ("quality", "prior", "real", "savings", "program", "engine", "sheet")


def front_photos(options: argparse.Namespace, count: int) -> list[tuple[TrueHead, Photo]]:
    """Of the first test heads one photo each."""
    backgrounds, found = PhotoBackgrounds(options.backgrounds), []
    for head in quality.read_made_heads(options.data, min(count, options.heads), quality.make_maker()):
        number = head.front()
        if number is not None:
            found.append((head, quality.photos_of(head, [number], backgrounds)[0]))
    return found


def measured_parts(options: argparse.Namespace) -> dict[str, Callable[[], dict]]:
    """What each part adds to the figures, beside those of `quality.py`."""
    # --photos names those of the test split; photos of the other splits lie beside them.
    bundle, faces = options.bundles[0], options.data / "photos"

    def of_program() -> dict:
        (_, photo), *_ = front_photos(options, 3)
        return {"program": program.measure_program(bundle, photo), "bundle_mb": program.bundle_mb(bundle)}

    def of_prior() -> dict:
        heads = quality.read_made_heads(options.data, options.heads, quality.make_maker())
        return {"prior": prior_limit.measure_prior(bundle, options.data / "points/test", heads)}

    def of_savings() -> dict:
        heads = front_photos(options, options.setting_heads)
        return {"savings": savings.measure_savings(bundle, heads, options.at, options.threads)}

    return {
        "prior": of_prior,
        "real": lambda: {
            "real": real_faces.measure_real(
                bundle, options.photos.parent, faces, sorted(options.seconds), options.heads, options.threads
            )
        },
        "savings": lambda: {
            "savings": savings.measure_savings(
                bundle, front_photos(options, options.setting_heads), options.at, options.threads
            )
        },
        "program": of_program,
        "engine": lambda: {"engine": engine.measure_engine()},
    }


def parser_of() -> argparse.ArgumentParser:
    parser = quality.parser_of(__doc__)
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=PARTS, help="default: all")
    parser.add_argument("--setting-heads", type=int, default=6, help="heads that settings are compared on")
    sheet.add_arguments(parser)
    return parser


def main(arguments: Sequence[str] | None = None) -> None:
    options = quality.parsed(arguments, parser_of())
    if "quality" in options.parts:
        measured = quality.run(options)
    elif options.figures.exists():
        measured = json.loads(options.figures.read_text())
        options.at = measured["at_s"]
    else:
        raise SystemExit(f"{options.figures} is not there yet: measure the part quality first.")
    for name, part in measured_parts(options).items():
        if name in options.parts:
            try:
                measured |= quality.shortened(part())
                options.figures.write_text(json.dumps(measured, indent=1) + "\n")
            except OSError as error:  # a program that is not built, data that are not there
                print(f"The part {name} is left out: {error}", file=sys.stderr)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    picture = options.out.with_name(f"{options.out.stem}-sheet.jpg")
    if "sheet" in options.parts:
        sources = sheet.Sources(options.data, options.backgrounds, options.photos, options.photo_count)
        sheet.draw(measured, options.bundles[0], sources, picture, options.threads)
    text = report.page(measured, picture.name if picture.exists() else "")
    options.out.write_text(text)
    print(text)


if __name__ == "__main__":
    main()
