"""Traced scenes: depth and labels of bodies whose edges can be written down, and what random ones must keep."""

import numpy as np
import pytest
import torch

from export.solids.ray_scenes import Convexes, drawn_scenes, labelled

CPU = torch.device("cpu")
FAR = 1e6
FOCAL_PX, SIDE_PX = 200.0, 48
MIDDLE = -(SIDE_PX - 1) / 2


def part(centre, half, axes=None, bulge=(0, 0, 0), there=True) -> dict:
    return {"centre": centre, "half": half, "axes": np.eye(3) if axes is None else axes, "bulge": bulge, "there": there}


NOTHING = part((0, 0, 0), (1, 1, 1), there=False)


def scene(*bodies) -> Convexes:
    """Each body: a part, or a part and its cutters."""
    rows = [list(body) if isinstance(body, tuple) else [body] for body in bodies]
    rows = [row + [NOTHING] * (3 - len(row)) for row in rows]

    def table(name: str) -> torch.Tensor:
        values = np.array([[np.asarray(p[name], float) for p in row] for row in rows])[None]
        return torch.tensor(values, dtype=torch.bool if name == "there" else torch.float32)

    shape = (1, len(rows), 3, 2)
    across = torch.tensor([0.0, 0, 1]).expand(*shape, 3)
    return Convexes(
        table("axes"), table("centre"), table("half"), across, torch.full(shape, FAR), table("bulge"), table("there")
    )


def seen(parts: Convexes) -> dict[str, np.ndarray]:
    crops = labelled(parts, torch.tensor([FOCAL_PX]), torch.tensor([[MIDDLE, MIDDLE]]), SIDE_PX)
    return {name: getattr(crops, name)[0].numpy() for name in ("depth", "distance", "kind", "counts")}


Y, X = (axis + MIDDLE for axis in np.mgrid[:SIDE_PX, :SIDE_PX])
WALL = part((0, 0, 12.0), (50, 50, 10.0))  # its face is 2 m away


def test_a_boards_rim_is_a_boundary_for_the_board_and_nothing_for_the_wall_behind():
    half_px = 15.0
    found = seen(scene(part((0, 0, 1.1), (half_px / FOCAL_PX, half_px / FOCAL_PX, 0.1)), WALL))
    board = (np.abs(X) < half_px) & (np.abs(Y) < half_px)
    np.testing.assert_allclose(found["depth"], np.where(board, 1.0, 2.0), rtol=1e-5)
    right = np.minimum(half_px - np.abs(X), half_px - np.abs(Y))
    np.testing.assert_allclose(found["distance"][board], right[board], atol=0.15)
    assert (found["distance"][~board] == 16).all()
    assert set(np.unique(found["kind"][board])) == {2}
    assert found["counts"].all()


def test_a_box_on_a_floor_has_creases_where_both_sides_are_seen():
    # Seen from above at 45 degrees: the floor's plane is y + z = 2, the box's foot is a line in it.
    c = np.sqrt(0.5)
    axes = np.array([[1, 0, 0], [0, c, -c], [0, c, c]])  # across, along the floor away from the camera, into the floor
    floor = part(np.array([0, 0, 2]) + 5 * axes[2], (50, 50, 5), axes)
    box = part(np.array([0, 0, 2]) - 0.05 * axes[2] - 0.5 * axes[1], (50, 0.5, 0.05), axes)
    found = seen(scene(floor, box))
    assert np.isfinite(found["distance"]).all()
    # In the column of the middle: the point nearest to the foot, in metres, against the label.
    z = found["depth"][:, SIDE_PX // 2]
    point = np.stack([0 * z, Y[:, 0] / FOCAL_PX * z, z], 1) - [0, 0, 2]
    over, along = -point @ axes[2], point @ axes[1]
    on_floor = over < 1e-3
    assert 5 < on_floor.sum() < 45
    foot = np.abs(along)[on_floor] / (z[on_floor] / FOCAL_PX)
    np.testing.assert_allclose(found["distance"][:, SIDE_PX // 2][on_floor], np.minimum(foot, 16), atol=0.2)
    near = found["distance"] < 8
    assert near.sum() > 200
    assert (found["kind"][near] == 1).mean() > 0.95


def test_a_ball_and_a_pipe_have_no_edge_at_their_silhouettes():
    ball = part((0, 0, 1.3), (FAR, FAR, FAR), bulge=(100, 100, 100))
    pipe = part((0, 0, 1.3), (FAR, FAR, FAR), bulge=(100, 0, 100))
    for body in (ball, pipe):
        found = seen(scene(body, WALL))
        assert found["depth"].min() == pytest.approx(1.2, rel=1e-3)
        assert (found["distance"] == 16).all()
        assert (found["kind"] == 0).all()


def test_a_slot_shows_its_floor_and_its_rims_are_edges_of_both_lips():
    half_px = 5.0
    slot = part((0, 0, 1.0), (half_px / FOCAL_PX, 50, 0.2))
    found = seen(scene((part((0, 0, 6.0), (50, 50, 5.0)), slot)))
    inside = np.abs(X) < half_px * 1 / 1.2 - 1
    lips = np.abs(X) > half_px + 1
    np.testing.assert_allclose(found["depth"][inside], 1.2, rtol=1e-5)
    np.testing.assert_allclose(found["depth"][lips], 1.0, rtol=1e-5)
    np.testing.assert_allclose(found["distance"][lips], np.minimum(np.abs(X) - half_px, 16)[lips], atol=0.15)
    assert (found["distance"][inside] < 16).all()


def test_random_scenes_have_finite_labels_of_all_kinds_and_other_ones_each_time():
    torch.manual_seed(2)
    crops, again = (labelled(*drawn_scenes(3, 32, CPU), 32) for _ in range(2))
    assert crops.depth.shape == (3, 32, 32)
    assert not torch.equal(crops.depth, again.depth)
    for made in (crops, again):
        assert torch.isfinite(made.depth).all()
        assert ((made.distance >= 0) & (made.distance <= 16)).all()
        assert torch.equal(made.kind > 0, made.distance < 16)
        assert not made.counts[made.depth == 0].any()
        assert (made.depth > 0).float().mean() > 0.1
    assert {0, 1, 2} <= set(torch.cat([crops.kind, again.kind]).unique().tolist())
