"""Shards in, predictions in, metrics out: on small made images with a made body surface."""

import dataclasses
import json

import cv2
import numpy as np
import pytest
from rich.console import Console

from export.evaluation import __main__ as command
from export.evaluation import report
from export.evaluation.backends import Prediction, fingerprint, open_backend
from export.evaluation.json_values import plain
from export.evaluation.measure import Metrics, Tally, image_ranges, measure
from export.evaluation.paint import mosaic, paint
from export.evaluation.plot import write_image
from export.evaluation.surface_accuracy import FATES, PixelAccuracy, SurfacePoints, mask_overlap, sample_pixels
from export.jobs import Workers
from export.shards import ShardError, read_image, read_images, shard_paths
from export.teachers.label import PhotoLabels

HEIGHT, WIDTH = 40, 60


class LineSurface:
    """A 'body' that is a line of 1 m along x: parts 1..4 one after another, U along it, 1 mm apart."""

    def __init__(self):
        self.x = np.linspace(0, 1, 1001)
        self.geodesic = np.abs(self.x[:, None] - self.x[None]).astype(np.float16)

    def nearest_by_point(self, points):
        return np.clip(np.round(points[:, 0] * 1000), 0, 1000).astype(int)

    def nearest_by_iuv(self, part, uv):
        return np.clip(np.round((part - 1 + uv[:, 0]) * 250), 0, 1000).astype(int)


def draw_person(label, point, number, box, parts=(1, 2, 3, 4)):
    """Vertical stripes of parts; U grows along x, so that the surface point is x along the line."""
    x0, y0, x1, y1 = box
    along = (np.arange(x0, x1) - x0) / (x1 - x0)
    index = np.minimum((along * 4).astype(int), 3)
    u = np.round((along * 4 - index) * 255)
    label[y0:y1, x0:x1, 0] = np.array(parts)[index]
    label[y0:y1, x0:x1, 1] = u
    label[y0:y1, x0:x1, 2] = 128
    label[y0:y1, x0:x1, 3] = number
    point[y0:y1, x0:x1, 0] = (index + u / 255) / 4


@pytest.fixture
def folder(tmp_path):
    """A shard of two images with two people each, one of the four marked ignore."""
    rng = np.random.default_rng(0)
    stores = {"image": [], "label": [], "point": []}
    boxes = [[5, 5, 25, 35], [30, 10, 55, 30]]
    for _ in range(2):
        label = np.zeros((HEIGHT, WIDTH, 4), np.uint8)
        point = np.zeros((HEIGHT, WIDTH, 3))
        for number, box in enumerate(boxes, 1):
            draw_person(label, point, number, box)
        photo = rng.integers(0, 255, (HEIGHT, WIDTH, 3), dtype=np.uint8)
        stores["image"].append(cv2.imencode(".jpg", photo)[1].tobytes())
        stores["label"].append(cv2.imencode(".png", label)[1].tobytes())
        stores["point"].append(cv2.imencode(".png", np.round(point * 65535).astype(np.uint16))[1].tobytes())
    arrays = {}
    for name, parts in stores.items():
        arrays[name] = np.frombuffer(b"".join(parts), np.uint8)
        arrays[name + "_end"] = np.cumsum([len(p) for p in parts])
    np.savez(
        tmp_path / "shard-00000.npz", **arrays,
        point_range=np.array([[0, 0, 0], [1, 1, 1]], np.float32), box=np.array(boxes * 2, np.float32),
        box_image=np.array([0, 0, 1, 1], np.int32), box_instance=np.array([1, 2, 1, 2], np.uint8),
        box_ignore=np.array([False, False, False, True]), meta=np.array("{}"),
    )  # fmt: skip
    return tmp_path


class Fake:
    """A backend that knows the truth, changed by `edit(prediction)`."""

    kind, precision, threshold, path = "fake", "fp32", 0.5, None

    def __init__(self, images, edit=lambda prediction: prediction):
        self.answers = {item.image.tobytes(): item for item in images}
        self.edit = edit

    def predict(self, image):
        item = self.answers[image.tobytes()]
        score = np.linspace(0.9, 0.8, len(item.box)).astype(np.float32)
        return self.edit(Prediction(item.box, score, item.label[..., :3].copy(), item.label[..., 3].copy()))


def metrics(folder, edit=lambda prediction: prediction):
    return metrics_of(list(read_images(shard_paths(folder))), edit)


def metrics_of(images, edit):
    backend, tally = Fake(images, edit), Tally(Fake.threshold)
    for image in images:
        tally.add(backend, image)
    return tally.metrics(LineSurface())


