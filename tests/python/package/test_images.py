"""Images come as arrays of many kinds, Pillow's images, tensors and paths; a wrong one is told in a sentence."""

import maquette
import numpy as np
import pytest
from PIL import Image


class Tensor:
    """An object that numpy reads, as tensors are."""

    def __init__(self, array):
        self._array = array

    def __array__(self, dtype=None, copy=None):
        return self._array


@pytest.fixture(scope="module")
def rgb() -> np.ndarray:
    return np.random.default_rng(0).integers(0, 255, (24, 32, 3), np.uint8)


def test_what_numpy_reads_is_an_image(rgb, tmp_path):
    path = tmp_path / "image 100%?.png"
    maquette.Frame(rgb).save(path)
    palette = Image.fromarray(rgb).quantize()
    for image in (rgb, Tensor(rgb), Image.fromarray(rgb), rgb[..., ::-1][..., ::-1], memoryview(rgb)):
        assert np.array_equal(maquette.Frame(image).pixels(), rgb)
    assert np.array_equal(maquette.Frame.open(path).pixels(), rgb)
    assert np.array_equal(maquette.Frame(palette).pixels(), np.asarray(palette.convert("RGB")))
    assert np.array_equal(maquette.Frame(Image.fromarray(rgb).convert("RGBA")).pixels(), rgb)
    assert maquette.Frame(Image.fromarray(rgb).convert("L")).pixels(maquette.PixelFormat.GREY8).shape == (24, 32)


def test_depth_is_read_from_doubles_and_files(tmp_path):
    depth = np.linspace(0.5, 3, 24 * 32).reshape(24, 32)
    assert maquette.Frame(depth).depth() == pytest.approx(depth, abs=1e-6)
    maquette.Frame(np.round(depth * 1000).astype(np.uint16)).save(tmp_path / "depth?.png")
    camera = maquette.Intrinsics.centred(32, 24, fov_deg=60)
    read = maquette.Frame.open(tmp_path / "depth?.png", depth_unit_m=0.001, intrinsics=camera)
    assert np.asarray(read) == pytest.approx(depth, abs=6e-4)
    assert read.intrinsics == camera
    with pytest.raises(FileNotFoundError, match="nowhere"):
        maquette.Frame.open("nowhere.png", depth_unit_m=0.001)
    with pytest.raises(TypeError, match=r"intrinsics is 60; it is a maquette.Intrinsics"):
        maquette.Frame(depth, intrinsics=60)


def test_a_frame_is_an_array(rgb):
    assert np.array_equal(np.asarray(maquette.Frame(rgb)), rgb)
    assert np.asarray(maquette.Frame(rgb), np.float32).dtype == np.float32
    assert np.asarray(maquette.Frame(rgb[..., 0])).shape == (24, 32)
    assert Image.fromarray(np.asarray(maquette.Frame(rgb))).size == (32, 24)
    assert maquette.Frame(rgb).resized(16, 12).shape == (12, 16)


def test_three_planes_become_a_frame():
    y = np.full((24, 33), 128, np.uint8)
    u = v = np.full((12, 17), 128, np.uint8)
    frame = maquette.Frame.of_yuv(y, u, v, rotation_deg=90, timestamp_ns=7)
    assert frame.shape == (33, 24)
    assert frame.timestamp_ns == 7
    assert np.ptp(frame.pixels()) <= 2
    with pytest.raises(ValueError, match="half the height"):
        maquette.Frame.of_yuv(y, u[:-1], v)


@pytest.mark.parametrize(
    ("image", "text"),
    [
        (np.zeros((4, 6, 3)), r"ndarray is float64 \[4, 6, 3\]; colours from 0 to 1 become bytes"),
        (np.zeros((3, 40, 60), np.uint8), "the channels come last"),
        (np.zeros((2, 4, 6, 3), np.uint8), "one image at a time"),
        (np.zeros((4, 6), np.int32), r"becomes image.astype\(numpy.uint16\)"),
        (np.zeros((4, 6, 2), np.uint8), r"uint8 \[4, 6, 2\]"),
        ([[1, 2], [3, 4]], "this list is int64"),
        (None, "this NoneType is None"),
        (object(), "this object is <object"),
    ],
)
def test_a_wrong_image_is_told_in_a_sentence(image, text):
    with pytest.raises(ValueError, match=f"An image is uint8 .*{text}"):
        maquette.Frame(image)


def test_formats_have_names(rgb):
    assert np.array_equal(maquette.Frame(rgb, "bgr8").pixels("rgb8"), rgb[..., ::-1])
    with pytest.raises(ValueError, match='format is "bgr9"; it is one of rgb8, bgr8'):
        maquette.Frame(rgb, "bgr9")


def test_a_missing_file_is_an_error_of_python():
    with pytest.raises(FileNotFoundError, match="nowhere"):
        maquette.DensePose(threads=1).run("nowhere.jpg")
