"""A contact sheet of clips, to be looked at: frames, their motion, and what the next frame shows where motion points.

python -m export.clips.sheet .data/clips/pushing/val/clip-0000*.npz --out sheet.png

A row of five a clip: first frame, two later ones, motion (hue: direction, brightness: pixels), and the frame rebuilt
from the next one by motion, with what is hidden there in magenta.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import cv2
import numpy as np

from export.clips.clip import Clip, ClipError, read_clip
from export.clips.motion import fetched_from_next, painted_motion

_SIDE = 192


def row_of(clip: Clip) -> np.ndarray:
    """uint8 [192, 5 * 192, 3] RGB; the small frames, enlarged."""
    frames = clip.small
    count = len(frames.rgb)
    # Where most moves: a motion image of a moment of rest shows nothing.
    t = int(np.hypot(*np.moveaxis(frames.motion, -1, 0)).mean((1, 2)).argmax())
    rebuilt = fetched_from_next(frames.rgb[t + 1], frames.motion[t])
    rebuilt = np.where(frames.visible[t][..., None], rebuilt, np.array([255, 0, 255], np.uint8))
    cells = [frames.rgb[0], frames.rgb[t], frames.rgb[count - 1], painted_motion(frames.motion[t], 4.0), rebuilt]
    return np.concatenate([cv2.resize(c, (_SIDE, _SIDE), interpolation=cv2.INTER_NEAREST) for c in cells], 1)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clips", type=Path, nargs="+", metavar="CLIP")
    parser.add_argument("--out", type=Path, default=Path("clips-sheet.png"))
    options = parser.parse_args()
    try:
        rows = [row_of(read_clip(path)) for path in options.clips]
    except ClipError as error:
        print(error, file=sys.stderr)
        return 1
    cv2.imwrite(str(options.out), np.concatenate(rows)[..., ::-1])
    print(f"wrote {options.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
