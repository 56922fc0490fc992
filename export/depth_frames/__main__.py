"""Real depth frames as whole views, and the field of edges over them.

python -m export.depth_frames fetch --out .data/solids/real
python -m export.depth_frames record box.maqrec --every 30 --out .data/solids/own
python -m export.depth_frames look .data/solids/real --onnx sdk/models/edges-int8 --sheet sheet.jpg
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import cv2
import numpy as np

from export.depth_frames.matching import MatchingError
from export.depth_frames.recordings import RecordingError, frames_of
from export.photos.packages import PackageError
from export.solids.records import RecordError, read_records, write_shard

VERSION = "depth-frames-1"


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m export.depth_frames", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(dest="command", required=True)
    fetch = commands.add_parser("fetch", help="frames out of packages")
    fetch.add_argument("--out", type=Path, default=Path(".data/solids/real"))
    record = commands.add_parser("record", help="recordings of a depth camera, with the JSON of true sizes beside each")
    record.add_argument("recordings", type=Path, nargs="+")
    record.add_argument("--every", type=int, default=1, help="of so many frames one is taken (default %(default)s)")
    record.add_argument("--most", type=int, default=100, help="frames of a recording (default %(default)s)")
    record.add_argument("--out", type=Path, default=Path(".data/solids/own"))
    look = commands.add_parser("look", help="a sheet of fields, and false positives where no edge is right")
    look.add_argument("folder", type=Path)
    look.add_argument("--onnx", type=Path, default=Path("sdk/models/edges-int8"), help="bundle (default %(default)s)")
    look.add_argument("--sheet", type=Path, default=Path("depth-frames.jpg"))
    look.add_argument("--only", nargs="*", default=[""], help="on the sheet: frames with one of these in their names")
    options = parser.parse_args(argv)
    try:
        {"fetch": _fetch, "record": _record, "look": _look}[options.command](options)
    except (PackageError, MatchingError, RecordingError, RecordError) as error:
        print(error, file=sys.stderr)
        return 1
    return 0


def _write(folder: Path, frames, split: str) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    write_shard(folder / "solids-00000.npz", [f.record() for f in frames], {"generator": VERSION, "split": split})
    print(f"{folder}: {len(frames)} frames")


def _fetch(options: argparse.Namespace) -> None:
    from export.depth_frames.originals import ORIGINALS  # needs embreex, of the extra `solids`

    _write(options.out, [frame for original in ORIGINALS for frame in original.frames()], "real")


def _record(options: argparse.Namespace) -> None:
    if options.every < 1 or options.most < 1:
        raise RecordingError("--every and --most must be at least 1.")
    frames = [f for path in options.recordings for f in frames_of(path, options.every, options.most)]
    _write(options.out, frames, "own")


def _look(options: argparse.Namespace) -> None:
    from export.depth_frames.sheet import false_positives, row_of
    from export.edges.data import frame_of
    from export.edges.graph_field import field_of_bundle

    field = field_of_bundle(options.onnx)
    records = list(read_records(options.folder))
    groups: dict[str, list] = {}
    for record in records:
        frame = frame_of(record)
        if frame.counts.any():
            groups.setdefault(record.name.split("-")[0].split("_")[0], []).append(frame)
    for name, frames in groups.items():
        found = false_positives(field, frames)
        print(f"{name}: of {found['pixels']} pixels without an edge near, "
              f"{found['under_1r']:.2%} under 1 r and {found['under_4r']:.2%} under 4 r")  # fmt: skip
    rows = [row_of(record, field) for record in records if any(part in record.name for part in options.only)]
    if not rows:
        raise RecordError(f"{options.folder} has no frame with {' or '.join(options.only)} in its name.")
    cv2.imwrite(str(options.sheet), np.concatenate(rows)[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 80])
    print(f"wrote {options.sheet}")


if __name__ == "__main__":
    sys.exit(main())
