"""The Python package over the library of this checkout."""

import gc

import maquette
import numpy as np
import pytest
from maquette.native import native

pytestmark = pytest.mark.skipif(
    not maquette.library_path().exists(), reason=f"{maquette.library_path()} is not built: run `make build`"
)


@pytest.fixture(scope="module")
def person() -> maquette.Frame:
    return maquette.Source("stub:people?count=1&seed=3&size=320x240").read()


@pytest.fixture(scope="module")
def densepose() -> maquette.DensePose:
    return maquette.DensePose(threads=1)


@pytest.fixture(scope="module")
def box() -> tuple[maquette.Frame, maquette.Intrinsics]:
    source = maquette.Source("stub:solids?scene=box&noise=none&size=320x240&seed=1")
    return source.read(), source.intrinsics


def test_people_of_a_frame_and_of_its_pixels_are_the_same(densepose, person):
    of_frame, of_array = densepose.run(person), densepose.run(person.pixels())

    assert len(of_frame.people) == 1
    assert of_frame.part.shape == (240, 320) == person.shape
    assert of_frame.stats["body_pixel_count"] == (of_frame.part > 0).sum() == (of_frame.person == 1).sum() > 500
    left, top, right, bottom = of_frame.people[0].box_px
    y, x = np.nonzero(of_frame.part)
    beside, above = 0.03 * (right - left) + 1, 0.05 * (bottom - top) + 1  # people are painted a little beyond their box
    assert x.min() >= left - beside
    assert x.max() <= right + beside
    assert y.min() >= top - above
    assert y.max() <= bottom + above
    assert (of_frame.part == of_array.part).mean() > 0.99  # RGB of a frame that may have been NV12


def test_keypoints_of_a_photo_lie_where_the_surface_shows_them(densepose):
    photo = maquette.sample("photo.jpg")
    assert densepose.run(photo).people[0].keypoints is None
    (person,) = (result := maquette.DensePose(has_keypoints=True, threads=1).run(photo)).people
    assert person.keypoints.shape == (33, 3)
    assert person.keypoints[maquette.COCO_KEYPOINTS].shape == (17, 3)
    # The sides of the head are parts 23 and 24; each keypoint of the face lies on one of them.
    for name in ("nose", "left_eye", "right_eye", "mouth_left", "mouth_right"):
        x, y, confidence = person.keypoints[maquette.KEYPOINTS.index(name)]
        assert confidence > 0.3, name
        assert result.part[int(y), int(x)] in (23, 24), name
    left, right = (person.keypoints[maquette.KEYPOINTS.index(f"{side}_shoulder")] for side in ("left", "right"))
    assert left[0] > right[0]  # the person faces us
    n = native()
    names = [n.ffi.string(n.lib.maq_densepose_get_keypoint_name(k)).decode() for k in range(33)]
    assert tuple(names) == maquette.KEYPOINTS


def test_red_and_blue_are_told_apart_by_the_format(densepose, person):
    rgb = person.pixels()
    as_rgb = densepose.run(rgb)
    as_bgr = densepose.run(maquette.Frame(rgb[..., ::-1], maquette.PixelFormat.BGR8))

    assert np.array_equal(as_rgb.part, as_bgr.part)
    assert np.array_equal(person.pixels(maquette.PixelFormat.BGR8), rgb[..., ::-1])


def test_painted_changes_the_pixels_of_people_alone(densepose, person):
    rgb = person.pixels()
    result = densepose.run(rgb)
    painted = result.painted(rgb, opacity=1)

    assert np.array_equal(painted[result.part == 0], rgb[result.part == 0])
    assert np.array_equal(painted[result.part > 0], maquette.part_colours()[result.part[result.part > 0]])


