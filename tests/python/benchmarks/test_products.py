"""The comparison of products, with products that find painted people: processes, scores, times."""

import io
import zipfile
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import photo_labels
import pytest
from fake_product import keypoints_in, painted

from benchmarks.products import clips, photographs, times
from benchmarks.products.install import DETECTOR, LANDMARKS, pack_task
from benchmarks.products.jitter import Jitter
from benchmarks.products.masks import box_of, frontmost
from benchmarks.products.protocol import ProductError, receive, send
from benchmarks.products.running import Product, Running, cut_off, size_mb
from export.keypoints import COUNT, NAMES, TORSO
from export.people.clips.clip_file import Truth, write_clip

SUPPORT = Path(__file__).parents[1] / "support"
JOINTS = [f"{side}_{name}" for name in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle") for side in
          ("left", "right")]  # fmt: skip
STEP_NS = 100_000_000


@pytest.fixture(autouse=True)
def find_the_fake_product(monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(SUPPORT))


def fake(name="fake", **settings):
    return Product(name, "fake_product:FakeProduct", settings)


def walkers(frames):
    """Boxes [T, 2, 4] of two people of 60 x 160 pixels who walk to the right, one pixel a frame."""
    first = np.array([[20 + t, 40, 80 + t, 200] for t in range(frames)])
    return np.stack([first, first + [150, 0, 150, 0]], 1)


@pytest.fixture
def clip(tmp_path):
    """A clip of six frames with two people."""
    boxes = walkers(6)
    points = np.array([[[keypoints_in(box)[NAMES.index(name.replace("_", " "))] for name in JOINTS] for box in row]
                       for row in boxes])  # fmt: skip
    pixels = (boxes[..., 2:] - boxes[..., :2]).prod(-1)
    truth = Truth(
        np.arange(6) * STEP_NS, boxes.astype(float), pixels, boxes.astype(float), points, np.zeros((6, 2, 12, 3)),
        np.ones((6, 2, 12), bool), np.ones(4), np.zeros((6, 3, 4)), {"fps": 10, "joints": JOINTS},
    )  # fmt: skip
    images = [painted(row) for row in boxes]
    labels = []
    for image in images:
        label = np.zeros((*image.shape[:2], 4), np.uint8)
        label[..., 3] = np.round(image[..., 0] / 80)
        label[..., 0] = label[..., 3] > 0
        labels.append(label)
    jpegs = [cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 100])[1].tobytes() for image in images]
    path = tmp_path / "val/clip-00-00000.npz"
    path.parent.mkdir()
    write_clip(path, jpegs, labels, truth)
    return path


def test_messages_keep_values_and_arrays():
    stream = io.BytesIO()
    sent = {"image": np.arange(12, dtype=np.uint8).reshape(2, 2, 3), "empty": np.zeros((0, 33, 3), np.float32)}
    send(stream, {"do": "photo"}, **sent)
    whole = stream.getvalue()
    message, arrays = receive(io.BytesIO(whole))
    assert message == {"do": "photo"}
    for name, array in sent.items():
        assert arrays[name].dtype == array.dtype
        assert np.array_equal(arrays[name], array)
    assert receive(io.BytesIO(b"")) is None
    with pytest.raises(ProductError, match="11 of 12 bytes"):
        receive(io.BytesIO(whole[:-1]))


def test_a_product_answers_from_its_own_process_without_a_network(tmp_path):
    if not cut_off():
        pytest.skip("this system does not allow a process without a network: unshare --net")
    with Running(fake(), 1, tmp_path / "log") as process:
        found = process.photo(painted(walkers(1)[0]))
        usage = process.ask("usage")
    assert usage["interfaces"] == ["lo"]
    assert found.box.tolist() == walkers(1)[0].tolist()
    assert np.unique(found.inds).tolist() == [0, 1, 2]
    assert found.keypoint.shape == (2, COUNT, 3)
    assert usage["peak_rss_mb"] >= usage["rss_mb"] > 5
    assert "a product writes to stdout" in (tmp_path / "log").read_text()


