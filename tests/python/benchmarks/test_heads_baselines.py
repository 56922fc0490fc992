"""The report of heads: what heads are measured beside, new views, real photographs, settings, the engine."""

import json
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
import torch
from ellipsoid_heads import RADII_MM, ball_points, ellipsoid, pictures_of_ellipsoid, true_ellipsoid, true_head
from maquette import MaquetteError
from scipy.spatial.transform import Rotation
from small_prior import small_prior

from benchmarks.heads import __main__ as whole_report
from benchmarks.heads import (
    engine,
    face_mesh,
    linear_head,
    new_views,
    prior_limit,
    program,
    quality,
    real_faces,
    report,
    savings,
)
from benchmarks.heads.distances import MM_PER_DM, Similarity, Triangles, TruePoints, measure
from benchmarks.heads.drawing import DrawnMesh
from benchmarks.heads.mean_head import template_points
from benchmarks.heads.photos import Photo, PhotoBackgrounds, photo_of
from export.densepose.network import MobileNetV2
from export.heads.fitting.anchor_fit import Observations
from export.heads.head_shards import HeadPoints
from export.heads.photos.face_points import read_face_points
from export.heads.photos.faces import PhotoFaces
from export.heads.sampling import look_at
from export.scenes.perceptual import Perceptual
from export.teachers.faces import LEFT_EYE, RIGHT_EYE, Face

pytestmark = pytest.mark.usefixtures("one_thread")


@pytest.fixture(scope="module")
def backgrounds(tmp_path_factory):
    folder = tmp_path_factory.mktemp("backgrounds")
    cv2.imwrite(str(folder / "green.png"), np.full((60, 90, 3), (0, 120, 0), np.uint8))
    return PhotoBackgrounds(folder)


def whole_ellipsoid():
    return replace(true_ellipsoid(), mesh=ellipsoid())


def test_sides_are_measured_apart():
    true, mesh = whole_ellipsoid(), ellipsoid()
    bulged = mesh.points.copy()
    bulged[bulged[:, 1] > 0] *= [1, 1.1, 1]  # the back alone
    found = measure(Triangles(bulged, mesh.faces), true, true.points[:, 1] < 0)
    assert found.seen_mm < 0.6 * found.unseen_mm
    assert found.seen_mm + found.unseen_mm == pytest.approx(2 * found.head_mm, rel=0.1)
    assert measure(mesh, true, np.ones(len(true.points), bool)).unseen_mm is None


def test_what_a_result_has_too_much_is_measured_from_it_to_the_truth():
    true, mesh = whole_ellipsoid(), ellipsoid()
    horn = ellipsoid(12, np.full(3, 30.0))
    horned = Triangles(
        np.concatenate([mesh.points, horn.points + [0, 0, 170]]),
        np.concatenate([mesh.faces, horn.faces + len(mesh.points)]),
    )
    plain, found = measure(mesh, true), measure(horned, true)
    assert plain.back_mm < 0.15
    assert found.head_mm < 0.2  # the true points do not see it
    assert found.back_mm > 1
    assert measure(mesh, true_ellipsoid()).back_mm is None


def test_what_lies_below_the_cut_is_no_fault_of_a_result():
    true, mesh = whole_ellipsoid(), ellipsoid()
    below = ellipsoid(12, np.full(3, 20.0))
    longer = Triangles(
        np.concatenate([mesh.points, below.points + [0, 0, -190]]),
        np.concatenate([mesh.faces, below.faces + len(mesh.points)]),
    )
    assert measure(longer, true).back_mm < 0.15


def test_points_are_seen_that_face_a_camera_with_nothing_between():
    head = true_head([0])
    head = replace(head, true=whole_ellipsoid())
    front, side = (look_at(np.radians(yaw), 0.0, 0.0, 20.0, np.zeros(3), 300.0, 64) for yaw in (0, 90))
    seen = head.seen_by([front])
    facing = (head.true.normals * [0, -1, 0]).sum(1)
    assert seen[facing > 0.3].all()
    assert not seen[facing < -0.1].any()
    both = head.seen_by([front, side])
    assert both[head.true.normals[:, 0] > 0.3].all()
    assert true_head([0]).seen_by([front]) is None
    # A shield before the face.
    shield = np.array([[-300.0, -200, -300], [300, -200, -300], [0, -200, 600]])
    own = head.true.mesh
    mesh = Triangles(
        np.concatenate([own.points, shield]), np.concatenate([own.faces, [[0, 1, 2]] + np.int64(len(own.points))])
    )
    assert not replace(head, true=replace(head.true, mesh=mesh)).seen_by([front]).any()


