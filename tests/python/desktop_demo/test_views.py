"""The desktop demo's views of people: the command line's results for the same frames say which colour belongs where."""

import shutil
from functools import cache

import cv2
import numpy as np
import pytest
from shown_by_demo import DEMO, ROOT, Mapped, Shown, directions, map_frames, part_colours, psnr_db, show

from export.people import outfit
from export.surface_grid import SurfaceGrid

pytestmark = [
    pytest.mark.skipif(not DEMO.exists(), reason="maquette-demo is not built (scripts/install-packages.sh desktop)"),
    pytest.mark.skipif(shutil.which("Xvfb") is None, reason="no Xvfb (scripts/install-packages.sh test)"),
]

# The walkers of the first are three in their 16th frame, one of them at the image's edge.
SOURCES = {"walkers": ("stub:people?count=3&seed=3", 16), "clip": (f"video:{ROOT}/tests/media/clip.mp4", 8)}


@pytest.fixture(scope="module", params=SOURCES)
def source(request):
    return request.param


@pytest.fixture(scope="module")
def mapped(source, tmp_path_factory) -> Mapped:
    found = map_frames(tmp_path_factory.mktemp(source), *SOURCES[source])
    assert len(found.people) == (3 if source == "walkers" else 1)
    return found


@pytest.fixture(scope="module")
def shown(source, tmp_path_factory):
    """Returns the program's image of the source, by view and options; tests with equal arguments share one run."""
    folder = tmp_path_factory.mktemp(f"shown_{source}")

    @cache
    def of(view: str, *options) -> Shown:
        uri, frames = SOURCES[source]
        found = show(folder, "--source", uri, "--frames", frames, "--view", view, *options)
        assert (found.report["view"], found.report["frames"], found.report["problem"]) == (view, frames, "")
        return found

    return of


def darkening(picture: np.ndarray, mapped: Mapped, where: np.ndarray) -> float:
    """The one factor by which the camera's image is shown there, after asserting that it is one."""
    ours, theirs = mapped.frame[where].astype(float), picture[where].astype(float)
    factor = float((ours * theirs).sum() / (ours * ours).sum())
    error = np.abs(theirs - factor * ours).max(-1)
    assert np.median(error) <= 4
    assert np.quantile(error, 0.95) <= 16  # edges are softer after they were enlarged
    return factor


def test_the_camera_is_shown_as_it_is(shown, mapped):
    picture = shown("camera", "--no-mesh")
    width, height = mapped.size
    assert picture.report["frame_px"] == [width, height]
    assert picture.report["mesh_px"] is None
    x, y, wide, tall = picture.report["picture_px"]
    assert wide / tall == pytest.approx(width / height, rel=0.01)
    assert x >= 0
    assert y >= 0
    at_pixels = picture.at_frame_pixels(width, height)
    right = psnr_db(at_pixels, mapped.frame)
    assert right > 30
    for axis in (0, 1):
        for way in (-1, 1):
            assert psnr_db(at_pixels, np.roll(mapped.frame, way, axis)) < right - 2


def test_people_are_reported_as_the_command_line_finds_them(shown, mapped):
    for options in (("boxes", "--no-mesh"), ("parts",)):
        people = shown(*options).report["people"]
        assert len(people) == len(mapped.people)
        for ours, theirs in zip(people, mapped.people, strict=True):
            assert np.allclose(ours["box"], theirs["box"], atol=0.5)
            assert ours["score"] == pytest.approx(theirs["score"], abs=0.01)


def test_parts_have_their_colours_and_the_background_is_the_camera(shown, mapped):
    picture = shown("parts")
    at_pixels, free = picture.at_frame_pixels(*mapped.size), picture.outside_mesh(*mapped.size)
    dark = darkening(at_pixels, mapped, mapped.far_from_people() & free)
    assert 0.7 < dark <= 1.02
    colours, inside, looked_at = part_colours().astype(float), mapped.inside() & free, 0
    for part in range(1, 25):
        own = inside & (mapped.iuv[..., 0] == part)
        if own.sum() < 30:
            continue
        unmixed = (at_pixels[own] - 0.3 * dark * mapped.frame[own].astype(float)) / 0.7
        away = np.linalg.norm(colours[1:] - np.median(unmixed, 0), axis=1)
        assert away.argmin() + 1 == part
        assert away.min() < 20
        looked_at += 1
    assert looked_at >= 8