def test_a_product_that_fails_is_named_with_its_reason(tmp_path):
    image = painted(walkers(1)[0])
    with Running(fake(fails="raise"), 1, tmp_path / "log") as process:
        with pytest.raises(ProductError, match="fake: ValueError: this photograph is not to its taste"):
            process.photo(image)
        assert len(process.ask("usage")) > 0  # and it still answers
    with Running(fake(fails="exit"), 1, tmp_path / "log") as process, pytest.raises(ProductError, match="status 3"):
        process.photo(image)


def test_threads_follow_the_cores_where_a_product_has_the_setting():
    assert fake().on(2).settings == {}
    assert replace(fake(), has_threads=True).on(2).settings == {"threads": 2}


def test_clips_are_scored_against_their_truth(clip, tmp_path):
    products = [
        fake("right"), fake("misses one", missed=[1]), fake("swaps", swaps=True), fake("mirrored", is_mirrored=True),
        replace(fake("segmenter"), has_people=False),
    ]  # fmt: skip
    measured = clips.measure(products, [clip], tmp_path)
    right, one, swaps, mirrored, segmenter = (measured["products"][product.name] for product in products)
    assert (measured["clips"], measured["frames"]) == (1, 6)
    for key in ("found", "found_by_mask", "precision", "joints", "torso_joints", "common_left_right"):
        assert right[key] == 1, key
    assert right["people"] == 12
    assert right["mask_iou"] > 0.97
    assert right["joint_jitter_p90"] < 0.02
    assert (right["ids"]["switches"], one["ids"]["switches"]) == (0, 0)
    assert swaps["ids"]["switches"] == 10  # both people in each of five changes
    assert one["found"] == one["joints"] == 0.5
    assert one["mask_iou"] == pytest.approx(0.5 * one["common_mask_iou"])
    # Only the person whom all find is in the common rows, of every product.
    assert {own["common_people"] for own in (right, one, swaps)} == {6}
    assert one["common_joints"] == 1
    assert mirrored["common_left_right"] == mirrored["common_joints"] == 0
    assert set(segmenter) == {"foreground_iou"}
    assert segmenter["foreground_iou"] > 0.97
    assert one["foreground_iou"] == pytest.approx(0.5, abs=0.02)


def test_only_the_first_frames_count_if_asked(clip, tmp_path):
    measured = clips.measure([fake()], [clip], tmp_path, max_frames=2)
    assert measured["frames"] == 2
    assert measured["products"]["fake"]["people"] == 4


def test_jitter_is_the_change_of_the_error():
    point, visible = np.zeros((COUNT, 2)), np.zeros(COUNT)
    for k, at in zip(TORSO, ([40, 0], [20, 0], [40, 50], [20, 50]), strict=True):
        point[k], visible[k] = at, 1  # a torso of 50 pixels
    keypoint = np.concatenate([point, np.ones((COUNT, 1))], 1)
    jitter, box = Jitter(), np.array([0.0, 0, 30, 40])
    for frame, (walked, error) in enumerate([(0, 0), (7, 5), (9, 5)]):
        moved = [walked, 0]
        off = keypoint + [error + walked, 0, 0]
        jitter.add("a", frame, 0, off, point + moved, visible, box + walked + error, box + walked)
    found = jitter.metrics()
    # The errors change by 5 pixels and by none: 5 of 50, and 10 (four sides of 5) of the diagonal of 50.
    assert found["joint_jitter_p50"] == pytest.approx(0.05)
    assert found["joint_jitter_p90"] == pytest.approx(0.1)
    assert found["box_jitter_p50"] == pytest.approx(0.1)
    jitter.add("a", 9, 0, keypoint + 40, point, visible, box, box)  # frames between are missing: no change
    assert jitter.metrics() == found
    assert np.isnan(Jitter().metrics()["box_jitter_p50"])


