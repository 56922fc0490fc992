"""A place known all around: what a camera sees of it and the light it throws agree with each other."""

import base64

import numpy as np
import pytest

from export.camera import Camera
from export.people.panoramas import Panorama
from export.photos.packages import PackageError
from export.photos.panoramas import NAMES, decoded

HEIGHT, WIDTH = 128, 256


def camera(towards: np.ndarray) -> Camera:
    """At the origin, level, looking along `towards` (world axes, z up)."""
    forward = towards / np.linalg.norm(towards)
    right = np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    rows = np.stack([right, np.cross(forward, right), forward])
    return Camera.centred(80, 60, 60.0, rows, np.zeros(3))


def with_lamp(azimuth: float, height: float, colour=(50.0, 50.0, 50.0)) -> Panorama:
    """Grey all around, and a lamp of 10 degrees there."""
    rows, columns = (np.arange(HEIGHT) + 0.5) / HEIGHT * np.pi, (np.arange(WIDTH) + 0.5) / WIDTH * 2 * np.pi
    polar, around = np.meshgrid(rows, columns, indexing="ij")
    direction = np.stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], -1)
    towards = np.array([np.cos(height) * np.cos(azimuth), np.cos(height) * np.sin(azimuth), np.sin(height)])
    radiance = np.full((HEIGHT, WIDTH, 3), 0.2)
    radiance[direction @ towards > np.cos(np.radians(10))] = colour
    return Panorama(radiance)


@pytest.mark.parametrize("yaw", [0.0, 1.0, 4.0])
def test_the_lamp_is_seen_where_its_light_comes_from(yaw):
    panorama = with_lamp(2.0, 0.2)
    looking = camera(np.array([np.cos(2.1 + yaw), np.sin(2.1 + yaw), 0.1]))
    picture = panorama.seen(looking, yaw, 1.0)
    y, x = np.nonzero(picture.sum(-1) > 700)
    light = panorama.light(looking, yaw, 1.0, np.random.default_rng(0))
    right, down, forward = light.directions[0]
    assert x.mean() + 0.5 == pytest.approx(40 + 60 * right / forward, abs=2)
    assert y.mean() + 0.5 == pytest.approx(30 + 60 * down / forward, abs=2)


def test_a_coloured_lamp_gives_coloured_light_and_leaves_the_rest_alone():
    panorama = with_lamp(0.5, 0.9, colour=(80.0, 40.0, 10.0))
    light = panorama.light(camera(np.array([1.0, 0, 0])), 0.0, panorama.exposure(0.8), np.random.default_rng(0))
    red, green, blue = light.colours[0]
    assert red > green > blue > 0
    assert np.ptp(light.ground) < 0.01
    assert light.colours[0].sum() > 3 * light.colours[1].sum()


def test_exposure_makes_bright_and_dark_places_equally_bright():
    bright, dark = with_lamp(1.0, 0.5), Panorama(with_lamp(1.0, 0.5).radiance / 100)
    view = camera(np.array([0, 1.0, 0]))
    first, second = (p.seen(view, 0.3, p.exposure(0.6)) for p in (bright, dark))
    assert np.abs(first - second).max() < 1
    assert 0 <= first.min() <= first.max() <= 255


def test_a_panorama_file_becomes_radiance_without_negative_light(tmp_path):
    exr = pytest.importorskip("OpenEXR", reason="the extra `train` is not installed")
    pixels = np.linspace(-1, 3, 4 * 8 * 3, dtype=np.float32).reshape(4, 8, 3)
    with exr.File({"type": exr.scanlineimage}, {"RGB": pixels}) as file:
        file.write(str(tmp_path / "a.exr"))
    text = (
        b"export default 'data:application/exr;base64," + base64.b64encode((tmp_path / "a.exr").read_bytes()) + b"'\n"
    )
    assert np.allclose(decoded(text), np.clip(pixels, 0, None), atol=0.01)
    with pytest.raises(PackageError, match="not a script"):
        decoded(b"<html>not found</html>")


def test_no_panorama_is_in_two_splits():
    every = [name for names in NAMES.values() for name in names]
    assert len(every) == len(set(every)) == 18
