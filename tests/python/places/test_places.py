"""Rendered places: cameras, depth and cloud agree, seeds decide, splits share nothing, damage is told in sentences."""

import json
import shutil
import struct

import cv2
import numpy as np
import pytest

from export.places import assets
from export.places.cameras import Lens, looking
from export.places.clouds import CloudFaults, CloudMaker
from export.places.dataset import frame_entry, held_out_views, render_place
from export.places.geometry_only import PlainStock
from export.places.mesh import Material, ModelError, Part, flat_normals, read_obj
from export.places.place import PlaceError, load_place
from export.places.polygons import triangles_of
from export.places.render import Lighting, Renderer
from export.point_cloud import PointCloudError, read_ply, write_ply

SEEDS = {"room": 3, "still life": 0, "object": 2}  # of the split to train on
FRAMES = 10

needs_furniture = pytest.mark.skipif(
    not assets.furniture_folder().exists(),
    reason="furniture is not unpacked: run `python -m export.places.assets furniture`",
)


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """One plain place of each kind with an exact cloud."""
    root = tmp_path_factory.mktemp("places")
    for kind, seed in SEEDS.items():
        render_place(PlainStock("train"), "train", seed, root / kind, small=True, exact=True, frames=FRAMES)
    return root


@pytest.fixture
def room(folders, tmp_path):
    """A copy of the room that a test may damage."""
    return shutil.copytree(folders / "room", tmp_path / "room")


@pytest.mark.parametrize("kind", SEEDS)
def test_every_kind_is_drawn(folders, kind):
    assert load_place(folders / kind).about["kind"] == kind


@pytest.mark.parametrize("kind", SEEDS)
def test_each_point_of_an_exact_cloud_is_where_some_depth_image_says(folders, kind):
    place = load_place(folders / kind)
    assert len(place.xyz) > 20_000
    nearest = np.full(len(place.xyz), np.inf)
    for view in place.source:
        depth = place.depth[view]
        pixel, z = place.camera(view).projected(place.xyz)
        at = np.round(pixel)
        with np.errstate(invalid="ignore"):
            inside = (z > 0) & (at >= 0).all(1) & (at < depth.shape[::-1]).all(1)
            inside &= np.abs(pixel - at).max(1) < 0.01  # the point came from the centre of a pixel
        x, y = at[inside].astype(int).T
        nearest[inside] = np.minimum(nearest[inside], np.abs(depth[y, x] - z[inside]))
    # Half a step of the stored depth, and the rounding of a point's float32.
    assert nearest.max() < 0.0005 + 1e-5


@pytest.mark.parametrize("kind", SEEDS)
def test_what_one_view_sees_the_next_ones_see_at_the_same_depth(folders, kind):
    place = load_place(folders / kind)
    agree, seen = 0, 0
    for a in range(FRAMES - 1):
        one, other = place.camera(a), place.camera(a + 1)
        depth, behind = place.depth[a], place.depth[a + 1]
        y, x = np.nonzero(depth > 0)
        points = one.lifted(np.stack([x, y], 1), depth[y, x])
        pixel, z = other.projected(points)
        at = np.round(pixel)
        with np.errstate(invalid="ignore"):
            inside = (z > 0.05) & (at >= 0).all(1) & (at < behind.shape[::-1]).all(1)
        u, v = at[inside].astype(int).T
        found, z = behind[v, u], z[inside]
        # Points clearly behind the other view's surface are hidden there; no point may lie in front of it.
        visible = (found > 0) & (z < found * 1.03)
        seen += visible.sum()
        agree += (np.abs(found - z)[visible] < 0.03 * z[visible]).sum()
    assert seen > 20_000
    assert agree / seen > 0.97


def test_points_have_the_colour_that_other_images_show(folders):
    place = load_place(folders / "room")
    view = int(place.held_out[0])
    image, depth = place.images[view], place.depth[view]
    pixel, z = place.camera(view).projected(place.xyz)
    at = np.round(pixel)
    with np.errstate(invalid="ignore"):
        inside = (z > 0) & (at >= 0).all(1) & (at < depth.shape[::-1]).all(1)
    x, y = at[inside].astype(int).T
    visible = np.abs(depth[y, x] - z[inside]) < 0.01
    assert visible.sum() > 500
    wrong = np.abs(image[y, x][visible].astype(int) - place.rgb[inside][visible]).mean(1)
    assert np.median(wrong) < 12


