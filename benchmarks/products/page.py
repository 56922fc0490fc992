"""The page docs/research/products.md: the table, the figure, where others are better, and how it was measured."""

from __future__ import annotations

from benchmarks import provenance
from benchmarks.products.rows import SECTIONS, Row, compared, losses, rows_of
from benchmarks.products.running import NO_MASKS

COMMAND = "python -m benchmarks.products"
FIGURE = "products.png"

_HOW = """\
## How to read it

- **Labels of the photographs** come from other networks (`export.teachers`): boxes from an SSD detector; masks,
  landmarks and sides from MediaPipe's heavy pose network and its selfie segmenter. Rows with \\* flatter MediaPipe: it
  made these labels. People whom it could not label have no landmarks there.
- *People found* in photographs flatters Maquette: its networks learnt from labels of the same detector, for other
  photographs. None of these photographs was trained on. Settings of Maquette were chosen on the test set, none on the
  fresh set.
- **Clips are rendered**, so their truth is exact. They favour Maquette: its networks were trained on such renderings,
  of other bodies, clothes and motions.
- *People whom all find*: the same people for all products, those whom each of them finds in that image. They are the
  easier ones. In rows with *missed people*, a person who is not found counts as wrong.
- A person is found if the boxes overlap by an IoU of 0.5. MediaPipe gives no boxes: its box is that of the largest
  region of its mask. The row by mask IoU needs no boxes.
- *Limb joints* are elbows, wrists, knees and ankles. Shoulders and hips have other definitions in MediaPipe. Maquette
  learnt the definitions of the clips, which favours it in that row.
- Jitter is the change of the error from one frame to the next, of joints that the image shows.
- MediaPipe gives no ids. Its position in the list of people is used as one.
- MediaPipe runs with `num_poses` 10 and its default thresholds, photographs in the mode for images, clips in the mode
  for video. The task files of lite and heavy are packed from the networks of `@mediapipe/pose`. That of full is
  Google's.
- *heavy, detector 0.2* has a lower threshold of the detector than the default of 0.5. It finds more people, and more
  false ones.
- *MediaPipe selfie* is the selfie segmenter, which gives one mask for all people. It finds no single people, so it
  competes in one row alone.
- Maquette always computes the surface (part, U, V), which no other product here has. It computes keypoints here, too.
- Each product runs in a process of its own{network}. One computes at a time. They alternate by windows of 25 frames,
  of which the first 5 do not count, or by photographs; medians. Processes are bound to one core or to two.
  Maquette has as many threads as cores. MediaPipe's Python API has no setting for threads.
- A frame takes less time where fewer people are found: compare the rows *people found in these frames*.
- The library of MediaPipe is its Python package without the packages that it needs (OpenCV, matplotlib, numpy). Ours is
  the library, ONNX Runtime and the Python package without numpy and cffi.
"""


def page(document: dict) -> str:
    rows = rows_of(document)
    products = document["products"]
    machine = document["machine"]
    versions = ", ".join(dict.fromkeys(own["version"] for own in products.values()))
    library = ", ".join(sorted({stamp["library"] for stamp in document["provenance"].values()}))
    lines = [
        "# Maquette beside MediaPipe",
        "",
        f"Written by `{COMMAND} --publish`. {provenance.sentence(document['provenance'])}",
        f"The library was built from commit {library}.",
        f"{versions}. {machine['processor']}, {machine['cores']} cores.",
        "",
        *_data(document),
        "",
        *table(rows, products),
        "",
    ]
    if "times" in document:
        lines += [f"![Error against time of all products](../images/{FIGURE})", ""]
        lines += [f"Warning: {text}." for text in document["times"]["warnings"]] + [""]
    else:
        lines += ["Times are not measured yet.", ""]
    lines += ["## Where MediaPipe is better", "", *(f"- {line}" for line in losses(rows, products)), ""]
    network = " without a network" if document["network_cut_off"] else ""
    return "\n".join(lines) + "\n" + _HOW.format(network=network)


def _data(document: dict) -> list[str]:
    lines = []
    if "photographs" in document:
        first = next(iter(document["photographs"]["products"].values()))
        counts = [f"{own['photos']} ({name}, {own['people']} people)" for name, own in first["sets"].items()]
        lines.append(
            f"Photographs with people: {', '.join(counts)}. Without people: {first['empty_photos']}, of animals "
            f"{first['animal_photos']}. All find {first['common_people']} of {first['people']} people."
        )
    if "clips" in document:
        own = document["clips"]
        first = next(iter(own["products"].values()))
        lines.append(
            f"Clips: {own['clips']} of {own['frames']} frames, with {first['people']} people to find, of whom all find "
            f"{first['common_people']}."
        )
    return lines


def table(rows: list[Row], products: dict[str, dict]) -> list[str]:
    """Lines of Markdown. The best product of a row is bold, as are its equals."""
    names = [name for name in products if not name.endswith(NO_MASKS)]
    lines = ["| | " + " | ".join(names) + " |", "| --- |" + " --- |" * len(names)]
    for section in SECTIONS:
        own = [row for row in rows if row.section == section]
        if own:
            lines.append(f"| **{section}** |" + " |" * len(names))
        for row in own:
            best = row.best(compared(row, products))
            cells = [f"**{row.shown(name)}**" if row.equals(name, best) else row.shown(name) for name in names]
            lines.append(f"| {row.marked_title} | " + " | ".join(cells) + " |")
    return lines