def test_photographs_are_scored_by_the_labels_of_the_set(tmp_path, capsys):
    (photos := tmp_path / "photos/test").mkdir(parents=True)
    (tmp_path / "photos/empty").mkdir()
    labels = photo_labels.labels()
    image = painted(labels.box, photo_labels.SIZE, photo_labels.SIZE)
    cv2.imwrite(str(photos / "one.png"), image)
    cv2.imwrite(str(photos / "without-labels.png"), image)
    cv2.imwrite(str(tmp_path / "photos/empty/plate.jpg"), image)  # a person found here is a false one
    point = {name.replace(" ", "_"): keypoints_in(labels.box[0])[k] for k, name in enumerate(NAMES)}
    photo_labels.labels(**point).save(tmp_path / "runs/people/labels/one.npz")
    chosen = photographs.Photographs.find(tmp_path)
    assert list(chosen.sets) == ["test"]
    assert "'fresh' are left out" in capsys.readouterr().out
    measured = photographs.measure([fake("right"), fake("blind", missed=[0])], chosen, tmp_path / "log")
    right, blind = (measured["products"][name] for name in ("right", "blind"))
    assert measured["photos"] == {"test": 1}
    assert (right["people"], right["found"], right["precision"]) == (1, 1, 1)
    assert (right["mask_iou"], right["joints"]) == (1, 1)
    assert (right["false_people"], blind["false_people"]) == (1, 0)
    assert (blind["found"], blind["mask_iou"], blind["joints"], blind["common_people"]) == (0, 0, 0, 0)


def test_times_alternate_and_count_the_frames_after_the_warm_up(clip, tmp_path, monkeypatch):
    monkeypatch.setattr(times, "_QUIET_S", 0.01)
    monkeypatch.setattr(times, "WARM_UP", 2)
    cv2.imwrite(str(tmp_path / "photo.png"), painted(walkers(1)[0]))
    products = [replace(fake(), networks=(clip,)), fake("misses one", missed=[0])]
    measured = times.measure(products, [clip], [tmp_path / "photo.png"], tmp_path / "log", rounds=3, starts=1)
    own, other = (measured["products"][product.name] for product in products)
    for cores in ("1", "2"):
        assert own["clips"][cores]["frames"] == 3 * (6 - 2)
        assert own["photographs"][cores]["frames"] == 3
        assert 2 <= own["clips"][cores]["ms"] <= own["clips"][cores]["ms_p90"]
        assert own["clips"][cores]["cpu_ms"] < 2
    assert (own["clips"]["1"]["people"], other["clips"]["1"]["people"]) == (2, 1)
    assert own["networks_mb"] == pytest.approx(clip.stat().st_size / 1e6, abs=0.01)
    assert own["start_cpu_s"] > 0
    assert own["peak_rss_mb"] > 5


def test_a_task_file_is_an_archive_that_is_not_compressed():
    with zipfile.ZipFile(io.BytesIO(pack_task(b"d" * 100, b"l" * 200))) as task:
        assert {(one.filename, one.file_size, one.compress_size) for one in task.infolist()} == {
            (DETECTOR, 100, 100), (LANDMARKS, 200, 200),
        }  # fmt: skip


def test_sizes_leave_out_compiled_python(tmp_path):
    (tmp_path / "package/__pycache__").mkdir(parents=True)
    (tmp_path / "package/a.py").write_bytes(b"x" * 1000)
    (tmp_path / "package/__pycache__/a.pyc").write_bytes(b"x" * 5000)
    (tmp_path / "b.so").write_bytes(b"x" * 2000)
    assert size_mb((tmp_path / "package", tmp_path / "b.so")) == pytest.approx(0.003)


def test_masks_give_boxes_and_one_plane():
    masks = np.zeros((2, 40, 60), np.float32)
    masks[0, 10:30, 5:25] = 0.8
    masks[0, 35:37, 50:52] = 0.9  # a stray region
    masks[1, 10:30, 20:40] = 0.9
    keypoint = np.array([[10, 12, 0.9], [22, 90, 0.9], [50, 20, 0.1]], np.float32)
    assert box_of(0, masks, keypoint, (40, 60)).tolist() == [5, 10, 25, 30]
    assert box_of(0, np.zeros((0, 40, 60)), keypoint, (40, 60)).tolist() == [10, 12, 22, 40]
    plane = frontmost(masks, (40, 60))
    assert (plane[15, 10], plane[15, 22], plane[15, 35], plane[0, 0]) == (1, 2, 2, 0)
    assert frontmost(np.zeros((0, 40, 60)), (40, 60)).max() == 0