def test_the_same_seed_gives_the_same_bytes_and_another_one_does_not(folders, tmp_path):
    stock = PlainStock("train")
    for name, seed, frames in (("again", SEEDS["still life"], FRAMES), ("other", 1, 5)):
        render_place(stock, "train", seed, tmp_path / name, small=True, exact=True, frames=frames)
    one, again, other = folders / "still life", tmp_path / "again", tmp_path / "other"
    files = sorted(f.relative_to(one) for f in one.rglob("*") if f.is_file())
    assert len(files) == 2 * FRAMES + 2
    for file in files:
        assert (one / file).read_bytes() == (again / file).read_bytes(), file
    assert (one / "cloud.ply").read_bytes() != (other / "cloud.ply").read_bytes()


def test_an_unfinished_place_is_not_there(tmp_path, monkeypatch):
    monkeypatch.setattr("export.places.dataset.write_ply", lambda *_: (_ for _ in ()).throw(OSError("full")))
    with pytest.raises(OSError, match="full"):
        render_place(PlainStock("train"), "train", 2, tmp_path / "p", small=True, exact=True, frames=5)
    assert not (tmp_path / "p").exists()
    monkeypatch.undo()
    render_place(PlainStock("train"), "train", 2, tmp_path / "p", small=True, exact=True, frames=5)
    assert load_place(tmp_path / "p").about["seed"] == 2
    assert [f.name for f in tmp_path.iterdir()] == ["p"]


def test_cameras_come_back_from_transforms_json_as_they_were(folders):
    table = json.loads((folders / "room" / "transforms.json").read_text())
    place = load_place(folders / "room")
    for k, entry in enumerate(table["frames"]):
        written = frame_entry(k, place.camera(k))
        for key in ("fl_x", "fl_y", "cx", "cy", "w", "h", "transform_matrix"):
            assert np.allclose(written[key], entry[key], rtol=0, atol=1e-12), key
    assert place.source.tolist() + place.held_out.tolist() != []
    assert sorted([*place.source, *place.held_out]) == list(range(FRAMES))
    assert len(place.held_out) == FRAMES // 5


def test_files_hold_the_axes_and_pixels_of_nerfstudio():
    # A camera at (0, -2, 1) that looks along +y: in OpenGL axes, along -z of its own; its up is +z of the world.
    camera = looking(Lens(64, 48, 60.0), np.array([0, -2.0, 1]), np.array([0, 0, 1.0]))
    entry = frame_entry(0, camera)
    assert np.allclose(entry["transform_matrix"], [[1, 0, 0, 0], [0, 0, -1, -2], [0, 1, 0, 1], [0, 0, 0, 1]])
    assert (entry["cx"], entry["cy"]) == (32, 24)  # the middle, counted from the corner of the first pixel
    pixel, depth = camera.projected(np.array([[0, 0, 1.0], [0.5, 0, 1.5]]))
    assert np.allclose(pixel[0], [31.5, 23.5])  # the same, counted from its centre
    assert pixel[1, 0] > 31.5
    assert pixel[1, 1] < 23.5
    assert np.allclose(depth, 2)


def _quad(corners, colour, **more):
    a, b, c, d = np.array(corners, np.float32)
    triangles = np.array([[a, b, c], [a, c, d]])
    return Part(triangles, flat_normals(triangles), np.zeros((2, 3, 2), np.float32), Material(colour=colour, **more))


def _lighting(**more):
    lamp = (np.array([0, -1.0, 1, 0]), np.ones(3))
    return Lighting((lamp,), np.ones(3), np.ones(3), np.ones((4, 8, 3), np.float32), plain=(0, 0, 0), **more)


def test_depth_is_that_of_the_centre_of_each_pixel():
    # The plane z = 1 + 0.8 x + 0.3 y, from above; rays of float64 are the reference.
    normal = np.array([-0.8, -0.3, 1])
    corners = [(x, y, 1 + 0.8 * x + 0.3 * y) for x, y in ((-60, -60), (60, -60), (60, 60), (-60, 60))]
    camera = looking(Lens(120, 90, 70.0, (5.0, -3.0)), np.array([0.3, -1.0, 4]), np.array([0, 0.5, 1.0]), 7.0)
    with Renderer([_quad(corners, (1, 1, 1))], _lighting()) as renderer:
        depth = renderer.depth(camera)
    x, y = np.meshgrid(np.arange(120), np.arange(90))
    away = camera.lifted(np.stack([x.ravel(), y.ravel()], 1), np.ones(x.size)) - camera.centre
    expected = ((1 - normal @ camera.centre) / (away @ normal)).reshape(90, 120)
    assert np.abs(depth / expected - 1).max() < 5e-6


