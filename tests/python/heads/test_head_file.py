"""Head files as Python reads them: the bytes that the native test writes again (tests/native/head)."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from export.checked_file import CHECKED
from export.heads.head_file import HEAD, HeadFileError, head_bytes, head_from_bytes, read_head, write_head
from export.xxh3 import xxh3

EXAMPLE, FIRST_EXAMPLE = (Path("tests/native/data/tiny_head") / f"example{of}.maqh" for of in ("", "_version_1"))


def test_it_holds_what_the_sdk_wrote():
    head = read_head(EXAMPLE)
    assert (head.shape.width, head.shape.layers, head.shape.smoothing) == (6, 5, np.float32(2e-4))
    numbers = (np.arange(10000) * 37 % 257 - 128) / 64
    at = 0
    for index, layer in enumerate(head.layers):
        assert layer.weights.shape == (head.shape.outputs(index), head.shape.inputs(index))
        together = np.column_stack([layer.weights, layer.bias])  # the native test counts row by row
        np.testing.assert_array_equal(together.ravel(), numbers[at : at + together.size])
        at += together.size
    np.testing.assert_array_equal(head.shape_codes, np.float32([0.1, -1.7, 2.3]))
    np.testing.assert_array_equal(head.colour_codes, np.float32([0.3, -0.01]))
    assert list(head.cameras["focal_px"]) == [812.25, 813.25]
    assert (head.cameras["width_px"] == 640).all()
    assert (head.cameras["height_px"] == 480).all()
    np.testing.assert_array_equal(head.cameras["translation"], [[0.1, -0.2, 9.5], [0.1, -0.2, 10.5]])
    turned = [[0.8, -0.6, 0], [0, 0, -1], [0.6, 0.8, 0]]
    np.testing.assert_array_equal(head.cameras["rotation"], [[[1, 0, 0], [0, 0, -1], [0, 1, 0]], turned])
    assert (head.metres_per_unit, head.metres_sigma, head.scale_source) == (0.0987, 0.004, "given")
    assert head.sharpness == 150.5
    np.testing.assert_array_equal(head.cut_normal, [0, 0.6, -0.8])
    np.testing.assert_array_equal(head.bounds_max, [1.5, 1.875, 2.125])
    anchors = numbers[at : at + 30].reshape(5, 3, 2)
    np.testing.assert_array_equal(head.template_points, anchors[..., 0])
    np.testing.assert_array_equal(head.anchor_points, anchors[..., 1])
    np.testing.assert_array_equal(head.anchor_sigma, [0.015625] * 5)
    assert list(head.places) == ["nose_tip", "chin"]
    assert bytes.fromhex(head.prior_sha256)[:3] == bytes([0, 7, 14])
    np.testing.assert_array_equal(head.code_factor, [0.5, -0.125, 0.75, 0.25, 0.0625, 1])


def test_what_is_read_is_written_again_byte_by_byte(tmp_path):
    write_head(read_head(EXAMPLE), tmp_path / "again.maqh")
    assert (tmp_path / "again.maqh").read_bytes() == EXAMPLE.read_bytes()
    assert [path.name for path in tmp_path.iterdir()] == ["again.maqh"]


def test_version_1_is_read_and_does_not_say_how_sure_codes_are():
    first, head = read_head(FIRST_EXAMPLE), read_head(EXAMPLE)
    assert first.code_factor is None
    assert head_bytes(replace(first, code_factor=head.code_factor)) == EXAMPLE.read_bytes()


def test_a_texture_is_read_and_written():
    head = replace(read_head(EXAMPLE), texture_px=512, texture=b"\xff\xd8\xff of a photo")
    data = head_bytes(head)
    assert len(data) == len(EXAMPLE.read_bytes()) + 8 + len(head.texture)
    again = head_from_bytes(data)
    assert (again.texture_px, again.texture) == (512, head.texture)
    assert read_head(EXAMPLE).texture == b""


def test_weights_that_the_file_cannot_hold_are_refused():
    head = read_head(EXAMPLE)
    head.layers[0].weights[0, 0] = 1e5
    with pytest.raises(HeadFileError, match="cannot be stored"):
        head_bytes(head)


def test_every_byte_that_is_missing_or_changed_is_noticed():
    data = EXAMPLE.read_bytes()
    for at in range(len(data)):
        changed = bytearray(data)
        changed[at] ^= 0x10
        for damaged in (data[:at], bytes(changed)):
            with pytest.raises(HeadFileError):
                head_from_bytes(damaged)


@pytest.mark.parametrize(
    ("key", "value", "text"),
    [
        ("cameras", 257, "claims more"),
        ("cameras", 256, "ends before"),
        ("places", 1, "belong to nothing"),
        ("scale_source", 3, "in a way"),
        ("has_code_factor", 2, "in a way"),
        ("zero", 1, "in a way"),
    ],
)
def test_heads_that_lie_are_refused_though_their_check_is_right(key, value, text):
    data = bytearray(EXAMPLE.read_bytes())
    head = np.frombuffer(data, HEAD, 1)[0].copy()
    head[key] = value
    data[: HEAD.itemsize] = head.tobytes()
    head["check"] = xxh3(bytes(data[CHECKED:]))
    data[: HEAD.itemsize] = head.tobytes()
    with pytest.raises(HeadFileError, match=text):
        head_from_bytes(bytes(data))
