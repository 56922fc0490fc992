"""Writes the measured values of sampled frames as sentences and tables."""

from __future__ import annotations

from collections.abc import Sequence

Table = list[list[str]]


def sampling_tables(document: dict) -> list[str | Table]:
    """Returns sentences and tables of a document of measure_images(), and of times under "times_ms"."""
    ahead = [str(k) for k in document["ahead"]]
    ratios = document["frechet"]
    parts: list[str | Table] = [
        f"Sampled by the transformer: {document['made']} frames after {document['given']} given ones of each of "
        f"{document['clips']} clips. PSNR in dB by frames ahead; best: the best of N samples for each frame.",
        _table(["", *ahead], document["psnr_db"], 2),
        "Rank correlation (Spearman) of the uncertainty and the error of the cells of a frame, by frames ahead.",
        _table(["", *ahead, "all"], document["rank"], 2),
        "Fifths of all cells, the most certain first: bits of a code (or change in grey levels), and error in grey "
        "levels (root mean square).",
        [["", "most certain", "", "", "", "least certain"]]
        + [
            [name, *(f"{bits:.2f}: {error:.1f}" for bits, error in rows)]
            for name, rows in document["reliability"].items()
        ],
        "Fréchet distance from the true clips as a ratio of the last frame's, by the detector's features of frames, "
        "and by their changes from frame to frame. FVD is not used, because its network is not free.",
        _table(
            ["", *ratios], {name: [own[name] for own in ratios.values()] for name in next(iter(ratios.values()))}, 2
        ),
    ]
    if "gain_db" in document:  # an older document has none
        parts.append("Mean gain 5 to 11 frames ahead over the better of the last frame and motion, dB.")
        parts.append(_table(["", "dB"], {name: [own] for name, own in document["gain_db"].items()}, 2))
    if "times_ms" in document:
        parts.append("Times of sampling, ms.")
        parts.append(_table(["", "ms"], {name: [own] for name, own in document["times_ms"].items()}, 1))
    return parts


def _table(title: list[str], rows: dict[str, Sequence[float]], digits: int) -> Table:
    return [title, *([name, *(f"{value:.{digits}f}" for value in own)] for name, own in rows.items())]
