"""`maquette edges` against the ONNX graph in Python."""

import json
import subprocess
from pathlib import Path

import cv2
import numpy as np
import pytest
import torch

from export.bundle import BundleInfo
from export.densepose.graphs import session
from export.edges.bundle import write_manifest
from export.edges.config import EPS_R, NetworkConfig
from export.edges.export_onnx import export
from export.edges.graph_field import field_of_planes, slopes_of
from export.edges.network import EdgeNetwork

PROGRAM = Path("build/release/stage/bin/maquette")
CONFIG = NetworkConfig((6, 8, 8))
FOCAL_PX = 45.0

pytestmark = pytest.mark.skipif(not PROGRAM.exists(), reason="the program is not built: make build")


@pytest.fixture(scope="module")
def bundle(tmp_path_factory):
    folder = tmp_path_factory.mktemp("edges")
    torch.manual_seed(0)
    network = EdgeNetwork(CONFIG).eval()
    network.head.weight.data *= 20
    network.head.bias.data[:4] = 0.5
    export(network, folder, CONFIG.multiple)
    write_manifest(folder, BundleInfo("random", "fp32"), CONFIG.multiple)
    return folder


def depth_frame(width: int, height: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:height, :width]
    depth = 2 / (1 + 0.01 * x + 0.003 * y)
    depth[height // 3 :, width // 2 :] = 1.1
    depth *= rng.normal(1, 0.003, depth.shape)
    depth[rng.random(depth.shape) < 0.05] = 0
    return depth.astype(np.float32)


def found_by_command(bundle: Path, folder: Path, source: str, *options: str) -> tuple[np.ndarray, dict]:
    command = [PROGRAM, "edges", source, "--out", folder / "out", "--bundle", bundle, "--json", *options]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    (distance,) = (folder / "out").glob("*_distance.png")
    return cv2.imread(str(distance), cv2.IMREAD_UNCHANGED) / 1000, json.loads(done.stdout)


def found_by_graph(bundle: Path, depth: np.ndarray) -> np.ndarray:
    given = slopes_of(depth, FOCAL_PX, CONFIG.multiple)
    (planes,) = session(bundle / "field.onnx").run(None, {"slopes": given})
    field = field_of_planes(planes)[: depth.shape[0], : depth.shape[1]]
    return np.where(depth > 0, field, EPS_R)


@pytest.mark.parametrize(("width", "height"), [(48, 40), (33, 51), (1, 1), (300, 1)])
def test_the_command_finds_the_field_of_the_graph(bundle, tmp_path, width, height):
    depth = depth_frame(width, height, seed=width)
    cv2.imwrite(str(tmp_path / "depth.tiff"), depth)
    source = f"image:{tmp_path}/depth.tiff?depth_unit=1&fx={FOCAL_PX}"
    found, line = found_by_command(bundle, tmp_path, source)
    # Files have thousandths; slopes differ by the rounding of inverse depths in Python.
    assert np.abs(found - found_by_graph(bundle, depth)).max() < 5e-3
    assert line["known_pixels"] == (depth > 0).sum()


def test_millimetres_of_16_bits_are_the_same_depth(bundle, tmp_path):
    millimetres = (1000 * depth_frame(40, 32, seed=5)).astype(np.uint16)
    cv2.imwrite(str(tmp_path / "depth.png"), millimetres)
    found, _ = found_by_command(bundle, tmp_path, f"image:{tmp_path}/depth.png?depth_unit=0.001&fx={FOCAL_PX}")
    depth = millimetres.astype(np.float32) * np.float32(0.001)
    assert np.abs(found - found_by_graph(bundle, depth)).max() < 5e-3


def test_planes_are_skipped_when_asked_for(bundle, tmp_path):
    source = "stub:solids?scene=wall&size=160x120"
    found, line = found_by_command(bundle, tmp_path, source, "--skip-planes", "--max-frames", "1")
    assert line["network_pixels"] == 0
    assert (found == EPS_R).all()


def test_frames_of_a_camera_at_rest_are_averaged_when_asked_for(bundle, tmp_path):
    rng = np.random.default_rng(4)
    folder = tmp_path / "frames"
    folder.mkdir()
    y, x = np.mgrid[:96, :128]
    depth = 1 / (0.7 + 0.001 * x - 0.0008 * y)
    for k in range(8):
        noisy = depth * (1 + rng.normal(0, 1 / FOCAL_PX, depth.shape))
        cv2.imwrite(str(folder / f"{k}.tiff"), noisy.astype(np.float32))
    sources = [f"image:{folder}/{k}.tiff?depth_unit=1&fx={FOCAL_PX}" for k in range(8)]
    command = [str(PROGRAM), "edges", *sources, "--bundle", str(bundle), "--out", str(tmp_path), "--json"]
    counts = {}
    for options in ((), ("--average", "8")):
        run = subprocess.run([*command, *options], capture_output=True, text=True, check=True)
        counts[options] = [json.loads(line)["averaged_pixels"] for line in run.stdout.splitlines()]
    assert counts[()] == [0] * 8
    alone, *rest = counts["--average", "8"]
    assert alone == 0
    assert min(rest) > 0.98 * depth.size
    refused = subprocess.run([*command, "--average", "65"], capture_output=True, text=True)
    assert refused.returncode != 0
    assert "--average" in refused.stderr


def test_the_lower_border_of_a_frame_that_is_no_multiple_is_no_edge(tmp_path):
    y, x = np.mgrid[:120, :212]  # 424 x 240 halved: 120 = 7.5 x 16, 212 = 13.25 x 16
    depth = (1 / (0.5 + 0.0018 * x - 0.0012 * y)).astype(np.float32)
    cv2.imwrite(str(tmp_path / "plane.tiff"), depth)
    shipped = Path(__file__).parents[3] / "sdk/models/edges-int8"
    found, _ = found_by_command(shipped, tmp_path, f"image:{tmp_path}/plane.tiff?depth_unit=1&fx=170")
    assert (found > 12).mean() > 0.99
