"""Results for supervision, rerun, ComfyUI, and in the colours of detectron2, with the real packages."""

import importlib.util
import subprocess
from pathlib import Path

import cv2
import maquette
import numpy as np
import pytest
from maquette.adapters.detectron2 import MAPS, visualize

ROOT = Path(__file__).parents[3]
MAP_OF = {"detectron2": cv2.COLORMAP_PARULA, "magicanimate": cv2.COLORMAP_VIRIDIS}
GROUND = {"detectron2": (0, 0, 0), "magicanimate": (68, 1, 84)}


@pytest.fixture(scope="module")
def frame() -> maquette.Frame:
    return maquette.Source("stub:people?count=2&seed=3&size=320x240").read()


@pytest.fixture(scope="module")
def result(frame) -> maquette.DensePoseResult:
    return maquette.DensePose(threads=1).run(frame)


def reference(result, show: str, colours: str, image: np.ndarray, opacity: float) -> np.ndarray:
    """The image as detectron2's MatrixVisualizer computes it, for the whole frame (densepose/vis/base.py)."""
    values = {"parts": result.part, "u": result.u, "v": result.v}[show].astype(np.float32)
    scaled = (values * (255.0 / 24 if show == "parts" else 1.0)).clip(0, 255).astype(np.uint8)
    shown = cv2.applyColorMap(scaled, MAP_OF[colours])[..., ::-1].copy()
    shown[result.part == 0] = image[result.part == 0]
    return (image * (1.0 - opacity) + shown * opacity).astype(np.uint8)


@pytest.mark.parametrize("colours", MAPS)
@pytest.mark.parametrize("show", ["parts", "u", "v"])
def test_colours_are_those_of_detectron2(result, frame, show, colours):
    ramp = np.arange(256, dtype=np.uint8)[:, None]
    assert np.array_equal(MAPS[colours], cv2.applyColorMap(ramp, MAP_OF[colours])[:, 0, ::-1])
    ground = np.broadcast_to(np.array(GROUND[colours], np.uint8), (*result.part.shape, 3))
    assert np.array_equal(visualize(result, show, colours), reference(result, show, colours, ground, 1.0))
    over = visualize(result, show, colours, image=frame, opacity=0.7)
    body = result.part > 0
    assert np.array_equal(over[body], reference(result, show, colours, frame.pixels(), 0.7)[body])
    assert np.array_equal(over[~body], frame.pixels()[~body])


@pytest.mark.parametrize("colours", MAPS)
def test_the_library_and_the_command_line_draw_the_same_colours(result, colours, tmp_path):
    drawn = result.draw(opacity=255, colours=colours)
    body = result.part > 0
    assert np.array_equal(drawn[body, :3], visualize(result, colours=colours)[body])
    assert not drawn[~body].any()
    program = ROOT / "build/release/stage/bin/maquette"
    source = "stub:people?count=2&seed=3&size=320x240"
    options = ["--threads", "1", "--max-frames", "1", "--overlay", "--colours", colours]
    subprocess.run([program, "densepose", source, "--out", tmp_path, *options], check=True, capture_output=True)
    iuv = cv2.imread(str(next(tmp_path.glob("*_IUV.png"))))
    shown = maquette.Source(next(tmp_path.glob("*_overlay.*"))).read().pixels().astype(int)
    wanted = MAPS[colours][iuv[..., 0].astype(int) * 85 // 8]
    wanted[iuv[..., 0] == 0] = GROUND[colours]
    assert np.median(np.abs(shown - wanted)) <= 3  # a clip is compressed


def test_people_are_detections_of_supervision(result, frame):
    supervision = pytest.importorskip("supervision", reason="supervision is not installed: pip install -e '.[dev]'")
    from maquette.adapters.supervision import detections

    found = detections(result)
    assert len(found) == len(result.people) == 2
    assert found.confidence == pytest.approx([person.score for person in result.people])
    assert np.array_equal(found.mask[1], result.person == 2)
    assert found.tracker_id.tolist() == [person.id for person in result.people]
    painted = supervision.MaskAnnotator().annotate(frame.pixels(), found)
    assert np.array_equal((painted != frame.pixels()).any(-1), result.person > 0)
    assert len(found[found.confidence > 2]) == 0
    nobody = maquette.DensePose(threads=1).run(np.zeros((64, 64, 3), np.uint8))
    assert len(detections(nobody)) == 0


def test_results_are_logged_to_rerun(result, frame, tmp_path):
    rerun = pytest.importorskip("rerun", reason="rerun-sdk is not installed: pip install -e '.[dev]'")
    from maquette.adapters import rerun as to_rerun

    rerun.init("maquette-test")
    rerun.save(tmp_path / "log.rrd")
    source = maquette.Source("stub:solids?scene=box&noise=none&size=320x240&seed=1")
    depth = source.read()
    curves = maquette.Edges(threads=1).run(depth, curves=True).curves
    camera = maquette.PinholeCamera.looking_at(source.intrinsics, (0, 0, 1), (0, 1, 0), (0, 0, 1))
    to_rerun.log_people("camera", frame, result)
    to_rerun.log_frame("depth", depth)
    to_rerun.log_curves("depth/edges", curves)
    to_rerun.log_camera("view", camera)
    rerun.disconnect()
    assert (tmp_path / "log.rrd").stat().st_size > 50_000
    turn = to_rerun._quaternion(curves.boxes[0].axes.T)
    x, y, z, w = turn
    rotation = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip
    assert np.abs(rotation) == pytest.approx(np.abs(curves.boxes[0].axes.T), abs=1e-6)


def test_a_head_is_logged_to_rerun(head, tmp_path):
    rerun = pytest.importorskip("rerun", reason="rerun-sdk is not installed: pip install -e '.[dev]'")
    from maquette.adapters.rerun import log_head

    rerun.init("maquette-test")
    rerun.save(tmp_path / "log.rrd")
    log_head("head", head.mesh(cell_m=0.01))
    rerun.disconnect()
    assert (tmp_path / "log.rrd").stat().st_size > 10_000


def test_the_node_of_comfyui_makes_hints_and_masks(result, frame):
    torch = pytest.importorskip("torch", reason="torch is not installed: pip install -e '.[train]'")
    spec = importlib.util.spec_from_file_location("comfyui_node", ROOT / "examples/comfyui/__init__.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    node = module.NODE_CLASS_MAPPINGS["MaquetteDensePose"]
    given = {name: kind[0][0] if isinstance(kind[0], list) else kind[1].get("default")
             for name, kind in node.INPUT_TYPES()["required"].items() if name != "image"}  # fmt: skip
    batch = torch.from_numpy(np.stack([frame.pixels()] * 2).astype(np.float32) / 255)
    hints, masks = getattr(node(), node.FUNCTION)(batch, **given | {"preset": "stream"})
    assert hints.shape == (2, 240, 320, 3)
    assert masks.shape == (2, 240, 320)
    expected = visualize(maquette.DensePose().run(frame.pixels()))
    assert np.array_equal((hints[0].numpy() * 255).round().astype(np.uint8), expected)
    assert np.array_equal(masks[0].numpy() > 0, expected.any(-1))
