"""Textures of people and look-ups of the surface through the Python package."""

import maquette
import numpy as np
import pytest
from maquette.frames import as_frame


@pytest.fixture(scope="module")
def densepose():
    return maquette.DensePose(bundle="sdk/models/densepose-b-int8")


@pytest.fixture
def result(densepose):
    return densepose.run("tests/media/photo.jpg")


def test_a_texture_has_the_colours_of_the_frame(result, tmp_path):
    texture = maquette.DensePoseTexture(tile_px=32)
    assert texture.draw().shape == (192, 128, 4)
    assert not texture.draw()[..., 3].any()
    texture.add_person(result, 0, "tests/media/photo.jpg")
    drawn = texture.draw()
    seen = drawn[..., 3] > 128
    assert 0.02 < seen.mean() < 0.5
    # The colour of a texel is that of the pixels around the pixel that shows its point.
    pixels = as_frame("tests/media/photo.jpg").pixels()
    errors = []
    for part in np.unique(result.part[result.person == 1]):
        column, row = divmod(int(part) - 1, 6)
        for y, x in zip(*np.nonzero(seen[32 * row : 32 * row + 32, 32 * column : 32 * column + 32])):  # noqa: B905
            found = result.find_pixel(0, int(part), (x + 0.5) / 32, 1 - (y + 0.5) / 32)
            at = pixels[int(found[1]), int(found[0])].astype(int)
            errors.append(np.abs(drawn[32 * row + y, 32 * column + x, :3] - at).mean())
    assert np.median(errors) < 12
    texture.save(tmp_path / "new folder" / "person.png")
    assert (tmp_path / "new folder" / "person.png").stat().st_size > 5000


def test_pixels_are_found_from_points_of_the_surface(result):
    y, x = (int(k[len(k) // 2]) for k in np.nonzero(result.person == 1))
    part, u, v = (int(k) for k in result.iuv[y, x])
    found = result.find_pixel(0, part, u / 255, v / 255)
    assert found[2] < 1e-5
    assert np.array_equal(result.iuv[int(found[1]), int(found[0])][0], part)
    missing = set(range(1, 25)) - set(np.unique(result.part[result.person == 1]).tolist())
    assert all(result.find_pixel(0, part, 0.5, 0.5) is None for part in missing)


def test_what_is_wrong_is_a_sentence(result):
    with pytest.raises(maquette.MaquetteError, match="tile_px is 4, but must be 8 to 512"):
        maquette.DensePoseTexture(tile_px=4)
    texture = maquette.DensePoseTexture()
    with pytest.raises(maquette.MaquetteError, match="index is 9"):
        texture.add_person(result, 9, "tests/media/photo.jpg")
    with pytest.raises(maquette.MaquetteError, match="frame has 8 x 8 pixels"):
        texture.add_person(result, 0, np.zeros((8, 8, 3), np.uint8))
    with pytest.raises(maquette.MaquetteError, match=r"must end with \.png"):
        texture.save("person.gif")
    with pytest.raises(maquette.MaquetteError, match="part is 0,"):
        result.find_pixel(0, 0, 0.5, 0.5)
