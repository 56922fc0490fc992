"""Bodies through the Python package: names, arrays, sentences, files."""

import maquette
import numpy as np
import pytest
from maquette.native import native


@pytest.fixture(scope="module")
def people():
    return maquette.DensePose(bundle="sdk/models/densepose-b-int8").run("tests/media/photo.jpg")


@pytest.fixture
def body():
    return maquette.Body("sdk/models/body")


def test_angles_have_the_names_of_the_library():
    n = native()
    names = tuple(n.text(n.lib.maq_body_get_angle_name(k)) for k in range(n.lib.MAQ_BODY_ANGLE_COUNT))
    assert names == maquette.BODY_ANGLES


def test_a_person_of_a_photo_has_a_mesh_keypoints_and_angles(people, body):
    person = body.run(people).people[0]
    assert person.fit == "fitted"
    assert person.pelvis_m is None
    assert person.vertices_m.shape == (body.mesh.vertex_count, 3)
    assert np.isfinite(person.vertices_m).all()
    assert person.keypoints_m.shape == (33, 3)
    assert person.joints_m.shape == (19, 3)
    assert set(person.angles_deg) == set(maquette.BODY_ANGLES)
    assert body.mesh.triangles.max() < body.mesh.vertex_count
    assert np.allclose(person.orientation @ person.orientation.T, np.eye(3), atol=1e-5)


def test_with_intrinsics_the_pelvis_has_a_place(people, body):
    camera = maquette.Intrinsics.centred(512, 512, focal_px=700)
    assert body.run(people, camera).people[0].pelvis_m[2] > 0.5


def test_sizes_have_intervals_and_a_height_sets_the_scale(people, body):
    camera = maquette.Intrinsics.centred(512, 512, focal_px=700)
    unknown = body.run(people, camera).people[0]
    known = body.run(people, camera, heights_m=[1.5] * len(people.people)).people[0]
    assert not unknown.sizes.is_height_known
    assert known.sizes.is_height_known
    for name in ("height", "chest", "waist", "hip", "inseam"):
        wide, narrow = getattr(unknown.sizes, name), getattr(known.sizes, name)
        assert wide.low_m < wide.value_m < wide.high_m
        assert narrow.high_m - narrow.low_m < wide.high_m - wide.low_m
    assert known.sizes.height.low_m == known.sizes.height.high_m == pytest.approx(1.5)
    assert known.pelvis_m[2] < unknown.pelvis_m[2]


def test_wrong_heights_are_refused_with_a_sentence(people, body):
    with pytest.raises(ValueError, match="heights_m has 0 numbers"):
        body.run(people, heights_m=[])
    with pytest.raises(maquette.MaquetteError, match=r"must be 1\.3 to 2\.3"):
        body.run(people, heights_m=[178.0] * len(people.people))


def test_arrays_of_other_shapes_are_refused_with_a_sentence(body):
    with pytest.raises(ValueError, match="pass \\[H, W, 3\\]"):
        body.run_planes(np.zeros((4, 4), np.uint8), np.zeros((4, 4), np.uint8), [])
    with pytest.raises(ValueError, match="keypoints have the shape"):
        body.run_planes(np.zeros((4, 4, 3), np.uint8), np.zeros((4, 4), np.uint8), [0], np.zeros((2, 33, 3)))


def test_a_clip_is_written_as_glb_and_bvh(people, body, tmp_path):
    clip = maquette.BodyClip(body)
    with pytest.raises(maquette.MaquetteError, match="no people"):
        clip.save(tmp_path / "none.glb")
    for frame in range(3):
        clip.add(body.run(people, timestamp_ns=frame * 33_000_000))
    assert clip.person_count == len(people.people)
    clip.save(tmp_path / "a.glb")
    clip.save_person(0, tmp_path / "a.bvh")
    assert (tmp_path / "a.glb").read_bytes()[:4] == b"glTF"
    assert "Frames: 3" in (tmp_path / "a.bvh").read_text()
