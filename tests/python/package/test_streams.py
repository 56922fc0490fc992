"""Pipelines, recordings, clips and the rest of sources in Python."""

import select
import threading

import maquette
import numpy as np
import pytest

PEOPLE = "stub:people?count=1&seed=3&size=320x240&frames=3"
BOX = "stub:solids?scene=box&noise=none&size=320x240&seed=1&frames=2"


def test_a_pipeline_gives_people_and_ends():
    model = maquette.DensePoseModel(threads=1)
    model.set_frame_budget(1000)
    alone = maquette.DensePose(threads=1).run(maquette.Source(PEOPLE).read())
    with maquette.Pipeline(PEOPLE, model) as pipeline:
        results = []
        for result in pipeline:
            results.append(
                (result.frame.sequence, result.densepose, result.edges, result.predicted, result.camera_health)
            )
            assert result.stats["run_ms"] > 0
            result.densepose.save  # noqa: B018
            assert len(result.people) == 1
            assert result.stats["age_ms"] == -1
        assert pipeline.info.state == "ended"
        assert pipeline.stats["result_count"] == 3
        assert model.surface().shape[0] == 24
        assert model.stats["key_frame_interval"] == 1
    assert [r[0] for r in results] == [0, 1, 2]
    assert np.array_equal(results[0][1].part, alone.part)
    assert all(r[2:] == (None, None, None) for r in results)


def test_a_pipeline_gives_edges_with_curves():
    with maquette.Pipeline(BOX, maquette.EdgesModel(threads=1, curves=True)) as pipeline:
        result = pipeline.read(30)
        frame, edges = result.frame, result.edges
        result.close()
        del result
    assert edges.curves.boxes
    assert edges.curves.snap_to_ray((0, 0, 0), edges.curves.corners_m[0])[0] == "corner"
    assert np.asarray(frame).shape == (240, 320)  # a part keeps the whole


def test_a_pipeline_predicts_and_checks_the_camera():
    model = maquette.PredictionModel(maquette.Predictor("motion"), 0.1, checks_camera=True)
    with maquette.Pipeline(PEOPLE, model) as pipeline:
        ahead = [(result.predicted.origin.horizon_s, result.camera_health.event) for result in pipeline]
    assert [horizon for horizon, _ in ahead] == pytest.approx([0.1] * len(ahead))
    assert {event for _, event in ahead} == {"ok"}


def test_a_pipeline_calls_back_records_and_pauses(tmp_path):
    seen, states, done = [], [], threading.Event()

    def came(result: maquette.PipelineResult) -> None:
        seen.append(result.frame.sequence)

    def changed(state: str, problem: str) -> None:
        states.append((state, problem))
        if state in ("ended", "failed"):
            done.set()

    pipeline = maquette.Pipeline(on_result=came, on_state=changed)
    pipeline.record(tmp_path / "take.maqrec")
    pipeline.set_source("stub:pattern?size=32x24&frames=4")
    assert done.wait(30)
    assert seen == [0, 1, 2, 3]
    assert states[0] == ("opening", "")
    with pytest.raises(maquette.MaquetteError, match="MAQ_ERROR_UNSUPPORTED"):
        pipeline.read(0)
    pipeline.record(None)
    done.clear()
    pipeline.set_source("nowhere.mp4")
    assert done.wait(30)
    assert pipeline.info.status == "MAQ_ERROR_NOT_FOUND"
    assert "nowhere.mp4" in pipeline.info.problem
    pipeline.close()
    assert sum(1 for _ in maquette.Source(tmp_path / "take.maqrec")) == 4

    paused = maquette.Pipeline()
    paused.pause()
    paused.set_source("stub:pattern?size=32x24&frames=4")
    with pytest.raises(TimeoutError):
        paused.read(0.2)
    paused.resume()
    assert paused.read(30).frame.sequence < 4
    waiting = threading.Timer(0.1, paused.stop)
    waiting.start()
    paused.set_source("stub:pattern?size=32x24&live=1&stall=600s@0.1s")
    assert sum(1 for _ in paused) < 50  # ends by stop()
    waiting.join()


