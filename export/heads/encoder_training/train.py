"""Trains the encoder of heads for a given time on images that are drawn while it learns, and on real faces.

    python -m export.heads.encoder_training.pack heads.pack
    python -m export.heads.encoder_training.train heads.pack --seconds 520 --out .data/runs/heads-encoder

It draws, crops and learns on the graphics processor where there is one, else on the processor, with small batches, to
try it out. Processes beside it make heads. Learning rate and end are by time. Writes weights.pt (the mean of the
weights, in half precision) every minute and at the end, log.json and sample.jpg: crops, true template points, ours.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch
from torch import Tensor
from torch.utils.data import DataLoader

from export.heads.encoder import (
    POINT,
    SCALES,
    HeadEncoder,
    cell_metrics,
    losses,
    photo_losses,
    photo_metrics,
    start_from_detector,
    start_from_encoder,
)
from export.heads.encoder_training.crops import Backgrounds, Cropper
from export.heads.encoder_training.generator import HeadStream
from export.heads.encoder_training.head_images import Painter, Pool
from export.heads.encoder_training.packed import read_heads, read_jpegs, read_real_faces
from export.training import Ema, SmoothedTerms, StopSignal, rate_at, save_atomically

SAVE_EVERY_S = 60
WARM_UP_STEPS = 100


@dataclass(frozen=True)
class Sizes:
    """heads of one drawing, images a head, images in the pool and before training starts, crops of a batch."""

    heads: int
    views: int
    pool: int
    first: int
    batch: int

    @staticmethod
    def of(device: torch.device, batch: int | None) -> Sizes:
        """batch: another one than the device's usual."""
        if device.type == "cuda":
            return Sizes(16, 4, 3072, 512, batch or 256)
        return Sizes(2, 2, 64, 8, batch or 16)


class Supply:
    """Fills a pool with images, the oldest first, of heads that other processes make."""

    def __init__(self, batches, painter: Painter, sizes: Sizes, device: torch.device) -> None:
        self._batches, self._painter, self._sizes, self._device = batches, painter, sizes, device
        self.pool, self.filled, self._at, self._view, self._heads = Pool.empty(sizes.pool, device), 0, 0, 0, None

    def draw(self) -> None:
        """Replaces as many images as there are heads in a drawing."""
        if self._heads is None or self._view == self._sizes.views:
            self._heads, self._view = next(self._batches).to(self._device), 0
        pictures = self._painter.draw(self._heads, self._view)
        self.pool.put(self._at, pictures)
        self._view += 1
        self.filled = max(self.filled, self._at + len(pictures.face))
        self._at = (self._at + len(pictures.face)) % self._sizes.pool


def synchronized_s(device: torch.device) -> float:
    """The time, once all that was asked for is done."""
    if device.type == "cuda":
        torch.cuda.synchronize(device)
    return time.monotonic()


def batch_terms(encoder: HeadEncoder, made: tuple, real: tuple | None, device: torch.device) -> tuple[dict, Tensor]:
    """Terms of the loss, each crop counting the same, and the cells."""
    image = made[0] if real is None else torch.cat([made[0], real[0]])
    with torch.autocast(device.type, torch.bfloat16):
        cells = encoder(image)
    cells, count = cells.float(), len(made[0])
    terms = losses(cells[:count], *made[1:])
    if real is not None:
        share = count / len(image)
        of_photos = photo_losses(cells[count:], *real[1:])
        terms = {name: share * value for name, value in terms.items()}
        terms |= {f"photo_{name}": (1 - share) * value for name, value in of_photos.items()}
    return terms, cells


@torch.no_grad()
def sample_sheet(image: Tensor, template: Tensor, cells: Tensor, matte: Tensor) -> np.ndarray:
    """BGR: rows of crops, their true template points, ours."""

    def coloured(points: Tensor) -> np.ndarray:
        colours = ((points / 3 + 0.5) * 255).clamp(0, 255) * (matte > 0.5)[..., None]
        return colours.cpu().numpy().repeat(4, 1).repeat(4, 2)

    columns = [image.cpu().numpy(), coloured(template), coloured(cells[..., POINT])]
    return np.concatenate(np.concatenate(columns, 2), 0)[..., ::-1].astype(np.uint8)


