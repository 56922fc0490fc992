"""Heads of the Python package, on round heads, which are known exactly: photos, fits, meshes, files, errors."""

import signal
import threading
from pathlib import Path

import maquette
import numpy as np
import pytest
import trimesh
from round_heads import BOX, COARSE_M, GREY, ROUND

PHOTO = Path(__file__).parents[3] / "tests/media/photo.jpg"

pytestmark = pytest.mark.skipif(
    not maquette.library_path().exists(), reason=f"{maquette.library_path()} is not built: run `make build`"
)


def test_a_photo_becomes_a_head(builder):
    told = []
    builder.add_photo(GREY, BOX)
    assert not builder.photos[0].is_used
    head = builder.fit(0, progress=lambda done, stage: told.append((done, stage)))

    assert [told[0], told[-1]] == [(0, "Finding cameras and a first shape."), (1, "The head is fitted.")]
    (photo,) = builder.photos
    assert photo.box_px == BOX
    assert photo.is_used
    assert photo.focal_px > 100
    assert 0 < photo.rms_px < 2
    assert photo.head_coverage == pytest.approx(0.22, abs=0.05)
    assert builder.stats["photo_count"] == builder.stats["used_photo_count"] == 1
    assert builder.stats["step_count"] == 0
    assert builder.stats["threads"] == 1
    # Three axes that differ by 7 %.
    assert head.info == maquette.HeadInfo(1, "prior", pytest.approx(0.07 / np.sqrt(3), abs=0.005), 0)


def test_the_mesh_is_closed_and_corresponds_to_the_template_head(head):
    mesh = head.mesh(cell_m=COARSE_M)
    count = len(mesh.positions_m)

    assert mesh.positions_m.shape == mesh.normals.shape == mesh.template_points_m.shape == mesh.colours.shape
    assert (mesh.positions_m.dtype, mesh.colours.dtype, mesh.triangles.dtype) == (np.float32, np.uint8, np.uint32)
    solid = trimesh.Trimesh(mesh.positions_m, mesh.triangles, process=False)
    assert solid.is_watertight
    assert solid.volume > 0  # counter-clockwise from outside
    assert len(mesh.triangles) == 2 * (count - 2)  # one piece without holes
    assert np.linalg.norm(mesh.normals, axis=1) == pytest.approx(1, abs=1e-4)
    assert (mesh.normals * mesh.positions_m).sum(1).mean() > 0.05  # outwards
    crown_m = head.landmark("crown").point_m[1]
    on_template_m = mesh.positions_m[:, 1] * 0.121 / crown_m  # whose crown is at 121 mm
    assert mesh.template_points_m[:, 1] == pytest.approx(on_template_m, abs=2e-3)
    assert mesh.colours[:, 0].mean() == pytest.approx(178, abs=15)  # red, of the prior
    assert (mesh.texture_coordinates, mesh.texture_jpeg, mesh.simplification_error_m) == (None, None, 0)


def test_meshes_are_as_fine_as_asked_for(head):
    whole, some = head.mesh("all", cell_m=COARSE_M), head.mesh(1000, cell_m=COARSE_M)

    assert len(whole.triangles) == len(head.mesh(cell_m=COARSE_M).triangles) > 3000
    assert len(some.triangles) == pytest.approx(1000, abs=10)
    assert 0 < some.simplification_error_m < COARSE_M
    assert len(head.mesh(cell_m=COARSE_M / 2).triangles) > 3 * len(whole.triangles)
    assert whole.positions_m.max() < 0.3  # copies: later meshes do not write over them


def test_the_animatable_head_has_the_template_s_vertices_and_facial_actions(head, tmp_path):
    mesh = head.mesh()
    jaw, wink = mesh.morph_targets

    assert len(mesh.positions_m) == 14 * 25 + 1 + 12  # as tests/native/generate/make_round_heads.py has it
    assert mesh.texture_coordinates.shape == (len(mesh.positions_m), 2)
    assert mesh.texture_jpeg is None
    assert (jaw.name, wink.name) == ("jawOpen", "eyeBlinkLeft")
    assert jaw.deltas_m.shape == (len(jaw.vertices), 3)
    assert jaw.deltas_m[:, 1] == pytest.approx(-0.015, abs=0.003)
    assert np.all(mesh.template_points_m[jaw.vertices, 1] < 0)
    assert np.all(np.diff(jaw.vertices.astype(int)) > 0)
    assert head.mesh(cell_m=COARSE_M).morph_targets == ()

    head.save(tmp_path / "a.maqh")
    opened = maquette.Head.open(tmp_path / "a.maqh")
    again = opened.mesh(bundle=ROUND)
    again.save(tmp_path / "a.glb")
    assert b'"targetNames":["jawOpen","eyeBlinkLeft"]' in (tmp_path / "a.glb").read_bytes()
    np.testing.assert_array_equal(again.triangles, mesh.triangles)