def test_the_mask_leaves_people_bright_and_darkens_what_is_behind(shown, mapped):
    picture = shown("mask")
    at_pixels, free = picture.at_frame_pixels(*mapped.size), picture.outside_mesh(*mapped.size)
    dark = darkening(at_pixels, mapped, mapped.far_from_people() & free)
    assert dark < 0.5
    bright = ((at_pixels - dark * mapped.frame.astype(float)) > 14).any(-1) & free
    person = (mapped.person > 0) & free
    assert (bright & person).sum() / (bright | person).sum() > 0.95


def test_contours_are_lines_of_u_and_v_on_bodies_alone(shown, mapped):
    picture = shown("contours")
    at_pixels, free = picture.at_frame_pixels(*mapped.size), picture.outside_mesh(*mapped.size)
    dark = darkening(at_pixels, mapped, mapped.far_from_people() & free)
    changed = np.linalg.norm(at_pixels - dark * mapped.frame.astype(float), axis=-1)
    inside = mapped.inside(2) & free
    # Lines are at multiples of 1/8, as in the command line's overlay: where those of two neighbours differ.
    line = np.zeros((2, *inside.shape), bool)
    for plane in (0, 1):
        step = np.floor(mapped.iuv[..., 1 + plane] / 255.0 * 8)
        for axis in (0, 1):
            line[plane] |= (np.roll(step, 1, axis) != step) | (np.roll(step, -1, axis) != step)
    on = inside & line.any(0)
    off = inside & (cv2.dilate(line.any(0).astype(np.uint8), np.ones((3, 3))) == 0)
    assert on.sum() > 100
    assert off.sum() > 100
    assert changed[on].mean() > 30
    assert changed[on].mean() > 3 * changed[off].mean()
    for plane in (0, 1):
        alone = inside & line[plane] & ~line[1 - plane] & (changed > 40)
        redness = at_pixels[alone][:, 2].astype(float) - at_pixels[alone][:, 0]
        assert np.corrcoef(redness, mapped.iuv[alone][:, 1 + plane])[0, 1] > 0.6  # low values blue, high ones red


def test_boxes_are_drawn_around_people_with_their_scores(shown, mapped):
    picture = shown("boxes", "--no-mesh")
    left, top, wide, _ = picture.report["picture_px"]
    scale = wide / mapped.size[0]
    bright = picture.screenshot.min(-1) > 200
    before = cv2.resize(mapped.frame, None, fx=scale, fy=scale).min(-1) > 200
    for person in mapped.people:
        x0, y0, x1, y1 = np.round(np.array(person["box"]) * scale).astype(int) + [left, top, left, top]
        across, down = np.arange(x0 + 8, x1 - 8), np.arange(y0 + 8, y1 - 8)
        edges = {"bottom": bright[y1 - 3 : y1 + 4, across].any(0), "left": bright[down, x0 - 3 : x0 + 4].any(1)}
        edges["right"] = bright[down, x1 - 3 : x1 + 4].any(1)
        for name, edge in edges.items():
            assert edge.mean() > 0.95, name
        inner = bright[y0 + 30 : y1 - 10, x0 + 10 : x1 - 10]
        assert inner.mean() < before[y0 + 30 - top : y1 - 10 - top, x0 + 10 - left : x1 - 10 - left].mean() + 0.1
        # The label is white, with dark figures in it.
        label = picture.screenshot[max(top, y0 - 26) : y0 + 2, x0 : x0 + 34].min(-1)
        assert (label > 230).mean() > 0.4
        assert (label < 90).sum() > 10


def worn_shades(at_pixels, mapped, texture, where):
    """Returns, for each pixel, the factor that fits the texture's colour to the shown colour best, and the residual."""
    label = mapped.iuv[where]
    wanted = outfit.looked_up(texture, label[:, 0], label[:, 1:] / 255.0).astype(float)
    got = at_pixels[where].astype(float)
    factor = (wanted * got).sum(1) / np.maximum((wanted * wanted).sum(1), 1)
    return factor, np.linalg.norm(got - factor[:, None] * wanted, axis=1)


def fraction_worn(at_pixels, mapped, texture, where) -> float:
    factor, off = worn_shades(at_pixels, mapped, texture, where)
    return float(((factor > 0.5) & (factor < 1.4) & (off < 25)).mean())


