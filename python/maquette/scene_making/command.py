"""maquette scene make: a scene from a film or a folder of photos."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from maquette.native import MaquetteError
from maquette.progress import ProgressLine
from maquette.scene_making.make import MAX_PHOTOS, make_scene

_EPILOG = """\
examples:
  maquette scene make film.mp4 --out place.maqs
  maquette scene make photos --out place.maqs
  maquette scene make photos --out place.spz    splats for other programs, fitted to the photos for a minute

beside the scene: place-preview.jpg, place-report.json, place-report.txt, and place-work with the result of each stage.
The same command goes on there after Ctrl-C. Film slowly, walk sideways, and show everything from several places.
"""


def run(arguments: list[str]) -> int:
    """Exit status: 0 made, 1 an error, 130 Ctrl-C."""
    parser = argparse.ArgumentParser(
        prog="maquette scene make", description=__doc__, epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("source", metavar="FILM_OR_FOLDER", help="a film, or a folder with photos")
    parser.add_argument("-o", "--out", required=True,
                        help="file of the scene: place.maqs; of splats: place.spz; it is replaced")  # fmt: skip
    parser.add_argument("--photos", type=int, default=MAX_PHOTOS, metavar="N",
                        help="photos or frames that are used at most; default: %(default)s")  # fmt: skip
    parser.add_argument("--threads", type=int, default=0, metavar="N", help="default: all cores")
    given = parser.parse_args(arguments)
    if given.photos < 3:
        parser.error(f"--photos is {given.photos}; a scene needs at least 3")
    if given.threads < 0:
        parser.error(f"--threads is {given.threads}; it is 1 or more")
    progress = ProgressLine()
    try:
        report = make_scene(given.source, given.out, progress, given.photos, given.threads)
    except KeyboardInterrupt:
        work = Path(given.out).with_name(f"{Path(given.out).stem}-work")
        print(f"\nmaquette: Interrupted. The same command goes on where it was ({work}).", file=sys.stderr)
        return 130
    except (MaquetteError, OSError) as error:
        print(f"\nmaquette: {error.text if isinstance(error, MaquetteError) else error}", file=sys.stderr)
        return 1
    print(report.text())
    return 0