def test_pictures_from_anywhere_are_counted():
    assert true_head([0, 150, -70]).all_around(2) == (0, 1)
    assert true_head([0, 150]).all_around(3) is None


# --- new views ---


def white(mesh):
    normals = mesh.points / RADII_MM**2
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)

    def colours(place):
        return np.full((len(place.face), 3), 240.0)

    return DrawnMesh.coloured(mesh.points / MM_PER_DM, mesh.faces, normals, colours)


def view_from(yaw_deg, drawn):
    camera = look_at(np.radians(yaw_deg), 0.05, 0.0, 10.0, np.zeros(3), 400.0, 128)
    return new_views.View(camera, *drawn.shown(camera))


def psnr_db(drawn, to_mesh, views):
    return new_views.view_errors(drawn, to_mesh, views)["psnr_db"]


def test_a_new_view_of_the_right_head_is_the_true_picture_wherever_the_result_lies():
    drawn = white(ellipsoid())
    views = [view_from(yaw, drawn) for yaw in (-30, 45)]
    turn = Rotation.from_rotvec([0.1, -0.2, 0.3]).as_matrix()
    to_mesh = Similarity(1.1, turn, np.array([5.0, -3, 8]))
    mesh = ellipsoid()
    moved = DrawnMesh.coloured(
        to_mesh(mesh.points) / MM_PER_DM, mesh.faces, mesh.points @ turn.T / 100,
        lambda place: np.full((len(place.face), 3), 240.0),
    )  # fmt: skip
    nowhere = Similarity(1.0, np.eye(3), np.zeros(3))
    assert psnr_db(drawn, nowhere, views) > 60
    assert psnr_db(moved, to_mesh, views) > 25  # up to a pixel of the border
    assert psnr_db(moved, nowhere, views) < 20


def test_both_silhouettes_count():
    views = [view_from(0, white(ellipsoid()))]
    nowhere = Similarity(1.0, np.eye(3), np.zeros(3))
    small, large = (white(ellipsoid(radii=RADII_MM * k)) for k in (0.9, 1.1))
    exact = psnr_db(white(ellipsoid()), nowhere, views)
    assert exact - psnr_db(small, nowhere, views) > 20
    assert exact - psnr_db(large, nowhere, views) > 20


def test_features_tell_the_right_head_from_others():
    torch.manual_seed(0)
    perceptual = Perceptual(MobileNetV2())
    views = [view_from(0, white(ellipsoid()))]
    nowhere = Similarity(1.0, np.eye(3), np.zeros(3))
    right, small, tiny = (
        new_views.view_errors(white(ellipsoid(radii=RADII_MM * k)), nowhere, views, perceptual)["distance"]
        for k in (1, 0.9, 0.7)
    )
    assert right < 1e-6 < small < tiny


def test_a_photo_is_projected_where_it_sees_the_mesh_and_continued_where_it_does_not():
    camera = look_at(0.0, 0.0, 0.0, 12.0, np.zeros(3), 500.0, 160)
    rgb = np.zeros((160, 160, 3), np.uint8)
    rgb[:, :80], rgb[:, 80:] = (200, 0, 0), (0, 0, 200)  # the person's right is on the left
    nowhere = Similarity(1.0, np.eye(3), np.zeros(3))
    drawn = new_views.with_photo(ellipsoid(), nowhere, Photo(rgb, np.zeros(4), camera))
    seen, present = drawn.shown(camera)
    np.testing.assert_allclose(seen[80, 60], [200, 0, 0], atol=3)
    np.testing.assert_allclose(seen[80, 100], [0, 0, 200], atol=3)
    assert present[80, 60]
    behind, _ = drawn.shown(look_at(np.pi, 0.0, 0.0, 12.0, np.zeros(3), 500.0, 160))
    np.testing.assert_allclose(behind[80, 100], [200, 0, 0], atol=3)  # the same half of the head, from behind
    np.testing.assert_allclose(behind[80, 60], [0, 0, 200], atol=3)