def test_landmarks_have_names(head):
    landmarks = head.landmarks()

    assert list(landmarks) == ["nose_tip", "chin", "crown", "pupil_left", "pupil_right"]
    left, right = landmarks["pupil_left"], landmarks["pupil_right"]
    assert left.point_m[0] == pytest.approx(-right.point_m[0], abs=1e-3)
    assert left.point_m[0] > 0.02  # the person's left
    assert landmarks["nose_tip"].point_m[2] > 0.05  # the face looks to z
    assert landmarks["crown"].sigma_m == pytest.approx(0.0021, abs=1e-4)
    assert landmarks["nose_tip"].sigma_m == pytest.approx(0.0031, abs=1e-4)  # how far it stands out is less sure
    np.testing.assert_array_equal(head.landmark("crown").point_m, landmarks["crown"].point_m)


def test_a_known_distance_or_depth_gives_the_size(head):
    def pupils_m(of):
        return np.linalg.norm(of.landmark("pupil_left").point_m - of.landmark("pupil_right").point_m)

    given = head.scaled_by_distance("pupil_left", "pupil_right", 0.07)
    assert pupils_m(given) == pytest.approx(0.07)
    assert given.info.scale == "given"
    seen_m = maquette.HeadRenderer(given.mesh()).run(given.camera()).depth
    millimetres = np.where(seen_m > 0, 1000 * seen_m, 5000).astype(np.uint16)
    for depth in (np.where(seen_m > 0, seen_m, 5).astype(np.float32), millimetres, maquette.Frame(millimetres)):
        measured = head.scaled_by_depth(depth)
        assert pupils_m(measured) == pytest.approx(0.07, rel=0.005)
        assert measured.info.scale == "depth"
    assert head.info.scale == "prior"
    with pytest.raises(maquette.MaquetteError, match="same landmark"):
        head.scaled_by_distance("chin", "chin", 0.07)
    with pytest.raises(maquette.MaquetteError, match="not depth"):
        head.scaled_by_depth(GREY)


def test_heads_are_opened_from_bytes(head, tmp_path):
    head.save(tmp_path / "a.maqh")
    data = (tmp_path / "a.maqh").read_bytes()
    maquette.Head.open(data).save(tmp_path / "b.maqh")
    assert (tmp_path / "b.maqh").read_bytes() == data
    for damaged in (b"", data[:-1], b"MAQHED" * 100):
        with pytest.raises(maquette.MaquetteError, match="The head in memory"):
            maquette.Head.open(damaged)


def test_frames_grey_photos_and_found_boxes_will_do(builder):
    builder.add_photo(maquette.Frame(GREY[..., ::-1], maquette.PixelFormat.BGR8), np.array(BOX))
    builder.add_photo(GREY[..., 0], BOX, roll_rad=0.2, focal_px=777)
    builder.add_photo(GREY)
    builder.fit(0)

    first, second, found = builder.photos
    assert first.box_px == second.box_px == BOX
    assert second.focal_px == 777
    left, top, right, bottom = found.box_px
    assert (left + right) / 2 == pytest.approx(160, abs=10)
    assert (top + bottom) / 2 == pytest.approx(120, abs=10)


def test_two_photos_make_one_head_with_two_cameras(builder):
    builder.add_photo(GREY, BOX)
    builder.add_photo(np.full((480, 640, 3), 120, np.uint8), (220, 120, 400, 360))
    head = builder.fit(0)

    assert head.info.photo_count == 2
    near, far = head.camera(0), head.camera(1)
    assert (near.intrinsics.width_px, far.intrinsics.width_px) == (320, 640)
    assert near.intrinsics.fx_px == pytest.approx(builder.photos[0].focal_px)
    assert near.rotation @ near.rotation.T == pytest.approx(np.eye(3), abs=1e-9)
    assert near.centre[2] > 0.3  # before the face, metres
    with pytest.raises(maquette.MaquetteError, match="index is 2"):
        head.camera(2)


