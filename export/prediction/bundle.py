"""A bundle for prediction (docs/reference/formats.md): the graphs that encode and decode frames, the codes with their
entries and probabilities, and the transformer if it has one."""

from __future__ import annotations

from pathlib import Path

from export import data_sources as sources
from export.bundle import BundleInfo, Signature, signature_of
from export.bundle import write_manifest as write_bundle_manifest
from export.prediction.code_file import FrameCodes, read_code_file
from export.prediction.graphs.transformer_file import TransformerTables, read_transformer_file
from export.prediction.graphs.transformer_graphs import CONTEXT, SLICES, head_name

GRAPHS = ("encoder", "decoder")
CODES, TRANSFORMER = "codes.maqc", "transformer.maqr"
TRAINED_FPS = (10, 30)  # of the clips that transformers were trained on
CELL_PX = 4  # pixels of a cell, both ways
TRAINING_DATA = (
    sources.RENDERED_CLIPS.used_for("training, calibration"),
    sources.BACKGROUNDS.used_for("training of the autoencoder, collages"),
    sources.PANDA_ARM.used_for("rendering"),
    sources.KUKA_ARM.used_for("rendering"),
)


def frame_side(graphs: dict[str, Signature], slices: int, width: int, side: int) -> int:
    """Side of a frame in pixels. Raises ValueError where graphs and codes do not belong together."""
    shapes = {
        name: [list(s) for way in ("inputs", "outputs") for s in graph[way].values()] for name, graph in graphs.items()
    }
    frame, features = [1, side * CELL_PX, side * CELL_PX, 3], [1, side, side, slices * width]
    if shapes != {"encoder": [frame, features], "decoder": [features, frame]}:
        raise ValueError(
            f"The graphs have {shapes}; codes of {slices} x {width} numbers at {side} x {side} places ask for frames "
            f"{frame} and features {features}."
        )
    return frame[1]


def write_manifest(folder: Path, info: BundleInfo) -> dict:
    """Writes `manifest.json` for the graphs, `codes.maqc` and the optional `transformer.maqr` in `folder`, and
    returns it. Raises ValueError where these files do not belong together."""
    codes = read_code_file(folder / CODES)
    graphs = {name: signature_of(folder / f"{name}.onnx") for name in GRAPHS}
    slices, _, width = codes.entries.shape
    keys: dict[str, object] = {"frame_px": frame_side(graphs, slices, width, codes.side), "codes": {"file": CODES}}
    files = [CODES]
    if (folder / TRANSFORMER).exists():
        tables = read_transformer_file(folder / TRANSFORMER)
        graphs |= {name: signature_of(folder / f"{name}.onnx") for name in transformer_graphs(slices)}
        require_transformer(graphs, tables, codes)
        keys["transformer"] = {"file": TRANSFORMER, "fps": list(TRAINED_FPS)}
        files.append(TRANSFORMER)
    return write_bundle_manifest(folder, "prediction", info, graphs, files=files, task_keys=keys)


def transformer_graphs(slices: int) -> list[str]:
    return [CONTEXT, SLICES, *(head_name(k) for k in range(slices))]


def require_transformer(graphs: dict[str, Signature], tables: TransformerTables, codes: FrameCodes) -> None:
    """Raises ValueError where graphs and tables are of other sizes than each other, or than the codes."""
    slices, entries, _ = codes.entries.shape
    places, width = codes.side**2, tables.earlier[-1][0].shape[1]
    found = len(tables.earlier), len(tables.slice_rows), graphs[CONTEXT]["outputs"].get("context")
    wanted = slices, slices * entries, [1, places, width]
    if found != wanted:
        raise ValueError(f"The transformer has {found} slices, rows and features; the codes ask for {wanted}.")
    for name, channels in ((SLICES, "features"), *((head_name(k), "features") for k in range(slices))):
        of_graph = {**graphs[name]["inputs"], **graphs[name]["outputs"]}[channels][-1]
        if of_graph != width:
            raise ValueError(f"{name} has features of {of_graph} numbers; the tables have {width}.")