# --- MediaPipe's points ---


def face_at(rotation, scale=90.0, depth_scale=1.0):
    """The face points as a camera far away sees them."""
    seen = read_face_points().template @ rotation.T
    pixel = np.stack([seen[:, 0], -seen[:, 2]], 1) * scale + 300
    return Face(pixel, depth_scale * scale * seen[:, 1] + 7, np.zeros(len(pixel)), 1.0)


def test_the_face_network_s_points_become_a_mesh_where_the_template_is():
    points = read_face_points()
    for turn in ([0, 0, 0.0], [0.1, 0.2, 0.5]):
        mesh = face_mesh.mesh_of(face_at(Rotation.from_rotvec(turn).as_matrix()))
        np.testing.assert_allclose(mesh.points, points.template * MM_PER_DM, atol=1e-6)
    flat = face_mesh.mesh_of(face_at(np.eye(3), depth_scale=0.3))
    assert np.abs(flat.points - points.template * MM_PER_DM).max() > 5
    assert mesh.faces.max() == len(points.template) - 1


def test_the_inner_face_is_what_its_points_cover():
    points = read_face_points()
    middle = points.template.mean(0)
    assert face_mesh.is_inner_face(points.template + 0.001 * (middle - points.template))[points.used].mean() > 0.95
    away = np.array([[0.0, 1.0, 0.3], [0.9, 0.1, 0.0], [0.0, -0.6, 1.2], [0.0, -0.7, -1.6]])  # nape, ear, crown, neck
    assert not face_mesh.is_inner_face(away).any()


# --- the linear head ---


def linear_heads(count=40, modes=3):
    rng = np.random.default_rng(0)
    base, directions = ball_points(300, 1), rng.normal(size=(modes, 300, 3))
    amounts = rng.normal(size=(count, modes)) * [3, 2, 1]
    return base + 0.01 * np.tensordot(amounts, directions, 1), base, directions


def test_principal_components_are_whitened_and_leave_what_is_left():
    heads, *_ = linear_heads()
    mean, linear, sigma = linear_head.principal_components(heads, 3)
    np.testing.assert_allclose(mean, heads.mean(0))
    assert sigma.max() < 1e-6
    flat = linear.reshape(-1, 3)
    codes = np.linalg.lstsq(flat, (heads - mean).reshape(len(heads), -1).T, rcond=None)[0].T
    np.testing.assert_allclose(codes.T @ codes / len(heads), np.eye(3), atol=1e-6)
    assert linear_head.principal_components(heads, 1)[2].mean() > 0.005


def test_the_linear_head_follows_what_is_seen(monkeypatch):
    heads, base, directions = linear_heads()
    camera = look_at(0.2, 0.1, 0.0, 12.0, np.zeros(3), 900.0, 400)
    true = base + 0.01 * np.tensordot([4.0, -3.0, 1.0], directions, 1)
    near = (true * (camera.centre - true)).sum(1) > 0
    pixels, principal = camera.projected(true[near])[0], np.array([camera.cx_px, camera.cy_px])
    count = near.sum()
    seen = Observations(base[near], np.full(count, 0.01), pixels, np.ones(count), 900.0, 0.0, principal)
    for name in ("Encoder", "look_at"):
        monkeypatch.setattr(linear_head, name, lambda *_, **__: None)
    monkeypatch.setattr(linear_head, "observations_of", lambda _: seen)
    single = np.float32
    prior = replace(
        small_prior(), template_points=base.astype(single), anchor_mean=base.astype(single),
        anchor_linear=np.zeros((300, 3, 3), single), anchor_sigma=np.full(300, 1.0, single),
    )  # fmt: skip
    monkeypatch.setattr(linear_head, "read_prior", lambda _: prior)
    shapes = SimpleNamespace(template=base, eye_faces=np.zeros((0, 3), int))
    maker = SimpleNamespace(shapes=shapes, faces=np.arange(300).reshape(-1, 3))
    found = linear_head.LinearHeads(Path(), maker, heads, 3).mesh(Photo(np.zeros((4, 4, 3)), np.zeros(4), camera))
    before, after = (np.linalg.norm(p - true * MM_PER_DM, axis=1).mean() for p in (heads.mean(0) * 100, found.points))
    assert after < 0.3 * before
    too_few = replace(seen, template=seen.template[:3], sigma=seen.sigma[:3], pixels=pixels[:3], pixel_sigma=np.ones(3))
    monkeypatch.setattr(linear_head, "observations_of", lambda _: too_few)
    heads_of = linear_head.LinearHeads(Path(), maker, heads, 3)
    assert heads_of.mesh(Photo(np.zeros((4, 4, 3)), np.zeros(4), camera)) is None