def test_a_recording_keeps_frames_and_seeks(tmp_path):
    source = maquette.Source(BOX)
    frames = list(source)
    with maquette.Recorder(tmp_path / "take.maqrec", source) as recorder:
        for frame in frames:
            recorder.add(frame)
        assert recorder.info["frame_count"] == 2
    played = maquette.Source(tmp_path / "take.maqrec")
    assert played.intrinsics == source.intrinsics
    assert np.array_equal(played.read().depth(), frames[0].depth())
    played.seek(frames[1].timestamp_ns / 1e9)
    assert played.read().timestamp_ns == frames[1].timestamp_ns
    assert played.read() is None
    with maquette.Recorder(tmp_path / "arrays.maqrec") as recorder:
        for time_s in (0.5, 0.75):
            recorder.add(np.zeros((24, 32, 3), np.uint8), time_s=time_s)
    first, second = (frame.timestamp_ns for frame in maquette.Source(tmp_path / "arrays.maqrec"))
    assert second - first == 250_000_000


def test_a_clip_is_written_and_an_unfinished_one_is_not(tmp_path):
    images = [np.full((48, 64, 3), value, np.uint8) for value in (40, 200)]
    with maquette.ClipWriter(tmp_path / "clip.mp4", fps=10) as clip:
        for image in images:
            clip.add(image)
    read = [np.asarray(frame) for frame in maquette.Source(tmp_path / "clip.mp4")]
    assert np.abs(np.array(read, int) - np.array(images)).max() < 8

    def fails() -> None:
        with maquette.ClipWriter(tmp_path / "other.mp4", fps=10) as clip:
            clip.add(images[0])
            clip.add(np.zeros((10, 10, 3), np.uint8))

    with pytest.raises(maquette.MaquetteError, match="MAQ_ERROR_INVALID_ARGUMENT"):
        fails()
    assert [path.name for path in tmp_path.iterdir()] == ["clip.mp4"]


def test_a_live_source_has_a_descriptor_and_stops():
    source = maquette.Source("stub:pattern?size=32x24&live=1&stall=600s@0.1s")
    assert select.select([source], [], [], 30)[0] == [source]
    with pytest.raises(maquette.MaquetteError, match="MAQ_ERROR_UNSUPPORTED"):
        source.control("exposure")
    with pytest.raises(maquette.MaquetteError, match="MAQ_ERROR_UNSUPPORTED"):
        source.set_control("exposure", 1000)
    stopping = threading.Timer(0.3, source.stop)
    stopping.start()
    assert 0 < sum(1 for _ in source) < 100
    stopping.join()
    assert {"stub", "image", "video", "rec"} <= {scheme.name for scheme in maquette.list_source_schemes()}
    assert all(camera.uri for camera in maquette.list_cameras())


def test_cancel_ends_the_next_run():
    frame = maquette.Source(PEOPLE).read()
    people = maquette.DensePose(threads=1)
    people.cancel()
    with pytest.raises(maquette.MaquetteError, match="MAQ_CANCELLED"):
        people.run(frame)
    assert people.run(frame).people
    edges = maquette.Edges(threads=1)
    edges.cancel()
    with pytest.raises(maquette.MaquetteError, match="MAQ_CANCELLED"):
        edges.run(maquette.Source(BOX).read())
    fusion = maquette.EdgesFusion(edges)
    fusion.add_view(maquette.Source(BOX).read(), maquette.PinholeCamera(
        maquette.Source(BOX).intrinsics, np.eye(3), np.zeros(3)))  # fmt: skip
    fusion.cancel()
    with pytest.raises(maquette.MaquetteError, match="MAQ_CANCELLED"):
        fusion.finish()
