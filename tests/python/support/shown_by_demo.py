"""Runs the desktop demo on a display in memory, and the command line on the same frames, to compare what they show.

`show` gives the demo's report and the screenshot; `map_frames` what the command line finds in the last of so many
frames, and the frame itself. Images are BGR, in the order of cv2.
"""

import atexit
import ctypes
import json
import os
import struct
import subprocess
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import cv2
import numpy as np

ROOT = Path(__file__).parents[3]
STAGE = ROOT / "build/release/stage"
DEMO, MAQUETTE = STAGE / "bin/maquette-demo", STAGE / "bin/maquette"

_FRAME_HEAD = struct.Struct("<IIqQIiiiiIQQ")  # docs/reference/formats.md, recording
_BGR8, _RGB8 = 2, 1


@cache
def display() -> str:
    """One for all tests: xvfb-run, which starts one for each program, now and then fails to clean up after it."""
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", "1", "-screen", "0", "1600x1200x24", "-nolisten", "tcp", "-noreset"],
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, start_new_session=True,
    )  # fmt: skip
    atexit.register(server.wait)
    atexit.register(server.terminate)
    number = server.stdout.readline().strip()
    assert number, "Xvfb does not start"
    return f":{number}"


def run(*command, env=None, cwd=ROOT, timeout_s=180) -> subprocess.CompletedProcess:
    words = [str(word) for word in command]
    return subprocess.run(words, capture_output=True, text=True, env=env, cwd=cwd, timeout=timeout_s, check=False)


def headless(*options, program=DEMO, env=None, cwd=ROOT, timeout_s=180) -> subprocess.CompletedProcess:
    env = os.environ | (env or {}) | {"DISPLAY": display()}
    return run(program, "--headless", *options, env=env, cwd=cwd, timeout_s=timeout_s)


@dataclass(frozen=True)
class Shown:
    report: dict
    screenshot: np.ndarray

    def rectangle(self, name: str) -> np.ndarray:
        """Returns the part in the rectangle that the report calls picture_px or mesh_px."""
        x, y, width, height = self.report[name]
        return self.screenshot[y : y + height, x : x + width]

    def at_frame_pixels(self, width: int, height: int) -> np.ndarray:
        """The shown image at the middles of the pixels of a frame of that size: uint8 [height, width, 3]."""
        left, top, wide, tall = self.report["picture_px"]
        x = left + (np.arange(width, dtype=np.float32) + 0.5) * wide / width - 0.5
        y = top + (np.arange(height, dtype=np.float32) + 0.5) * tall / height - 0.5
        return cv2.remap(self.screenshot, *np.meshgrid(x, y), cv2.INTER_LINEAR)

    def outside_mesh(self, width: int, height: int) -> np.ndarray:
        """Which of these pixels the body in the corner leaves free: bool [height, width]."""
        free = np.ones(self.screenshot.shape[:2], np.uint8)
        if self.report["mesh_px"]:
            x, y, wide, tall = self.report["mesh_px"]
            free[max(0, y - 2) : y + tall + 2, max(0, x - 2) : x + wide + 2] = 0
        return Shown(self.report, free[..., None].repeat(3, 2)).at_frame_pixels(width, height)[..., 0] == 1


def room_of_few_photos(folder: Path) -> Path:
    """A capture with every third photo of the rendered room: built in half the time."""
    room = ROOT / "tests/media/room"
    about = json.loads((room / "transforms.json").read_text())
    about["frames"] = about["frames"][::3]
    names = {frame["file_path"] for frame in about["frames"]}
    for split in ("train_filenames", "test_filenames"):
        about[split] = [name for name in about[split] if name in names]
    (folder / "transforms.json").write_text(json.dumps(about))
    for name in ("images", "cloud.ply"):
        (folder / name).symlink_to(room / name)
    return folder


def show(folder: Path, *options) -> Shown:
    screenshot = folder / "shown.png"
    screenshot.unlink(missing_ok=True)
    ran = headless("--size", "1500x1000", "--screenshot", screenshot, *options)
    assert ran.returncode == 0, ran.stderr
    picture = cv2.imread(str(screenshot))
    assert picture is not None
    report = json.loads(ran.stdout)
    assert list(picture.shape[1::-1]) == report["window_px"]
    return Shown(report, picture)