def test_training_heads_that_are_not_there_are_asked_for(tmp_path):
    with pytest.raises(FileNotFoundError, match="points train"):
        linear_head.read_visible(tmp_path)


def test_baselines_stand_beside_the_head_in_every_row(backgrounds):
    head, mean = true_head([0]), ellipsoid(radii=RADII_MM * [1.2, 1, 1])
    inner = head.true.points[:, 1] < -80
    head = replace(head, true=replace(whole_ellipsoid(), is_inner_face=inner))
    case = quality.Case.of(head, [0], backgrounds, quality.NOTHING_ELSE)
    others = quality.Baselines(
        SimpleNamespace(mesh=lambda *_: ellipsoid(radii=RADII_MM * [1.1, 1, 1])),
        SimpleNamespace(mesh=lambda *_: ellipsoid(radii=RADII_MM * [1.3, 1, 1])),
    )
    found = quality.measure_baselines(case, mean, others)
    assert found["linear_head_mm"] < 0.7 * found["mean_head_mm"]
    assert found["face_mesh_inner_face_mm"] > found["mean_inner_face_mm"] > found["linear_inner_face_mm"]
    assert found["mean_seen_mm"] is not None
    nobody = quality.Baselines(SimpleNamespace(mesh=lambda *_: None), SimpleNamespace(mesh=lambda *_: None))
    lost = quality.measure_baselines(case, mean, nobody)
    assert lost["face_mesh_inner_face_mm"] is None
    assert "linear_head_mm" not in lost


# --- real photographs ---

SIDE = 256  # of a stored face


def real_face(mesh, template, **more):
    """A face whose points are where the mesh has them."""
    pixel = mesh.camera.projected(mesh.at(template))[0]
    matte = np.zeros((SIDE, SIDE), np.uint8)
    settings = {"name": "a/0", "split": "test", "rgb": np.zeros((300, 300, 3), np.uint8), "box": np.zeros(4),
                "square": np.array([149.5, 149.5, 300.0]), "pixel": pixel, "template": template,
                "weight": np.ones(len(template)), "matte": matte, "eyes_px": 50.0}  # fmt: skip
    return real_faces.RealFace(**settings | more)


def posed(mesh, camera):
    return real_faces.PosedMesh(mesh.points / MM_PER_DM, mesh.points / MM_PER_DM, mesh.faces, camera)


@pytest.fixture
def camera():
    return look_at(0.2, 0.0, 0.0, 12.0, np.zeros(3), 1000.0, 300)


def test_points_of_a_real_face_are_compared_in_pixels_and_by_the_eyes(camera):
    mesh = posed(ellipsoid(), camera)
    template = ball_points(200) * RADII_MM / MM_PER_DM
    np.testing.assert_allclose(mesh.at(template), template, atol=0.02)
    face = real_face(mesh, template)
    assert real_faces.figures_of(face, mesh)["points_px"] < 1e-6
    off = real_faces.figures_of(replace(face, pixel=face.pixel + [3, 4]), mesh)
    assert off["points_px"] == pytest.approx(5)
    assert off["points"] == pytest.approx(0.1)
    weight = np.arange(200) % 2
    half = replace(face, pixel=face.pixel + np.where(weight[:, None] > 0, [[0, 0]], [[90, 0]]), weight=weight)
    assert real_faces.figures_of(half, mesh)["points_px"] < 1e-6


