"""Processor time of a frame, native and in WebAssembly, one thread, in turn.

python -m tests.web.measure              after `make build web`
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import time
from pathlib import Path

import cv2
import maquette
import numpy as np

ROOT = Path(__file__).resolve().parents[2]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--frames", type=int, default=10, help="of a round")
    options = parser.parse_args()

    photo = cv2.imread(str(ROOT / "tests/media/photo.jpg"))
    image = np.full((480, 640, 3), 128, np.uint8)
    image[:, 80:560] = cv2.resize(photo, (480, 480), interpolation=cv2.INTER_AREA)
    raw = ROOT / "build/web/tests/frame.rgba"
    raw.parent.mkdir(parents=True, exist_ok=True)
    raw.write_bytes(cv2.cvtColor(image, cv2.COLOR_BGR2RGBA).tobytes())

    command = ["node", str(ROOT / "tests/web/measure.js"), str(raw), "640", "480", str(options.frames)]
    node = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert node.stdin is not None
    assert node.stdout is not None
    assert node.stdout.readline() == "ready\n"
    native, web = [], []
    with maquette.DensePose(threads=1) as densepose:
        for _ in range(10):
            densepose.run(image)
        for _ in range(options.rounds):
            begin = time.process_time()
            for _ in range(options.frames):
                densepose.run(image)
            native.append(1000 * (time.process_time() - begin) / options.frames)
            node.stdin.write("\n")
            node.stdin.flush()
            web.append(float(node.stdout.readline()))
    node.stdin.close()
    ratios = [b / a for a, b in zip(native, web, strict=True)]
    for name, values in (("native", native), ("WebAssembly", web)):
        print(f"{name}: median {statistics.median(values):.1f} ms of processor time a frame, min {min(values):.1f}")
    print(f"ratio: median {statistics.median(ratios):.2f}, {min(ratios):.2f} to {max(ratios):.2f}")


if __name__ == "__main__":
    main()
