"""Recordings of depth cameras are read as the SDK wrote them, and what cannot be used is told in a sentence."""

import json
import struct
import subprocess
from pathlib import Path

import cv2
import numpy as np
import pytest

from export.depth_frames.__main__ import main
from export.depth_frames.recordings import RecordingError, frames_of
from export.solids.records import read_records

PROGRAM = Path("build/release/stage/bin/maquette")
CAMERA = {
    "width_px": 40, "height_px": 32, "fx_px": 50.0, "fy_px": 51.0, "cx_px": 19.0, "cy_px": 16.0,
    "distortion": [0.0] * 8,
}  # fmt: skip
SIZES = {"boxes": [{"name": "carton", "size_m": [0.2, 0.4, 0.3], "error_m": 0.002}]}


def frame(encoding: int, pixels: np.ndarray, depth: np.ndarray | None = None) -> bytes:
    height, width = pixels.shape[:2]
    beside = (0, 0) if depth is None else depth.shape[::-1]
    head = struct.pack("<4sIqQIiiiiIQQ", b"MAQF", 0, 0, 0, encoding, width, height, *beside, 0, pixels.nbytes, 0)
    return head + pixels.tobytes() + (b"" if depth is None else depth.tobytes())


def recording(path: Path, *frames: bytes, camera: dict | None = CAMERA) -> Path:
    head = json.dumps({"made_by": "a test"} | ({"calibration": camera} if camera else {})).encode()
    path.write_bytes(b"MAQREC\r\n" + struct.pack("<IIQ", 1, len(head), 0) + head + b"".join(frames))
    return path


def millimetres(seed: int) -> np.ndarray:
    depth = np.random.default_rng(seed).integers(300, 4000, (32, 40), dtype=np.uint16)
    depth[0, :3] = 0, 65535, 65534
    return depth


def test_depth_of_all_kinds_is_read_in_metres(tmp_path):
    metres = np.full((32, 40), 1.25, "<f4")
    metres[0, :4] = np.nan, np.inf, -1, 0
    path = recording(
        tmp_path / "take.maqrec",
        frame(7, millimetres(1)),
        frame(8, metres),
        frame(1, np.zeros((64, 80, 3), np.uint8), millimetres(2)),
    )
    a, b, c = frames_of(path)
    assert a.intrinsics == (50, 51, 19, 16)
    np.testing.assert_allclose(a.depth[1:], millimetres(1)[1:] / 1000, rtol=1e-6)
    np.testing.assert_allclose(a.depth[0, :3], (0, 0, 65.534), rtol=1e-6)
    assert (b.depth[0, :4] == 0).all()
    assert (b.depth[1:] == 1.25).all()
    np.testing.assert_allclose(c.depth[1:], millimetres(2)[1:] / 1000, rtol=1e-6)
    assert [f.name for f in frames_of(path, every=2)] == ["own/take/000000", "own/take/000002"]
    assert len(frames_of(path, most=1)) == 1


def test_a_recording_cut_anywhere_gives_the_frames_that_are_whole(tmp_path):
    one = frame(7, millimetres(1))
    whole = recording(tmp_path / "whole.maqrec", one, one).read_bytes()
    first = len(whole) - len(one)
    for cut in (*range(0, 200, 13), first - 1, first, first + 10, len(whole) - 1, len(whole)):
        path = tmp_path / "cut.maqrec"
        path.write_bytes(whole[:cut])
        if cut < first:
            with pytest.raises(RecordingError, match=r"cut\.maqrec"):
                frames_of(path)
        else:
            assert len(frames_of(path)) == 1 + (cut == len(whole))


@pytest.mark.parametrize(
    ("camera", "wanted"),
    [
        (None, "no calibration.*fov="),
        (CAMERA | {"distortion": [0.1] + [0.0] * 7}, "rectified"),
        (CAMERA | {"width_px": 80}, "another size"),
    ],
)
def test_a_camera_that_is_not_known_is_told(tmp_path, camera, wanted):
    with pytest.raises(RecordingError, match=wanted):
        frames_of(recording(tmp_path / "a.maqrec", frame(7, millimetres(1)), camera=camera))


def test_images_without_depth_are_told(tmp_path):
    with pytest.raises(RecordingError, match="no frame of depth"):
        frames_of(recording(tmp_path / "a.maqrec", frame(1, np.zeros((32, 40, 3), np.uint8))))


@pytest.mark.parametrize(
    "text",
    ["{", "[]", '{"boxes": [{"size_m": [1, 1, 1]}]}', '{"boxes": [{"name": "a", "size_m": [1, 1]}]}',
     '{"boxes": [{"name": "a", "size_m": [400, 300, 200]}]}'],
)  # fmt: skip
def test_sizes_of_another_form_are_told(tmp_path, text):
    path = recording(tmp_path / "a.maqrec", frame(7, millimetres(1)))
    path.with_suffix(".json").write_text(text)
    with pytest.raises(RecordingError, match=r"a\.json"):
        frames_of(path)


def test_true_sizes_come_with_each_view(tmp_path, capsys):
    path = recording(tmp_path / "box.maqrec", frame(7, millimetres(1)))
    path.with_suffix(".json").write_text(json.dumps(SIZES))
    assert main(["record", str(path), "--out", str(tmp_path / "own")]) == 0
    (record,) = read_records(tmp_path / "own")
    assert record.seen_curves()["boxes"] == [{"name": "carton", "size_m": [0.4, 0.3, 0.2], "error_m": 0.002}]
    planes = record.decoded()
    assert planes["depth"].shape == (32, 32)  # multiples of 16
    assert planes["ignore"].all()
    assert main(["record", str(tmp_path / "none.maqrec")]) == 1
    assert "none.maqrec cannot be read" in capsys.readouterr().err


@pytest.mark.skipif(not PROGRAM.exists(), reason="the program is not built: make build")
def test_what_the_program_records_is_read_back(tmp_path):
    depth = millimetres(4)
    cv2.imwrite(str(tmp_path / "depth.png"), depth)
    source = f"image:{tmp_path}/depth.png?depth_unit=0.001&fov=60"
    path = tmp_path / "take.maqrec"
    subprocess.run([PROGRAM, "record", source, path, "--frames", "1"], check=True, capture_output=True)
    (seen,) = frames_of(path)
    np.testing.assert_allclose(seen.depth, np.where(depth < 65535, depth / 1000, 0), rtol=1e-6)
    assert seen.intrinsics[0] == pytest.approx(20 / np.tan(np.radians(30)), rel=1e-6)