def test_people_wear_the_outfit_where_their_u_v_say(shown, mapped):
    picture = shown("try-on", "--no-mesh")
    at_pixels, inside = picture.at_frame_pixels(*mapped.size), mapped.inside()
    texture = cv2.imread(str(outfit.OUTFIT))
    right = fraction_worn(at_pixels, mapped, texture, inside)
    assert right > 0.8
    # The same tiles upside down or left to right are not what is shown.
    tiles = texture.reshape(6, outfit.TILE_PX, 4, outfit.TILE_PX, 3)
    for wrong in (tiles[:, ::-1], tiles[:, :, :, ::-1]):
        assert fraction_worn(at_pixels, mapped, wrong.reshape(texture.shape), inside) < right - 0.1
    darkening(at_pixels, mapped, mapped.far_from_people())


def test_another_texture_is_worn_instead(shown, mapped, tmp_path):
    hue = (np.arange(24) * 180 / 24).astype(np.uint8)
    saturation = np.where(np.arange(24) % 2, 150, 255).astype(np.uint8)
    hsv = np.stack([hue, saturation, np.full(24, 190, np.uint8)], 1)[None]
    flat = cv2.cvtColor(hsv, cv2.COLOR_HSV2BGR)[0]
    texture = np.zeros((6 * 64, 4 * 64, 3), np.uint8)
    for part in range(1, 25):
        column, row = divmod(part - 1, 6)
        texture[64 * row : 64 * (row + 1), 64 * column : 64 * (column + 1)] = flat[part - 1]
    cv2.imwrite(str(tmp_path / "flat.png"), texture)
    picture = shown("try-on", "--no-mesh", "--texture", tmp_path / "flat.png")
    inside = mapped.inside()
    got = directions(picture.at_frame_pixels(*mapped.size)[inside])
    nearest = (got @ directions(flat).T).argmax(1) + 1
    assert (nearest == mapped.iuv[inside][:, 0]).mean() > 0.95


def test_the_body_in_the_corner_gets_the_colours_of_the_person(shown, mapped):
    by_part, as_person = shown("camera", "--no-person-colours"), shown("camera")
    body, other = (picture.rectangle("mesh_px").astype(float) for picture in (as_person, by_part))
    coloured = np.abs(body - other).max(-1) > 30
    assert coloured.mean() > 0.02
    # The image shows each of these colours, as bright or darker: the body has a light of its own.
    near = body[coloured] @ np.ones(3)
    image = np.unique((mapped.frame[mapped.iuv[..., 0] > 0] // 8).reshape(-1, 3), axis=0) * 8.0 + 4
    hues = directions(image) @ directions(body[coloured][near > 60]).T
    assert (hues.max(0) > 0.98).mean() > 0.9


def test_the_body_in_the_corner_is_coloured_where_it_was_seen(shown, mapped):
    without, with_mesh = shown("camera", "--no-mesh"), shown("camera", "--mesh", "--no-person-colours")
    body = with_mesh.rectangle("mesh_px").astype(float)
    x, y, wide, tall = with_mesh.report["mesh_px"]
    behind = without.screenshot[y : y + tall, x : x + wide].astype(float)
    drawn = cv2.erode((np.abs(body - behind).max(-1) > 6).astype(np.uint8), np.ones((3, 3))) > 0
    assert drawn.mean() > 0.05
    rows, columns = np.nonzero(drawn)
    assert np.ptp(rows) > 0.6 * tall  # from head to foot
    assert abs(columns.mean() / wide - 0.5) < 0.15
    # Not seen is grey; seen has the colour of the part.
    saturation = (body.max(-1) - body.min(-1))[drawn] / np.maximum(body.max(-1)[drawn], 1)
    lit = saturation > 0.35
    assert lit.mean() > 0.05
    table = directions(part_colours()[1:])
    nearest = (directions(body[drawn][lit]) @ table.T).argmax(1) + 1
    assert np.isin(nearest, list(mapped.seen_parts)).mean() > 0.9
    # Each colour is as high up as its part of the template is.
    grid = SurfaceGrid.load(outfit.GRID)
    low, high = (choose(grid.points[..., 2], (1, 2))[nearest - 1] for choose in (np.nanmin, np.nanmax))
    z = np.nanmax(grid.points[..., 2]) * (rows.max() - rows[lit]) / np.ptp(rows)
    assert ((z > low - 0.12) & (z < high + 0.12)).mean() > 0.85
