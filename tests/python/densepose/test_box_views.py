"""Views of images to learn from, and what their boxes show."""

import cv2
import numpy as np
import pytest
import torch

from export.densepose.box_views import People, Picture, matched, view_of, without_people

BLACK = np.zeros((200, 300, 3), np.uint8)


def picture(box, image=BLACK) -> Picture:
    boxes = np.array(box, np.float32).reshape(-1, 4)
    return Picture(cv2.imencode(".png", image)[1].tobytes(), boxes, np.zeros(len(boxes), bool))


def people(box, ignore) -> People:
    return People(torch.tensor(box, dtype=torch.float32), torch.tensor(ignore))


def test_boxes_of_a_view_lie_where_the_view_shows_the_people():
    bright = BLACK.copy()
    bright[60:160, 100:150] = 255
    seen = 0
    for seed in range(20):
        image, shown = view_of(picture([100, 60, 150, 160], bright), 256, np.random.default_rng(seed))
        if not len(shown.box) or shown.ignore[0]:
            continue
        seen += 1
        x0, y0, x1, y1 = (int(v) for v in shown.box[0].round())
        inner, light = image[y0 + 3 : y1 - 3, x0 + 3 : x1 - 3].astype(float), image.max()
        assert inner.mean() > 0.7 * light
        outside = image.astype(float)
        outside[max(y0 - 4, 0) : y1 + 4, max(x0 - 4, 0) : x1 + 4] = np.nan
        assert not np.nanmean(outside) > 0.6 * light
    assert seen > 10


def test_boxes_on_somebody_unsure_are_left_out_and_those_beside_are_nobody():
    boxes = torch.tensor([[0, 0, 50, 100], [100, 0, 150, 100], [110, 10, 140, 80], [200, 0, 250, 100]]).float()
    person, match, known = matched(boxes, people([[2, 0, 52, 100], [100, 0, 150, 100]], [False, True]))
    assert person[known].tolist() == [True, False]
    assert known.tolist() == [True, False, False, True]
    assert match[0] == 0


def test_a_file_that_is_no_image_is_named(tmp_path):
    (tmp_path / "torn.jpg").write_bytes(b"not a photo")
    with pytest.raises(ValueError, match=r"torn\.jpg is not an image"):
        without_people(tmp_path)