def test_metrics_of_parts_are_those_of_the_whole(folder, monkeypatch):
    images = list(read_images(shard_paths(folder)))

    def spoil(prediction):
        return prediction.above(0.85)  # some people are missed

    monkeypatch.setattr("export.evaluation.measure._backend", lambda text, score_floor: Fake(images, spoil))
    monkeypatch.setattr("export.evaluation.measure.IMAGES_A_JOB", 1)
    ranges = image_ranges("fake", 0.05, shard_paths(folder))
    assert [(r.first, r.count) for r in ranges] == [(0, 1), (1, 1)]
    parts, whole = measure(ranges, LineSurface(), Workers(0)), metrics(folder, spoil)
    assert whole.recall_shown < 1
    for field in dataclasses.fields(Metrics):
        if field.name != "seconds_per_image":
            left, right = (json.dumps(plain(getattr(f, field.name))) for f in (parts, whole))
            assert left == right, field.name
    monkeypatch.setattr("export.evaluation.measure.IMAGES_A_JOB", 50)
    (one,) = image_ranges("fake", 0.05, [*shard_paths(folder)] * 2, limit=1)
    assert one.count == 1


def test_reading_a_shard_gives_back_labels_points_and_boxes(folder):
    first, second = read_images(shard_paths(folder))
    assert first.image.shape == (HEIGHT, WIDTH, 3)
    assert first.box.tolist() == [[5, 5, 25, 35], [30, 10, 55, 30]]
    assert second.ignore.tolist() == [False, True]
    y, x = sample_pixels(first, 2).T
    assert np.all(first.label[y, x, 3] == 2)
    along = (first.label[y, x, 0] - 1 + first.label[y, x, 1] / 255) / 4
    assert np.allclose(first.point[y, x, 0], along, atol=1e-3)
    assert [item.name for item in read_images(shard_paths(folder), limit=1)] == [first.name]
    assert [item.name for item in read_images(shard_paths(folder), limit=1, first=1)] == [second.name]


def test_a_folder_without_shards_says_how_to_make_them(tmp_path):
    with pytest.raises(ShardError, match=r"export\.people\.dataset"):
        shard_paths(tmp_path)


def test_a_file_that_is_no_shard_is_named(tmp_path):
    np.savez(tmp_path / "shard-00000.npz", image=np.zeros(3))
    with pytest.raises(ShardError, match=r"shard-00000\.npz lacks"):
        list(read_images(shard_paths(tmp_path)))


def test_sampled_pixels_are_the_same_every_time_and_at_most_196(folder):
    first = next(read_images(shard_paths(folder)))
    again = next(read_images(shard_paths(folder)))
    assert len(sample_pixels(first, 1)) == 196
    assert np.array_equal(sample_pixels(first, 1), sample_pixels(again, 1))


def test_the_truth_itself_gets_full_marks(folder):
    result = metrics(folder)
    assert (result.images, result.people, result.ignored) == (2, 3, 1)
    assert (result.ap_box, result.part_accuracy, result.mask_iou) == (1, 1, 1)
    assert (result.ap_gps, result.ap_gpsm) == (1, 1)
    assert (result.recall_shown, result.precision_shown) == (1, 1)
    assert (result.median_du, result.median_dv) == (0, 0)
    assert result.error_cm_painted < 0.3


def test_pixels_of_a_missed_person_count_as_wrong(folder):
    def forget_second(prediction):
        shown = prediction.inds == 1
        iuv = prediction.iuv * shown[..., None]
        return Prediction(prediction.box[:1], prediction.score[:1], iuv, prediction.inds * shown)

    result = metrics(folder, forget_second)
    first, second = 20 * 30, 25 * 20
    assert result.part_accuracy == pytest.approx(first / (first + second))
    assert result.mask_iou == pytest.approx(first / (first + second))
    assert result.ap_box_50 == pytest.approx(67 / 101)  # two of three people asked for


def test_people_below_the_score_threshold_enter_ap_but_not_the_image(folder):
    def doubt(prediction):
        return Prediction(prediction.box, prediction.score - 0.6, prediction.iuv, prediction.inds)

    result = metrics(folder, doubt)
    assert (result.ap_box, result.ap_gps) == (1, 1)
    assert (result.found, result.part_accuracy, result.mask_iou) == (0, 0, 0)
    assert np.isnan(result.error_cm_painted)


def test_thirty_centimetres_along_the_surface_halve_gps(folder):
    def shift(prediction):
        iuv = prediction.iuv.copy()
        along = (iuv[..., 0] - 1 + iuv[..., 1] / 255) / 4
        along = np.where(along < 0.5, along + 0.3, along - 0.3)
        iuv[..., 0] = np.where(iuv[..., 0] > 0, np.minimum((along * 4).astype(int), 3) + 1, 0)
        iuv[..., 1] = np.where(iuv[..., 0] > 0, np.round((along * 4 - (iuv[..., 0] - 1.0)) * 255), 0)
        return Prediction(prediction.box, prediction.score, iuv, prediction.inds)

    result = metrics(folder, shift)
    assert result.error_cm_painted == pytest.approx(30, abs=0.5)
    assert result.ap_gps_by_threshold[0] in (0, 1)  # exp(-.3^2 / (2 * .255^2)) = 0.5006
    assert result.ap_gps_by_threshold[1] == 0
    assert result.ap_box == 1


