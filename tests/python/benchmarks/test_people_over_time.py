"""Scores of ids over time and the two baselines, on cases that are counted by hand."""

import json
import subprocess
import sys

import cv2
import numpy as np
import pytest

from benchmarks.people_over_time import detections
from benchmarks.people_over_time.__main__ import ids_of, library_ids, measured
from benchmarks.people_over_time.detections import Detections
from benchmarks.people_over_time.kalman import BoxFilter
from benchmarks.people_over_time.metrics import Frame, iou_of, scores
from benchmarks.people_over_time.over_time import changes, counted, frames_of, rated, returns
from benchmarks.people_over_time.trackers import NO_ID, ByteTrack, Sort
from export.people.clips.clip_file import Truth, write_clip

WIDTH, HEIGHT, FPS = 640, 480, 10
STEP_NS = 1_000_000_000 // FPS


def box_at(x, y=100.0):
    return [x, y, x + 50, y + 150]


def truth_of(boxes, visible_px=None):
    """boxes [T, P, 4], NaN where the image does not show the person; everybody shows 40 % of the box."""
    boxes = np.array(boxes, np.float32)
    frames, people = boxes.shape[:2]
    area = np.nan_to_num((boxes[..., 2:] - boxes[..., :2]).prod(-1))
    pixels = (0.4 * area).astype(np.int32) if visible_px is None else np.array(visible_px, np.int32)
    nothing = np.zeros((frames, people, 15, 3), np.float32)
    return Truth(
        np.arange(frames) * STEP_NS, boxes, pixels, boxes, nothing[..., :2], nothing, nothing[..., 0] > 0, np.ones(4),
        np.zeros((frames, 3, 4)), {"fps": FPS},
    )  # fmt: skip


def found_of(boxes, ids=None, scores=None):
    """Detections of each frame: as many boxes as there are; ids and scores by person."""
    boxes = np.array(boxes, float)
    people = boxes.shape[1]
    ids = np.full(people, NO_ID) if ids is None else np.array(ids)
    scores = np.ones(people) if scores is None else np.array(scores, float)
    out = []
    for t, row in enumerate(boxes):
        own = ids[t] if ids.ndim == 2 else ids
        there = ~np.isnan(row[:, 0])
        out.append(Detections(t * STEP_NS, row[there], scores[there], own[there]))
    return out


def frames_with(true_ids, ids):
    """Frames in which box k of the truth is box k that was found."""
    return [Frame(np.array(g), np.array(i), np.eye(len(g), len(i))) for g, i in zip(true_ids, ids, strict=True)]


def test_iou_of_boxes():
    found = iou_of(np.array([[0, 0, 10, 10]]), np.array([[0, 0, 10, 10], [5, 0, 15, 10], [20, 20, 30, 30]]))
    assert found == pytest.approx(np.array([[1, 1 / 3, 0]]))
    assert iou_of(np.zeros((0, 4)), np.zeros((2, 4))).shape == (0, 2)


def test_right_ids_have_full_scores():
    found = scores(frames_with([[0, 1]] * 10, [[1, 0]] * 10))
    for key in ("HOTA", "DetA", "AssA", "IDF1", "MOTA", "recall", "precision"):
        assert found[key] == pytest.approx(1)
    assert found["switches"] == 0


def test_two_people_who_exchange_their_ids_in_the_middle():
    found = scores(frames_with([[0, 1]] * 10, [[0, 1]] * 5 + [[1, 0]] * 5))
    # Each true box of the 10 agrees with 5 of a track's 10: the association is 5 / (10 + 10 - 5).
    assert found["DetA"] == pytest.approx(1)
    assert found["AssA"] == pytest.approx(1 / 3)
    assert found["HOTA"] == pytest.approx(np.sqrt(1 / 3))
    assert found["IDF1"] == pytest.approx(0.5)
    assert found["switches"] == 2
    assert found["MOTA"] == pytest.approx(1 - 2 / 20)


def test_a_missed_person_and_a_box_of_nobody():
    frames = [Frame(np.array([0, 1]), np.array([0, 2]), np.array([[1.0, 0], [0, 0]]))] * 4
    found = scores(frames)
    assert found["recall"] == pytest.approx(0.5)
    assert found["precision"] == pytest.approx(0.5)
    assert found["MOTA"] == pytest.approx(0)
    assert found["DetA"] == pytest.approx(1 / 3)


