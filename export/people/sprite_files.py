"""A sheet of sprites as the two files that libmaquette embeds: colours, and how much of each pixel is covered.

`NAME.jpg` holds the colours, continued smoothly into pixels that nothing covers, so that no edge costs bytes there.
`NAME.mask` holds alpha without loss, in quarters, which is what the renderer's 2 x 2 samples give: each value coded
given its neighbours by adaptive binary arithmetic coding (Witten, Neal and Cleary 1987, "Arithmetic coding for data
compression"). Its reader is sdk/src/sources/synthetic/people_sheet.cpp, which does the same steps.
"""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

ORDER = (0, 4, 1, 2)  # a value is asked for in this order: is it 0, is it 4, is it 1, is it 2; otherwise it is 3
KIND = (0, 1, 1, 1, 2)  # of a value: nothing, a part, all
ONE = 1 << 16  # a probability of 1
RATE_BITS = 5  # a probability moves 1/32 of the way to what came


def extended_colours(bgra: np.ndarray) -> np.ndarray:
    """The colours, rows x columns x 3, with those of pixels of alpha 0 interpolated from the others near them."""
    weight = (bgra[..., 3] > 0).astype(np.float32)
    sums = [(bgra[..., :3] * weight[..., None], weight)]
    while min(sums[-1][1].shape) > 1:
        rows, columns = (side // 2 for side in sums[-1][1].shape)
        colour, weight = (part.reshape(rows, 2, columns, 2, -1).sum((1, 3)) for part in sums[-1])
        sums.append((colour, weight[..., 0]))
    filled = np.zeros((1, 1, 3), np.float32)
    for colour, weight in reversed(sums):
        coarser = cv2.resize(filled, weight.shape[::-1], interpolation=cv2.INTER_LINEAR).reshape(colour.shape)
        filled = np.where(weight[..., None] > 0, colour / np.maximum(weight, 1)[..., None], coarser)
    return np.clip(np.rint(filled), 0, 255).astype(np.uint8)


def coded_mask(alpha: np.ndarray) -> bytes:
    """`alpha`, rows x columns of 0 to 255, rounded to quarters and coded."""
    coded = bytearray()
    low, high = 0, 0xFFFFFFFF
    probabilities = [ONE // 2] * (5 * 5 * 3 * 3 * len(ORDER))  # that the answer is yes, by context
    above = [0] * (alpha.shape[1] + 2)
    for row in np.pad((alpha.astype(int) * 4 + 127) // 255, ((0, 0), (1, 1))).tolist():
        for x in range(1, len(row) - 1):
            context = ((row[x - 1] * 5 + above[x]) * 3 + KIND[above[x - 1]]) * 3 + KIND[above[x + 1]]
            for i, value in enumerate(ORDER, context * len(ORDER)):
                middle = low + ((high - low) * probabilities[i] >> 16)
                if row[x] == value:
                    high = middle
                    probabilities[i] += (ONE - probabilities[i]) >> RATE_BITS
                else:
                    low = middle + 1
                    probabilities[i] -= probabilities[i] >> RATE_BITS
                while (low ^ high) >> 24 == 0:
                    coded.append(low >> 24)
                    low, high = (low << 8) & 0xFFFFFFFF, (high << 8) & 0xFFFFFFFF | 0xFF
                if row[x] == value:
                    break
        above = row
    return bytes(coded) + low.to_bytes(4, "big")


def write_sheet(bgra: np.ndarray, jpeg: Path, quality: int) -> int:
    """Writes `jpeg`, and the mask beside it; returns the bytes of both."""
    jpeg.parent.mkdir(parents=True, exist_ok=True)
    options = [cv2.IMWRITE_JPEG_QUALITY, quality, cv2.IMWRITE_JPEG_OPTIMIZE, 1]
    if not cv2.imwrite(str(jpeg), extended_colours(bgra), options):
        raise OSError(f"{jpeg} cannot be written.")
    mask = jpeg.with_suffix(".mask")
    mask.write_bytes(coded_mask(bgra[..., 3]))
    return jpeg.stat().st_size + mask.stat().st_size
