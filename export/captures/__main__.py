"""Real places as captures: photographs fetched from packages, posed by structure from motion, made dense; or the plain
photographs, for `maquette scene make`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from export.captures.dense import POINTS
from export.captures.originals import ORIGINALS, write_plain
from export.captures.structure import CaptureError
from export.photos.packages import NetworkError, PackageError, load_packages

EPILOG = """\
examples:
  python -m export.captures list         what there is, with package and licence; fetches nothing
  python -m export.captures fetch        all of them into .data/places/real, a minute or two each
  python -m export.captures fetch house  only this one
  python -m export.captures photos house the plain photographs alone, into .data/places/photos/house
"""

CAPTURES, PHOTOS = Path(".data/places/real"), Path(".data/places/photos")
UNREACHABLE = 69  # exit status when a package server cannot be reached (EX_UNAVAILABLE of sysexits.h)


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m export.captures", description=__doc__, epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("command", choices=("fetch", "list", "photos"))
    parser.add_argument("names", nargs="*", metavar="NAME", help="default: all")
    parser.add_argument("--out", type=Path, help=f"default: {CAPTURES}; for photos: {PHOTOS}")
    parser.add_argument("--points", type=int, default=POINTS, help="at most so many; default: %(default)s")
    parser.add_argument("--force", action="store_true", help="make again what is already there")
    arguments = parser.parse_args(argv)
    known = [original.name for original in ORIGINALS]
    unknown = sorted(set(arguments.names) - set(known))
    if unknown:
        parser.error(f"there is no {', '.join(unknown)}; there are {', '.join(known)}")
    out = arguments.out or (PHOTOS if arguments.command == "photos" else CAPTURES)
    for original in ORIGINALS:
        folder = out / original.name
        if arguments.names and original.name not in arguments.names:
            continue
        if arguments.command == "list":
            package = load_packages()[original.package]
            print(f"{original.name:8} {original.shows}; {package.package} {package.version}, {package.licence}")
        elif folder.exists() and not arguments.force:
            print(f"{folder} is there already")
        else:
            try:
                folder.parent.mkdir(parents=True, exist_ok=True)
                if arguments.command == "photos":
                    print(f"{folder}: {write_plain(original, folder)} photos")
                    continue
                from export.captures.folder import make

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
