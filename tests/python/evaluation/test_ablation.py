"""Ablations: what is judged is what is on the photograph, and each training differs in what it says."""

import argparse
import json
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
import torch
from photo_labels import BOX, SIZE, labels
from rectangle_people import write_shard

from export.densepose.network import MobileNetV2
from export.evaluation import ablation
from export.evaluation.photos import PhotoSet


@pytest.fixture
def dev(tmp_path) -> PhotoSet:
    """One photograph: a white person on black."""
    image = np.zeros((SIZE, SIZE, 3), np.uint8)
    image[20:180, 40:120] = 255
    photos, known = tmp_path / "photos" / "val", tmp_path / "teachers" / "labels"
    photos.mkdir(parents=True)
    known.mkdir(parents=True)
    cv2.imwrite(str(photos / "white.png"), image)
    labels(BOX, left_hip=(60, 100), right_hip=(100, 100), nose=(80, 30)).save(known / "white.npz")
    return PhotoSet.find([photos], known, [])


def test_a_crop_shows_the_whole_box_in_its_middle():
    image = np.zeros((300, 400, 3), np.uint8)
    image[50:250, 300:380] = 255
    crop, into = ablation.crop_around(image, np.array([300, 50, 380, 250]), 128)
    y, x = np.nonzero(crop[..., 0] > 200)
    assert np.ptp(y) + 1 == pytest.approx(128 / ablation.MARGIN, abs=2)
    assert (x.mean(), y.mean()) == pytest.approx((63.5, 63.5), abs=1)
    assert into @ [340, 150, 1] == pytest.approx([64, 64])


def test_judged_is_what_the_head_paints_inside_the_box(dev):
    net = SimpleNamespace(detector=lambda tensor: ([tensor[:, :, 2::4, 2::4]], [], []))

    def white_is(part):
        def index(features):
            logits = torch.zeros(1, 25, *features.shape[-2:])
            logits[0, part] = features[0, 0]
            return logits

        return SimpleNamespace(index=index)

    front = ablation.judge(net, white_is(2), dev)
    assert front["mask_iou"] > 0.93
    assert front["part_at_landmark"] == pytest.approx(2 / 3)  # the nose has no torso
    left = ablation.judge(net, white_is(10), dev)
    assert left["left_right"] == pytest.approx(0.5)
    assert ablation.judge(net, white_is(0), dev)["mask_iou"] == 0


def test_variations_change_the_images_they_say(tmp_path):
    write_shard(tmp_path / "people" / "train", 8)
    every = ablation.records_of(ablation.Variation("all"), tmp_path)
    alone = ablation.Variation("alone", keep=ablation.VARIATIONS["alone"].keep)
    assert len(every) == 8
    assert all(r.decoded()[1][..., 3].max() < 2 for r in ablation.records_of(alone, tmp_path))
    assert len(ablation.records_of(ablation.Variation("few", count=3), tmp_path)) == 3
    (plain, *_), original = ablation.records_of(ablation.Variation("plain", plain=True), tmp_path), every[0].decoded()
    image, label = plain.decoded()
    around = label[..., 3] == 0
    assert np.array_equal(label, original[1])
    assert len(np.unique(image[around], axis=0)) == 1
    assert np.array_equal(image[~around], original[0][~around])


def test_a_training_leaves_its_figures_and_is_not_repeated(tmp_path, dev, monkeypatch, capsys):
    for split in ("train", "val"):
        write_shard(tmp_path / "people" / split, 4)
    torch.save(MobileNetV2().state_dict(), tmp_path / "backbone.pt")
    options = argparse.Namespace(
        out=tmp_path, data=tmp_path, images=16, pretrained=tmp_path / "backbone.pt", bf16=False
    )  # fmt: skip
    ablation._work(("reference", 0, options, 1))
    found = json.loads((tmp_path / "reference-0.json").read_text())
    assert found["images"] == 16
    assert all(0 <= found[name] <= 1 for name in ("mask_iou", "part_at_landmark", "pixel_part"))

    assert found["rendered"] == 4

    docs = tmp_path / "docs"
    (docs / "pictures").mkdir(parents=True)
    monkeypatch.setattr("sys.argv", ["ablation", "--out", str(tmp_path), "--docs", str(docs), "--show"])
    ablation.main()
    assert f"| {found['mask_iou']:.3f} ± 0.000 |" in capsys.readouterr().out
    assert json.loads((docs / "ablation.json").read_text()) == [found]
    assert cv2.imread(str(docs / "pictures" / "ablation.png")).shape[1] > 800


def test_the_table_gives_mean_and_half_the_range_of_the_seeds(tmp_path):
    for seed, value in enumerate((0.5, 0.6)):
        row = {"variation": "few", "seed": seed} | dict.fromkeys(ablation.FIGURES, value)
        (tmp_path / f"few-{seed}.json").write_text(json.dumps(row))
    *_, line = ablation.table(ablation.gathered(tmp_path)).splitlines()
    assert line == "| 3,000 rendered images |" + " 0.550 ± 0.050 |" * len(ablation.FIGURES)
