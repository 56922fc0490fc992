"""Compact crops: what is kept exactly, how far the rest is off, and what is said of other files."""

import numpy as np
import pytest
from box_crops import write_crops

from export.solids.compact import read_compact, write_compact
from export.solids.records import RecordError, packed, read_records

FOCAL_PX = 300.0


def crop(number: int) -> dict[str, np.ndarray]:
    """A ball before two leaning walls, with a hole, noise of labels and a part that is left out."""
    y, x = np.mgrid[:64, :96].astype(np.float64)
    depth = 1 / (0.5 + 0.0013 * x - 0.0007 * (y + number))
    depth[:, 48:] = 1 / (0.6 - 0.0011 * x - 0.0007 * y)[:, 48:]
    off = np.hypot(x - 50, y - 30)
    ball = off < 14
    depth[ball] = 1.4 - np.sqrt(16**2 - off[ball] ** 2) * 0.01
    depth[:5, :7] = 0
    patch = np.where(ball, 900, np.where(x < 48, 17, 3))
    distance = np.random.default_rng(number).uniform(0, 16, depth.shape)
    distance[40:] = 16
    return {
        "depth": depth.astype(np.float32),
        "distance": distance.astype(np.float16),
        "kind": np.where(distance < 16, number % 4, 0).astype(np.uint8),
        "ignore": (y + x) % 9 == 0,
        "patch": np.where(depth > 0, patch, 65535).astype(np.uint16),
    }


@pytest.fixture
def records():
    return [packed(f"crop/{k}", crop(k), (FOCAL_PX, FOCAL_PX, 10.0 + k, 4.0)) for k in range(5)]


def test_depth_and_distances_come_back_within_their_steps_and_the_rest_exactly(records, tmp_path):
    write_compact(tmp_path / "crops.xz", records)
    found = list(read_compact(tmp_path / "crops.xz"))
    assert len(found) == len(records)
    for record, compact in zip(records, found, strict=True):
        before, after = record.decoded(), compact.decoded()
        assert (compact.name, compact.height, compact.width) == (record.name, record.height, record.width)
        assert compact.intrinsics == record.intrinsics
        assert {name: plane.dtype for name, plane in before.items()} == {n: p.dtype for n, p in after.items()}
        assert np.array_equal(before["kind"], after["kind"])
        assert np.array_equal(before["ignore"], after["ignore"])
        known = before["depth"] > 0
        assert np.array_equal(known, after["depth"] > 0)
        off_r = np.abs(before["depth"] - after["depth"])[known] / before["depth"][known] * FOCAL_PX
        assert off_r.max() <= 0.0101
        assert off_r[before["patch"][known] != 900].max() < 1e-4  # flat patches: to the digits of float32
        assert np.abs(before["distance"].astype(float) - after["distance"]).max() <= 1 / 31
        names = {(a, b) for a, b in zip(before["patch"].ravel(), after["patch"].ravel(), strict=True)}
        assert len(names) == 4  # one new number for each old one
        assert (65535, 65535) in names


def test_the_same_crops_make_the_same_bytes(records, tmp_path):
    for name in ("first", "second"):
        write_compact(tmp_path / name, records)
    assert (tmp_path / "first").read_bytes() == (tmp_path / "second").read_bytes()


def test_other_files_and_crops_are_refused_in_a_sentence(records, tmp_path):
    write_compact(tmp_path / "crops.xz", records)
    whole = (tmp_path / "crops.xz").read_bytes()
    for content in (b"", whole[:-40], b"PK" + whole, whole[:200] + bytes(50) + whole[250:]):
        (tmp_path / "broken.xz").write_bytes(content)
        with pytest.raises(RecordError, match="make it again"):
            list(read_compact(tmp_path / "broken.xz"))
    others = list(read_records(write_crops(tmp_path / "box", 0, 1)))
    for mixed in ([*records, *others], []):
        with pytest.raises(RecordError, match="different sizes, or none"):
            write_compact(tmp_path / "mixed.xz", mixed)
