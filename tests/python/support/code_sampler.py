"""Codes drawn by their logits, in numpy: the reference for `sdk/src/prediction/transformer/code_sampler.h`, which gives
the same codes of equal logits. Whole numbers are counted; of floats each operation is rounded by itself."""

from __future__ import annotations

import numpy as np

_WORDS = 1 << 32
_UNIT = np.float32(1 << 30)  # the weight of the likeliest
F = np.float32


def philox(counter: tuple[int, int, int, int], seed: int) -> tuple[int, int, int, int]:
    """Philox4x32-10 (Salmon, Moraes, Dror, Shaw, SC 2011)."""
    key = [seed % _WORDS, seed >> 32]
    for _ in range(10):
        first, second = 0xD2511F53 * counter[0], 0xCD9E8D57 * counter[2]
        counter = (
            second >> 32 ^ counter[1] ^ key[0], second % _WORDS, first >> 32 ^ counter[3] ^ key[1], first % _WORDS,
        )  # fmt: skip
        key = [(key[0] + 0x9E3779B9) % _WORDS, (key[1] + 0xBB67AE85) % _WORDS]
    return counter


def exp_of_negative(x: np.ndarray) -> np.ndarray:
    """exp(x) for float32 from -87 to 0 within 3e-7 of its value: `sdk/src/core/simd_clones.h`."""
    rounds = F(12582912)
    scaled = x * F(1.44269504)
    whole = (scaled + rounds) - rounds
    rest = (scaled - whole) * F(0.69314718)
    total = np.full_like(x, F(1) / F(720))
    for factor in (F(1) / F(120), F(1) / F(24), F(1) / F(6), F(0.5), F(1), F(1)):
        total = total * rest + factor
    return total * ((whole.astype(np.int32) + 127) << 23).view(np.float32)


def drawn_code(
    logits: np.ndarray, temperature: float, seed: int, stream: int, frame: int, sample: int, place: int, slice_: int
) -> int:
    """One of finite float32 logits [K] at a finite temperature above 0."""
    below = np.maximum((logits - logits.max()) / F(temperature), F(-87))
    weights = (exp_of_negative(below) * _UNIT).astype(np.int64)
    words = philox((place, frame, stream, sample << 16 | slice_), seed)
    random = (words[0] << 32 | words[1]) >> 11
    at = min(int(float(random) * 2.0**-53 * float(weights.sum())), int(weights.sum()) - 1)
    return int(np.searchsorted(np.cumsum(weights), at, side="right"))
