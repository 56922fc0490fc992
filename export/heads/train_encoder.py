"""Trains the encoder of heads on pictures of made heads.

    python -m export.heads.view_shards train --count 600
    python -m export.heads.train_encoder --data .data/heads/views --out .data/runs/heads-encoder --minutes 40

With `--photos` (of export.heads.photos.faces) a share of each batch are real faces, of which template points are known
at MediaPipe's face points alone. It resumes from `--out` by itself. Writes checkpoint.pt, weights.pt (for
export.heads.export_onnx), log.json, curves.png and sample.png: crops of held-out heads, true template points, ours,
matte.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch
from torch.utils.data import DataLoader

from export.heads.encoder import (
    MATTE,
    POINT,
    SCALES,
    HeadEncoder,
    figures,
    losses,
    photo_figures,
    photo_losses,
    run_encoder,
    save_encoder,
    start_from_detector,
    start_from_encoder,
)
from export.heads.encoder_data import Backgrounds, Crop, CropStream, batched, crop_of, face_box_of, read_heads
from export.heads.photos.crops import MixedStream, PhotoCrop, batched_photos, crop_photo
from export.heads.photos.faces import read_photos
from export.training import (
    SAVE_EVERY_S,
    Ema,
    Interval,
    Schedule,
    SmoothedTerms,
    StopSignal,
    Stopwatch,
    rate_at,
    save_atomically,
    write_log,
)

VIEWS = 6  # of a held-out head


@dataclass(frozen=True)
class HeldOut:
    """What is validated on: crops of made heads, crops of their faces, faces of photos."""

    crops: list[Crop]
    face_crops: list[Crop]
    faces: list[PhotoCrop]


def held_out_crops(folder: Path, backgrounds: Backgrounds) -> list[Crop]:
    """The same crops of validation heads each time, VIEWS a head, with and without what cameras do."""
    rng = np.random.default_rng(1)
    heads = read_heads(folder, "val")
    return [crop_of(p, k, backgrounds, rng, augment=k % 2 == 1) for p in heads for k in range(VIEWS)]


def held_out_face_crops(folder: Path, backgrounds: Backgrounds) -> list[Crop]:
    """The same crops of the faces of validation heads each time, as of good photos."""
    rng = np.random.default_rng(1)
    return [
        crop_of(p, k, backgrounds, rng, augment=False, of_face=True)
        for p in read_heads(folder, "val")
        for k in range(VIEWS)
        if face_box_of(p, k) is not None
    ]


def held_out_faces(folder: Path) -> list[PhotoCrop]:
    """The faces of the validation photos, upright in the middle of their crops."""
    rng = np.random.default_rng(1)
    return [
        crop_photo(f, k, None, rng, augment=False, of_face=True)
        for f in read_photos(folder, "val")
        for k in range(len(f.rgb))
    ]


@torch.no_grad()
def run(encoder: HeadEncoder, image: torch.Tensor) -> torch.Tensor:
    return torch.cat([encoder(image[k : k + 16]) for k in range(0, len(image), 16)])


def validate(encoder: HeadEncoder, held_out: HeldOut) -> dict[str, float]:
    image, *labels = batched(held_out.crops)
    found = figures(run(encoder, image), *labels)
    image, *labels = batched(held_out.face_crops)
    of_faces = figures(run(encoder, image), *labels)
    found |= {"face_mm": of_faces["point_mm"], "face_median_mm": of_faces["median_mm"]}
    if held_out.faces:
        image, *labels = batched_photos(held_out.faces)
        found |= photo_figures(run(encoder, image), *labels)
    return found


@torch.no_grad()
def write_sample(encoder: HeadEncoder, crops: list[Crop], path: Path) -> None:
    """Crops, true template points, found ones, found matte."""
    rows = []
    for crop in crops[:: max(1, len(crops) // 8)][:8]:
        cells = run_encoder(encoder, crop.image)

        def shown(points: np.ndarray, mask: np.ndarray) -> np.ndarray:
            colour = np.clip((points / 3 + 0.5) * 255, 0, 255) * mask[..., None]
            return cv2.resize(colour, (192, 192), interpolation=cv2.INTER_NEAREST)

        matte = 1 / (1 + np.exp(-cells[..., MATTE]))
        grey = cv2.resize(matte * 255, (192, 192), interpolation=cv2.INTER_NEAREST)
        true = shown(crop.template, crop.matte > 0.5)
        ours = shown(cells[..., POINT], matte > 0.5)
        rows.append(np.concatenate([crop.image, true, ours, np.repeat(grey[..., None], 3, 2)], 1))
    cv2.imwrite(str(path), np.concatenate(rows)[..., ::-1].astype(np.uint8))


def batch_losses(encoder: HeadEncoder, batch: tuple, precision: str) -> dict[str, torch.Tensor]:
    """Terms of a batch of `CropStream` or `MixedStream`; each crop of a mixed one counts the same."""
    made, photos = batch if isinstance(batch[0], (tuple, list)) else (batch, None)
    image = made[0] if photos is None else torch.cat([made[0], photos[0]])
    with torch.autocast("cpu", torch.bfloat16, enabled=precision == "bfloat16"):
        cells = encoder(image).float()
    count = len(made[0])
    terms = losses(cells[:count], *made[1:])
    if photos is None:
        return terms
    share = count / len(image)
    real = photo_losses(cells[count:], *photos[1:])
    return {name: share * value for name, value in terms.items()} | {
        f"photo_{name}": (1 - share) * value for name, value in real.items()
    }


def parsed() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=Path(".data/heads/views"))
    parser.add_argument("--photos", type=Path, help="faces of photos, such as .data/heads/photos; default: none")
    parser.add_argument(
        "--photo-share", dest="photo_fraction", type=float, default=0.2, help="of a batch, with --photos"
    )
    parser.add_argument("--start", type=Path, help="weights.pt of an encoder to go on from, instead of --init")
    parser.add_argument("--backgrounds", type=Path, default=Path(".data/backgrounds"))
    parser.add_argument("--out", type=Path, default=Path(".data/runs/heads-encoder"))
    parser.add_argument("--init", type=Path, default=Path("export/weights/densepose-b.pt"), help="of a person detector")
    parser.add_argument("--minutes", type=float, default=40, help="of the whole schedule, over resumes")
    parser.add_argument("--steps", type=int, help="length of the schedule in steps instead of minutes")
    parser.add_argument("--batch", type=int, default=16)
    parser.add_argument("--rate", type=float, default=1e-3)
    parser.add_argument("--heads", type=int, help="use only so many heads")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--threads", type=int, help="default: one a core")
    parser.add_argument("--precision", choices=("float32", "bfloat16"), default="float32")
    parser.add_argument("--validate-minutes", type=float, default=10)
    return parser.parse_args()


def train(arguments: argparse.Namespace) -> None:
    """Runs or resumes a training."""
    cv2.setNumThreads(1)  # before its first use: OpenCV's threads do not survive the fork of the loader's worker
    if arguments.threads:
        torch.set_num_threads(arguments.threads)
    torch.manual_seed(arguments.seed)
    arguments.out.mkdir(parents=True, exist_ok=True)
    heads = read_heads(arguments.data, "train", arguments.heads)
    backgrounds = Backgrounds(arguments.backgrounds / "val")
    crops, face_crops = (of(arguments.data, backgrounds) for of in (held_out_crops, held_out_face_crops))
    faces = held_out_faces(arguments.photos) if arguments.photos else []
    held_out = HeldOut(crops, face_crops, faces)
    encoder = HeadEncoder()
    start_from_detector(encoder, arguments.init)
    if arguments.start:
        start_from_encoder(encoder, arguments.start)
    encoder.to(memory_format=torch.channels_last)
    mean = Ema(encoder, 0.998)
    trained = [p for p in encoder.parameters() if p.requires_grad]
    optimizer = torch.optim.AdamW(trained, arguments.rate, weight_decay=1e-4)
    step, spent_s, log = 0, 0.0, []
    path = arguments.out / "checkpoint.pt"
    if path.exists():
        state = torch.load(path, weights_only=True)
        encoder.load_state_dict(state["net"])
        mean.net.load_state_dict(state["mean"])
        optimizer.load_state_dict(state["optimizer"])
        step, spent_s, log = state["step"], state["spent_s"], state["log"]
    encoder.train()
    made = (heads, Backgrounds(arguments.backgrounds / "train"), arguments.batch, arguments.seed + step)
    photos = read_photos(arguments.photos, "train") if arguments.photos else []
    stream = MixedStream(*made, photos=photos, share=arguments.photo_fraction) if photos else CropStream(*made)
    batches = iter(DataLoader(stream, batch_size=None, num_workers=1, prefetch_factor=4))
    schedule, stop = Schedule(arguments.minutes, arguments.steps), StopSignal()
    clock, smoothed = Stopwatch(spent_s), SmoothedTerms()
    save, due = Interval(SAVE_EVERY_S), Interval(arguments.validate_minutes * 60)
    bar = schedule.bar(step, spent_s)

    def checkpoint() -> None:
        save_atomically(
            {"net": encoder.state_dict(), "mean": mean.net.state_dict(), "optimizer": optimizer.state_dict(),
             "step": step, "spent_s": spent_s, "log": log}, path,
        )  # fmt: skip
        save_encoder(mean.net, arguments.out / "weights.pt")

    def validated() -> None:
        found = validate(mean.net, held_out)
        log.append({"step": step, "spent": spent_s} | found)
        names = ["point_mm", "median_mm", "face_median_mm", "normal_deg"] + ["photo_mm"] * bool(held_out.faces)
        write_log(log, arguments.out, names, "spent", "held-out heads, mm")
        write_sample(mean.net, held_out.crops, arguments.out / "sample.png")
        bar.write(" ".join(f"{k}={v:.4g}" for k, v in log[-1].items()))

    while not schedule.finished(step, spent_s) and not stop:
        for group in optimizer.param_groups:
            group["lr"] = rate_at(step, schedule.fraction(step, spent_s), arguments.rate)
        terms = batch_losses(encoder, next(batches), arguments.precision)
        optimizer.zero_grad(set_to_none=True)
        sum(SCALES[name.removeprefix("photo_")] * value for name, value in terms.items()).backward()
        torch.nn.utils.clip_grad_norm_(trained, 5.0)
        optimizer.step()
        step += 1
        mean.update(encoder, step)
        smoothed.update(terms)
        clock.lap()
        spent_s = clock.spent_s
        schedule.advance(bar, step, spent_s)
        if step % 20 == 0:
            log.append({"step": step, "loss": smoothed.loss, "terms": dict(smoothed.values)})
            bar.set_postfix(step=step, loss=f"{smoothed.loss:.3f}", refresh=False)
        if save.due():
            checkpoint()
            save.restart()
        if due.due():
            validated()
            due.restart()
            clock.skip()
    validated()
    checkpoint()


def main() -> None:
    train(parsed())


if __name__ == "__main__":
    main()
