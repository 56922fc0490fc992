"""One file with the clips that prediction is trained on, for a machine with a GPU and without a network.

    python -m export.prediction.pack make prediction.pack     here, where clips and photographs are
    python -m export.prediction.pack open prediction.pack     there: .data/clips and .data/backgrounds

Frames are kept as H.264 without subsampled colours (39 dB and 10 kB a clip at the default quality), so they are not
quite those that were rendered; motion and visibility are left out. `make` needs the program `ffmpeg`.
`scripts/train-prediction-from-pack.sh` does all that follows.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import tarfile
import tempfile
from pathlib import Path

import cv2
import numpy as np

from export.clips.clip import FORMAT, FRAMES, SIDE_PX, clip_paths, read_rgb
from export.pack_file import PackWriter, jpeg, shrunk

DATA = Path(".data")
_STILL_SIDE = 384  # of photographs, the longer one; collages are made of them there


def film(frames: np.ndarray, quality: int) -> bytes:
    """uint8 [N, 64, 64, 3] -> H.264; each clip begins with a whole image. quality: x264's constant rate factor."""
    with tempfile.NamedTemporaryFile(suffix=".mp4") as file:
        command = (
            f"ffmpeg -y -loglevel error -f rawvideo -pix_fmt rgb24 -s {SIDE_PX}x{SIDE_PX} -r 30 -i - -c:v libx264 "
            f"-preset medium -crf {quality} -pix_fmt yuv444p -g {FRAMES} -keyint_min {FRAMES} -sc_threshold 0"
        )
        try:
            subprocess.run([*command.split(), file.name], input=frames.tobytes(), check=True)
        except FileNotFoundError:
            raise SystemExit("ffmpeg is not there, which writes the film: apt-get install ffmpeg") from None
        return Path(file.name).read_bytes()


def frames_of(content: bytes) -> np.ndarray:
    """The frames that `film` was given, with the loss of the compression."""
    with tempfile.NamedTemporaryFile(suffix=".mp4") as file:
        Path(file.name).write_bytes(content)
        capture, frames = cv2.VideoCapture(file.name), []
        while True:
            there, frame = capture.read()
            if not there:
                break
            frames.append(frame[..., ::-1])
    return np.stack(frames)


def make(path: Path, data: Path, sets: list[str], quality: int) -> dict[str, int]:
    """Writes the pack; returns bytes by folder."""
    with tarfile.open(path, "w") as tar:
        pack = PackWriter(tar)
        for kind in sets:
            for split in ("train", "val"):
                paths = clip_paths(data / "clips", kind, split)
                read = [read_rgb(own) for own in paths]
                if not read:
                    raise SystemExit(f"No clips of {kind} ({split}) in {data / 'clips'}: see export/clips/README.md")
                facts = {"names": [own.stem for own in paths], "fps": [fps for _, fps in read]}
                pack.add(f"clips/{kind}-{split}.json", json.dumps(facts).encode())
                pack.add(f"clips/{kind}-{split}.mp4", film(np.concatenate([rgb for rgb, _ in read]), quality))
        for split in ("train", "val"):
            for photo in sorted((data / "backgrounds" / split).glob("*.jpg")):
                pack.add(f"backgrounds/{split}/{photo.name}", jpeg(shrunk(cv2.imread(str(photo)), _STILL_SIDE)))
    return pack.bytes


def open_pack(path: Path, data: Path) -> None:
    """Unpacks into `data`, as trainings read it."""
    with tarfile.open(path) as tar:
        files = {entry.name: tar.extractfile(entry).read() for entry in tar if entry.isfile()}
    for name, content in files.items():
        if name.startswith("backgrounds/"):
            (data / name).parent.mkdir(parents=True, exist_ok=True)
            (data / name).write_bytes(content)
        elif name.endswith(".json"):
            facts, (kind, split) = json.loads(content), Path(name).stem.split("-")
            folder = data / "clips" / kind / split
            folder.mkdir(parents=True, exist_ok=True)
            frames = frames_of(files[name.removesuffix(".json") + ".mp4"])
            for k, (clip, fps) in enumerate(zip(facts["names"], facts["fps"], strict=True)):
                of_clip = json.dumps({"format": FORMAT, "set": kind, "split": split, "fps": fps}).encode()
                own = frames[k * FRAMES : (k + 1) * FRAMES]
                np.savez(folder / f"{clip}.npz", facts=np.frombuffer(of_clip, np.uint8), small_rgb=own)
            print(f"{len(facts['names'])} clips of {kind} ({split})", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("command", choices=("make", "open"))
    parser.add_argument("pack", type=Path)
    parser.add_argument("--data", type=Path, default=DATA, help="default %(default)s")
    parser.add_argument("--sets", nargs="+", default=["pushing", "shapes"], help="default %(default)s")
    parser.add_argument("--quality", type=int, default=14, help="0: lossless, 50: worst (default %(default)s)")
    parser.add_argument("--max-mib", type=float, default=60, help="a larger pack is an error (default %(default)s)")
    options = parser.parse_args()
    if options.command == "open":
        open_pack(options.pack, options.data)
        return
    for name, count in make(options.pack, options.data, options.sets, options.quality).items():
        print(f"{count / 2**20:8.1f} MiB: {name}")
    size = options.pack.stat().st_size / 2**20
    if size > options.max_mib:
        parser.error(f"{options.pack} has {size:.1f} MiB, more than {options.max_mib:g}: raise --quality")


if __name__ == "__main__":
    main()
