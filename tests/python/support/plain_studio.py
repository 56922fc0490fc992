"""A studio of rendered people with stand-ins for what only the large packages hold: clips, the game's fabrics, skin,
photos. What it draws depends on nothing but the job, in any process."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from unittest.mock import patch

import cv2
import numpy as np

WIDTH, HEIGHT = 160, 256  # of the renderer in conftest.py


@contextmanager
def plain_studio(folder: Path) -> Iterator:
    """folder: for its few images."""
    from export.people import scene
    from export.people.motion import Clips, drawn_pose
    from export.people.wardrobe import Fabrics

    rng = np.random.default_rng(5)
    (folder / "backgrounds" / "val").mkdir(parents=True)
    (folder / "panoramas" / "val").mkdir(parents=True)
    np.save(folder / "panoramas" / "val" / "noise.npy", rng.uniform(0, 2, (64, 128, 3)).astype(np.float16))
    for k in range(4):
        coarse = rng.integers(0, 255, (9, 12, 3), np.uint8)
        cv2.imwrite(
            str(folder / "backgrounds" / "val" / f"{k}.jpg"),
            cv2.resize(coarse, (640, 480), interpolation=cv2.INTER_CUBIC),
        )
    cv2.imwrite(str(folder / "skin.png"), np.full((64, 64, 3), (110, 140, 190), np.uint8))
    poses = [drawn_pose(rng) for _ in range(24)]
    clips = Clips(
        *(np.stack([getattr(p, key) for p in poses]) for key in ("root", "chest", "limbs")), np.arange(24) < 8
    )

    class FewFabrics(Fabrics):
        def __init__(self, split, photos, bare=False):
            self.bare, self.photos, self.tiles = bare, photos, rng.integers(0, 255, (6, 256, 256, 3), np.uint8)

    with (
        patch.object(scene, "load_clips", lambda split: clips),
        patch.object(scene, "Fabrics", FewFabrics),
        patch.object(scene.assets, "skin_texture", lambda: folder / "skin.png"),
    ):
        yield scene.Studio("val", WIDTH, HEIGHT, folder, points=True)