def test_images_lie_over_their_depth():
    # A white wall from x = 0.1 to the right: its edge is seen in a column that a camera tells exactly.
    camera = looking(Lens(101, 40, 60.0, (3.3, 0.0)), np.array([0, -2.0, 0]), np.zeros(3))
    wall = _quad([(0.1, 0, -5), (9, 0, -5), (9, 0, 5), (0.1, 0, 5)], (1, 1, 1), emission=50.0)
    with Renderer([wall], _lighting()) as renderer:
        row, found = renderer.colour(camera, 1.0)[20, :, 0] / 255, renderer.depth(camera)[20] > 0
    edge = camera.projected(np.array([[0.1, 0, 0]]))[0][0, 0]
    assert 101 - row.sum() - 0.5 == pytest.approx(edge, abs=0.15)  # to the four samples of a pixel
    assert found.argmax() == np.ceil(edge)


_WALL = [(-9, 0, -9), (9, 0, -9), (9, 0, 9), (-9, 0, 9)]


def _seen(part, *eyes):
    """Images of a part by cameras at `eyes` that look at the origin."""
    with Renderer([part], _lighting()) as renderer:
        cameras = [looking(Lens(64, 64, 50.0), np.array(eye, float), np.zeros(3)) for eye in eyes]
        return [renderer.colour(c, 0.5).astype(int) for c in cameras]


def test_glass_is_seen_but_depth_looks_through_it():
    wall, glass = _quad(_WALL, (0.5, 0.2, 0.2)), _quad(np.array(_WALL) - [0, 1, 0], (0, 1, 0), opacity=0.5)
    camera = looking(Lens(64, 64, 50.0), np.array([0, -3.0, 0]), np.zeros(3))
    with Renderer([wall], _lighting()) as renderer:
        bare, depth = renderer.colour(camera, 0.5).astype(int), renderer.depth(camera)
    with Renderer([wall, glass], _lighting()) as renderer:
        assert np.array_equal(renderer.depth(camera), depth)
        assert (renderer.colour(camera, 0.5)[..., 1] - bare[..., 1] > 20).all()


def test_dull_things_look_the_same_from_everywhere_and_shiny_ones_do_not():
    # Light comes from (0, -1, 1): the wall y = 0 throws it back to (0, -1, -1).
    eyes = (0, -2, 2), (0, -2, -2)
    dull = _seen(_quad(_WALL, (0.5, 0.2, 0.2)), *eyes)
    assert np.ptp(dull[0], axis=(0, 1)).max() <= 1
    assert np.abs(dull[0] - dull[1]).max() <= 1
    away, into = _seen(_quad(_WALL, (0.5, 0.2, 0.2), specular=0.5, shininess=40.0), *eyes)
    assert np.abs(away - dull[0]).max() <= 1
    assert (into - away)[28:36, 28:36].min() > 20


def test_resized_cameras_see_the_same():
    camera = looking(Lens(64, 48, 60.0, (3.0, -2.0)), np.array([0, -2.0, 1]), np.array([0.2, 0, 1.0]), 5.0)
    point = np.array([[0.3, 0.1, 1.2]])
    large, small = camera.projected(point)[0], camera.resized(16, 12).projected(point)[0]
    assert np.allclose((large + 0.5) / 4, small + 0.5)