@dataclass(frozen=True)
class Mapped:
    """A frame and what the command line found in it."""

    frame: np.ndarray
    iuv: np.ndarray  # part, U * 255, V * 255
    person: np.ndarray  # 1 for the first; 0 for nobody
    people: list  # {"box": [x0, y0, x1, y1], "score": s}
    seen_parts: frozenset  # of all frames up to this one

    @property
    def size(self) -> tuple[int, int]:
        return self.person.shape[1], self.person.shape[0]

    def inside(self, margin_px: int = 1) -> np.ndarray:
        """Pixels whose neighbours have the same part of the same person: bool [height, width]."""
        key = self.iuv[..., 0].astype(np.int32) + 32 * self.person
        same = np.ones(key.shape, bool)
        for dy in range(-margin_px, margin_px + 1):
            for dx in range(-margin_px, margin_px + 1):
                same &= np.roll(key, (dy, dx), (0, 1)) == key
        return same & (self.person > 0)

    def far_from_people(self, margin_px: int = 3) -> np.ndarray:
        near = cv2.dilate((self.person > 0).astype(np.uint8), np.ones((2 * margin_px + 1,) * 2))
        return near == 0


def map_frames(folder: Path, source: str, frames: int) -> Mapped:
    recording = folder / "frames.maqrec"
    for command in (
        ("densepose", source, "--out", folder / "mapped", "--max-frames", frames),
        ("record", source, recording, "--frames", frames),
    ):
        ran = run(MAQUETTE, *command)
        assert ran.returncode == 0, ran.stderr
    stems = sorted(path.name.removesuffix(".json") for path in (folder / "mapped").glob("*.json"))
    assert len(stems) == frames

    def picture(stem: str, kind: str) -> np.ndarray:
        return cv2.imread(str(folder / "mapped" / f"{stem}_{kind}.png"), cv2.IMREAD_UNCHANGED)

    people = json.loads((folder / "mapped" / f"{stems[-1]}.json").read_text())["people"]
    seen = frozenset(np.concatenate([np.unique(picture(stem, "IUV")[..., 0]) for stem in stems]).tolist()) - {0}
    return Mapped(last_frame(recording), picture(stems[-1], "IUV"), picture(stems[-1], "INDS"), people, seen)


def last_frame(recording: Path) -> np.ndarray:
    data = recording.read_bytes()
    at = 24 + struct.unpack_from("<I", data, 12)[0]
    while data[at : at + 4] == b"MAQF":
        head = _FRAME_HEAD.unpack_from(data, at)
        encoding, width, height, picture_bytes = head[4], head[5], head[6], head[10]
        assert encoding in (_BGR8, _RGB8)
        pixels = np.frombuffer(data, np.uint8, width * height * 3, at + _FRAME_HEAD.size).reshape(height, width, 3)
        at += _FRAME_HEAD.size + picture_bytes
    return pixels if encoding == _BGR8 else pixels[..., ::-1]


@cache
def part_colours() -> np.ndarray:
    """Returns the colours of the C API: uint8 [25, 3] BGR, 0 for the background."""
    library = ctypes.CDLL(str(STAGE / "lib/libmaquette.so"))
    colours = np.zeros((25, 3), np.uint8)
    for part in range(25):
        rgb = (ctypes.c_uint8 * 3)()
        library.maq_densepose_get_part_colour(part, rgb)
        colours[part] = rgb[::-1]
    return colours


def psnr_db(one: np.ndarray, other: np.ndarray) -> float:
    return float(-10 * np.log10(max(1e-9, np.mean((one.astype(np.float64) - other) ** 2) / 255**2)))


def directions(colours: np.ndarray) -> np.ndarray:
    """Colours without their brightness."""
    colours = colours.astype(np.float64)
    return colours / np.maximum(np.linalg.norm(colours, axis=-1, keepdims=True), 1e-9)