def test_scores_are_those_of_trackeval():
    """Values of TrackEval 1.3.0 (HOTA, Identity, CLEAR) for these random boxes."""
    rng, frames = np.random.default_rng(0), []
    for t in range(60):
        g = np.sort(rng.permutation(5)[: rng.integers(0, 6)])
        boxes = np.stack([g * 60 + t * 2, g * 10, g * 60 + t * 2 + 50, g * 10 + 100], 1).astype(float).reshape(-1, 4)
        keep = rng.random(len(g)) < 0.85
        k = g[keep]
        ids = np.where((t > 30) & (k < 2), 1 - k, k) + (5 * (t > 45)) * (k == 3)
        shown = boxes[keep] + rng.normal(0, 6, (keep.sum(), 4))
        if rng.random() < 0.3:
            ids, shown = np.append(ids, 9), np.concatenate([shown, [[400, 200, 450, 300]]])
        frames.append(Frame(g, ids.astype(int), iou_of(boxes, shown)))
    found = scores(frames)
    expected = {"HOTA": 0.4806689, "DetA": 0.5634836, "AssA": 0.4101317, "IDF1": 0.6554054, "MOTA": 0.6907895}
    assert {key: found[key] for key in expected} == pytest.approx(expected, abs=1e-6)
    assert found["switches"] == 3


def test_small_and_hidden_people_do_not_count_and_their_boxes_are_no_errors():
    truth = truth_of([[box_at(0), box_at(300)]] * 3, visible_px=[[3000, 300]] * 3)
    assert counted(truth).tolist() == [[True, False]] * 3
    found = found_of([[box_at(0), box_at(300)]] * 3, ids=[1, 2])
    frames = frames_of(truth, found, library_ids(found))
    assert [f.ids.tolist() for f in frames] == [[1]] * 3
    inside = found_of([[box_at(0), [310, 120, 340, 160]]] * 3, ids=[1, 2])  # an arm of who is hidden
    assert [f.ids.tolist() for f in frames_of(truth, inside, library_ids(inside))] == [[1]] * 3
    beside = found_of([[box_at(0), box_at(500)]] * 3, ids=[1, 2])  # nobody is there
    assert [f.ids.tolist() for f in frames_of(truth, beside, library_ids(beside))] == [[1, 2]] * 3
    with pytest.raises(ValueError, match="3 frames"):
        frames_of(truth, found[:2], library_ids(found[:2]))


def away_and_back(frames=60, first=15, then=40):
    """Two people; the first is out of view for 2.5 s."""
    boxes = np.array([[box_at(100), box_at(300)]] * frames, float)
    boxes[first:then, 0] = np.nan
    return boxes


@pytest.mark.parametrize(("after", "recognised", "mistaken"), [(1, 1, 0), (7, 0, 0), (2, 0, 1)])
def test_who_comes_back_is_recognised_by_the_same_id(after, recognised, mistaken):
    boxes = away_and_back()
    ids = np.tile([1, 2], (60, 1))
    ids[40:] = [after, 2 if after != 2 else 3]
    truth, found = truth_of(boxes), found_of(boxes, ids)
    assert len(returns(truth, frames_of(truth, found, library_ids(found)))) == 1
    row = rated([(truth, found)], library_ids)
    assert (row["returns"], row["recognised"], row["mistaken"]) == (1, recognised, mistaken)


def test_an_absence_of_less_than_two_seconds_is_no_return():
    boxes = away_and_back(then=33)
    truth, found = truth_of(boxes), found_of(boxes, [1, 2])
    assert returns(truth, frames_of(truth, found, library_ids(found))) == []


def test_ids_of_two_clips_are_told_apart():
    boxes = np.array([[box_at(100)]] * 10, float)
    clip = truth_of(boxes), found_of(boxes, [1])
    row = rated([clip, clip], library_ids)
    assert (row["people"], row["tracks"]) == (2, 2)
    assert row["HOTA"] == pytest.approx(1)


def test_changes_of_the_count():
    assert changes([2, 2, 3, 2, 2, 0]) == 3
    boxes = away_and_back()
    row = rated([(truth_of(boxes), found_of(boxes, [1, 2]))], library_ids)
    assert row["count_changes_per_min"] == row["true_count_changes_per_min"] == pytest.approx(2 * 60 / 5.9)


def test_the_filter_follows_an_even_motion_and_goes_on_without_boxes():
    box = BoxFilter(np.array(box_at(0)))
    for k in range(1, 25):
        box.predict(1 / 30)
        box.update(np.array(box_at(4.0 * k)))
    assert box.box == pytest.approx(box_at(96.0), abs=2)
    before = np.trace(box.covariance[:4, :4])
    box.predict(10 / 30)
    assert box.box == pytest.approx(box_at(136.0), abs=6)
    assert np.trace(box.covariance[:4, :4]) > before
    assert np.allclose(box.covariance, box.covariance.T)


