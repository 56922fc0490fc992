"""Training of the evidence of people: who is nobody, while what is said of people is kept."""

from dataclasses import replace

import pytest
import torch

from export.densepose import train_evidence
from export.densepose.box_views import People
from export.densepose.config import NetworkConfig
from export.densepose.network import MobileParsingRCNN, PersonEvidence
from export.densepose.targets import mean_evidence
from export.densepose.train_evidence import View

NO_PEOPLE = People(torch.zeros(0, 4), torch.zeros(0, dtype=torch.bool))
BOXES = torch.tensor([[8, 8, 100, 120], [30, 20, 90, 110], [60, 4, 124, 100]]).float()


@pytest.fixture(scope="module")
def seen() -> list[View]:
    """Two kinds of images, which the backbone's maps tell apart; the box head takes both for people."""
    torch.manual_seed(0)
    made = []
    for k in range(16):
        fine, coarse = torch.randn(1, 96, 8, 8), 30 * torch.randn(1, 160, 4, 4)
        fine[:, ::2] += 1 if k % 2 else -1
        made.append(View(fine.half(), coarse.half(), BOXES, torch.ones(3), torch.zeros(3).bool(), keeps=k % 2 == 0))
    return made


def likely(evidence: PersonEvidence, view: View) -> torch.Tensor:
    with torch.no_grad():
        return (view.logit + mean_evidence(evidence(view.fine.float(), view.coarse.float()), view.boxes)).sigmoid()


def test_images_without_people_become_nobody_and_scores_of_all_others_stay(seen):
    evidence = train_evidence.fit(seen, steps=200, rate=5e-3, seed=0)
    for view in seen:
        if view.keeps:
            assert (likely(evidence, view) - view.logit.sigmoid()).abs().max() < 0.1
        else:
            assert likely(evidence, view).max() < 0.2


def test_people_whom_labels_are_sure_of_are_to_be_likely(seen):
    evidence = PersonEvidence((0, 0, 96, 160), 4)  # which says nothing yet
    unlikely = replace(seen[0], logit=torch.full((3,), -2.0))
    assert train_evidence.view_loss(evidence, unlikely).abs() < 1e-6
    assert train_evidence.view_loss(evidence, replace(unlikely, person=torch.ones(3).bool())) > 0.5
    sure = replace(seen[0], logit=torch.full((3,), 4.0), person=torch.ones(3).bool())
    assert train_evidence.view_loss(evidence, sure).abs() < 1e-6
    assert train_evidence.view_loss(evidence, seen[1]) > 1


def test_a_view_has_the_boxes_that_may_show_somebody():
    torch.manual_seed(1)
    net = MobileParsingRCNN(NetworkConfig(width=16)).eval()
    image = torch.randn(1, 3, 128, 128)
    boxes = train_evidence.view(net, image, NO_PEOPLE, keeps=True).boxes
    assert len(boxes) > 0
    sure, unsure = (People(boxes[:1], torch.tensor([ignored])) for ignored in (False, True))
    view = train_evidence.view(net, image, sure, keeps=True)
    assert view.person[0]
    assert [tuple(view.fine.shape), tuple(view.coarse.shape)] == [(1, 96, 8, 8), (1, 160, 4, 4)]
    assert not train_evidence.view(net, image, unsure, keeps=True).person.any()
    with torch.no_grad():
        net.box_head.logits.bias.copy_(torch.tensor([-20.0, 0.0]))
    assert len(train_evidence.view(net, image, NO_PEOPLE, keeps=True).boxes) == 0
    assert train_evidence.view(net, image, sure, keeps=True).person.all()