def test_results_are_drawn_and_saved_as_the_command_line_does(person, tmp_path):
    densepose = maquette.DensePose(threads=1, result_pool_size=2)
    result = densepose.run(person)
    result.save(tmp_path / "person")
    stored = maquette.Frame.open(tmp_path / "person_IUV.png").pixels(maquette.PixelFormat.BGR8)
    assert np.array_equal(stored, result.iuv)
    assert (tmp_path / "person_INDS.png").exists()
    assert str(result) == "<DensePoseResult 320 x 240, 1 person>"
    assert result.people[0].id == 1

    body = result.part > 0
    over, alone = result.draw(person, opacity=255), result.draw(opacity=100)
    assert np.array_equal(over[body, :3], maquette.part_colours()[result.part[body]])
    assert np.array_equal(over[~body, :3], person.pixels()[~body])
    assert np.array_equal(alone[..., 3], np.where(body, 100, 0))
    assert np.array_equal(result.draw(opacity=100, is_mirrored=True), alone[:, ::-1])
    newer = [densepose.run(person) for _ in range(3)]
    newer[-1].draw()
    with pytest.raises(maquette.MaquetteError, match="many newer results"):
        result.draw()


def test_names_and_surface_of_the_parts(densepose):
    assert maquette.part_name(0) == "background"
    assert maquette.part_name(25) == "unknown part"
    surface = densepose.surface()
    known = surface[np.isfinite(surface).all(-1)]
    assert surface.shape[0] == 24
    assert 1.4 < np.ptp(known[:, 2]) < 2.2  # metres from sole to crown


def test_a_box_is_measured_saved_and_snapped_to(box, tmp_path):
    depth, intrinsics = box
    assert depth.intrinsics == intrinsics
    result = maquette.Edges(threads=1).run(depth, curves=True)

    assert result.distance_r.shape == (240, 320)
    assert result.eps_r == 16
    assert result.distance_r.max() <= 16
    assert len(result.curves.boxes) == 1
    measured = result.curves.boxes[0]
    assert np.all(np.diff(measured.size_m) <= 0)
    assert measured.axes @ measured.axes.T == pytest.approx(np.eye(3), abs=1e-6)
    assert {c.type for c in result.curves.curves} <= {"line", "arc", "spline"}
    line = next(c for c in result.curves.curves if c.type == "line")
    assert np.linalg.norm(line.points_m[-1] - line.points_m[0]) == pytest.approx(line.length_m, rel=1e-6)
    corner = result.curves.corners_m[0]
    x, y = corner[:2] / corner[2] * intrinsics.fx_px + [intrinsics.cx_px, intrinsics.cy_px]
    target, point = result.curves.snap(x, y)
    assert target == "corner"
    assert point == pytest.approx(corner)
    assert result.curves.snap(-500, -500, 1) is None
    assert str(measured).startswith("<Box ")
    assert result.curves.snap_to_ray((0, 0, 0), corner)[0] == "corner"
    result.save(tmp_path / "box")
    assert (tmp_path / "box_distance.png").exists()
    result.curves.save(tmp_path / "box.dxf")
    assert (tmp_path / "box.dxf").stat().st_size > 100


def test_depth_in_metres_and_in_millimetres_are_one_scene(box):
    depth, intrinsics = box
    metres = depth.depth()
    edges = maquette.Edges(threads=1)
    of_metres = edges.run(metres, intrinsics)
    of_millimetres = edges.run(np.round(metres * 1000).astype(np.uint16), intrinsics)

    assert maquette.Frame(np.round(metres * 1000).astype(np.uint16)).depth() == pytest.approx(metres, abs=5.1e-4)
    assert np.abs(of_metres.distance_r - of_millimetres.distance_r)[metres > 0].mean() < 1
    wrapped = edges.run(maquette.Frame(metres, intrinsics=intrinsics))
    assert np.array_equal(wrapped.distance_r, of_metres.distance_r)
    with pytest.raises(maquette.MaquetteError, match="intrinsics"):
        edges.run(metres)
    with pytest.raises(ValueError, match="own intrinsics"):
        edges.run(depth, maquette.Intrinsics.centred(320, 240, fov_deg=30))


