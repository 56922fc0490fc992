"""The fit in numpy and torch, on an ellipsoid whose anchors and field are known."""

import numpy as np
import pytest

from export.heads.anchor_fit import AnchorFitOptions, Observations, fit_anchors, start
from export.heads.prior import FieldShape, Layer, Prior

torch = pytest.importorskip("torch", reason="the extra `train` is not installed")

TRUTH = np.array([0.8, -1.2, 0.5])
FOCAL_PX = 900.0


def prior() -> Prior:
    """Three codes stretch the axes of the unit ball by 8 % each; the field plays no part."""
    shape = FieldShape(octaves=1, width=8, surface_width=8, feature=3)
    points = np.random.default_rng(0).normal(size=(400, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    linear = np.einsum("mc,ck->mck", points, 0.08 * np.eye(3))

    def layer(index: int, *codes: int) -> Layer:
        return Layer(
            np.zeros((*codes, shape.outputs(index), shape.inputs(index)), np.float32),
            np.zeros((*codes, shape.outputs(index)), np.float32),
        )

    single = np.float32
    return Prior(
        shape, [layer(k) for k in range(shape.layers)],
        [layer(k, 3) for k in shape.personal[0]], [layer(k, 2) for k in shape.personal[1]],
        100.0, np.float32([0, 0, -3]), np.float32([0, 0, -1]), np.full(3, -4, single), np.full(3, 4, single),
        points.astype(single), points.astype(single), linear.astype(single), np.full(400, 0.005, single),
    )  # fmt: skip


def seen(noise_dm: float = 0.005, outliers: float = 0.2) -> tuple[Observations, np.ndarray, np.ndarray]:
    """Observations of the near side of TRUTH's head, and the camera: rotation, shift."""
    rng = np.random.default_rng(1)
    turn = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0.0]])  # the face looks to -y
    shift = np.array([0.3, -0.2, 8.0])
    points = rng.normal(size=(600, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    points = points[points[:, 1] < -0.2]
    camera = (points * (1 + 0.08 * TRUTH)) @ turn.T + shift
    pixels = FOCAL_PX * camera[:, :2] / camera[:, 2:]
    template = points + rng.normal(0, noise_dm, points.shape)
    wrong = rng.random(len(points)) < outliers
    template[wrong] = rng.permutation(template[wrong])
    codes = np.zeros((3, 2))
    return Observations(template, np.full(len(points), 0.01), pixels, codes), turn, shift


def test_the_start_finds_a_camera_far_away():
    observations, turn, _ = seen(outliers=0)
    rotation, _ = start(observations.template, observations.pixels, FOCAL_PX, np.zeros(2))
    assert np.degrees(np.arccos((np.trace(rotation @ turn.T) - 1) / 2)) < 3
    assert np.linalg.det(rotation) == pytest.approx(1)


def test_codes_and_camera_are_found_beside_outliers():
    observations, turn, shift = seen()
    fit = fit_anchors(prior(), observations, AnchorFitOptions(FOCAL_PX, 0.01, weight=1.0))
    assert np.degrees(np.arccos(np.clip((np.trace(fit.rotation @ turn.T) - 1) / 2, -1, 1))) < 1
    # Size and distance look alike: what is compared is the shape.
    ratio = (1 + 0.08 * fit.codes) / (1 + 0.08 * TRUTH)
    assert np.ptp(ratio[[0, 2]]) < 0.01
    assert fit.shift[2] == pytest.approx(shift[2], rel=0.08)
    assert (fit.weight < 0.2).mean() == pytest.approx(0.2, abs=0.06)


def test_what_the_encoder_says_of_codes_is_their_prior():
    observations, *_ = seen()
    told = np.stack([TRUTH, np.full(3, np.log(0.01))], 1)
    observations = Observations(observations.template, observations.sigma, observations.pixels, told)
    fit = fit_anchors(prior(), observations, AnchorFitOptions(FOCAL_PX))
    assert np.abs(fit.codes - TRUTH).max() < 0.05


def test_too_few_points_are_refused():
    few = Observations(np.zeros((5, 3)), np.ones(5), np.zeros((5, 2)), np.zeros((3, 2)))
    with pytest.raises(ValueError, match="5 template points"):
        fit_anchors(prior(), few, AnchorFitOptions(FOCAL_PX))


def test_opacity_in_its_log_form_is_that_of_sigmoids():
    from export.heads.fit import log_clear

    distances = torch.tensor([[0.3, 0.1, -0.1, -0.3, 0.2]], dtype=torch.float64)
    inside = torch.sigmoid(20 * distances)
    expected = torch.clamp(inside[:, 1:] / inside[:, :-1], max=1)  # 1 - alpha of NeuS
    assert torch.allclose(log_clear(distances, 20.0).exp(), expected, atol=1e-12)


def test_faces_are_told_by_template_points():
    from export.heads.face import is_face

    assert is_face(np.array([[0.0, -1.24, -0.35], [0, 1, 0]])).tolist() == [True, False]
