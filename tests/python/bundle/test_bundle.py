"""Manifests: what the writers write is what is shipped, and what readers refuse."""

import json
import shutil
from pathlib import Path

import pytest

from export import bundle
from export.bundle import BundleInfo, read_manifest
from export.densepose import bundle as densepose
from export.densepose.graphs import open_bundle
from export.heads import bundle as heads
from export.prediction import bundle as prediction
from export.scenes import bundle as scenes

DENSEPOSE = Path("sdk/models/densepose-b-int8")
TINY = Path("tests/native/data/tiny_bundle")
HEADS = ("sdk/models/heads-int8", "tests/native/data/round_heads/bundle", "tests/native/data/tiny_head/bundle")
PREDICTION = ("sdk/models/prediction-int8", "tests/native/data/tiny_prediction/bundle")
SCENES = ("sdk/models/scenes-int8", "tests/native/data/tiny_scene/bundle")


def copied(folder: str | Path, target: Path) -> tuple[Path, BundleInfo]:
    """A copy without its manifest, and what that said about the bundle."""
    copy = Path(shutil.copytree(folder, target / "bundle"))
    said = read_manifest(copy)
    (copy / "manifest.json").unlink()
    return copy, BundleInfo(said["name"], said["precision"], said["version"], said["training_data"], said["measured"])


def test_the_shipped_dense_pose_manifest_is_what_its_writer_writes(tmp_path):
    source = open_bundle(DENSEPOSE)
    copy, info = copied(DENSEPOSE, tmp_path)
    densepose.write_manifest(copy, info, source.network, source.decode)
    assert (copy / "manifest.json").read_bytes() == (source.folder / "manifest.json").read_bytes()


@pytest.mark.parametrize("folder", SCENES)
def test_the_manifests_of_scene_networks_are_what_their_writer_writes(folder, tmp_path):
    copy, info = copied(folder, tmp_path)
    written = scenes.write_manifest(copy, info)
    assert (copy / "manifest.json").read_bytes() == (Path(folder) / "manifest.json").read_bytes()
    assert scenes.identity(written) == scenes.identity(read_manifest(Path(folder)))


@pytest.mark.parametrize("folder", HEADS)
def test_the_manifests_of_heads_are_what_their_writer_writes(folder, tmp_path):
    copy, info = copied(folder, tmp_path)
    heads.write_manifest(copy, info, face=read_manifest(Path(folder))["encoder"].get("face"))
    assert (copy / "manifest.json").read_bytes() == (Path(folder) / "manifest.json").read_bytes()


@pytest.mark.parametrize("folder", PREDICTION)
def test_the_manifests_of_prediction_are_what_their_writer_writes(folder, tmp_path):
    copy, info = copied(folder, tmp_path)
    prediction.write_manifest(copy, info)
    assert (copy / "manifest.json").read_bytes() == (Path(folder) / "manifest.json").read_bytes()


def test_files_are_signed_with_their_size_and_digest(tmp_path):
    (tmp_path / "abc").write_bytes(b"abc")
    digest = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"  # FIPS 180-4
    assert bundle.signed(tmp_path / "abc") == {"sha256": digest, "bytes": 3}


def test_graphs_with_other_names_are_refused(tmp_path):
    copy, info = copied(TINY, tmp_path)
    graphs = {"box_head": {"inputs": {"rois": ["people", 7, 7, 3]}, "outputs": {"scores": ["people", 6]}}}
    with pytest.raises(ValueError, match=r"has the outputs \['boxes'\]; the format asks for \['scores'\]"):
        bundle.write_manifest(copy, "densepose", info, graphs, files=(), task_keys={})
    assert not (copy / "manifest.json").exists()


def test_a_bundle_of_another_format_version_is_refused_with_what_to_do(tmp_path):
    copy = Path(shutil.copytree(TINY, tmp_path / "bundle"))
    manifest = read_manifest(copy)
    for version in (bundle.FORMAT_VERSION - 1, bundle.FORMAT_VERSION + 1, None):
        (copy / "manifest.json").write_text(json.dumps(manifest | {"format_version": version}))
        with pytest.raises(ValueError, match=f"has format version {version}, .*export it again"):
            read_manifest(copy)


def test_a_folder_without_a_manifest_is_not_a_bundle(tmp_path):
    with pytest.raises(FileNotFoundError, match="is not a model bundle"):
        read_manifest(tmp_path)