def test_views_are_fused(box):
    depth, intrinsics = box
    camera = maquette.PinholeCamera(intrinsics, np.eye(3), np.array([0.0, 0, 0]))
    told = []
    fusion = maquette.EdgesFusion(maquette.Edges(threads=1), progress=told.append, threads=1)
    alone = fusion.add_view(depth, camera)
    fusion.add_view(depth, camera)
    fusion.finish()

    assert alone.distance_r.shape == (240, 320)
    points = fusion.points()
    assert len(points) == fusion.info["point_count"] > 1000
    assert points["view_count"].max() == 2
    assert np.linalg.norm(points["normal"], axis=1) == pytest.approx(1, abs=1e-4)
    assert fusion.curves().curves
    assert not fusion.curves().boxes
    assert told == sorted(told)
    assert told[-1] <= 1
    failing = maquette.EdgesFusion(maquette.Edges(threads=1), progress=lambda done: 1 / 0, threads=1)
    failing.add_view(depth, camera)
    with pytest.raises(ZeroDivisionError):
        failing.finish()
    with pytest.raises(maquette.MaquetteError, match="min_views"):
        maquette.EdgesFusion(maquette.Edges(threads=1), min_views=-1)


def test_many_results_and_curves_are_freed(box, densepose, person):
    depth, _ = box
    edges = maquette.Edges(threads=1)
    for _ in range(20):  # more than a pool holds
        assert edges.run(depth, curves=True).curves.curves
        densepose.run(person)
    kept = [edges.run(depth, curves=True) for _ in range(16)]
    with pytest.raises(maquette.MaquetteError, match="MAQ_ERROR_POOL_EMPTY"):
        edges.run(depth, curves=True)
    kept.clear()
    gc.collect()
    assert edges.run(depth, curves=True).curves.curves


def test_sources_end_and_close():
    source = maquette.Source("stub:pattern?size=32x24&frames=3")
    frames = list(source)
    assert [frame.sequence for frame in frames] == [0, 1, 2]
    assert frames[1].timestamp_ns > frames[0].timestamp_ns
    assert source.read() is None
    assert source.info["width_px"] == 32
    with pytest.raises(maquette.MaquetteError, match="MAQ_ERROR_UNSUPPORTED"):
        _ = source.intrinsics
    source.close()
    source.close()
    with pytest.raises(maquette.MaquetteError, match="closed"):
        source.read()
    assert frames[0].pixels().shape == (24, 32, 3)  # frames outlive their source


def test_a_scene_is_built_saved_and_rendered(tmp_path):
    folder = _small_capture(tmp_path)
    stages = []
    scene = maquette.Scene.build(folder, progress=lambda done, stage: stages.append((done, stage)), threads=1)
    scene.save(tmp_path / "place.maqs")
    opened = maquette.Scene.open(tmp_path / "place.maqs")
    camera = maquette.Capture(folder).views[0].camera
    image = maquette.SceneRenderer(opened, threads=1).run(camera)

    assert stages[-1][0] == pytest.approx(1, abs=0.2)
    assert all(stage for _, stage in stages)
    assert opened.point_count == scene.point_count > 0
    assert np.linalg.norm(opened.up) == pytest.approx(1)
    height, width = camera.intrinsics.height_px, camera.intrinsics.width_px
    assert image.rgb.shape == (height, width, 3)
    assert image.depth[image.alpha == 255].min() > 0
    image.save(tmp_path / "view.png", alpha=True)
    assert np.array_equal(maquette.Frame.open(tmp_path / "view.png").pixels()[image.alpha == 255],
                          image.rgb[image.alpha == 255])  # fmt: skip
    assert maquette.Scene.open((tmp_path / "place.maqs").read_bytes()).point_count == opened.point_count

    capture = maquette.Capture(folder)
    builder = maquette.SceneBuilder(_wall_points(), up=capture.up, threads=1)
    seen = [builder.add_view(capture.photo(k), view.camera) for k, view in enumerate(capture.views)]
    assert min(seen) > 0
    assert builder.stats["view_count"] == 2
    assert builder.finish().point_count == scene.point_count
    builder.cancel()
    with pytest.raises(maquette.MaquetteError, match="MAQ_CANCELLED"):
        builder.add_view(capture.photo(0), camera)
    with pytest.raises(maquette.MaquetteError, match="MAQ_ERROR_NOT_FOUND"):
        capture.depth(0)
    with pytest.raises(maquette.MaquetteError, match="MAQ_CANCELLED"):
        maquette.Scene.build(folder, progress=lambda done, stage: False)
    with pytest.raises(ZeroDivisionError):
        maquette.Scene.build(folder, progress=lambda done, stage: 1 / 0)


