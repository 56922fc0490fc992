"""The lists of photographs agree with each other, and packages are read and checked as promised."""

import hashlib
import io
import json
import tarfile
import zipfile

import cv2
import numpy as np
import pytest

from export.photos import backgrounds, packages, panoramas, people
from export.photos.packages import Package, PackageError, PackageReader, fetch


def test_every_photo_comes_from_a_listed_package_and_every_package_is_used():
    listed = set(packages.load_packages())
    photos = backgrounds.load_backgrounds() + backgrounds.load_photographs()
    assert {p.package for p in photos} | {m.package for m in people.load_people()} | {panoramas.PACKAGE} == listed


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


def test_no_photograph_is_both_trained_on_and_tested_on():
    photos = backgrounds.load_photographs()
    assert len({p.name for p in photos}) == len({(p.package, p.member) for p in photos}) == len(photos)
    looked_at = {(m.package, m.member) for m in people.load_people()}
    assert not looked_at & {(p.package, p.member) for p in photos}
    assert {p.split for p in photos} == {
        "train",
        "val",
        "test",
        "fresh",
        "empty",
        "animals",
        "train-animals",
        "views",
    }


def test_no_animal_of_the_test_stands_in_the_background_of_training():
    tested = {(p.package, p.member) for p in backgrounds.load_photographs() if p.split == "animals"}
    assert len(tested) >= 20
    assert not tested & {(p.package, p.member) for p in backgrounds.load_backgrounds()}


def test_animals_to_train_with_are_many_and_no_package_has_animals_of_the_test_too():
    photos = backgrounds.load_photographs()
    trained = [p for p in photos if p.split == "train-animals"]
    assert len(trained) >= 59
    assert not {p.package for p in trained} & {p.package for p in photos if p.split == "animals"}
    kept_from_training = {p.member for p in backgrounds.load_backgrounds() if p.split != "train"}
    assert not [p.name for p in trained if p.member in kept_from_training]


def test_photographs_without_a_licence_for_more_are_tested_on_alone():
    listed = packages.load_packages()
    for photo in backgrounds.load_photographs():
        if "tests only" in listed[photo.package].licence:
            assert photo.split in ("test", "fresh", "empty", "animals"), photo.name


def test_nothing_is_trained_on_or_chosen_by_that_shares_a_package_with_the_fresh_test():
    photos = backgrounds.load_photographs()
    fresh = [p for p in photos if p.split == "fresh"]
    assert len(fresh) >= 40
    learnt_from = [p for p in photos if p.split in ("train", "val", "train-animals")]
    learnt_from += [p for p in backgrounds.load_backgrounds() if p.split != "test"]
    assert not {p.package for p in fresh} & {p.package for p in learnt_from}


def test_nothing_of_the_performance_that_checks_views_is_trained_on():
    checked = {p.package for p in backgrounds.load_photographs() if p.split == "views"}
    assert checked
    assert not [p.name for p in backgrounds.load_photographs() if p.split == "train" and p.package in checked]
    poses = json.loads((backgrounds.FOLDER.parent / "people" / "photo_poses.json").read_text())["poses"]
    trained = {p.name for p in backgrounds.load_photographs() if p.split == "train"}
    assert {pose["photo"] for pose in poses} <= trained


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
    photo = backgrounds.Photograph("one", "a", "in/side.txt", "val")
    monkeypatch.setattr(packages, "ARCHIVES", tmp_path)
    monkeypatch.setattr(backgrounds, "load_packages", lambda: {"a": package})
    assert backgrounds.build([photo], tmp_path / "out") == {"val": 1}
    written = tmp_path / "out" / "val" / "one.jpg"
    assert cv2.imread(str(written)).shape == (576, 741, 3)
    path.unlink()
    backgrounds.build([photo], tmp_path / "out")  # nothing is missing, so the package is not needed


def test_a_photo_may_be_a_frame_of_a_clip(tmp_path, monkeypatch):
    writer = cv2.VideoWriter(str(tmp_path / "clip.avi"), cv2.VideoWriter_fourcc(*"MJPG"), 10, (64, 48))
    for k in range(5):
        writer.write(np.full((48, 64, 3), 50 * k, np.uint8))
    writer.release()
    path = archive(tmp_path, ".whl", (tmp_path / "clip.avi").read_bytes())
    package = Package("a", "pip", "a", "1", path.name, packages.sha256_of(path), "MIT")
    monkeypatch.setattr(packages, "ARCHIVES", tmp_path)
    monkeypatch.setattr(backgrounds, "load_packages", lambda: {"a": package})
    backgrounds.build([backgrounds.Photograph("third", "a", "in/side.txt#3", "train")], tmp_path)
    assert cv2.imread(str(tmp_path / "train" / "third.jpg")).mean() == pytest.approx(150, abs=3)
    with pytest.raises(PackageError, match=r"side\.txt#9 is not an image"):
        backgrounds.build([backgrounds.Photograph("beyond", "a", "in/side.txt#9", "train")], tmp_path)
