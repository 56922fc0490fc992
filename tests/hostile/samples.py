"""Good files of every format, which the kinds damage: some of the repository's, some made once by the program."""

import json
import subprocess
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

ROOT = Path(__file__).parents[2]
DATA = ROOT / "tests/native/data"
PEOPLE_BUNDLE = DATA / "tiny_bundle"
SCENE_BUNDLE = DATA / "tiny_scene/bundle"
HEADS_BUNDLE = DATA / "round_heads/bundle"
PREDICTION_BUNDLE = DATA / "tiny_prediction/bundle"
CAPTURE = DATA / "tiny_scene/capture"
CLIP = ROOT / "tests/media/clip.mp4"
# A head of a photo, a.jpg: the encoder of this bundle sees one wherever a photo is not black.
HEAD = ("head", "a.jpg", "--bundle", str(HEADS_BUNDLE), "--threads", "1", "--seconds", "0", "--cell", "20",
        "--box", "10,10,50,40")  # fmt: skip
# Arguments of every run of dense pose: small networks, one thread, one or two frames.
DENSEPOSE = ("densepose", "--bundle", str(PEOPLE_BUNDLE), "--threads", "1", "--max-frames", "2", "--out", "out")


@dataclass(frozen=True)
class Samples:
    """program: what made them. images, clips, recordings, scenes, heads: bytes of good files by name. colmap: texts of
    a model by file name."""

    program: Path
    images: dict[str, bytes]
    clips: dict[str, bytes]
    recordings: dict[str, bytes]
    scenes: dict[str, bytes]
    heads: dict[str, bytes]
    colmap: dict[str, str]


def make_samples(program: Path, folder: Path) -> Samples:
    """folder: for files of the program's own making; may be removed afterwards."""
    folder.mkdir(parents=True, exist_ok=True)

    def made(name: str, *words: str) -> bytes:
        subprocess.run([program, *words], cwd=folder, check=True, capture_output=True)
        return (folder / name).read_bytes()

    stub = "stub:pattern?size=32x24&frames=4"
    build = ("scene", "build", str(CAPTURE), "--bundle", str(SCENE_BUNDLE), "--threads", "1")
    images = make_images()
    (folder / "a.jpg").write_bytes(images["baseline.jpg"])
    return Samples(
        program=program,
        images=images,
        clips={"clip.mp4": CLIP.read_bytes(), "clip.avi": _avi(folder / "clip.avi")},
        recordings={
            "raw.maqrec": made("raw.maqrec", "record", stub, "raw.maqrec"),
            "jpeg.maqrec": made("jpeg.maqrec", "record", stub, "jpeg.maqrec", "--quality", "80"),
        },
        scenes={
            f"{bits}.maqs": made(f"{bits}.maqs", *build, "--coefficients", str(bits), "--out", f"{bits}.maqs")
            for bits in (8, 16, 32)
        },
        heads={"a.maqh": made("a.maqh", *HEAD, "--save", "a.maqh")},
        colmap=colmap_model(),
    )


def picture(width: int = 64, height: int = 48) -> np.ndarray:
    """BGR, neither smooth nor all noise."""
    y, x = np.mgrid[:height, :width]
    noise = np.random.default_rng(0).integers(0, 40, (height, width, 3))
    return (np.stack([3 * x, 4 * y, 2 * (x + y)], -1) % 200 + noise).astype(np.uint8)


def make_images() -> dict[str, bytes]:
    bgr = picture()
    grey, alpha = cv2.cvtColor(bgr, cv2.COLOR_BGR2GRAY), cv2.cvtColor(bgr, cv2.COLOR_BGR2BGRA)
    encoded = {
        "baseline.jpg": (bgr, []),
        "progressive.jpg": (bgr, [cv2.IMWRITE_JPEG_PROGRESSIVE, 1]),
        "grey.jpg": (grey, []),
        "rgb.png": (bgr, []),
        "alpha.png": (alpha, []),
        "deep.png": (bgr.astype(np.uint16) * 257, []),
        "lossy.webp": (bgr, [cv2.IMWRITE_WEBP_QUALITY, 80]),
        "lossless.webp": (alpha, [cv2.IMWRITE_WEBP_QUALITY, 101]),
        "rgb.bmp": (bgr, []),
        "rgb.tif": (bgr, []),
        "rgb.ppm": (bgr, []),
    }
    return {name: cv2.imencode(Path(name).suffix, image, how)[1].tobytes() for name, (image, how) in encoded.items()}


def _avi(path: Path) -> bytes:
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), 30, (64, 48))
    for shift in range(4):
        writer.write(np.roll(picture(), shift, 1))
    writer.release()
    return path.read_bytes()


def colmap_model() -> dict[str, str]:
    """The capture in the layout of COLMAP: the cameras of transforms.json, every point of its own."""
    table = json.loads((CAPTURE / "transforms.json").read_text())
    intrinsics = " ".join(str(table[key]) for key in ("fl_x", "fl_y", "cx", "cy"))
    images = []
    for number, frame in enumerate(table["frames"], 1):
        matrix = np.array(frame["transform_matrix"], float)
        rotation = (matrix[:3, :3] * (1, -1, -1)).T
        place = -rotation @ matrix[:3, 3]
        numbers = " ".join(repr(float(x)) for x in (*_quaternion(rotation), *place))
        images.append(f"{number} {numbers} 1 {Path(frame['file_path']).name}\n0 0 -1\n")
    rng = np.random.default_rng(0)
    points = [
        f"{number} {' '.join(f'{x:.3f}' for x in rng.uniform(-1, 1, 3))} 200 100 50 0.5 1 0\n"
        for number in range(1, 100)
    ]
    return {
        "cameras.txt": f"# cameras\n1 PINHOLE {table['w']} {table['h']} {intrinsics}\n",
        "images.txt": "# images\n" + "".join(images),
        "points3D.txt": "# points\n" + "".join(points),
    }


def _quaternion(rotation: np.ndarray) -> np.ndarray:
    """w, x, y, z: the eigenvector of the greatest eigenvalue (Bar-Itzhack, 2000)."""
    r = rotation
    k = np.array([
        [r[0, 0] + r[1, 1] + r[2, 2], 0, 0, 0],
        [r[2, 1] - r[1, 2], r[0, 0] - r[1, 1] - r[2, 2], 0, 0],
        [r[0, 2] - r[2, 0], r[0, 1] + r[1, 0], r[1, 1] - r[0, 0] - r[2, 2], 0],
        [r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], r[2, 2] - r[0, 0] - r[1, 1]],
    ])  # fmt: skip
    return np.linalg.eigh(k)[1][:, -1]
