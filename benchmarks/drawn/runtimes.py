"""The graphs of prediction in other runtimes, measured alternately: how fast is ours beside them?

    python -m benchmarks.drawn.runtimes --threads 1

Encoder, decoder and the network that mends as float graphs of torch's weights, and as int8 graphs of the shipped
bundle; the context of the transformer, its slices for all places at once, and a head in int8 alone. Inputs are random.
PyTorch runs the float networks as they were trained. How rounds are timed, and when a runtime is struck out:
benchmarks/peers.py.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
import onnxruntime
import torch

from benchmarks.peers import (
    Peer,
    Runner,
    compare_outputs,
    maquette_runs,
    openvino_runs,
    print_table,
    rows_of,
    time_alternately,
)
from benchmarks.prediction import BUNDLE
from export.prediction.export_onnx import DecoderGraph, EncoderGraph, export_graphs
from export.prediction.pictures.mended_graph import MENDED, MendedGraph, export_mended
from export.prediction.pictures.train_convolutional import load_convolutional
from export.prediction.train_autoencoder import load_autoencoder

Feed = dict[str, np.ndarray]
PICTURES = ("encoder", "decoder", MENDED)
CODES = ("context", "slices", "head_0")
# Of a pass over all places of a frame; a graph of slices keeps no keys from before then.
FREE = {"samples": 1, "rows": 256, "kept": 0, "kept_and_rows": 256}


def feeds_of(folder: Path, names: tuple[str, ...]) -> dict[str, Feed]:
    """Random inputs of each graph: grey levels where it sees pictures."""
    rng, feeds = np.random.default_rng(0), {}
    for name in names:
        graph = onnxruntime.InferenceSession(folder / f"{name}.onnx", providers=["CPUExecutionProvider"])
        feeds[name] = {
            i.name: (128 + 60 * rng.standard_normal([FREE.get(n, n) for n in i.shape])).clip(0, 255).astype(np.float32)
            if i.name in ("image", "pictures")
            else rng.standard_normal([FREE.get(n, n) for n in i.shape]).astype(np.float32)
            for i in graph.get_inputs()
        }
    return feeds


def torch_runs(modules: dict[str, torch.nn.Module], feeds: dict[str, Feed], threads: int) -> dict[str, Runner]:
    torch.set_num_threads(threads)
    runs = {}
    for name, module in modules.items():
        inputs = [torch.from_numpy(value) for value in feeds[name].values()]
        found: list[torch.Tensor] = []

        def run(module=module, inputs=inputs, found=found) -> None:
            with torch.inference_mode():
                found[:] = [module(*inputs)]

        runs[name] = Runner(run, lambda found=found: [x.numpy() for x in found])
    return runs


def measure(int8: Path, autoencoder: Path, mender: Path, threads: int, rounds: int) -> list[dict]:
    """A row a runtime and precision, as of benchmarks.peers."""
    net, mending = load_autoencoder(autoencoder).float().eval(), load_convolutional(mender).float().eval()
    feeds = feeds_of(int8, PICTURES + CODES)
    of_pictures = {name: feeds[name] for name in PICTURES}
    with tempfile.TemporaryDirectory() as folder:
        export_graphs(net, Path(folder))
        export_mended(mending, Path(folder))
        modules = {"encoder": EncoderGraph(net), "decoder": DecoderGraph(net), MENDED: MendedGraph(mending)}
        made = [
            ("Maquette", "int8", lambda: maquette_runs(int8, feeds, threads)),
            ("Maquette", "fp32", lambda: maquette_runs(Path(folder), of_pictures, threads)),
            ("OpenVINO", "int8", lambda: openvino_runs(int8, feeds, threads)),
            ("OpenVINO", "fp32", lambda: openvino_runs(Path(folder), of_pictures, threads)),
            ("PyTorch", "fp32", lambda: (torch.__version__.split("+")[0], torch_runs(modules, of_pictures, threads))),
        ]
        peers = []
        for name, precision, make in made:
            peer = Peer(name, "", precision)
            try:
                peer.version, peer.runs = make()
            except ImportError as error:
                peer.missing = f"not installed ({error.name}); scripts/make-venv.sh train,bench installs it"
            peers.append(peer)
        compare_outputs(peers)
        time_alternately(peers, rounds, block=7)
    return rows_of(peers)


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.drawn.runtimes",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--bundle", type=Path, default=BUNDLE)
    parser.add_argument("--autoencoder", type=Path, default=Path("export/weights/prediction-autoencoder.pt"))
    parser.add_argument("--mender", type=Path, default=Path("export/weights/prediction-mender.pt"))
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--rounds", type=int, default=15)
    options = parser.parse_args()
    rows = measure(options.bundle, options.autoencoder, options.mender, options.threads, options.rounds)
    print_table({"runtimes": rows}, PICTURES + CODES)


if __name__ == "__main__":
    main()