@pytest.mark.parametrize("tracker", [Sort, ByteTrack])
def test_people_who_walk_past_each_other_keep_their_ids(tracker):
    # At different heights in the image, so that boxes overlap by a third at most.
    boxes = [[box_at(10 * t, 60), box_at(400 - 10 * t, 160)] for t in range(40)]
    own, given = tracker(), []
    for one in found_of(boxes):
        given.append(own.update(one.boxes, one.scores, 1 / 30))
    assert np.unique(given, axis=0).tolist() == [[1, 2]]


@pytest.mark.parametrize("tracker", [Sort, ByteTrack])
def test_a_track_ends_after_a_second_without_boxes(tracker):
    for away_s, same in ((0.9, True), (1.2, False)):
        own, box = tracker(), np.array([box_at(100)])
        for _ in range(5):
            first = own.update(box, np.ones(1), 0.1)
        steps = round(away_s / 0.1)
        for _ in range(steps - 1):
            assert own.update(np.zeros((0, 4)), np.zeros(0), 0.1).size == 0
        assert (own.update(box, np.ones(1), 0.1) == first).all() == same


def test_low_scores_continue_tracks_of_bytetrack_and_begin_none():
    box, other = np.array([box_at(100)]), np.array([box_at(300)])
    own = ByteTrack()
    assert own.update(box, np.array([0.9]), 0.1).tolist() == [1]
    assert own.update(box, np.array([0.3]), 0.1).tolist() == [1]
    assert own.update(other, np.array([0.3]), 0.1).tolist() == [NO_ID]
    assert own.update(other, np.array([0.65]), 0.1).tolist() == [NO_ID]  # enough to be matched, not to begin
    assert own.update(other, np.array([0.8]), 0.1).tolist() == [2]
    assert Sort().update(box, np.array([0.3]), 0.1).tolist() == [1]


def test_the_library_is_rated_beside_the_baselines():
    boxes = [[box_at(100), box_at(300)]] * 10
    truths = {"a": truth_of(boxes)}
    rows = measured(truths, {"a": found_of(boxes, [1, 2])})
    assert list(rows) == ["library", "SORT", "ByteTrack"]
    assert rows["SORT"]["HOTA"] == pytest.approx(1)
    assert rows["library"]["IDF1"] == pytest.approx(1)
    with pytest.raises(ValueError, match="no detections of a"):
        measured(truths, {"b": found_of(boxes)})
    assert [i.tolist() for i in ids_of("SORT", found_of(boxes))] == [[1, 2]] * 10


def test_detections_are_read_as_they_were_saved(tmp_path):
    found = found_of(away_and_back(), [4, 1 << 40], [0.9, 0.5])
    path = tmp_path / "new" / "every-1.json"
    detections.save(path, {"clip": found})
    again = detections.load(path)["clip"]
    assert len(again) == len(found)
    for a, b in zip(found, again, strict=True):
        assert a.time_ns == b.time_ns
        for key in ("boxes", "scores", "ids"):
            assert np.array_equal(getattr(a, key), getattr(b, key))
            assert getattr(a, key).shape == getattr(b, key).shape
    path.write_text(json.dumps({"clip": [{"boxes": []}]}))
    with pytest.raises(ValueError, match="holds no detections"):
        detections.load(path)


def run(*arguments):
    program = [sys.executable, "-m", "benchmarks.people_over_time", *map(str, arguments)]
    return subprocess.run(program, capture_output=True, text=True)


def test_the_command_scores_saved_detections(tmp_path):
    boxes = [[box_at(100), box_at(300)]] * 6
    image = cv2.imencode(".jpg", np.zeros((HEIGHT, WIDTH, 3), np.uint8))[1].tobytes()
    label = np.zeros((HEIGHT, WIDTH, 4), np.uint8)
    write_clip(tmp_path / "clip-00-00003.npz", [image] * 6, [label] * 6, truth_of(boxes))
    detections.save(tmp_path / "mine.json", {"clip-00-00003": found_of(boxes, [5, 6])})
    ran = run(tmp_path, "--detections", tmp_path / "mine.json", "--save", tmp_path / "out")
    assert ran.returncode == 0, ran.stderr
    assert "library" in ran.stdout
    report = json.loads((tmp_path / "out" / "scores.json").read_text())
    assert report["mine"]["library"]["HOTA"] == pytest.approx(1)
    wrong = run(tmp_path / "none")
    assert wrong.returncode == 1
    assert "export.people.clips.dataset" in wrong.stderr