def test_photos_are_added_to_a_head_from_a_file(builder, head, tmp_path):
    head.save(tmp_path / "a.maqh")
    builder.add_head(maquette.Head.open(tmp_path / "a.maqh"))
    builder.add_photo(GREY, BOX)
    both = builder.fit(0)

    assert (both.info.photo_count, builder.stats["photo_count"]) == (2, 1)
    assert both.camera(0).centre == pytest.approx(head.camera(0).centre)  # that of its photo, as it was
    assert both.landmark("nose_tip").sigma_m < head.landmark("nose_tip").sigma_m


def test_a_photo_without_the_head_is_rejected_and_has_no_camera(builder):
    blue = np.full_like(GREY, (20, 60, 200))  # in blue the bundle sees a mirrored head, which no camera explains
    builder.add_photo(blue, BOX)
    builder.add_photo(GREY, BOX)
    head = builder.fit(0)

    assert [photo.is_used for photo in builder.photos] == [False, True]
    assert builder.stats["used_photo_count"] == head.info.photo_count == 1
    assert head.camera(0).intrinsics.fx_px == pytest.approx(builder.photos[1].focal_px)


def test_photos_are_forgotten(builder):
    builder.add_photo(GREY, BOX)
    builder.clear()

    assert builder.photos == []
    with pytest.raises(maquette.MaquetteError, match="no photos"):
        builder.fit(0)


def test_the_fit_takes_the_colours_of_the_photo(builder):
    builder.add_photo(GREY, BOX)
    seen = builder.fit(0).mesh(cell_m=COARSE_M).colours[:, 0].mean()
    fitted = builder.fit(20).mesh(cell_m=COARSE_M).colours[:, 0].mean()

    assert builder.stats["step_count"] > 0
    assert abs(fitted - 140) < abs(seen - 140)


def test_false_from_progress_cancels(builder):
    builder.add_photo(GREY, BOX)
    told = []
    with pytest.raises(maquette.MaquetteError, match="MAQ_CANCELLED"):
        builder.fit(60, progress=lambda done, stage: told.append(done) or len(told) < 3)

    assert len(told) == 3
    assert builder.fit(0).info.photo_count == 1  # the builder stays usable


def test_what_progress_raises_comes_out_of_the_fit(builder, capsys):
    class OwnError(Exception):
        pass

    def progress(done, stage):
        raise OwnError(f"at {done}")

    builder.add_photo(GREY, BOX)
    with pytest.raises(OwnError, match="at 0"):
        builder.fit(60, progress=progress)
    assert capsys.readouterr().err == ""
    assert builder.fit(0).info.photo_count == 1


def test_ctrl_c_ends_a_fit_without_progress(builder):
    builder.add_photo(GREY, BOX)
    fitting = threading.Event()
    pressed = threading.Thread(target=lambda: fitting.wait(60) and signal.raise_signal(signal.SIGINT))
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)
    pressed.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            builder.fit(3600, preview=lambda head: fitting.set(), preview_interval_s=3600)
    finally:
        pressed.join()
        signal.signal(signal.SIGINT, handler)
    assert not builder.photos[0].is_used  # the fit did not go on to its end


def test_another_thread_cancels(builder):
    builder.add_photo(GREY, BOX)
    builder.cancel()  # nothing runs: it holds for the next
    with pytest.raises(maquette.MaquetteError, match="MAQ_CANCELLED"):
        builder.fit(0)

    fitting = threading.Event()
    waiting = threading.Thread(target=lambda: fitting.wait(60) and builder.cancel())
    waiting.start()
    with pytest.raises(maquette.MaquetteError, match="MAQ_CANCELLED"):
        builder.fit(3600, progress=lambda done, stage: fitting.set())
    waiting.join()


def test_previews_are_heads_and_their_errors_come_out(builder):
    builder.add_photo(GREY, BOX)
    seen = []
    builder.fit(0.5, preview=seen.append, preview_interval_s=0.01)
    assert len(seen) >= 2
    assert len(seen[0].mesh(cell_m=COARSE_M).triangles) > 3000
    count = len(seen)
    builder.fit(0.2)
    assert len(seen) == count  # no longer

    with pytest.raises(ZeroDivisionError):
        builder.fit(60, preview=lambda head: 1 / 0, preview_interval_s=0)
    builder.fit(0.1)


