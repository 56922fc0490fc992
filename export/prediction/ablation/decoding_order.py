"""In which order the parallel transformer should decode a frame, and in how many passes.

    python -m export.prediction.codes                           # first: codes of clips
    python -m export.prediction.ablation.decoding_order         # some minutes

A pass gives all codes; those of some places are taken as known for the next. `confidence`: the places of whose
likeliest codes the network is surest (MaskGIT, arXiv 2202.04200). `raster`: blocks of rows. `subscaling` (1, 2, 2):
every other place of every other row first, as the Latent Video Transformer has it (each of the four parts again in
blocks where there are more passes; two parts at once where there are two).

Prints by order and passes, for each time ahead: bits a code (exact: each code given those of the passes before), and
PSNR in dB of what the likeliest codes show.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional as F
from tqdm import tqdm

from export.prediction.attention import PLACES
from export.prediction.codes import CodedClips, read_codes
from export.prediction.config import CODE_SIDE
from export.prediction.data import Clips, read_clips
from export.prediction.motion_pictures import HORIZONS
from export.prediction.parallel import ParallelTransformer, times_ahead
from export.prediction.pictures.picture_error import psnr_db
from export.prediction.train_autoencoder import load_autoencoder
from export.prediction.train_parallel import load_parallel
from export.prediction.train_transformer import Examples, examples

ORDERS = ("confidence", "raster", "subscaling")
PASSES = (1, 2, 4, 8, 12)


def fixed_groups(order: str, passes: int) -> list[np.ndarray]:
    """Numbers of the places that each pass makes known, in turn, of an order that no network decides. Raises ValueError
    for another order."""
    places = np.arange(PLACES)
    if order == "raster":
        return np.array_split(places, passes)
    if order != "subscaling":
        raise ValueError(f"{order} is not an order that is known beforehand.")
    row, column = np.divmod(places, CODE_SIDE)
    # Each part lies as far as it can from those before it.
    parts = [places[(row % 2 == a) & (column % 2 == b)] for a, b in ((0, 0), (1, 1), (0, 1), (1, 0))]
    if passes < len(parts):
        return [np.sort(np.concatenate(own)) for own in np.array_split(np.array(parts), passes)]
    return [block for own in parts for block in np.array_split(own, passes // len(parts))]


class Decoder:
    """Frames [B] after `before`, of which the context network is asked once."""

    def __init__(self, net: ParallelTransformer, before: Tensor, times: Tensor) -> None:
        self.net, self.context = net, net.context(before, times)

    def features(self, codes: Tensor, known: Tensor) -> Tensor:
        """codes [B, slices, 256], known bool [B, 256] -> [B, 256, width], normalised."""
        square = (CODE_SIDE, CODE_SIDE)
        return self.net.heads.norm(
            self.net.slices(self.context, codes.unflatten(2, square), known.unflatten(1, square))
        )

    def likeliest(self, features: Tensor) -> tuple[Tensor, Tensor]:
        """Slice after slice: codes [B, slices, 256], and the logarithm of their probability [B, 256]."""
        chosen: list[Tensor] = []
        sure = torch.zeros(features.shape[:2])
        for k in range(self.net.shape.slices):
            best = self.net.heads.slice_logits(features, k, chosen).float().log_softmax(-1).max(-1)
            sure = sure + best.values
            chosen.append(best.indices)
        return torch.stack(chosen, 1), sure


def surest(sure: Tensor, known: Tensor, passes_left: int) -> Tensor:
    """Which places [B, 256] to take as known next: as many in each frame, those of the largest `sure` not known yet."""
    count = math.ceil(int((~known[0]).sum()) / passes_left)
    at = sure.masked_fill(known, -math.inf).topk(count, 1).indices
    return torch.zeros_like(known).scatter_(1, at, True)


@torch.no_grad()
def decoded(
    net: ParallelTransformer, before: Tensor, times: Tensor, order: str, passes: int, true: Tensor | None = None
) -> tuple[Tensor, Tensor]:
    """Codes int64 [B, slices, 16, 16] and bits a code [B]: of the likeliest codes, or of `true` ones, which are then
    those that are known."""
    decoder = Decoder(net, before, times)
    codes = torch.zeros_like(before[:, 0]).flatten(2) if true is None else true.flatten(2)
    known = torch.zeros(codes.shape[0], PLACES, dtype=torch.bool)
    groups = None if order == "confidence" else fixed_groups(order, passes)
    bits = torch.zeros(len(codes))
    for number in range(passes):
        features = decoder.features(codes, known)
        best, sure = decoder.likeliest(features)
        if groups is None:
            new = surest(sure, known, passes - number)
        else:
            new = torch.zeros_like(known)
            new[:, torch.from_numpy(groups[number])] = True
        if true is None:
            codes = torch.where(new[:, None], best, codes)
        earlier = list(codes.unbind(1))
        logits = [net.heads.slice_logits(features, k, earlier[:k]).float() for k in range(len(earlier))]
        nats = torch.stack(
            [F.cross_entropy(own.mT, codes[:, k], reduction="none") for k, own in enumerate(logits)], 1
        )  # fmt: skip
        bits += (nats * new[:, None]).sum((1, 2)) / math.log(2)
        known = known | new
    return codes.unflatten(2, (CODE_SIDE, CODE_SIDE)), bits / codes[0].numel()


def frames_of(
    coded: CodedClips, clips: Clips, net: ParallelTransformer, ahead: int, count: int
) -> tuple[Examples, Tensor, Tensor]:
    """Frames spread evenly over clips and times that are `ahead` frames after one with two before it: what is seen and
    their codes, their times, and the frames uint8 [count, 64, 64, 3]. Raises SystemExit where a clip has no codes."""
    numbers = {name: k for k, name in enumerate(coded.names)}
    missing = [name for name in clips.names if name not in numbers]
    if missing:
        raise SystemExit(f"{missing[0]} has no codes: python -m export.prediction.codes")
    first = net.shape.frames - 1 + ahead
    each = clips.frames.shape[1] - first
    chosen = torch.linspace(0, len(clips) * each - 1, min(count, len(clips) * each)).long()
    which, t = chosen // each, first + chosen % each
    clip = torch.tensor([numbers[clips.names[int(k)]] for k in which])
    one = examples(coded, clip, t, net.shape, torch.full_like(t, HORIZONS.index(ahead)))
    return one, times_ahead(one.fps, torch.full((len(t),), float(ahead))), clips.frames[which, t]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=Path(".data/clips"))
    parser.add_argument("--codes", type=Path, default=Path(".data/prediction"), help="folder of codes-val.npz")
    parser.add_argument("--autoencoder", type=Path, default=Path(".data/runs/prediction-autoencoder/weights.pt"))
    parser.add_argument("--parallel", type=Path, default=Path(".data/runs/prediction-parallel/weights.pt"))
    parser.add_argument("--set", default="pushing", help="of validation clips (default %(default)s)")
    parser.add_argument("--frames", type=int, default=32, help="of each time ahead (default %(default)s)")
    parser.add_argument("--ahead", type=int, nargs="+", choices=HORIZONS, default=[1, 4, 8])
    parser.add_argument("--threads", type=int, default=1)
    options = parser.parse_args()
    torch.set_num_threads(options.threads)
    net, autoencoder = load_parallel(options.parallel), load_autoencoder(options.autoencoder)
    coded, clips = read_codes(options.codes, "val"), read_clips(options.data, [options.set], "val")
    cases = [(order, passes) for passes in PASSES for order in (ORDERS if passes > 1 else ORDERS[:1])]
    rows: dict[tuple[str, int], list[str]] = {case: [] for case in cases}
    for ahead in options.ahead:
        one, times, truth = frames_of(coded, clips, net, ahead, options.frames)
        for case in tqdm(cases, desc=f"{ahead} ahead", unit="case", leave=False):
            bits = decoded(net, one.before, times, *case, true=one.codes)[1].mean()
            made = autoencoder.decode(decoded(net, one.before, times, *case)[0])
            rows[case].append(f"{float(bits):.2f} / {float(psnr_db(made, truth).mean()):.2f}")
    print("| passes | order | " + " | ".join(f"{ahead} ahead" for ahead in options.ahead) + " |")
    print("| --- | --- |" + " --- |" * len(options.ahead))
    for (order, passes), own in rows.items():
        print(f"| {passes} | {order if passes > 1 else 'all'} | " + " | ".join(own) + " |")


if __name__ == "__main__":
    main()
