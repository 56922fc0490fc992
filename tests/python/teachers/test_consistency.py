"""Labels that weights give themselves: only where they agree, and never against what is known."""

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="the networks need torch: scripts/make-venv.sh train,dev")

from export.densepose.config import NetworkConfig  # noqa: E402
from export.densepose.decode import Result  # noqa: E402
from export.densepose.network import MobileParsingRCNN  # noqa: E402
from export.shards import BOX_ALONE, PERSON, POSSIBLE_PARTS, REGION, UNSURE, visible_boxes  # noqa: E402
from export.teachers import consistency  # noqa: E402
from export.teachers.consistency import Answer, Consensus, KeptConsensus  # noqa: E402


@pytest.fixture(scope="module")
def consensus():
    torch.manual_seed(0)
    return Consensus([MobileParsingRCNN(NetworkConfig(width=16)).eval()], sides_px=(96, 128))


@pytest.fixture
def picture():
    rng = np.random.default_rng(0)
    image = rng.integers(0, 255, (160, 200, 3), np.uint8)
    label = np.zeros((160, 200, 4), np.uint8)
    label[20:140, 50:110] = (PERSON, 0, 0, 1)
    label[60:80, 50:110, 0] = REGION + 12
    label[80:90, 50:110, :3] = 2, 40, 50
    label[90:95, 50:110, 0] = UNSURE
    label[20:60, 150:170] = (PERSON, 0, 0, 2)  # small
    label[100:159, 150:199] = (UNSURE, 0, 0, BOX_ALONE)
    return image, label


def test_the_mirrored_image_gets_the_mirrored_answer(consensus, picture):
    image, label = picture
    mask = label[..., 3] == 1
    answer, _ = consensus.ask(image, mask)
    mirrored, _ = consensus.ask(np.ascontiguousarray(image[:, ::-1]), np.ascontiguousarray(mask[:, ::-1]))
    back = mirrored.mirrored()
    for ours, theirs in zip(vars(answer).values(), vars(back).values(), strict=True):
        assert torch.allclose(ours, theirs, atol=1e-3)
    assert answer.index.sum(0) == pytest.approx(1, abs=1e-4)


def test_what_is_known_stays_and_the_rest_is_filled_within_what_is_possible(consensus, picture):
    image, label = picture
    filled = consensus.complete(image, label, min_probability=0.0)
    own = label[..., 3] == 1
    changed = (filled != label).any(-1)
    assert changed[own & (label[..., 0] == PERSON)].all()
    assert not changed[~own].any()
    assert not changed[label[..., 0] <= 24].any()
    assert not changed[label[..., 0] == UNSURE].any()
    assert POSSIBLE_PARTS[label[changed, 0], filled[changed, 0]].all()
    assert np.array_equal(filled[..., 3], label[..., 3])
    # Weights that know nothing agree on nothing.
    assert np.array_equal(consensus.complete(image, label, min_probability=0.95), label)


def test_people_whom_only_the_weights_find_are_left_out_of_training(consensus, picture, monkeypatch):
    image, label = picture
    instance = np.zeros(label.shape[:2], np.uint8)
    instance[20:140, 40:110], instance[5:60, 120:148] = 1, 2  # somebody labelled, and somebody who is not
    label[5:8, 120:148, 0] = UNSURE
    found = Result(np.zeros((2, 4), np.float32), np.ones(2, np.float32), np.zeros((160, 200, 3), np.uint8), instance)
    monkeypatch.setattr(consistency, "infer", lambda graphs, rgb, network, config: found)
    out = consensus.ignore_unlabelled(image, label)
    changed = (out != label).any(-1)
    assert np.array_equal(changed, instance == 2)
    assert (out[changed] == (UNSURE, 0, 0, 254)).all()
    assert visible_boxes(out)[2].tolist() == [False, False, False, True]


def test_an_answer_is_kept_for_the_same_image_label_and_weights_alone(consensus, picture, tmp_path, monkeypatch):
    asked = []

    class Counted(Consensus):
        def complete(self, image, label):
            asked.append(label)
            return consensus.complete(image, label, min_probability=0.0)

        def ignore_unlabelled(self, image, label):
            return label

    monkeypatch.setattr(Consensus, "of_files", staticmethod(lambda weights: Counted(consensus.networks)))
    weights = tmp_path / "weights.pt"
    weights.write_bytes(b"first")
    image, label = picture
    first = KeptConsensus([weights], tmp_path / "kept").complete(image, label)
    again = KeptConsensus([weights], tmp_path / "kept").complete(image, label)
    assert len(asked) == 1
    assert np.array_equal(first, again)
    assert np.array_equal(first, consensus.complete(image, label, min_probability=0.0))
    KeptConsensus([weights], tmp_path / "kept").complete(image, np.zeros_like(label))
    KeptConsensus([weights], tmp_path / "kept").complete(np.ascontiguousarray(image[::-1]), label)
    weights.write_bytes(b"second")
    KeptConsensus([weights], tmp_path / "kept").complete(image, label)
    assert len(asked) == 4


def test_charts_are_averaged_by_the_probability_of_their_part():
    def one(probability: float, u: float) -> Answer:
        index = torch.full((25, 1, 1), 0.0)
        index[2], index[3] = probability, 1 - probability
        return Answer(torch.ones(15, 1, 1) / 15, index, torch.full((25, 1, 1), u), torch.zeros(25, 1, 1))

    mean = Answer.mean([one(0.9, 0.2), one(0.1, 0.8)])
    assert mean.index[2].item() == pytest.approx(0.5)
    assert mean.u[2].item() == pytest.approx(0.9 * 0.2 + 0.1 * 0.8)
    assert mean.u[3].item() == pytest.approx(0.1 * 0.2 + 0.9 * 0.8)
