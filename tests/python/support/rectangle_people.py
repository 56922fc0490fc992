"""Training shards of people made of rectangles: every part one colour, U and V rising through it."""

from pathlib import Path

import numpy as np

from export.shards import ShardWriter

# Part number: x0, y0, x1, y1 in shares of the person's box. What is not covered is background.
BODY = {
    23: (0.35, 0.0, 0.5, 0.2),
    24: (0.5, 0.0, 0.65, 0.2),
    2: (0.25, 0.2, 0.75, 0.55),
    22: (0.0, 0.2, 0.25, 0.5),
    21: (0.75, 0.2, 1.0, 0.5),
    9: (0.25, 0.55, 0.5, 1.0),
    10: (0.5, 0.55, 0.75, 1.0),
}


def picture(rng: np.random.Generator, width=192, height=160, people=2) -> tuple[np.ndarray, np.ndarray]:
    """BGR uint8 [H, W, 3] and label uint8 [H, W, 4] = (I, U*255, V*255, instance)."""
    image = rng.integers(90, 130, (height, width, 3), np.uint8)
    label = np.zeros((height, width, 4), np.uint8)
    for number in range(1, people + 1):
        tall = int(rng.integers(height // 2, height - 10))
        wide = tall // 2
        left, top = int(rng.integers(0, width - wide)), int(rng.integers(0, height - tall))
        for part, share in BODY.items():
            x0, x1 = (left + round(s * wide) for s in share[::2])
            y0, y1 = (top + round(s * tall) for s in share[1::2])
            image[y0:y1, x0:x1] = ((part * 67) % 256, (part * 131) % 256, 255 if part > 12 else 0)
            label[y0:y1, x0:x1, 0] = part
            label[y0:y1, x0:x1, 1] = np.linspace(0, 255, x1 - x0)[None]
            label[y0:y1, x0:x1, 2] = np.linspace(0, 255, y1 - y0)[:, None]
            label[y0:y1, x0:x1, 3] = number
    return image, label


def write_shard(folder: Path, images: int, seed: int = 0) -> None:
    """Writes `folder/shard-00000.npz` with what training reads (docs/reference/formats.md)."""
    rng = np.random.default_rng(seed)
    folder.mkdir(parents=True)
    shard = ShardWriter(boxes=False)
    for k in range(images):
        shard.add(*picture(rng, people=1 + k % 2), jpeg_quality=95)
    shard.write(folder / "shard-00000.npz", {})
