"""Edges by mistake on scans of round things: which frames and pixels count, and what is said without them."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.edges import round_scans, section_of_views
from export.depth_frames.frames import DepthFrame
from export.solids.records import write_shard

SHAPE = 48, 64


class Found:
    """A bundle in whose fields the first `columns` are an edge."""

    columns = 16

    def __init__(self, *_):
        pass

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def run(self, depth, camera):
        assert camera.focal_px == 60
        distance = np.broadcast_to(np.where(np.arange(depth.shape[1]) < self.columns, 0.5, 16), depth.shape)
        return SimpleNamespace(distance=distance)


def write(folder, names):
    smooth = np.zeros(SHAPE, bool)
    smooth[:, :32] = True
    frames = [DepthFrame(name, np.ones(SHAPE, np.float32), (60.0, 60.0, 31.5, 23.5), smooth) for name in names]
    write_shard(folder / "solids-00000.npz", [frame.record() for frame in frames], {"split": "real"})


def test_pixels_where_no_edge_is_right_count_over_both_scans_and_no_other_frame(tmp_path, monkeypatch):
    monkeypatch.setattr(round_scans, "Edges", Found)
    write(tmp_path, [*round_scans.NAMES, "real/board-02"])
    found = round_scans.measure(tmp_path, Path("bundle"), 1)
    assert found["pixels"] == 2 * SHAPE[0] * 32
    assert [scan["name"] for scan in found["scans"]] == list(round_scans.NAMES)
    assert round_scans.figures_from(found) == {round_scans.FIGURE: pytest.approx(50)}
    table, _ = section_of_views.round_parts(found)
    assert table[-1] == ["both", "3,072", "50.00", "50.0"]


def test_what_is_missing_is_said(tmp_path, monkeypatch):
    monkeypatch.setattr(round_scans, "SCANS", tmp_path)
    assert round_scans.found_in(Path("bundle"), 1) == (None, f"{tmp_path} has no scans: {round_scans.FETCH}")
    write(tmp_path, [round_scans.NAMES[0], "real/walls"])
    assert round_scans.found_in(Path("bundle"), 1) == (None, f"{tmp_path} has 1 of 2 scans: {round_scans.FETCH}")
    assert round_scans.figures_from(None) == {}
    assert section_of_views.round_parts(None) == []
