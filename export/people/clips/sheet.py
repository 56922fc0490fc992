"""A contact sheet of clips of people, to be looked at: frames with boxes, ids and joints, and the ids of pixels.

python -m export.people.clips.sheet .data/people-clips/val/clip-*.npz --out sheet.png
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import cv2
import numpy as np

from export.people.clips.clip_file import ClipError, PeopleClip, read_clip
from export.people.clips.recording import RecordingError
from export.people.sheet import painted

_COLOURS = ((60, 60, 255), (60, 220, 60), (255, 120, 40), (40, 220, 255), (255, 60, 220))


def marked(clip: PeopleClip, frame: int) -> np.ndarray:
    """A frame with the visible box, the id and the visible joints of each person."""
    image, truth = clip.image(frame), clip.truth
    for p in range(truth.people):
        colour = _COLOURS[p % len(_COLOURS)]
        if truth.visible_px[frame, p]:
            x0, y0, x1, y1 = truth.visible_box[frame, p].astype(int)
            cv2.rectangle(image, (x0, y0), (x1 - 1, y1 - 1), colour, 2)
            cv2.putText(image, str(p + 1), (x0 + 4, y0 + 26), cv2.FONT_HERSHEY_SIMPLEX, 0.9, colour, 2, cv2.LINE_AA)
        for at in truth.joints_px[frame, p][truth.joint_visible[frame, p]]:
            cv2.circle(image, (round(float(at[0])), round(float(at[1]))), 3, colour, -1, cv2.LINE_AA)
    text = f"{truth.time_ns[frame] / 1e9:.2f} s"
    cv2.putText(image, text, (8, image.shape[0] - 10), cv2.FONT_HERSHEY_SIMPLEX, 0.7, (255, 255, 255), 2, cv2.LINE_AA)
    return image


def sheet_of(clip: PeopleClip, frames: int, width_px: int) -> np.ndarray:
    """Frames at even times; below each its parts."""
    cells = []
    for k in np.linspace(0, clip.truth.frames - 1, frames).round().astype(int):
        image = clip.image(k)
        pair = np.concatenate([marked(clip, k), painted(image, clip.label(k))])
        cells.append(
            cv2.resize(pair, (width_px, width_px * pair.shape[0] // pair.shape[1]), interpolation=cv2.INTER_AREA)
        )
    return np.concatenate(cells, 1)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clips", type=Path, nargs="+", metavar="CLIP")
    parser.add_argument("--frames", type=int, default=8, help="of each clip (default %(default)s)")
    parser.add_argument("--width", type=int, default=240, help="of each frame in pixels (default %(default)s)")
    parser.add_argument("--out", type=Path, default=Path("people-clips-sheet.png"))
    options = parser.parse_args()
    try:
        rows = [sheet_of(read_clip(path), options.frames, options.width) for path in options.clips]
    except (ClipError, RecordingError, OSError) as error:
        print(error, file=sys.stderr)
        return 1
    cv2.imwrite(str(options.out), np.concatenate(rows))
    print(f"wrote {options.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