def test_photos_of_a_wall_make_a_dense_cloud_of_it_and_a_scene():
    rng = np.random.default_rng(0)
    pattern = np.kron(rng.integers(30, 220, (48, 64, 3)), np.ones((3, 3, 1))).astype(np.uint8)
    # Cameras that stand 10 pixels of the wall apart, 2 before it.
    photos = [pattern[:, 40 - shift : 150 - shift] for shift in (0, 10, -10)]
    intrinsics = maquette.Intrinsics.centred(110, 144, fov_deg=58)
    step = 10 * 2 / intrinsics.fx_px
    cameras = [maquette.PinholeCamera(intrinsics, np.eye(3), np.array([-k * step, 0, 5])) for k in (0, 1, -1)]
    x, y = np.meshgrid(np.linspace(-0.8, 0.8, 8), np.linspace(-0.8, 0.8, 8))
    sparse = np.stack([x.ravel(), y.ravel(), 7 + 0.1 * np.sin(9 * x.ravel())], 1)
    stages = []

    dense = maquette.DenseCloud(photos, cameras, sparse, progress=lambda done, stage: stages.append((done, stage)))
    frame, camera = dense.depth(1)

    assert dense.points.shape == dense.rgb.shape
    assert np.median(np.abs(dense.points[:, 2] - 7)) < 0.02
    assert np.mean(np.abs(dense.points[:, 2] - 7) < 0.1) > 0.8
    assert frame.depth().shape == (144, 110)
    np.testing.assert_allclose(camera.centre, cameras[1].centre)
    assert [done for done, _ in stages] == sorted(done for done, _ in stages)
    again = maquette.DenseCloud(photos, cameras, sparse - [0, 0, 7], origin=(0, 0, 7), threads=2, max_points=1000)
    assert len(again.points) == 1000
    assert np.median(np.abs(again.points[:, 2])) < 0.02
    with pytest.raises(maquette.MaquetteError, match="MAQ_ERROR_NOT_FOUND"):
        maquette.DenseCloud(photos[:1], cameras[:1], sparse)
    with pytest.raises(ValueError, match="3 photos, 2 cameras"):
        maquette.DenseCloud(photos, cameras[:2], sparse)
    with pytest.raises(maquette.MaquetteError, match="MAQ_CANCELLED"):
        maquette.DenseCloud(photos, cameras, sparse, progress=lambda done, stage: False)


def test_a_camera_that_looks_at_a_point_sees_it_in_the_middle():
    intrinsics = maquette.Intrinsics.centred(640, 480, fov_deg=60)
    camera = maquette.PinholeCamera.looking_at(intrinsics, [1, 2, 3], [4, 2, 1], up=[0, 0, 1])
    x, y, z = camera.rotation @ (np.array([4, 2, 1]) - camera.centre)

    assert (x, y) == pytest.approx((0, 0), abs=1e-12)
    assert z == pytest.approx(np.sqrt(13))
    assert (camera.rotation @ [0, 0, 1])[1] < 0  # up is up, and y points down
    assert np.linalg.det(camera.rotation) == pytest.approx(1)