def test_held_out_views_are_one_of_five_neighbours():
    views = held_out_views(40, np.random.default_rng(0))
    assert (views // 5).tolist() == list(range(8))


def test_faults_of_clouds_do_what_they_say():
    camera = looking(Lens(200, 150, 60.0), np.array([0, -2.0, 0]), np.zeros(3))
    depth, image = np.full((150, 200), 2, np.float32), np.full((150, 200, 3), 90, np.uint8)

    def cloud(**faults):
        maker = CloudMaker(CloudFaults(**faults), 1, np.random.default_rng(0))
        maker.add(camera, depth, image)
        return maker.cloud()[0]

    exact = cloud()
    assert len(exact) == 30_000
    assert np.abs(exact[:, 1]).max() < 1e-6
    assert len(cloud(points=1000)) == 1000
    noisy = cloud(noise=0.01)
    assert 0.015 < np.std(noisy[:, 1]) < 0.025
    assert 0.02 < 1 - len(cloud(missing=0.1)) / 30_000 < 0.2
    strays = cloud(outliers=0.02)
    assert len(strays) == 30_000
    assert 2000 < len(cloud(grazing=75)) < 15_000
    assert len(cloud(patchiness=1.0)) < 25_000
    assert cloud(drift=0.01)[:, 1].std() < 1e-6
    assert np.abs(cloud(drift=0.01)[:, 1]).max() > 1e-4


def test_polygons_with_a_dent_are_cut_without_covering_it():
    dented = np.array([(0, 0, 0), (4, 0, 0), (4, 4, 0), (2, 1, 0), (0, 4, 0)], float)
    triangles = triangles_of(dented)
    corners = dented[np.array(triangles)]
    areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] / 2
    assert (areas > 0).all()
    assert areas.sum() == pytest.approx(10)


def test_obj_files_are_read_and_broken_ones_refused(tmp_path):
    (tmp_path / "a.mtl").write_text("newmtl red\nKd 1 0 0\nKs 0.5 0.5 0.5\nNs 96\nd 0.5\n")
    text = (
        "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nusemtl red\nf 1/1 2/1 3/1 4/1\nf -4 -3 -2\nf 1 1 2\n"
    )
    (tmp_path / "a.obj").write_text(text)
    ((corners, uv, material),) = read_obj(tmp_path / "a.obj")
    assert corners.shape == uv.shape[:2] + (3,) == (3, 3, 3)
    assert material.colour == (1, 0, 0)
    assert material.opacity == 0.5
    for broken, sentence in (("f 1 2 9\n", "not in the file"), ("v 1 x 2\n", "cannot be read"), ("", "no triangle")):
        (tmp_path / "b.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\n" + broken)
        with pytest.raises(ModelError, match=sentence):
            read_obj(tmp_path / "b.obj")


def test_clouds_come_back_from_ply_and_damaged_ones_are_refused(tmp_path):
    rng = np.random.default_rng(0)
    xyz, rgb = rng.normal(size=(100, 3)).astype(np.float32), rng.integers(0, 256, (100, 3), dtype=np.uint8)
    file = tmp_path / "a.ply"
    write_ply(file, xyz, rgb)
    read = read_ply(file)
    assert np.array_equal(read.positions.astype(np.float32), xyz)
    assert np.array_equal(np.rint(255 * read.colours), rgb)
    data = file.read_bytes()
    for damaged, sentence in (
        (data[:-1], "promises"), (data[:50], "no header"), (b"", "no header"),
        (data.replace(b"vertex 100", b"vertex 999999999"), "at most"),
        (data.replace(b"float x", b"double x"), "promises"),
    ):  # fmt: skip
        file.write_bytes(damaged)
        with pytest.raises(PointCloudError, match=sentence):
            read_ply(file)


def _table(room):
    return json.loads((room / "transforms.json").read_text())


@pytest.mark.parametrize(
    ("damage", "sentence"),
    [
        (lambda t: t["frames"].clear(), "`frames`"),
        (lambda t: t.pop("maquette"), "format"),
        (lambda t: t["frames"][2].update(fl_x=0), "focal"),
        (lambda t: t["frames"][2].update(fl_x="x"), "fl_x"),
        (lambda t: t["frames"][2].pop("transform_matrix"), "transform_matrix"),
        (lambda t: t["frames"][2]["transform_matrix"][0].__setitem__(0, 3.0), "no rotation"),
        (lambda t: t["frames"][2].update(w=10**9), "pixels"),
        (lambda t: t["frames"][2].update(w=20), "sizes"),
        (lambda t: t["frames"][2].update(file_path="../../etc/passwd"), "leaves the folder"),
        (lambda t: t.update(ply_file_path="/etc/passwd"), "leaves the folder"),
        (lambda t: t.update(train_filenames=["images/none.jpg"]), "train_filenames"),
        (lambda t: t.update(test_filenames=t["train_filenames"]), "both"),
        (lambda t: t["maquette"].update(up_axis=[0, 0, float("nan")]), "up_axis"),
        (lambda t: t["maquette"].update(depth_unit_m=0), "depth_unit_m"),
    ],
)
def test_damaged_tables_are_told_in_a_sentence(room, damage, sentence):
    table = _table(room)
    damage(table)
    (room / "transforms.json").write_text(json.dumps(table))
    with pytest.raises(PlaceError, match=sentence):
        load_place(room)


