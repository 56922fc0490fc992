"""Opens every view of the desktop demo, on rendered people, a clip, a room, solids, a photo: images of its guide.

scripts/install-packages.sh test && make build && scripts/make-venv.sh
.venv/bin/python scripts/desktop-demo-images.py
"""

from __future__ import annotations

import argparse
import json
import subprocess
import tempfile
from pathlib import Path

import cv2
import numpy as np
from tqdm import tqdm

ROOT = Path(__file__).parent.parent
DEMO = ROOT / "build/release/stage/bin/maquette-demo"
VIEWS = ["camera", "parts", "contours", "mask", "boxes", "try-on"]
PEOPLE = ("stub:people?count=2&seed=3", 99)
CLIP = ("tests/media/clip.mp4", 24)
ROOM = ("tests/media/room", 20)
# With the pointer near a corner of a carton.
SOLIDS = ("stub:solids?scene=room&seed=2&size=640x480", 20)
POINTER = ("--pointer", "581,402")
# The last frame is one that the camera would have taken while it stalls.
STALLS = "stub:people?seed=3&fps=15&stall=300ms@3s"
PHOTO = ("tests/media/photo.jpg", 12)
HEADS = [("--shading", "colour"), ("--shading", "normals"), ("--compare", "slider")]


def shown(source: str, frames: int, folder: Path, *options: str) -> tuple[np.ndarray, dict]:
    """The window at the end of a run, uint8 [height, width, 3] BGR, and what the demo reports."""
    picture = folder / "shown.png"
    command = ["xvfb-run", "-a", "-s", "-screen 0 1600x1200x24", DEMO, source, "--headless", "--frames", str(frames),
               "--size", "1280x800", "--screenshot", picture, *options]  # fmt: skip
    ran = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    report = json.loads(ran.stdout)
    print(" ".join([Path(source).name, *options]), report["ui"])
    return cv2.imread(str(picture)), report


def bridged(folder: Path) -> np.ndarray:
    """While the camera stalls, which is some 46 frames after the start."""
    for frames in range(45, 55):
        picture, report = shown(STALLS, frames, folder, "--predict", "--conceal", "--ahead", "100")
        if report["prediction"]["now_is_predicted"]:
            return picture
    raise RuntimeError("No run ended with a bridged frame; the machine is too busy.")


def with_a_jump(folder: Path) -> str:
    """The clip with 20 of its frames left out after the 40th."""
    path = folder / "jump.mp4"
    source = cv2.VideoCapture(str(ROOT / CLIP[0]))
    frames = [source.read()[1] for _ in range(72)]
    clip = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"mp4v"), 30, frames[0].shape[1::-1])
    for frame in frames[:40] + frames[60:]:
        clip.write(frame)
    clip.release()
    return str(path)


def sheet(pictures: list[np.ndarray], columns: int, width_px: int) -> np.ndarray:
    """Images of one size beside and below each other."""
    height_px = round(pictures[0].shape[0] * width_px / pictures[0].shape[1])
    small = [cv2.resize(p, (width_px, height_px), interpolation=cv2.INTER_AREA) for p in pictures]
    rows = [np.hstack(small[i : i + columns]) for i in range(0, len(small), columns)]
    return np.vstack(rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=ROOT / "docs/images")
    options = parser.parse_args()
    if not DEMO.exists():
        parser.error(f"{DEMO} is not there; build it: make packages-test build")

    def keep(name: str, picture: np.ndarray) -> None:
        cv2.imwrite(str(options.out / name), picture, [cv2.IMWRITE_JPEG_QUALITY, 88])

    with tempfile.TemporaryDirectory() as temporary, tqdm(total=23, unit="picture") as progress:

        def run(source: tuple[str, int], *arguments: str) -> np.ndarray:
            picture, _ = shown(*source, Path(temporary), *arguments)
            progress.update()
            return picture

        keep("desktop-demo.jpg", run((CLIP[0], 40), "--view", "contours"))
        # The image alone, without the panel.
        alone = ("--no-mesh",)
        keep("desktop-people.jpg", sheet([run(PEOPLE, "--view", v, *alone)[44:756, :950] for v in VIEWS], 3, 520))
        keep("desktop-clip.jpg", sheet([run(CLIP, "--view", v, *alone)[133:667, :950] for v in VIEWS], 3, 520))
        keep(
            "desktop-scene.jpg",
            sheet([run(ROOM, "--compare", c)[44:756, :950] for c in ("none", "slider", "error")], 3, 520),
        )
        keep("desktop-head.jpg", sheet([run(PHOTO, "--head", *h)[44:756, :950] for h in HEADS], 3, 520))
        keep("desktop-demo-next.jpg", bridged(Path(temporary)))
        progress.update()
        keep("desktop-demo-health.jpg", run((with_a_jump(Path(temporary)), 41), "--predict", "--health"))
        keep("desktop-demo-uncertainty.jpg", run((CLIP[0], 40), "--predict", "--entropy", "--sample", "--ahead", "300"))
        keep("desktop-demo-edges.jpg", run(SOLIDS, "--edges", *POINTER))


if __name__ == "__main__":
    main()