def test_a_person_painted_by_another_detection_is_not_that_detections_merit(folder):
    def swap(prediction):
        inds = np.array([0, 2, 1], np.uint8)[prediction.inds]
        return Prediction(prediction.box, prediction.score, prediction.iuv, inds)

    images = list(read_images(shard_paths(folder)))
    result = metrics_of(images[:1], swap)
    assert (result.ap_box, result.part_accuracy) == (1, 1)
    assert result.ap_gps == 1  # each person is still painted right by one detection
    one = metrics_of(images[:1], lambda p: swap(p).above(0.85))
    assert one.ap_gps_50 == pytest.approx(51 / 101)


def test_pixels_painted_beside_the_person_lower_gpsm_but_not_gps(folder):
    def spill(prediction):
        """The first person's paint goes on over 30 columns on background, so that its mask IoU is .4."""
        only = prediction.above(0.85)
        iuv, inds = only.iuv.copy(), only.inds.copy()
        free = (inds == 0) & (np.arange(WIDTH) < 55)[None]
        spilled = np.flatnonzero(free.ravel())[: int(1.5 * (inds == 1).sum())]
        inds.ravel()[spilled] = 1
        iuv.reshape(-1, 3)[spilled] = 1
        return Prediction(only.box, only.score, iuv, inds)

    images = list(read_images(shard_paths(folder)))[1:]  # its second person is ignored
    result = metrics_of(images, spill)
    assert result.ap_gps == 1
    assert result.ap_gpsm_by_threshold == [1, 1, 1] + [0] * 7  # sqrt(.4) = .632


def test_the_overlap_of_masks_is_intersection_over_union_of_each_pair():
    inds = np.array([[1, 1, 1, 2, 0, 0]], np.uint8)
    instance = np.array([[0, 4, 4, 4, 4, 7]], np.uint8)
    assert np.allclose(mask_overlap(inds, 2, instance, np.array([4, 7])), [[2 / 5, 0], [1 / 4, 0]])


def test_the_surface_error_of_a_part_is_that_of_its_own_painted_points():
    distance = np.array([0.1, 0.3, np.inf, 0.5, 0.9], np.float32)
    part, owner = np.array([3, 3, 3, 4, 4], np.uint8), np.array([1, 1, 0, 1, 2], np.uint8)
    points = SurfacePoints(distance, part, np.ones(5, bool), owner, [])
    error = points.part_error_cm(shown=owner < 2)  # the last point belongs to somebody not shown
    assert error[3:5] == pytest.approx([20, 50])
    assert np.isnan(error[5])


def test_an_answer_of_the_wrong_size_is_refused(folder):
    with pytest.raises(ValueError, match="planes"):
        metrics(folder, lambda p: Prediction(p.box, p.score, p.iuv[1:], p.inds[1:]))


def test_median_difference_is_over_right_parts_only():
    label = np.zeros((1, 4, 4), np.uint8)
    label[0, :, 0] = [1, 1, 1, 2]
    iuv = label[..., :3].copy()
    iuv[0, :, 0] = [1, 1, 1, 3]
    iuv[0, :, 1] = [10, 20, 30, 255]
    pixels = PixelAccuracy()
    pixels.add(label, iuv)
    assert pixels.median_difference() == (20 / 255, 0)
    assert pixels.part_recall()[[1, 2]].tolist() == [1, 0]
    assert pixels.part_precision()[[1, 3]].tolist() == [1, 0]
    assert np.isnan(pixels.part_precision()[2])  # painted nowhere


def test_pixels_painted_wrong_are_told_apart_by_how():
    #        right; front for back; left for right, twice, and a head's half; another part; background; a missed one
    true = [2, 1, 15, 10, 23, 2, 2, 9]
    painted = [2, 2, 16, 7, 24, 23, 0, 0]
    pixels = PixelAccuracy()
    label, iuv = np.zeros((1, 9, 4), np.uint8), np.zeros((1, 9, 3), np.uint8)
    label[0, :8, 0], iuv[0, :8, 0] = true, painted  # the last pixel is nobody's
    pixels.add(label, iuv)
    shares = [1 / 8, 1 / 8, 3 / 8, 1 / 8, 2 / 8]
    assert pixels.fates() == dict(zip(FATES, shares, strict=True))