def test_missing_and_damaged_files_are_told_in_a_sentence(room, tmp_path):
    with pytest.raises(PlaceError, match="transforms"):
        load_place(tmp_path)
    place = load_place(room)
    (room / "images" / "001.jpg").write_bytes(b"\xff\xd8")
    (room / "depth" / "001.png").unlink()
    cv2.imwrite(str(room / "images" / "002.jpg"), np.zeros((5, 5, 3), np.uint8))
    for pictures, k in ((place.images, 1), (place.images, 2), (place.depth, 1)):
        with pytest.raises(PlaceError, match=f"00{k}"):
            pictures[k]
    cloud = (room / "cloud.ply").read_bytes()
    (room / "cloud.ply").write_bytes(cloud[:-15] + struct.pack("<3f", np.nan, 0, 0) + b"abc")
    with pytest.raises(PlaceError, match="finite"):
        load_place(room)
    (room / "cloud.ply").unlink()
    with pytest.raises(PlaceError, match="cloud"):
        load_place(room)
    (room / "transforms.json").write_text("{")
    with pytest.raises(PlaceError, match="JSON"):
        load_place(room)


def test_images_are_read_one_by_one_or_several_at_once(folders):
    place = load_place(folders / "room")
    height, width = place.images.height, place.images.width
    assert place.images[0].shape == (height, width, 3)
    assert place.images[2:4].shape == (2, height, width, 3)
    assert np.array_equal(place.images[[3, 1]][1], place.images[1])
    assert place.depth[0].dtype == np.float32


@needs_furniture
def test_only_models_that_are_free_by_their_own_licence_file_are_taken():
    from export.places.catalogue import load_models

    models = load_models()
    assert len(models) == 173
    assert not {m.name for m in models} & {"winchesterSofa", "winchesterArmchair"}  # their files say CC-BY
    assert {m.asset.licence for m in models} == {"CC0-1.0"}


@needs_furniture
def test_splits_share_no_model_tile_photograph_or_panorama():
    from export.places.catalogue import Stock, family_of_model

    try:
        stocks = [Stock(split, people=False) for split in assets.SPLITS]
    except FileNotFoundError as missing:
        pytest.skip(str(missing))
    for have in (
        lambda s: {family_of_model(m.name) for m in s.models},
        lambda s: {assets.family_of(f.name) for f in s.tile_files},
        lambda s: {f.name for f in s.photo_files},
        lambda s: {f.name for f in s.panorama_files},
    ):
        train, val, test = (have(s) for s in stocks)
        assert train
        assert val
        assert test
        assert not (train & val) | (train & test) | (val & test)
    assert min(len(s.models) for s in stocks) >= 20


@needs_furniture
def test_models_stand_on_the_ground_in_their_size():
    from export.places.catalogue import load_models, parts_of

    models = {m.name: m for m in load_models()}
    for name in ("crate", "oakChair", "iphone", "pedestrianRailing1"):
        parts = parts_of(models[name])
        points = np.concatenate([p.corners.reshape(-1, 3) for p in parts])
        assert np.allclose(np.ptp(points, axis=0), models[name].size, atol=1e-4)
        assert points[:, 2].min() == pytest.approx(0, abs=1e-5)
        normals = np.concatenate([p.normals.reshape(-1, 3) for p in parts])
        length = np.linalg.norm(normals, axis=1)  # 0: slivers, which are shaded as they lie
        assert (np.abs(length - 1) < 1e-3).mean() > 0.99


def test_families_hold_variants_together():
    assert assets.family_of("grass_01.jpg") == assets.family_of("Grass_02b.jpg") == "grass"
    assert assets.family_of("rock2") == assets.family_of("rock1")
    assert assets.family_of("aegean_anatolia-cliff_01") == "aegean_anatolia-cliff"
