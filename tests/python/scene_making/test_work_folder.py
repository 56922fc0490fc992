"""Results of stages: kept, forgotten when the input changes, and never in a folder of somebody else's files."""

import json
import os
from pathlib import Path

import maquette
import pytest
from maquette.scene_making.work_folder import WorkFolder, write_atomically


def test_results_are_kept_until_the_input_changes(tmp_path):
    folder = tmp_path / "work"
    work = WorkFolder(folder, {"files": [1]})
    assert work.result("photos") is None
    (work.fresh_folder("photos") / "a.jpg").write_bytes(b"a")
    work.finish("photos", {"count": 1})
    work.close()
    work = WorkFolder(folder, {"files": [1]})
    assert work.result("photos") == {"count": 1}
    assert (folder / "photos/a.jpg").exists()
    work.close()
    work = WorkFolder(folder, {"files": [2]})
    assert work.result("photos") is None
    assert not (folder / "photos").exists()
    work.close()


def test_a_damaged_list_of_stages_starts_again(tmp_path):
    WorkFolder(tmp_path / "work", {}).close()
    (tmp_path / "work/stages.json").write_text('{"key"')
    work = WorkFolder(tmp_path / "work", {})
    assert work.result("photos") is None
    work.close()


def test_a_folder_of_other_files_is_left_alone(tmp_path):
    (tmp_path / "thesis.txt").write_text("mine")
    with pytest.raises(maquette.MaquetteError, match="not a work folder"):
        WorkFolder(tmp_path, {})
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]
    with pytest.raises(maquette.MaquetteError, match="is a file"):
        WorkFolder(tmp_path / "thesis.txt", {})


def test_two_processes_do_not_share_a_folder(tmp_path):
    work = WorkFolder(tmp_path / "work", {})
    with pytest.raises(maquette.MaquetteError, match="in use by another process"):
        WorkFolder(tmp_path / "work", {})
    work.close()
    WorkFolder(tmp_path / "work", {}).close()


def test_a_full_disk_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "stages.json"
    write_atomically(path, json.dumps({"old": 1}))

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left"):
        write_atomically(path, json.dumps({"new": 1}))
    assert json.loads(path.read_text()) == {"old": 1}
    assert [Path(name).name for name in os.listdir(tmp_path)] == ["stages.json"]