def test_table_and_files_show_differences_and_hold_no_nan(folder, tmp_path):
    results = {"fp32 torch": metrics(folder), "int8 capi": metrics(folder, lambda p: p.above(0.85))}
    console = Console(width=140, record=True)
    report.print_table(results, console)
    text = console.export_text()
    assert "part accuracy" in text
    assert "-45.5" in text
    assert report.largest_difference(results) > 40
    report.write_json(tmp_path / "e.json", results, {}, dict.fromkeys(results, ("model", "0123")), {"images": 2})
    document = json.loads((tmp_path / "e.json").read_text(), parse_constant=pytest.fail)
    assert document["results"]["int8 capi"]["images"] == 2
    assert document["results"]["int8 capi"]["photos"] is None
    write_image(tmp_path / "e.png", results, {})
    assert cv2.imread(str(tmp_path / "e.png")) is not None


def test_one_command_measures_rendered_images_and_labelled_photographs(folder, tmp_path, monkeypatch):
    images = list(read_images(shard_paths(folder)))
    backend = Fake(images)
    backend.path = tmp_path / "weights.pt"
    backend.path.write_bytes(b"weights")
    monkeypatch.setattr(command, "open_backend", lambda text, score_floor: backend)
    monkeypatch.setattr("export.evaluation.measure._backend", lambda text, score_floor: backend)
    monkeypatch.setattr("export.people.atlas.load_surface_table", LineSurface)
    (tmp_path / "photos").mkdir()
    cv2.imwrite(str(tmp_path / "photos/one.png"), images[0].image[..., ::-1])
    people, mask = len(images[0].box), np.zeros((2, HEIGHT, WIDTH), bool)
    nobody = np.zeros(people, bool)
    PhotoLabels(
        box=images[0].box, score=np.ones(people), outlined=nobody, sure=nobody, point=np.zeros((people, 33, 2)),
        visible=np.zeros((people, 33)), world=np.zeros((people, 33, 3)), mask=mask, doubt=mask,
    ).save(tmp_path / "labels/one.npz")  # fmt: skip
    arguments = ["--data", str(folder), "--photos", str(tmp_path / "photos"), "--labels", str(tmp_path / "labels")]
    arguments += ["--empty", str(tmp_path / "empty"), "--animals", str(tmp_path / "animals")]
    arguments += ["--out", str(tmp_path / "out"), "--backends", "fake"]
    assert command.main(arguments) == 0
    document = json.loads((tmp_path / "out/evaluation.json").read_text())
    metrics = report.column_of(document, fingerprint(backend.path))
    assert (metrics["images"], metrics["photos"]["photos"]) == (2, 1)
    assert (tmp_path / "out/evaluation.png").exists()


def test_an_image_is_found_again_by_its_name(folder):
    second = list(read_images(shard_paths(folder)))[1]
    assert np.array_equal(read_image(folder, second.name).image, second.image)
    for name in ("shard-00000/0002", "shard-00009/0000", "photo.jpg"):
        with pytest.raises(ShardError, match=name):
            read_image(folder, name)


def test_painting_changes_people_and_leaves_the_rest_alone(folder):
    item = next(read_images(shard_paths(folder)))
    empty = np.zeros((0, 4), np.float32), np.zeros(0, np.float32)
    picture = paint(item.image, Prediction(*empty, item.label[..., :3], item.label[..., 3]))
    background = item.label[..., 0] == 0
    assert np.array_equal(picture[background], item.image[background])
    assert (picture != item.image)[~background].any(-1).mean() > 0.9
    assert mosaic([picture] * 3, 2).shape == (2 * HEIGHT, 2 * WIDTH, 3)


def test_unknown_backend_and_missing_model_are_explained(tmp_path):
    with pytest.raises(ValueError, match="unknown backend 'tflite'"):
        open_backend("tflite", 0.05)
    with pytest.raises(FileNotFoundError, match="onnx=PATH"):
        open_backend(f"onnx={tmp_path / 'nothing'}", 0.05)
    with pytest.raises(ValueError, match="only capi takes settings"):
        open_backend("torch?person_crops=1", 0.05)
    with pytest.raises(ValueError, match=r"maq_densepose_config's fields as name=number, not 'person_crops=auto'"):
        open_backend("capi?person_crops=auto", 0.05)


def test_settings_of_the_sdk_are_part_of_the_backends_name(monkeypatch):
    given = {}

    class Told:
        def __init__(self, path, **settings):
            given.update(settings)

        def set_roll(self, roll_rad):
            given["roll_rad"] = roll_rad

    monkeypatch.setattr("maquette.DensePose", Told)
    backend = open_backend("capi?person_crops=1&long_side_px=384", 0.05)
    assert given == {"score_threshold": 0.05, "person_crops": 1, "long_side_px": 384}
    assert backend.kind == "capi?person_crops=1&long_side_px=384"
    assert open_backend("capi?roll_deg=-90", 0.05).kind == "capi?roll_deg=-90"
    assert given["roll_rad"] == pytest.approx(-np.pi / 2)
    assert open_backend("capi", 0.05).kind == "capi"
