"""Error against run time for people at any size: what becomes of the answers of each setting."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from photo_labels import BOX, SIZE, labels

from benchmarks import person_sizes
from export.evaluation.backends import Prediction
from export.evaluation.photos import PhotoSet


class Column:
    """A setting that needs as many milliseconds as its input has pixels a side, and sees half of everybody without
    crops."""

    def __init__(self, setting, bundle, threads):
        self.setting, self.ms, self.answers = setting, [], []

    def run(self, image, counted):
        if counted:
            self.ms.append(float(self.setting.options["long_side_px"]))
        inds = np.zeros(image.shape[:2], np.uint8)
        x0, y0, x1, y1 = BOX[0].astype(int)
        rows = 1 if "person_crops" in self.setting.options else 2
        inds[y0 : y0 + (y1 - y0) // rows, x0:x1] = 1
        iuv = np.stack([10 * inds, 0 * inds, 0 * inds], -1)
        self.answers.append(Prediction(BOX, np.array([0.9], np.float32), iuv, inds))

    def predictions(self):
        yield from self.answers

    def close(self):
        pass


@pytest.fixture
def rows(tmp_path, monkeypatch):
    monkeypatch.setattr(person_sizes, "Column", Column)
    for k in range(3):
        cv2.imwrite(str(tmp_path / f"{k}.png"), np.zeros((SIZE, SIZE, 3), np.uint8))
        labels(left_hip=(60, 50), left_knee=(60, 150)).save(tmp_path / "labels" / f"{k}.npz")
    chosen = PhotoSet.find([tmp_path], tmp_path / "labels", [])
    assert len(chosen.photos) == 3
    nothing = PhotoSet([], tmp_path, [])
    return person_sizes.measure(person_sizes.Pictures([], chosen, nothing), Path("bundle"), None, 0.7)


def test_every_setting_is_judged_by_its_own_answers(rows):
    assert [row["setting"] for row in rows] == [setting.name for setting in person_sizes.settings()]
    by_name = {row["setting"]: row for row in rows}
    plain, crops = by_name["384 px"], by_name["384 px, crops of all"]
    assert (plain["ms"], crops["ms"]) == (384, 384)
    assert plain["photographs"] == {"recall": 1, "mask": 0.5, "part": 0.5, "side": 1}
    assert crops["photographs"] == {"recall": 1, "mask": 1, "part": 1, "side": 1}
    assert plain["rendered"] is plain["views"] is None


def test_the_report_shows_what_was_measured_and_says_what_was_not(rows):
    title, parts = person_sizes.section(rows)
    assert title == "People at any size"
    table = parts[-1]
    assert table[0] == ["setting", "ms", "photographs: recall at P .9", "photographs: mask IoU", "photographs: part",
                        "photographs: left/right"]  # fmt: skip
    assert table[1] == ["256 px", "256.0", "1.000", "0.500", "0.500", "1.000"]
    assert "Not measured: rendered, views" in parts[2]
    figure = person_sizes.draw({"person_sizes": rows})
    assert [axis.get_title() for axis in figure.axes] == ["photographs"]
