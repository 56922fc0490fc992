"""Exports the autoencoder of frames as fp32 ONNX graphs, compares them with torch, and writes the bundle of prediction.

    python -m export.prediction.codes                         # first: codes of clips, from which the table is counted
    python -m export.prediction.export_onnx --out .data/bundles/prediction-fp32
    python -m export.prediction.export_onnx --transformer .data/runs/prediction-transformer/weights.pt    # with it

`encoder.onnx`: image [1, 64, 64, 3], RGB, 0..255 -> features [1, 16, 16, slices * width], of which each slice is given
the number of the nearest entry. `decoder.onnx`: entries in the place of features -> image [1, 64, 64, 3].
"""

from __future__ import annotations

import argparse
import copy
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

from export.bundle import BundleInfo, bytes_of
from export.checked_file import write_whole
from export.densepose.graphs import session
from export.onnx_graphs import channels_first, channels_last, largest_difference, write_graph
from export.prediction.autoencoder import Autoencoder
from export.prediction.bundle import CELL_PX, CODES, TRAINING_DATA, TRANSFORMER, write_manifest
from export.prediction.code_file import code_bytes
from export.prediction.codes import read_codes
from export.prediction.config import CODE_SIDE
from export.prediction.export_transformer import export_transformer
from export.prediction.graphs.transformer_file import TransformerTables, transformer_bytes
from export.prediction.table import CodeTable
from export.prediction.train_autoencoder import load_autoencoder
from export.prediction.train_transformer import load_transformer
from export.prediction.transformer import LatentTransformer

TOLERANCE = 1e-4  # largest |ONNX - torch|, relative to the output's largest value
HALF_RANGE = 127.5
FRAME_PX = CODE_SIDE * CELL_PX


class EncoderGraph(nn.Module):
    """Grey is taken off before the first convolution, which pads by 0; its scale lies in the weights."""

    def __init__(self, net: Autoencoder) -> None:
        super().__init__()
        self.layers = copy.deepcopy(net.encoder)
        self.layers[0].weight.data /= HALF_RANGE

    def forward(self, image: Tensor) -> Tensor:
        return channels_last(self.layers(channels_first(image - HALF_RANGE)))


class DecoderGraph(nn.Module):
    def __init__(self, net: Autoencoder) -> None:
        super().__init__()
        self.layers = net.decoder

    def forward(self, features: Tensor) -> Tensor:
        return channels_last(self.layers(channels_first(features))) * HALF_RANGE + HALF_RANGE


@torch.no_grad()
def export_graphs(net: Autoencoder, folder: Path) -> dict[str, float]:
    """Writes both graphs; returns how far each is from torch. Raises ValueError where that is too far."""
    net = net.eval().float()
    rng = np.random.default_rng(0)
    image = torch.from_numpy(rng.uniform(0, 255, (1, FRAME_PX, FRAME_PX, 3)).astype(np.float32))
    codes = torch.from_numpy(rng.integers(net.shape.entries, size=(1, net.shape.slices, CODE_SIDE, CODE_SIDE)))
    features = channels_last(net.codebook.looked_up(codes))
    expected = {
        "encoder": channels_last(net.encoder(channels_first(image / HALF_RANGE - 1))),
        "decoder": net.decode(codes),
    }
    found = {}
    for name, graph, given, inside, outside in (
        ("encoder", EncoderGraph(net), image, "image", "features"),
        ("decoder", DecoderGraph(net), features, "features", "image"),
    ):
        path = folder / f"{name}.onnx"
        write_graph(graph, [given], path, [inside], [outside])
        (made,) = session(path).run([outside], {inside: given.numpy()})
        found[name] = largest_difference(expected[name].numpy(), made)
        if not found[name] <= TOLERANCE:
            raise ValueError(f"{path} differs from torch by {found[name]:.1e} of its largest value.")
    return found


def export_bundle(
    net: Autoencoder,
    table: CodeTable,
    folder: Path,
    info: BundleInfo,
    transformer: LatentTransformer | None = None,
) -> dict[str, float]:
    """The whole bundle; returns how far each part is from torch. Raises ValueError where that is too far. table: the
    transformer's own, where there is one."""
    folder.mkdir(parents=True, exist_ok=True)
    differences = export_graphs(net, folder)
    (folder / TRANSFORMER).unlink(missing_ok=True)  # of an earlier export
    if transformer is not None:
        differences["transformer"] = export_transformer(transformer, folder)
        write_whole(transformer_bytes(TransformerTables.of(transformer)), folder / TRANSFORMER)
    entries = net.codebook.entries.numpy()
    write_whole(code_bytes(entries, table.frequency.numpy(), table.after.numpy(), CODE_SIDE), folder / CODES)
    write_manifest(folder, info)
    return differences


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--autoencoder", type=Path, default=Path(".data/runs/prediction-autoencoder/weights.pt"))
    parser.add_argument(
        "--codes", type=Path, default=Path(".data/prediction"), help="folder of export.prediction.codes"
    )
    parser.add_argument("--transformer", type=Path, help="its weights, whose table is taken; default: without one")
    parser.add_argument("--out", type=Path, default=Path(".data/bundles/prediction-fp32"))
    parser.add_argument("--name", help="default: the folder's name")
    options = parser.parse_args()
    if not options.autoencoder.exists():
        parser.error(f"{options.autoencoder} does not exist. Train it: python -m export.prediction.train_autoencoder")
    net = load_autoencoder(options.autoencoder)
    transformer = load_transformer(options.transformer) if options.transformer else None
    if transformer is None:
        table = CodeTable.counted(read_codes(options.codes, "train").codes, net.shape.entries)
    else:
        table = CodeTable.of_stacked(transformer.table)
    info = BundleInfo(options.name or options.out.name, "fp32", training_data=TRAINING_DATA)
    for name, difference in export_bundle(net, table, options.out, info, transformer).items():
        print(f"{name}: within {difference:.1e} of torch")
    print(f"{options.out}: {bytes_of(options.out) / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
