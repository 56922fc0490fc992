"""Images of heads by the Python package, and the head of a person whom dense pose finds."""

import gc
from pathlib import Path

import cv2
import maquette
import numpy as np
import pytest
from round_heads import BOX, COARSE_M, GREY
from scipy.spatial import cKDTree

PHOTO = Path(__file__).parents[3] / "tests/media/photo.jpg"

pytestmark = pytest.mark.skipif(
    not maquette.library_path().exists(), reason=f"{maquette.library_path()} is not built: run `make build`"
)


def test_planes_show_the_mesh(head, renderer):
    mesh = head.mesh(cell_m=COARSE_M)
    camera = renderer.camera(yaw_rad=0.4, pitch_rad=0.1, width_px=160, height_px=120)
    image = renderer.run(camera)

    assert image.rgb.shape == image.normals.shape == image.template_points.shape == (120, 160, 3)
    assert image.alpha.shape == image.depth.shape == (120, 160)
    inside = image.alpha == 255
    assert 0.1 < inside.mean() < 0.8
    for plane in (image.rgb, image.depth, image.normals, image.template_points):
        assert not plane[image.alpha == 0].any()
    assert camera.centre[0] > 0.1  # to the person's left
    # Pixels at their depths lie on the mesh, with its normals and template points.
    y, x = np.nonzero(inside)
    given = camera.intrinsics
    rays = np.stack([(x - given.cx_px) / given.fx_px, (y - given.cy_px) / given.fy_px, np.ones(len(x))], 1)
    points = (rays * image.depth[inside][:, None]) @ camera.rotation + camera.centre
    distance, nearest = cKDTree(mesh.positions_m).query(points)
    assert distance.max() < COARSE_M
    in_camera = mesh.normals[nearest] @ camera.rotation.T
    assert (image.normals[inside] * in_camera).sum(1).mean() > 0.97
    assert np.abs(image.template_points[inside] - mesh.template_points_m[nearest]).max() < 2 * COARSE_M
    assert image.rgb[inside].mean(0)[0] > image.rgb[inside].mean(0)[2]  # red, then blue


def test_by_the_camera_of_its_photo_a_head_lies_on_the_head(head, renderer):
    alpha = renderer.run(head.camera()).alpha / 255

    assert alpha.shape == GREY.shape[:2]
    assert (alpha.sum(0) * np.arange(320)).sum() / alpha.sum() == pytest.approx(154.5, abs=4)  # the box's middle
    assert alpha.sum() / (1.6 * 120) ** 2 == pytest.approx(0.22, abs=0.07)


def test_shadings_differ_and_backgrounds_are_behind(head, renderer):
    camera = renderer.camera(0.4, 0.1, 80, 60)
    seen = set()
    try:
        for shading in ("colour", "shape", "normals", "template", "depth"):
            renderer.set_shading(shading)
            seen.add(renderer.run(camera).rgb.tobytes())
    finally:
        renderer.set_shading("colour")
    assert len(seen) == 5
    own = maquette.HeadRenderer(head.mesh(cell_m=COARSE_M), "normals", background=(10, 20, 30), threads=1)
    rgb = own.run(camera).rgb
    assert rgb[0, 0].tolist() == [10, 20, 30]
    assert rgb.tobytes() not in seen


def test_many_images_and_heads_are_freed(builder, renderer):
    camera = renderer.camera(0, 0, 64, 48)
    kept = [renderer.run(camera) for _ in range(10)]  # more than a pool holds
    assert all((image.alpha == kept[0].alpha).all() for image in kept)
    builder.add_photo(GREY, BOX)
    for _ in range(5):
        builder.fit(0, progress=lambda done, stage: None, preview=lambda head: None)
    gc.collect()


def test_the_head_of_a_person_is_built_with_the_shipped_bundle():
    rgb = cv2.imread(str(PHOTO))[..., ::-1].copy()
    box_px = maquette.DensePose(threads=1).run(rgb).people[0].head_box_px
    left, top, right, bottom = box_px
    assert 0 <= left < right <= rgb.shape[1]
    assert 0 <= top < bottom <= rgb.shape[0]
    with maquette.HeadBuilder(threads=1) as builder:
        builder.add_photo(rgb, box_px)
        head = builder.fit(0)

    size_m = np.ptp(head.mesh(cell_m=COARSE_M).positions_m, axis=0)
    assert (size_m > 0.13).all()
    assert (size_m < 0.4).all()
    pupils_m = head.landmark("pupil_left").point_m - head.landmark("pupil_right").point_m
    assert 0.05 < np.linalg.norm(pupils_m) < 0.075
    # By the camera of the photo it lies where dense pose sees the head.
    y, x = np.nonzero(maquette.HeadRenderer(head.mesh(cell_m=COARSE_M), threads=1).run(head.camera()).alpha)
    assert left < x.mean() < right
    assert top < y.mean() < bottom


def test_who_shows_no_head_has_no_box():
    densepose = maquette.DensePose(threads=1)
    rgb = maquette.Source("stub:people?count=1&seed=3&size=320x240").read().pixels()
    result = densepose.run(rgb)
    left, top, right, bottom = (int(side) for side in result.people[0].head_box_px)
    y, x = np.nonzero(np.isin(result.part, (23, 24)))
    assert (x.min(), y.min(), x.max() + 1, y.max() + 1) == (left, top, right, bottom)
    rgb[: bottom + 30] = rgb[0, 0]
    result = densepose.run(rgb)

    assert [person.head_box_px for person in result.people] == [None]
    assert not np.isin(result.part, (23, 24)).any()