def test_silhouettes_are_compared_where_the_mask_is_certain(camera):
    mesh = posed(ellipsoid(), camera)
    x = np.arange(SIDE)
    drawn = white(ellipsoid()).shown(camera)[1]
    matte = np.where(cv2.resize(drawn.astype(np.uint8), (SIDE, SIDE), interpolation=cv2.INTER_AREA) > 0, 255, 0)
    face = real_face(mesh, ball_points(30), matte=matte.astype(np.uint8))
    assert real_faces.matte_iou(face, mesh) > 0.97
    shifted = replace(face, matte=np.roll(face.matte, 40, 1))
    assert real_faces.matte_iou(shifted, mesh) < 0.75
    unknown = np.where((x > 120) & (face.matte == 255), 128, face.matte).astype(np.uint8)
    assert real_faces.matte_iou(replace(face, matte=unknown), mesh) > 0.97
    assert real_faces.matte_iou(real_face(mesh, ball_points(30)), mesh) is None


def test_real_faces_are_read_in_pixels_of_their_photo(tmp_path):
    (tmp_path / "photos/test").mkdir(parents=True)
    (tmp_path / "faces/test").mkdir(parents=True)
    cv2.imwrite(str(tmp_path / "photos/test/one.png"), np.zeros((90, 120, 3), np.uint8))
    pixel = np.full((1, 468, 2), (SIDE - 1) / 2, np.float32)
    pixel[0, LEFT_EYE, 0] += SIDE / 4
    found = PhotoFaces(
        np.zeros((1, SIDE, SIDE, 3), np.uint8), pixel, np.zeros((468, 3), np.float32), np.ones((1, 468), np.float32),
        np.zeros((1, SIDE, SIDE), np.uint8), np.float32([[60, 50, 64]]),
    )  # fmt: skip
    found.save(tmp_path / "faces/test/one.npz")
    found.save(tmp_path / "faces/test/gone.npz")
    (face,) = real_faces.real_faces(tmp_path / "photos", tmp_path / "faces")
    assert (face.name, face.split) == ("one/0", "test")
    np.testing.assert_allclose(face.pixel[RIGHT_EYE], [60, 50])
    assert face.eyes_px == pytest.approx(16)
    np.testing.assert_allclose(face.box, [40.5, 30.5, 80.5, 70.5])
    assert real_faces.measure_real(Path(), tmp_path / "nothing", tmp_path / "faces", [0]) == []


def test_a_face_that_is_not_found_is_said_to_be_missing(monkeypatch, camera):
    mesh = posed(ellipsoid(), camera)
    face = real_face(mesh, ball_points(40) * RADII_MM / MM_PER_DM)
    monkeypatch.setattr(real_faces, "real_faces", lambda *_: iter([face, replace(face, name="b/0")]))
    wrong = replace(mesh, points=1.1 * mesh.points)
    monkeypatch.setattr(real_faces, "MeanHeads", lambda _: SimpleNamespace(posed=lambda *_: wrong))

    class Builder:
        __enter__, __exit__ = lambda self: self, lambda *_: None

    def fitted(_, own, seconds):
        if own.name == "b/0":
            raise MaquetteError("No head is seen.", "MAQ_ERROR_NOT_FOUND")
        return mesh

    monkeypatch.setattr(real_faces, "HeadBuilder", lambda *_, **__: Builder())
    monkeypatch.setattr(real_faces, "fitted_mesh", fitted)
    rows = real_faces.measure_real(Path(), Path(), Path(), [0, 2])
    assert ["missing" in row for row in rows] == [False, False, True, True]
    page = report.page(empty_report() | {"real": rows})
    assert "| 2 s | 1 of 2 | 0.00 | 0.00 % |" in page
    assert "Not found: b/0: No head is seen." in page


def test_template_points_of_the_mean_head_are_those_of_its_field():
    import torch

    from export.heads.field import bases_of, geometry, surface

    prior = small_prior()
    points = ball_points(50)
    weights = bases_of(prior).combine(torch.zeros(prior.shape_codes), torch.zeros(prior.colour_codes))
    at = torch.from_numpy(points.astype(np.float32))
    wanted = surface(prior.shape, weights, at, geometry(prior.shape, weights, at))[1]
    np.testing.assert_allclose(template_points(prior, points), wanted.detach().numpy(), rtol=1e-5, atol=1e-6)


