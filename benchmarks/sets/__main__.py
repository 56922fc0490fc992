"""The shipped networks, and what is predicted without them, on sets of clips.

    python -m benchmarks.sets people flights
    python -m benchmarks.sets pushing --frames 24

Of validation clips: PSNR in dB of frames made codes and frames again, the share of codes that stay as they are from
frame to frame, bits a code by frequency, by the table, by the table with what a stream's places learn, and by the
transformer (int8, as shipped); then PSNR at 320 x 240 by frames ahead of the last frame, motion, `auto` and `auto`
mended by the network, and what the latter two gain over the better of the others. Needs the built library and the
program measure_prediction.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from benchmarks.prediction import BUNDLE, HORIZONS
from benchmarks.sets.measure import JUDGED, gate_of, networks_on, pictures_on


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.sets", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("sets", nargs="+", metavar="SET", help="of export.clips")
    parser.add_argument("--bundle", type=Path, default=BUNDLE)
    parser.add_argument("--data", type=Path, default=Path(".data/clips"))
    parser.add_argument("--frames", type=int, default=96, help="whose bits are counted (default %(default)s)")
    parser.add_argument("--clips", type=int, default=48, help="at most so many by time ahead (default %(default)s)")
    options = parser.parse_args()
    networks = {kind: networks_on(options.data, kind, options.bundle, options.frames) for kind in options.sets}
    names = list(next(iter(networks.values())))
    print("| set | " + " | ".join(names) + " |\n| --- |" + " --- |" * len(names))
    for kind, own in networks.items():
        print(f"| {kind} | " + " | ".join(f"{value:.2f}" for value in own.values()) + " |", flush=True)
    print("\n| set | method | " + " | ".join(map(str, HORIZONS)) + " |\n| --- | --- |" + " --- |" * len(HORIZONS))
    for kind in options.sets:
        found = pictures_on(options.data, kind, options.clips)
        for name, own in found.items():
            print(f"| {kind} | {name} | " + " | ".join(f"{value:.2f}" for value in own.mean(0)) + " |")
        for method in JUDGED:
            gained, losers, worst = gate_of(found, method)
            print(f"| | {method} over the better | " + " | ".join(f"{value:+.2f}" for value in gained) + " |")
            print(
                f"{kind}, {method}: {losers} of {found[method].size} clips and times lose more than 0.1 dB, at most "
                f"{-worst:.2f}"
            )


if __name__ == "__main__":
    main()
