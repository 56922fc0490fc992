"""Real places as captures: photographs fetched from packages, posed by structure from motion, made dense."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from export.captures.dense import POINTS
from export.captures.originals import ORIGINALS
from export.captures.structure import CaptureError
from export.photos.packages import NetworkError, PackageError, load_packages

EPILOG = """\
examples:
  python -m export.captures list         what there is, with package and licence; fetches nothing
  python -m export.captures fetch        all of them into .data/places/real, a minute or two each
  python -m export.captures fetch house  only this one
"""

UNREACHABLE = 69  # exit status when a package server cannot be reached (EX_UNAVAILABLE of sysexits.h)


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m export.captures", description=__doc__, epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("command", choices=("fetch", "list"))
    parser.add_argument("names", nargs="*", metavar="NAME", help="default: all")
    parser.add_argument("--out", type=Path, default=Path(".data/places/real"), help="default: %(default)s")
    parser.add_argument("--points", type=int, default=POINTS, help="at most so many; default: %(default)s")
    parser.add_argument("--force", action="store_true", help="make again what is already there")
    arguments = parser.parse_args(argv)
    known = [original.name for original in ORIGINALS]
    unknown = sorted(set(arguments.names) - set(known))
    if unknown:
        parser.error(f"there is no {', '.join(unknown)}; there are {', '.join(known)}")
    for original in ORIGINALS:
        folder = arguments.out / original.name
        if arguments.names and original.name not in arguments.names:
            continue
        if arguments.command == "list":
            package = load_packages()[original.package]
            print(f"{original.name:8} {original.shows}; {package.package} {package.version}, {package.licence}")
        elif folder.exists() and not arguments.force:
            print(f"{folder} is there already")
        else:
            try:
                from export.captures.folder import make

                folder.parent.mkdir(parents=True, exist_ok=True)
                photos, posed, points = make(original, folder, arguments.points)
            except ModuleNotFoundError as error:
                print(f"{error}. Run: scripts/make-venv.sh captures", file=sys.stderr)
                return 1
            except NetworkError as error:
                print(error, file=sys.stderr)
                return UNREACHABLE
            except (PackageError, CaptureError, OSError) as error:
                print(error, file=sys.stderr)
                return 1
            print(f"{folder}: {posed} of {photos} photos posed, {points} points")
    return 0


if __name__ == "__main__":
    sys.exit(main())
