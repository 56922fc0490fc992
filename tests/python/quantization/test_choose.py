"""Float layers are chosen by gain a byte, until the threshold holds, and are written where they are read."""

from pathlib import Path

import numpy as np
import onnx
import pytest
from onnx import helper, numpy_helper

from export.evaluation.backends import Prediction
from quantization.agreement import Agreement, Tally, compare, load_images
from quantization.blocks import Candidate, Workpiece, block_of, candidates
from quantization.choose import pick, with_float_nodes
from quantization.graphs.prepare import prepare
from quantization.quantize import calibrate
from quantization.settings import DensePoseSettings, GraphSettings, read_settings

TOML = Path("quantization/densepose.toml")


def candidate(pattern, gain, size):
    return Candidate("trunk", pattern, gain, (20.0, 21.0), size, 0)


def test_blocks_are_the_first_two_parts_of_a_name():
    assert block_of("/backbone/blocks.3/expand/conv/Conv") == "/backbone/blocks.3/*"
    assert block_of("/rpn/conv/Conv") == "/rpn/conv/*"
    assert block_of("/logits/Gemm") == "/logits/Gemm"


def test_picking_stops_at_the_gate_and_passes_over_what_does_not_fit_or_gain():
    ranked = [candidate("a", 3, 10), candidate("big", 2, 1000), candidate("bad", -1, 1), candidate("b", 1, 10)]
    ranked.append(candidate("c", 0.5, 10))
    seen = []

    def measure(taken):
        seen.append([c.pattern for c in taken])
        return 0.9 + 0.05 * len(taken)

    taken, measured = pick(ranked, 100, 200, measure, 0.98)
    assert [c.pattern for c in taken] == ["a", "b"]
    assert seen == [[], ["a"], ["a", "b"]]
    assert measured == pytest.approx([0.9, 0.95, 1.0])
    assert pick(ranked, 100, 200, measure, 0.5)[0] == []
    assert [c.pattern for c in pick(ranked, 100, 115, measure, 2)[0]] == ["a"]


def test_chosen_nodes_are_written_and_read_back_with_the_rest_as_it_was(tmp_path):
    text = TOML.read_text()
    path = tmp_path / "chosen.toml"
    path.write_text(with_float_nodes(text, {"trunk": ("/a/*", "/b/*"), "dense_head": ("/c/Conv",)}))
    before, after = (read_settings(toml, DensePoseSettings) for toml in (TOML, path))
    assert after.graphs["trunk"].float_nodes == ("/a/*", "/b/*")
    assert after.graphs["dense_head"].float_nodes == ("/c/Conv",)
    for name in ("rpn_fine", "rpn_coarse", "box_head"):
        assert after.graphs[name] == before.graphs[name]
    comments = [line for line in text.splitlines() if line.startswith("#")]
    assert [line for line in path.read_text().splitlines() if line.startswith("#")] == comments
    assert with_float_nodes(with_float_nodes(text, {"dense_head": ()}), {}) == with_float_nodes(
        text, {"dense_head": ()}
    )
    with pytest.raises(ValueError, match=r"\[nothing\]"):
        with_float_nodes(text, {"nothing": ()})


def test_the_block_that_spoils_most_is_ranked_first(tmp_path):
    """/bad/* loses all but the loudest weight of each channel to rounding; /good/* has equal weights."""
    rng = np.random.default_rng(0)
    bad = rng.normal(size=(8, 8, 1, 1)) * 0.02
    bad[np.arange(8), np.arange(8)] = 3
    arrays = {"good.weight": np.ones((8, 8, 1, 1)) / 8, "bad.weight": bad}
    values = [numpy_helper.from_array(array.astype(np.float32), name) for name, array in arrays.items()]
    nodes = [
        helper.make_node("Conv", ["x", "good.weight"], ["m"], "/net/good/Conv", kernel_shape=[1, 1]),
        helper.make_node("Conv", ["m", "bad.weight"], ["y"], "/net/bad/Conv", kernel_shape=[1, 1]),
    ]
    value = helper.make_tensor_value_info
    ends = [value("x", 1, [1, 8, "h", "w"])], [value("y", 1, [1, 8, "h", "w"])]
    model = helper.make_model(
        helper.make_graph(nodes, "g", *ends, values), opset_imports=[helper.make_opsetid("", 17)], ir_version=8
    )
    onnx.save(model, tmp_path / "g.onnx")
    prepare(tmp_path / "g.onnx", tmp_path / "prepared.onnx")
    given = [{"x": rng.normal(size=(1, 8, 8, 8)).astype(np.float32)} for _ in range(2)]
    ranges = calibrate(tmp_path / "prepared.onnx", given, GraphSettings())
    piece = Workpiece("g", tmp_path / "prepared.onnx", ranges, GraphSettings(), given, given)
    found = candidates(piece)
    assert [c.pattern for c in found] == ["/net/bad/*", "/net/good/*"]
    assert found[0].gain > 0
    assert found[0].macs == 8 * 8 * 8 * 8
    assert found[0].sqnr[1] > found[0].sqnr[0]


def prediction(parts, people=1):
    iuv = np.zeros((1, len(parts), 3), np.uint8)
    iuv[0, :, 0] = parts
    scores = np.ones(people, np.float32)
    return Prediction(np.zeros((people, 4), np.float32), scores, iuv, (iuv[..., 0] > 0).astype(np.uint8))


def test_label_agreement_is_over_the_pixels_that_are_somebody_in_fp32():
    expected, actual = prediction([0, 1, 2, 3, 4]), prediction([5, 1, 2, 9, 0], people=2)
    found = compare([expected], [actual])
    assert found.pixels == 4
    assert found.labels == pytest.approx(2 / 4)
    assert found.parts == pytest.approx(2 / 3)
    assert found.mask_iou == pytest.approx(3 / 5)
    assert found.people == (1, 2)
    assert found.same_count == 0
    assert not found.passed


def test_differences_of_u_and_v_are_taken_where_the_part_is_the_same():
    expected, actual = prediction([1, 1, 2]), prediction([1, 1, 3])
    actual.iuv[0, 0, 1] = 51
    actual.iuv[0, 2, 2] = 255
    found = compare([expected], [actual])
    assert found.du == pytest.approx(0.1)
    assert found.dv == 0


def test_equal_results_pass_and_nobody_is_no_pass():
    assert compare([prediction([0, 1, 2])], [prediction([0, 1, 2])]).passed
    nobody: Agreement = Tally().metrics()
    assert np.isnan(nobody.labels)
    assert not nobody.passed


def test_results_of_different_lengths_are_an_error():
    with pytest.raises(ValueError, match="shorter"):
        compare([prediction([1])], [])


def test_images_are_read_from_files_and_missing_ones_explained():
    assert load_images(Path("tests/media/photo.jpg"))[0].shape == (512, 512, 3)
    assert len(load_images(Path("tests/media/clip.mp4"), 3)) == 3
    with pytest.raises(FileNotFoundError, match="nowhere"):
        load_images(Path("nowhere"))
