"""The whole report of heads: distances by seconds of fitting (`quality.py`), and a sheet to look at (`sheet.py`).

python -m benchmarks.heads --out docs/benchmarks/heads.md        10 to 30 minutes with all heads and times
python -m benchmarks.heads --heads 2 --seconds 0 1               does it run?
"""

from __future__ import annotations

from collections.abc import Sequence

from benchmarks.heads import quality, report, sheet


def main(arguments: Sequence[str] | None = None) -> None:
    parser = quality.parser_of(__doc__)
    sheet.add_arguments(parser)
    options = quality.parsed(arguments, parser)
    measured = quality.run(options)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    picture = options.out.with_name(f"{options.out.stem}-sheet.jpg")
    sources = sheet.Sources(options.data, options.backgrounds, options.photos, options.photo_count)
    drawn = sheet.draw(measured, options.bundles[0], sources, picture, options.threads)
    text = report.page(measured, picture.name if drawn else "")
    options.out.write_text(text)
    print(text)


if __name__ == "__main__":
    main()