def test_the_prior_s_limit_is_measured_with_codes_fitted_to_the_truth(tmp_path, monkeypatch):
    import torch

    from export.heads.field import bases_of, geometry

    prior = small_prior()
    bases = bases_of(prior)
    points = (0.5 * ball_points(400)).astype(np.float32)
    wanted = torch.full((prior.shape_codes,), 1.5), torch.zeros(prior.colour_codes)
    with torch.no_grad():
        distance = geometry(bases.shape, bases.combine(*wanted), torch.from_numpy(points))[:, 0].numpy()
    on = points[np.abs(distance) < np.sort(np.abs(distance))[60]]  # the nearest to that head's surface
    stored = HeadPoints(
        on, on, on, np.full(on.shape, 128, np.uint8), points, distance, points, distance, points, points
    )
    np.savez(tmp_path / "head-00000.npz", **vars(stored))
    monkeypatch.setattr(prior_limit, "read_prior", lambda _: prior)
    true = TruePoints(on.astype(np.float64) * MM_PER_DM, np.arange(len(on)) < 30)
    head = SimpleNamespace(name="head-00000", true=true)
    (row,) = prior_limit.measure_prior(Path(), tmp_path, [head], 60)
    assert row["head_mm"] < row["mean_head_mm"]
    assert "codes fitted to the true distances: head, mm" in report.page(empty_report() | {"prior": [row]})


# --- settings, the program, the engine, the page ---


def empty_report():
    return {"machine": {"processor": "x", "cores": 2}, "bundles": ["b"], "at_s": 2, "rows": []}


def test_settings_are_compared_over_heads_that_all_of_them_found():
    row = {"whole_s": 1, "mesh_s": 0.5, "steps": 9, "triangles": 100, "face_mm": 1.0, "head_mm": 2.0}
    rows = [row | {"setting": name, "head": head} for name in ("one", "other") for head in "ab"]
    rows[1] |= {"face_mm": 3.0}
    assert "| one | 1.00 | 0.50 | 9 | 100 | 2.00 | 2.00 |" in savings.settings_table(rows)
    assert "| one | 1.00 | 0.50 | 9 | 100 | 1.00 | 2.00 |" in savings.settings_table(rows[:3])
    names = [setting.name for setting in savings.settings_of(2)]
    assert len(set(names)) == len(names)


def test_time_and_memory_of_a_program_are_its_own(tmp_path):
    hungry = [sys.executable, "-c", "x = bytearray(200_000_000); print('done')"]
    seconds, peak_mb = program.run_counted(hungry, tmp_path / "out")
    assert 200 < peak_mb < 400
    assert seconds > 0
    assert (tmp_path / "out").read_text() == "done\n"
    _, small_mb = program.run_counted([sys.executable, "-c", ""], tmp_path / "out")
    assert small_mb < 100
    with pytest.raises(OSError, match="ended with 3"):
        program.run_counted([sys.executable, "-c", "raise SystemExit(3)"], tmp_path / "out")


def test_pytorch_computes_what_the_engine_is_measured_with():
    from export.heads.prior import FieldShape

    shape = FieldShape(width=16, surface_width=16)
    works = engine.torch_works(shape, 8)
    assert list(works) == list(engine.PASSES)
    assert works["distance"]().shape == (8, 1 + shape.feature)
    assert not works["forward"]()[0].requires_grad
    for work in works.values():
        work()
    small = FieldShape(octaves=0, width=2, geometry_layers=1, feature=0, surface_width=1, surface_layers=1)
    assert engine.macs_of(small) == 3 * 2 + 2 * 1 + 4 * 1 + 1 * 6
    rows = [{"isa": "avx2", "what": "forward, back to all weights", "us": 0.5, "torch_us": 2.0, "fraction": 0.5}]
    page = report.page(empty_report() | {"engine": rows})
    assert "| avx2 | forward, back to all weights | 0.500 | 2.000 | 0.25 | 50 % |" in page
    assert "| engine: a point of a step by PyTorch, one thread | 0.25 | ≤ 0.33 | ≤ 0.15 | met |" in page
    assert "| engine: fraction of the float peak | 0.50 | ≥ 0.4 | ≥ 0.6 | met |" in page
    impossible = report.page(empty_report() | {"engine": [rows[0] | {"fraction": 3.0}]})
    assert "| engine: fraction of the float peak | 3.00 | ≥ 0.4 | ≥ 0.6 | not measured |" in impossible