@pytest.mark.parametrize(
    ("call", "error", "text"),
    [
        (lambda: maquette.DensePose("nowhere"), maquette.MaquetteError, "nowhere.*MAQ_ERROR_NOT_FOUND"),
        (
            lambda: maquette.DensePose(long_side=288),
            TypeError,
            "no setting long_side; .*The settings are .*long_side_px",
        ),
        (lambda: maquette.DensePose(long_side_px=-4), maquette.MaquetteError, "long_side_px"),
        (lambda: maquette.Frame(np.zeros((4, 4)), maquette.PixelFormat.BGR8), ValueError, r"BGR8 is uint8 \[H, W, 3\]"),
        (lambda: maquette.Frame(np.zeros((0, 4, 3), np.uint8)), maquette.MaquetteError, "MAQ_ERROR_"),
        (lambda: maquette.Frame.decode(b"no picture"), maquette.MaquetteError, "MAQ_ERROR_UNREADABLE"),
        (lambda: maquette.Source("nothing:"), maquette.MaquetteError, "MAQ_ERROR_UNSUPPORTED"),
        (lambda: maquette.Scene.open("nowhere.maqs"), maquette.MaquetteError, "MAQ_ERROR_NOT_FOUND"),
        (lambda: maquette.Capture("nowhere"), maquette.MaquetteError, "MAQ_ERROR_NOT_FOUND"),
    ],
)
def test_what_is_wrong_is_said(call, error, text):
    with pytest.raises(error, match=text):
        call()


def test_what_is_closed_is_said_and_nothing_reaches_the_library(densepose, person, box):
    depth, _ = box
    with maquette.Edges(threads=1) as edges:
        curves = edges.run(depth, curves=True).curves
    other = maquette.DensePose(threads=1)
    frame = maquette.Frame(person.pixels())
    fusion = maquette.EdgesFusion(maquette.Edges(threads=1))
    for closed in (edges, other, frame, fusion, curves):
        closed.close()
        closed.close()
    calls = (
        lambda: edges.run(depth), lambda: other.run(person), lambda: other.reset(), lambda: frame.pixels(),
        lambda: densepose.run(frame), lambda: fusion.finish(), lambda: curves.snap(0, 0),
    )  # fmt: skip
    for call in calls:
        with pytest.raises(maquette.MaquetteError, match=r"This \w+ is closed"):
            call()
    assert curves.boxes  # copies stay


def test_depth_is_wanted_for_edges(person):
    with pytest.raises(maquette.MaquetteError, match="MAQ_ERROR_UNSUPPORTED"):
        maquette.Edges(threads=1).run(person)


def _wall_points():
    return np.stack([*np.meshgrid(np.linspace(-1, 1, 60), np.linspace(-1, 1, 60)), np.zeros((60, 60))], -1).reshape(
        -1, 3
    )


def _small_capture(folder):
    """A wall of coloured points before two cameras, as transforms.json."""
    import json

    import cv2

    rng = np.random.default_rng(0)
    place = folder / "capture"
    place.mkdir()
    size = 96
    frames = []
    for k, shift in enumerate((-0.1, 0.1)):
        picture = cv2.resize(rng.integers(0, 255, (8, 8, 3), np.uint8), (size, size), interpolation=cv2.INTER_CUBIC)
        cv2.imwrite(str(place / f"{k}.png"), picture)
        pose = np.eye(4)
        pose[:3, 3] = shift, 0, 2
        frames.append({"file_path": f"{k}.png", "transform_matrix": pose.tolist()})
    header = (
        "ply\nformat ascii 1.0\nelement vertex 3600\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
    )
    rows = "\n".join(" ".join(f"{v:.4f}" for v in point) for point in _wall_points())
    (place / "points.ply").write_text(header + rows + "\n")
    camera = {"w": size, "h": size, "fl_x": 100, "fl_y": 100, "cx": size / 2, "cy": size / 2}
    about = {**camera, "ply_file_path": "points.ply", "frames": frames}
    (place / "transforms.json").write_text(json.dumps(about))
    return place