def test_a_head_saved_and_opened_is_the_same_head(head, tmp_path):
    head.save(tmp_path / "head.maqh")
    opened = maquette.Head.open(tmp_path / "head.maqh")

    assert opened.info == head.info
    for name, landmark in head.landmarks().items():
        np.testing.assert_allclose(opened.landmark(name).point_m, landmark.point_m, atol=1e-4)
    one, other = opened.mesh(cell_m=COARSE_M), head.mesh(cell_m=COARSE_M)
    for reduced in (np.min, np.max):
        np.testing.assert_allclose(reduced(one.positions_m, 0), reduced(other.positions_m, 0), atol=2e-4)
    np.testing.assert_allclose(opened.camera().centre, head.camera().centre)
    opened.save(tmp_path / "again.maqh")
    assert (tmp_path / "again.maqh").read_bytes() == (tmp_path / "head.maqh").read_bytes()


@pytest.mark.parametrize("ending", [".glb", ".obj", ".ply"])
def test_files_for_other_programs_have_the_triangles_asked_for(head, tmp_path, ending):
    path = tmp_path / f"head{ending}"
    mesh = head.mesh(1000, cell_m=COARSE_M)
    mesh.save(path)
    read = trimesh.load(path, force="mesh")

    assert read.is_watertight
    assert len(read.faces) == len(mesh.triangles)
    np.testing.assert_allclose(read.bounds, [mesh.positions_m.min(0), mesh.positions_m.max(0)], atol=1e-5)


def test_a_texture_has_the_pixels_of_the_photo(tmp_path):
    with maquette.HeadBuilder(ROUND, threads=1, texture_px=256) as builder:
        builder.add_photo(GREY, BOX)
        head = builder.fit(0)
    mesh = head.mesh(cell_m=COARSE_M)
    texture = maquette.Frame.decode(mesh.texture_jpeg).pixels()

    assert head.info.texture_px == 256
    assert texture.shape == (256, 256, 3)
    assert mesh.texture_coordinates.shape == (len(mesh.positions_m), 2)
    assert (mesh.texture_coordinates >= 0).all()
    assert (mesh.texture_coordinates <= 1).all()
    front = mesh.texture_coordinates[np.argmax(mesh.positions_m[:, 2])]
    x, y = (front * 256).astype(int)
    assert texture[y, x] == pytest.approx(GREY[0, 0], abs=6)
    head.save(tmp_path / "head.maqh")
    opened = maquette.Head.open(tmp_path / "head.maqh")
    assert opened.mesh(cell_m=COARSE_M).texture_jpeg == mesh.texture_jpeg

    animatable = opened.mesh(bundle=ROUND)
    texture = maquette.Frame.decode(animatable.texture_jpeg).pixels()
    assert texture.shape == (512, 512, 3)
    front = animatable.texture_coordinates[np.argmax(animatable.positions_m[:, 2])]
    x, y = (front * 512).astype(int)
    assert texture[y, x] == pytest.approx(GREY[0, 0], abs=6)