def full_row(head, face, **more):
    return {"bundle": "b", "set": "one photo", "head": head, "asked_s": 2, "face_mm": face, "head_mm": 2.0,
            "unaligned_mm": 9, "scale": 0.9, "normals_deg": 20, "mean_face_mm": 2, "mean_head_mm": 4, "yaw_deg": -20,
            "mean_unaligned_mm": 10, "mean_normals_deg": 30, "head_px": 130, "focal_ratio": 1.1, "rotation_deg": 3.0,
            "fit_s": 1, "steps": 50, "encode_ms": 1, "mesh_ms": 300, "used_photos": 1, "linear_head_mm": 2.5,
            "linear_face_mm": 1.5, "view_psnr_db": 20.0, "mean_view_psnr_db": 18.0, "seen_mm": 1.0, "unseen_mm": 3.0,
            "face_mesh_inner_face_mm": 2.6, "inner_face_mm": 1.1, "hair": "long"} | more  # fmt: skip


def test_the_page_has_baselines_groups_and_targets():
    rows = [full_row("a", 1.0), full_row("b", 2.0, hair="none", face_mesh_inner_face_mm=None)]
    page = report.page(empty_report() | {"rows": rows})
    assert "| one photo: head by linear head | 0.80 | ≤ 0.9 | ≤ 0.75 | met |" in page
    assert "| one photo: new views, dB over the mean head with the photo projected | 2.00 | ≥ 1.5 | ≥ 3 | met |" in page
    assert "| one photo: mesh at 1.6 mm, s | 0.30 | ≤ 1 | ≤ 0.4 | stretch |" in page
    assert "| long | 1 | 1.00 | 0.50 | 2.00 | 0.50 |" in page
    assert "| none | 1 | 2.00 |" in page
    assert "| 120 to 150 px | 2 | 1.50 |" in page
    # Only where everybody has an answer.
    assert "| 1 heads |" in page
    assert "| fitted, 2 s | 1.00 | 1.10 | 2.00 | 1.00 | 3.00 |" in page
    assert "| MediaPipe's 468 points |  | 2.60 |" in page


def test_the_page_warns_of_fits_that_time_ended_too_early():
    def page(steps):
        return report.page(empty_report() | {"rows": [full_row(head, 1.0, steps=steps) for head in "ab"]})

    assert "Fits of 2 s came no further than 5 steps: the machine was busy" in page(5)
    assert "| one photo: face, mm | 1.00 | ≤ 1.8 | ≤ 1.3 | not measured |" in page(5)
    assert "| one photo: face, mm | 1.00 | ≤ 1.8 | ≤ 1.3 | stretch |" in page(120)
    assert "busy" not in page(120)


def test_parts_can_be_measured_again(tmp_path, monkeypatch):
    figures, out = tmp_path / "heads.json", tmp_path / "heads.md"
    arguments = ["--figures", str(figures), "--out", str(out), "--parts", "engine"]
    with pytest.raises(SystemExit, match="quality first"):
        whole_report.main(arguments)
    figures.write_text(json.dumps(empty_report() | {"rows": [full_row("a", 1.0)]}))
    row = {"isa": "avx2", "what": "distance", "us": 0.123456789, "torch_us": 2.0, "fraction": None}
    monkeypatch.setattr(engine, "measure_engine", lambda: [row])
    whole_report.main(arguments)
    text = out.read_text()
    assert "| avx2 | distance | 0.123 |" in text
    assert "| one photo: face, mm | 1.00 |" in text
    assert json.loads(figures.read_text())["engine"][0]["us"] == 0.12346

    def fails():
        raise FileNotFoundError("no program")

    monkeypatch.setattr(engine, "measure_engine", fails)
    whole_report.main(arguments)
    assert "| avx2 | distance | 0.123 |" in out.read_text()  # as it was


def test_a_photo_and_its_pictures_agree(backgrounds):
    photo = photo_of(pictures_of_ellipsoid([10]), 0, backgrounds, np.random.default_rng(0))
    moved = new_views.moved(photo.camera, Similarity(2.0, np.eye(3), np.array([100.0, 0, 0])))
    point = np.array([[0.3, -0.8, 0.2]])
    np.testing.assert_allclose(moved.projected(2 * point + [1, 0, 0])[0], photo.camera.projected(point)[0])