def train(options: argparse.Namespace) -> None:
    began = time.monotonic()
    cv2.setNumThreads(1)
    torch.set_num_threads(1)
    torch.manual_seed(options.seed)
    options.out.mkdir(parents=True, exist_ok=True)
    with np.load(options.pack) as file:
        stored = dict(file)
    on_gpu = torch.cuda.device_count() > 0 and not options.cpu
    device = torch.device("cuda" if on_gpu else "cpu")
    sizes = Sizes.of(device, options.batch)
    stream = HeadStream(read_heads(stored), sizes.heads, sizes.views, options.seed)
    # Processes start before anything is done on the graphics processor: it does not survive their fork.
    batches = iter(DataLoader(stream, batch_size=None, num_workers=options.workers))
    skin = read_jpegs(stored["skin_bytes"], stored["skin_ends"])[0]
    backgrounds = torch.from_numpy(np.stack(read_jpegs(stored["background_bytes"], stored["background_ends"])))
    faces = read_real_faces(stored)
    if on_gpu:
        torch.backends.cudnn.benchmark = True
    painter = Painter(torch.from_numpy(skin), torch.from_numpy(stored["eye"]), device, options.seed)
    kernels = torch.from_numpy(stored["motion"].astype(np.float32))
    cropper = Cropper(Backgrounds(backgrounds.to(device)), kernels, device, options.seed)
    faces = faces.to(device)
    encoder = HeadEncoder()
    if options.detector:
        start_from_detector(encoder, options.detector)
    else:
        start_from_encoder(encoder, options.start)
    encoder.backbone.freeze()
    encoder.to(device, memory_format=torch.channels_last).train()
    mean = Ema(encoder, 0.998)
    trained = [p for p in encoder.parameters() if p.requires_grad]
    optimizer = torch.optim.AdamW(trained, options.rate, weight_decay=1e-4)
    supply = Supply(batches, painter, sizes, device)
    smoothed, log, skipped = SmoothedTerms(), [], 0

    def save() -> None:
        state = {n: v.half() if v.is_floating_point() else v for n, v in mean.net.state_dict().items()}
        save_atomically({"state": {n: v.cpu() for n, v in state.items()}}, options.out / "weights.pt")
        (options.out / "log.json").write_text(json.dumps(log))

    draw_s = 0.0
    while supply.filled < sizes.first:
        start = synchronized_s(device)
        supply.draw()
        draw_s = synchronized_s(device) - start
    print(f"{time.monotonic() - began:.1f} s: {supply.filled} pictures, {draw_s * 1e3:.0f} ms for the last", flush=True)
    started = time.monotonic()
    length = options.seconds - (started - began) if options.until is None else options.until - time.time()
    stop = StopSignal()
    photos = round(options.photo_fraction * sizes.batch)
    step, every, saved, lapse = 0, 1, started, started
    while time.monotonic() - started < length and not stop:
        fraction = (time.monotonic() - started) / length
        for group in optimizer.param_groups:
            group["lr"] = rate_at(step, fraction, options.rate, WARM_UP_STEPS)
        if step % every == 0:
            supply.draw()
        made = cropper.made(supply.pool, supply.filled, sizes.batch - photos)
        real = cropper.real(faces, photos) if photos else None
        terms, cells = batch_terms(encoder, made, real, device)
        optimizer.zero_grad(set_to_none=True)
        sum(SCALES[name.removeprefix("photo_")] * value for name, value in terms.items()).backward()
        norm = torch.nn.utils.clip_grad_norm_(trained, 5.0)
        if math.isfinite(float(norm)):
            optimizer.step()
            mean.update(encoder, step)
            smoothed.update({name: value.detach() for name, value in terms.items()})
        else:
            skipped += 1
        step += 1
        if step in (1, 20) or step % 100 == 0:
            found = cell_metrics(cells[: len(made[0])].detach(), *made[1:])
            if real is not None:
                found |= photo_metrics(cells[len(made[0]) :].detach(), *real[1:])
            now = synchronized_s(device)
            log.append(
                {"step": step, "seconds": round(now - started, 1), "loss": smoothed.loss, "skipped": skipped} | found
            )
            print(" ".join(f"{k}={v:.4g}" for k, v in log[-1].items()), f"every={every}", flush=True)
            if step == 20 or step == 100:
                lapse = now if step == 20 else lapse
            if step == 100:
                each = (now - lapse) / 80
                every = max(1, min(8, math.ceil(draw_s / (0.35 * each))))
        if step == 20:
            count = min(8, len(made[0]))
            sheet = sample_sheet(made[0][:count], made[1][:count], cells[:count].detach(), made[2][:count])
            if real is not None:
                row = real[0][:count].cpu().numpy()[..., ::-1].astype(np.uint8)
                row = np.concatenate([np.concatenate(row, 0), np.zeros(((count - len(row)) * 192, 192, 3), np.uint8)])
                sheet = np.concatenate([sheet, row], 1)
            cv2.imwrite(str(options.out / "sample.jpg"), sheet)
        if time.monotonic() - saved > SAVE_EVERY_S:
            save()
            saved = time.monotonic()
    save()
    print(f"{time.monotonic() - began:.1f} s: {step} steps", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pack", type=Path)
    parser.add_argument(
        "--start", type=Path, default=Path("export/weights/heads-encoder.pt"), help="initial weights of the encoder"
    )
    parser.add_argument(
        "--detector",
        type=Path,
        help="initial trunk and neck, such as export/weights/densepose-b.pt, in place of --start",
    )
    parser.add_argument("--out", type=Path, default=Path(".data/runs/heads-encoder"))
    parser.add_argument("--seconds", type=float, default=520, help="from start to end, all told")
    parser.add_argument("--until", type=float, metavar="TIME", help="of the end, Unix time, instead of --seconds")
    parser.add_argument("--rate", type=float, default=2e-3)
    parser.add_argument("--batch", type=int, help="crops; default: 256 on a graphics processor, else 16")
    parser.add_argument("--photo-share", dest="photo_fraction", type=float, default=0.12, help="of a batch: real faces")
    parser.add_argument("--workers", type=int, default=5, help="processes that make heads")
    parser.add_argument("--cpu", action="store_true", help="leave a graphics processor alone")
    parser.add_argument("--seed", type=int, default=0)
    train(parser.parse_args())


if __name__ == "__main__":
    main()
