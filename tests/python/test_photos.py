"""The lists of photographs agree with each other, and packages are read and checked as promised."""

import hashlib
import io
import tarfile
import zipfile

import cv2
import numpy as np
import pytest

from export.photos import backgrounds, packages, people
from export.photos.packages import Package, PackageError, PackageReader, fetch


def test_every_photo_comes_from_a_listed_package_and_every_package_is_used():
    listed = set(packages.load_packages())
    used = {p.package for p in backgrounds.load_backgrounds()} | {m.package for m in people.load_people()}
    assert used == listed


def test_no_package_is_under_a_copyleft_or_non_commercial_licence():
    for package in packages.load_packages().values():
        licence = package.licence.split("(")[0]
        assert not any(word in licence for word in ("GPL", "-NC", "NC-", "-SA")), package.name


def test_there_are_enough_photos_and_every_split_has_some():
    photos = backgrounds.load_backgrounds()
    assert len(photos) >= 150
    assert len({p.name for p in photos}) == len(photos)
    counts = {split: sum(p.split == split for p in photos) for split in backgrounds.SPLITS}
    assert counts["train"] > 5 * max(counts["val"], counts["test"])
    assert min(counts.values()) >= 10
    assert sum(m.kind == "photo" for m in people.load_people()) >= 12


def test_photos_of_one_scene_share_a_split():
    scenes = {}
    for photo in backgrounds.load_backgrounds():
        scenes.setdefault(photo.scene, set()).add(photo.split)
    assert all(len(splits) == 1 for splits in scenes.values())


def test_the_split_of_a_name_never_changes():
    found = {split: [] for split in backgrounds.SPLITS}
    for k in range(24):
        found[backgrounds.split_of(f"photo-{k}")].append(k)
    assert found["val"] == [7, 11, 15]
    assert found["test"] == [2, 5, 16]


@pytest.mark.parametrize(("size", "expected"), [((100, 300), (100, 300)), ((1000, 1500), (576, 864))])
def test_shrinking_keeps_small_photos_and_the_aspect_of_large_ones(size, expected):
    assert backgrounds.shrink(np.zeros((*size, 3), np.uint8)).shape[:2] == expected


def archive(folder, kind, content=b"hello"):
    path = folder / f"a{kind}"
    if kind == ".whl":
        with zipfile.ZipFile(path, "w") as file:
            file.writestr("in/side.txt", content)
    else:
        with tarfile.open(path, "w:gz") as file:
            entry = tarfile.TarInfo("in/side.txt")
            entry.size = len(content)
            file.addfile(entry, io.BytesIO(content))
    return path


@pytest.mark.parametrize("kind", [".whl", ".tgz"])
def test_members_of_archives_are_read_and_missing_ones_named(tmp_path, kind):
    with PackageReader(archive(tmp_path, kind)) as reader:
        assert reader.read("in/side.txt") == b"hello"
        with pytest.raises(PackageError, match=r"has no file in/other\.txt"):
            reader.read("in/other.txt")


def test_a_changed_archive_is_refused(tmp_path, monkeypatch):
    path = archive(tmp_path, ".whl")
    monkeypatch.setattr(packages, "ARCHIVES", tmp_path)
    right = hashlib.sha256(path.read_bytes()).hexdigest()
    package = Package("a", "pip", "a", "1", path.name, right, "MIT")
    assert fetch(package) == path
    path.write_bytes(path.read_bytes() + b"x")
    with pytest.raises(PackageError, match="has SHA-256"):
        fetch(package)


def test_building_writes_each_photo_once_into_its_split(tmp_path, monkeypatch):
    png = cv2.imencode(".png", np.full((700, 900, 3), 90, np.uint8))[1].tobytes()
    path = archive(tmp_path, ".whl", png)
    package = Package("a", "pip", "a", "1", path.name, packages.sha256_of(path), "MIT")
    photo = backgrounds.Background("one", "a", "in/side.txt", "one")
    monkeypatch.setattr(packages, "ARCHIVES", tmp_path)
    monkeypatch.setattr(backgrounds, "load_packages", lambda: {"a": package})
    monkeypatch.setattr(backgrounds, "load_backgrounds", lambda: [photo])
    assert sum(backgrounds.build(tmp_path / "out").values()) == 1
    written = tmp_path / "out" / photo.split / "one.jpg"
    assert cv2.imread(str(written)).shape == (576, 741, 3)
    path.unlink()
    backgrounds.build(tmp_path / "out")  # nothing is missing, so the package is not needed