@pytest.mark.parametrize(
    ("call", "error", "text"),
    [
        (lambda b, h, r: maquette.HeadBuilder("nowhere"), maquette.MaquetteError, "nowhere.*MAQ_ERROR_NOT_FOUND"),
        (lambda b, h, r: maquette.HeadBuilder(thread=1), TypeError, "setting thread; did you mean threads.*texture_px"),
        (lambda b, h, r: maquette.HeadBuilder(ROUND, True, texture_px=100), maquette.MaquetteError, "texture_px"),
        (lambda b, h, r: maquette.HeadBuilder(ROUND, False, texture_px=512), maquette.MaquetteError, "TEXTURE_OFF"),
        (lambda b, h, r: b.add_photo(GREY, (5, 5, 5, 9)), maquette.MaquetteError, "box .* empty"),
        (lambda b, h, r: b.add_photo(GREY, (np.nan, 5, 50, 90)), maquette.MaquetteError, "MAQ_ERROR_INVALID_ARGUMENT"),
        (lambda b, h, r: b.add_photo(GREY, (400, 5, 500, 90)), maquette.MaquetteError, "MAQ_ERROR_INVALID_ARGUMENT"),
        (lambda b, h, r: b.add_photo(GREY, (0, 0, 0, 0)), ValueError, "box_px is 0, 0, 0, 0"),
        (lambda b, h, r: b.add_photo(GREY, (1, 2, 3)), ValueError, "box_px is .* 4 numbers: left, top"),
        (lambda b, h, r: b.add_photo(GREY, BOX, focal_px=0), ValueError, "focal_px is 0"),
        (lambda b, h, r: b.add_photo(GREY, BOX, focal_px=-3), maquette.MaquetteError, "focal"),
        (lambda b, h, r: b.add_photo(GREY, BOX, roll_rad=np.inf), maquette.MaquetteError, "roll"),
        (lambda b, h, r: b.add_photo(np.ones((9, 9), np.float32)), maquette.MaquetteError, "MAQ_ERROR_UNSUPPORTED"),
        (lambda b, h, r: b.add_photo(0 * GREY, BOX), maquette.MaquetteError, "MAQ_ERROR_NOT_FOUND"),
        (lambda b, h, r: b.fit(-1), maquette.MaquetteError, "time for the fit is -1 s"),
        (lambda b, h, r: b.fit(0, preview=print, preview_interval_s=-1), maquette.MaquetteError, "previews is -1"),
        (lambda b, h, r: maquette.Head.open("nowhere.maqh"), maquette.MaquetteError, "MAQ_ERROR_NOT_FOUND"),
        (lambda b, h, r: maquette.Head.open(PHOTO), maquette.MaquetteError, "MAQ_ERROR_UNREADABLE"),
        (lambda b, h, r: h.save("/dev/null/head.maqh"), maquette.MaquetteError, "MAQ_ERROR_UNWRITABLE"),
        (lambda b, h, r: h.mesh().save("head.stl"), maquette.MaquetteError, r"\.glb"),
        (lambda b, h, r: h.mesh("most"), ValueError, 'triangle_count is "most"; it is a number or "all"'),
        (lambda b, h, r: h.mesh(5), maquette.MaquetteError, "triangle_count"),
        (lambda b, h, r: h.mesh(cell_m=1), maquette.MaquetteError, "cell_m"),
        (lambda b, h, r: h.landmark("tail"), maquette.MaquetteError, "tail.*MAQ_ERROR_NOT_FOUND"),
        (lambda b, h, r: maquette.HeadRenderer(h.mesh(), "nice"), ValueError, 'shading is "nice"; .*template'),
        (lambda b, h, r: maquette.HeadRenderer(h.mesh(), background=(1, 2)), ValueError, "3 numbers: red, green, blue"),
        (lambda b, h, r: maquette.HeadRenderer(h.mesh(), shading_strength=2.0), maquette.MaquetteError, "strength"),
        (lambda b, h, r: maquette.HeadRenderer(h.mesh(), lamp=2), TypeError, "no setting lamp"),
        (lambda b, h, r: r.set_shading("nice"), ValueError, "nice"),
        (lambda b, h, r: r.camera(np.nan), maquette.MaquetteError, "MAQ_ERROR_INVALID_ARGUMENT"),
        (lambda b, h, r: r.camera(0, 0, 64, -1), maquette.MaquetteError, "MAQ_ERROR_IMAGE_SIZE"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said(builder, head, renderer, call, error, text):
    builder.add_photo(GREY, BOX)
    with pytest.raises(error, match=text):
        call(builder, head, renderer)
    assert builder.stats["photo_count"] == 1  # what was there stays


def test_what_is_closed_is_said_and_nothing_reaches_the_library(head, renderer, tmp_path):
    camera = renderer.camera(0, 0, 64, 48)
    head.save(tmp_path / "head.maqh")
    opened = maquette.Head.open(tmp_path / "head.maqh")
    mesh = opened.mesh(cell_m=COARSE_M)
    own, triangles = maquette.HeadRenderer(mesh), mesh.triangles
    builder = maquette.HeadBuilder(ROUND, threads=1)
    for closed in (opened, builder, mesh):
        closed.close()
        closed.close()
    calls = (
        lambda: builder.add_photo(GREY), lambda: builder.fit(0), lambda: builder.clear(), lambda: builder.cancel(),
        lambda: builder.photos, lambda: builder.stats, lambda: opened.info, lambda: opened.mesh(),
        lambda: opened.landmark("chin"), lambda: opened.landmarks(), lambda: opened.camera(),
        lambda: opened.save(tmp_path / "a.maqh"), lambda: mesh.save(tmp_path / "a.ply"), lambda: mesh.normals,
        lambda: maquette.HeadRenderer(mesh),
    )  # fmt: skip
    for call in calls:
        with pytest.raises(maquette.MaquetteError, match=r"This Head(Builder|Mesh)? is closed"):
            call()
    assert own.run(camera).alpha.any()  # a renderer does not need its mesh
    own.close()
    for call in (lambda: own.run(camera), lambda: own.camera(), lambda: own.set_shading("shape")):
        with pytest.raises(maquette.MaquetteError, match="This HeadRenderer is closed"):
            call()
    assert len(triangles)  # copies stay
