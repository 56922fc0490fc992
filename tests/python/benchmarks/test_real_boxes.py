"""Reading organised point clouds, and cartons that stand in several frames."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from benchmarks.edges import real_boxes


def write_cloud(path: Path, points: np.ndarray) -> None:
    """points: float32 [H, W, 3]. The stream has literal runs alone."""
    height, width = points.shape[:2]
    content = np.moveaxis(points, -1, 0).astype("<f4").tobytes()
    packed = b"".join(bytes([len(part) - 1]) + part for part in
                      (content[k : k + 32] for k in range(0, len(content), 32)))  # fmt: skip
    head = (f"# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {width}\n"
            f"HEIGHT {height}\nPOINTS {width * height}\nDATA binary_compressed\n")  # fmt: skip
    path.write_bytes(head.encode() + struct.pack("<II", len(packed), len(content)) + packed)


def test_depth_and_camera_of_a_cloud_are_those_it_was_made_with(tmp_path):
    v, u = np.mgrid[0:6, 0:8].astype(float)
    z = 1 + 0.1 * u
    points = np.stack([(u - 3.2) / 525 * z, (v - 2.5) / 520 * z, z], -1)
    points[2, 3] = np.nan
    write_cloud(tmp_path / "cloud.pcd", points)
    depth, camera = real_boxes.read_depth(tmp_path / "cloud.pcd")
    assert depth[2, 3] == 0
    assert depth[0, 7] == pytest.approx(1.7)
    assert (camera.fx_px, camera.fy_px) == pytest.approx((525, 520), rel=1e-4)
    assert (camera.cx_px, camera.cy_px) == pytest.approx((3.2, 2.5), abs=1e-2)


def test_a_cloud_without_rows_is_left_out_and_another_file_is_refused(tmp_path):
    write_cloud(tmp_path / "cloud.pcd", np.ones((1, 5, 3)))
    assert real_boxes.read_depth(tmp_path / "cloud.pcd") is None
    (tmp_path / "text.pcd").write_text("DATA ascii\n")
    with pytest.raises(ValueError, match=r"no compressed \.pcd"):
        real_boxes.read_depth(tmp_path / "text.pcd")


def test_references_of_the_stream_repeat_what_was_written():
    assert real_boxes.decompressed(bytes([2]) + b"abc" + bytes([(3 << 5), 2]), 8) == b"abcabcab"
    for damaged in (bytes([32, 5]), bytes([5]) + b"ab", bytes([32])):
        with pytest.raises(ValueError, match="compressed point cloud"):
            real_boxes.decompressed(damaged, 8)


def test_boxes_of_about_one_size_are_one_carton():
    sizes = np.array([[0.2, 0.1, 0.05], [0.4, 0.3, 0.2], [0.205, 0.1, 0.052], [0.2, 0.104, 0.05]])
    cartons = real_boxes.cartons_of(sizes)
    assert [len(of) for of in cartons] == [3, 1]


def test_a_folder_without_frames_is_refused(tmp_path):
    with pytest.raises(FileNotFoundError, match="mOSD"):
        real_boxes.measure(tmp_path)
