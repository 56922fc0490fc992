"""The two files of a sprite sheet, read back."""

import cv2
import numpy as np

from export.people.sprite_files import KIND, ONE, ORDER, RATE_BITS, extended_colours, write_sheet


def decoded_mask(coded: bytes, rows: int, columns: int) -> np.ndarray:
    """Alpha of a mask, read as sdk/src/sources/synthetic/people_sheet.cpp does."""
    low, high, value, position = 0, 0xFFFFFFFF, int.from_bytes(coded[:4], "big"), 4
    probabilities = np.full((5, 5, 3, 3, len(ORDER)), ONE // 2, int)
    quarters = np.zeros((rows + 1, columns + 2), int)
    for y in range(1, rows + 1):
        for x in range(1, columns + 1):
            beside, above = quarters[y, x - 1], quarters[y - 1, x - 1 : x + 2]
            chances = probabilities[beside, above[1], KIND[above[0]], KIND[above[2]]]
            quarters[y, x] = 3
            for i, answer in enumerate(ORDER):
                middle = low + ((high - low) * int(chances[i]) >> 16)
                yes = value <= middle
                low, high = (low, middle) if yes else (middle + 1, high)
                chances[i] += (ONE - chances[i]) >> RATE_BITS if yes else -(chances[i] >> RATE_BITS)
                while low >> 24 == high >> 24:
                    low, high = (low << 8) & 0xFFFFFFFF, (high << 8) & 0xFFFFFFFF | 0xFF
                    value = (value << 8) & 0xFFFFFFFF | coded[position]
                    position += 1
                if yes:
                    quarters[y, x] = answer
                    break
    assert position == len(coded)
    return (quarters[1:, 1:-1] * 255 + 2) // 4


def discs(seed: int) -> np.ndarray:
    random = np.random.default_rng(seed)
    large = np.zeros((128, 256), np.uint8)
    for x, y, radius in random.integers((0, 0, 5), (256, 128, 30), (8, 3)):
        cv2.circle(large, (int(x), int(y)), int(radius), 255, -1)
    alpha = large.reshape(64, 2, 128, 2).mean((1, 3)).round().astype(np.uint8)
    return np.dstack([random.integers(0, 256, (64, 128, 3), dtype=np.uint8), alpha])


def test_alpha_in_quarters_comes_back_without_loss(tmp_path):
    empty, full = np.zeros((4, 8, 4), np.uint8), np.full((8, 4, 4), 255, np.uint8)
    for seed, sheet in enumerate([discs(1), discs(2), empty, full]):
        path = tmp_path / f"{seed}.jpg"
        size_bytes = write_sheet(sheet, path, 90)
        mask = path.with_suffix(".mask").read_bytes()
        assert size_bytes == path.stat().st_size + len(mask)
        assert np.array_equal(decoded_mask(mask, *sheet.shape[:2]), sheet[..., 3])


def test_noise_is_coded_too(tmp_path):
    alpha = np.random.default_rng(0).choice([0, 64, 128, 191, 255], (32, 64)).astype(np.uint8)
    write_sheet(np.dstack([alpha] * 4), tmp_path / "noise.jpg", 50)
    assert np.array_equal(decoded_mask((tmp_path / "noise.mask").read_bytes(), 32, 64), alpha)


def test_colours_are_kept_where_something_is_covered_and_smooth_elsewhere():
    sheet = discs(3)
    colours = extended_colours(sheet)
    assert np.array_equal(colours[sheet[..., 3] > 0], sheet[sheet[..., 3] > 0][:, :3])
    outside = cv2.erode((sheet[..., 3] == 0).astype(np.uint8), np.ones((5, 5))) > 0
    steps = np.abs(np.diff(colours.astype(int), axis=1)).max(2)
    assert steps[outside[:, 1:]].mean() < 10 < np.abs(np.diff(sheet[..., :3].astype(int), axis=1)).mean()
