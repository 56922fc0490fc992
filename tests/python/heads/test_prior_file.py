"""Prior files: what is written is what is read, and what is refused."""

from dataclasses import fields, replace

import numpy as np
import pytest
from small_prior import SMALL, small_prior

from export.checked_file import CHECKED
from export.heads.prior import FieldShape, Layer, Prior, PriorError, check_prior, combined
from export.heads.prior_file import HEAD, bases_errors, prior_bytes, prior_from_bytes, read_prior, write_prior
from export.xxh3 import xxh3


def arrays_of(prior: Prior) -> dict[str, np.ndarray]:
    """By name, all numbers but those of the shape."""
    found = {}
    for one in fields(prior):
        value = getattr(prior, one.name)
        if isinstance(value, list):
            for k, layer in enumerate(value):
                found[f"{one.name}.{k}.weights"], found[f"{one.name}.{k}.bias"] = layer.weights, layer.bias
        elif isinstance(value, dict):
            found |= {f"{one.name}.{name}": point for name, point in value.items()}
        elif one.name != "shape":
            found[one.name] = np.asarray(value)
    return found


def test_what_is_written_in_float32_is_read_again(tmp_path):
    prior = small_prior()
    write_prior(prior, tmp_path / "prior.maqp", bases="float32", constant="float32")
    again = read_prior(tmp_path / "prior.maqp")
    assert again.shape == replace(prior.shape, smoothing=float(np.float32(prior.shape.smoothing)))
    before, after = arrays_of(prior), arrays_of(again)
    assert list(before) == list(after)
    for name in before:
        expected = before[name].astype(np.float16) if name == "anchor_linear" else before[name]
        np.testing.assert_array_equal(after[name], expected.astype(after[name].dtype), err_msg=name)
    assert [path.name for path in tmp_path.iterdir()] == ["prior.maqp"]


@pytest.mark.parametrize(("bases", "largest"), [("float32", 0), ("float16", 1e-3), ("int8", 0.02)])
def test_the_error_of_stored_bases_is_told_by_layer(bases, largest):
    errors = bases_errors(small_prior(), bases)
    assert [error.layer for error in errors] == [0, 1, 4]
    for error in errors:
        assert (error.relative_rms > 0) == (largest > 0)
        assert error.relative_rms <= largest
    if bases == "int8":
        assert min(error.relative_rms for error in errors) > 1e-3


def test_int8_bases_are_at_most_half_a_step_of_their_row_off():
    prior = small_prior()
    again = prior_from_bytes(prior_bytes(prior, "int8"))
    for layer, stored in zip(prior.shape_bases, again.shape_bases, strict=True):
        step = np.abs(layer.weights).max(-1, keepdims=True) / 127
        assert (np.abs(stored.weights - layer.weights) <= 0.5001 * step).all()


def test_rows_of_zeros_stay_zero_in_int8():
    prior = small_prior()
    prior.shape_bases[0].weights[1, 2] = 0
    again = prior_from_bytes(prior_bytes(prior, "int8"))
    assert (again.shape_bases[0].weights[1, 2] == 0).all()


def test_a_head_is_w0_and_its_codes_times_the_bases():
    prior = small_prior()
    codes, colours = np.array([0.5, -2, 1]), np.array([1.5, -1])
    layers = combined(prior, codes, colours)
    expected = prior.constant[1].weights + sum(c * basis for c, basis in zip(codes, prior.shape_bases[1].weights))  # noqa: B905
    np.testing.assert_allclose(layers[1].weights, expected, rtol=1e-5)
    np.testing.assert_array_equal(layers[2].weights, prior.constant[2].weights)
    expected = prior.constant[4].bias + colours @ prior.colour_bases[0].bias
    np.testing.assert_allclose(layers[4].bias, expected, rtol=1e-5)


def test_every_byte_that_is_missing_or_changed_is_noticed():
    data = prior_bytes(small_prior())
    for left in range(0, len(data), 7):
        with pytest.raises(PriorError):
            prior_from_bytes(data[:left])
    for at in range(0, len(data), 5):
        changed = bytearray(data)
        changed[at] ^= 0x10
        with pytest.raises(PriorError):
            prior_from_bytes(bytes(changed))


@pytest.mark.parametrize(
    ("key", "value", "text"),
    [
        ("bases_format", 3, "in a way"),
        ("constant_format", 2, "in a way"),
        ("zero", 1, "in a way"),
        ("anchors", 8, "ends before|belong to nothing"),
        ("anchors", 1 << 31, "claims more"),
        ("shape_codes", 513, "claims more"),
        ("landmarks", 3, "ends before"),
        ("sharpness", np.nan, "sharpness"),
        ("cut_normal", 1, "length 1"),
        ("bounds_min", 1, "bounds_min"),
    ],
)
def test_heads_that_lie_are_refused_though_their_check_is_right(key, value, text):
    data = bytearray(prior_bytes(small_prior()))
    head = np.frombuffer(data, HEAD, 1)[0].copy()
    head[key] = value
    data[: HEAD.itemsize] = head.tobytes()
    head["check"] = xxh3(bytes(data[CHECKED:]))
    data[: HEAD.itemsize] = head.tobytes()
    with pytest.raises(PriorError, match=text):
        prior_from_bytes(bytes(data))


def test_priors_that_the_sdk_would_refuse_are_not_written():
    prior = small_prior()
    huge = [Layer(layer.weights * 1e5, layer.bias) for layer in prior.constant]
    broken = [Layer(np.full_like(layer.weights, np.nan), layer.bias) for layer in prior.constant]
    for change, text in (
        ({"constant": huge}, "cannot be stored as float16"),
        ({"constant": broken}, "not finite"),
        ({"constant": prior.constant[1:]}, "has 6 layers"),
        ({"shape_bases": prior.shape_bases[::-1]}, "has the shape"),
        ({"shape": replace(SMALL, octaves=9)}, "octaves"),
        ({"sharpness": 0}, "sharpness"),
        ({"cut_normal": np.ones(3)}, "length 1"),
        ({"bounds_max": np.array([1.0, 0, 1])}, "bounds_max"),
        ({"anchor_sigma": prior.anchor_sigma * 0}, "anchor_sigma"),
        ({"landmarks": {"": np.zeros(3)}}, "name of a landmark"),
    ):
        with pytest.raises(PriorError, match=text):
            prior_bytes(replace(prior, **change))
    with pytest.raises(PriorError, match="constants as int8"):
        prior_bytes(prior, constant="int8")


def test_a_prior_of_the_size_that_is_shipped_takes_little_more_than_a_megabyte():
    prior = small_prior(FieldShape(), shape_codes=64, colour_codes=32, anchors=800)
    check_prior(prior)
    assert len(prior_bytes(prior, "int8")) < 1.25e6
