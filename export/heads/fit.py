"""Fits a head to one photo in numpy and torch: the reference of what `maquette head` does on the device.

    python -m export.heads.fit photo.jpg --out head.maqh
    python -m export.heads.fit photo.jpg --out head.maqh --bundle .data/bundles/heads-fp32 --box 120,40,380,390

The crop, the encoder, the stages, the rays and their order are the same (`export.heads.fitting`), and so is the file;
`maquette head info head.maqh` reads it. Some ten times slower. Without --box the head is looked for in the middle of
the photo, then in all of it; people are not looked for.
"""

from __future__ import annotations

import argparse
import hashlib
import math
from pathlib import Path

import numpy as np
import torch
from tqdm import tqdm

from export.bundle import read_manifest
from export.heads.fitting.anchor_fit import AnchorFit, fit_anchors, observations_of
from export.heads.fitting.photo import Encoder, HeadPhoto, NoHead, look_at, read_photo
from export.heads.fitting.ray_fit import FitOptions, HeadState, RayFit
from export.heads.head_file import CAMERA, HeadFileError, StoredHead, write_head
from export.heads.prior import Prior, PriorError, combined
from export.heads.prior_file import prior_from_bytes

BUNDLE = Path("sdk/models/heads-int8")
METRES_PER_UNIT = 0.1


def size_by_codes(prior: Prior) -> tuple[np.ndarray, np.ndarray]:
    """The anchors from their middle [M, 3], and how the mean of their distance from it depends on each code [K], as a
    fraction of it."""
    from_middle = (prior.anchor_mean - prior.anchor_mean.mean(0)).astype(np.float64)
    by_code = np.einsum("mc,mck->k", from_middle, prior.anchor_linear.astype(np.float64))
    return from_middle, by_code / (from_middle**2).sum()


def anchor_sigma(prior: Prior, covariance: np.ndarray) -> np.ndarray:
    """[M], of each coordinate: what the codes do not say of a point, and what is left of the codes [K, K] but for the
    size, which no photo tells."""
    from_middle, size = size_by_codes(prior)
    moves = prior.anchor_linear.astype(np.float64) - from_middle[..., None] * size
    return np.sqrt(prior.anchor_sigma**2 + np.einsum("mck,kl,mcl->m", moves, covariance, moves, optimize=True) / 3)


def stored_head(
    prior: Prior, prior_sha256: str, photo: HeadPhoto, state: HeadState, covariance: np.ndarray
) -> StoredHead:
    """The head as it is kept. covariance: of the shape codes, [K, K]."""
    shape, colour = state.shape.numpy(), state.colour.numpy()
    camera = state.pose.camera()
    row = (*photo.size, camera.focal_px, *photo.centre, camera.rotation, camera.shift)
    return StoredHead(
        prior.shape,
        combined(prior, shape, colour),
        shape,
        colour,
        np.array([row], CAMERA),
        METRES_PER_UNIT,
        float(np.linalg.norm(size_by_codes(prior)[1])) * METRES_PER_UNIT,
        "prior",
        prior.sharpness,
        prior.cut_point.astype(np.float64),
        prior.cut_normal.astype(np.float64),
        prior.bounds_min,
        prior.bounds_max,
        prior.template_points,
        prior.anchor_mean + prior.anchor_linear @ shape,
        anchor_sigma(prior, covariance).astype(np.float32),
        prior.places,
        prior_sha256,
        code_factor=np.linalg.cholesky(covariance)[np.tril_indices(len(shape))].astype(np.float32),
    )


def numbers(text: str) -> tuple[float, ...]:
    values = tuple(float(part) for part in text.split(","))
    if len(values) != 4 or not all(map(math.isfinite, values)) or values[2] <= values[0] or values[3] <= values[1]:
        raise argparse.ArgumentTypeError(f"{text} is no box; give left,top,right,bottom in pixels")
    return values


def parsed(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("photo", type=Path, help="JPEG or PNG, of one person")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="the head, .maqh")
    parser.add_argument("--bundle", type=Path, default=BUNDLE, metavar="DIR", help=f"of heads; default: {BUNDLE}")
    parser.add_argument(
        "--box", type=numbers, metavar="L,T,R,B", help="where the head with its hair is, px; default: it is looked for"
    )
    parser.add_argument("--roll", type=float, default=0, help="how far it is turned clockwise in the photo, degrees")
    parser.add_argument("--focal-px", type=float, default=0, help="focal length; default: estimated")
    parser.add_argument("--steps", type=int, default=FitOptions.max_steps, help="0: stage 0 alone; default %(default)s")
    parser.add_argument("--seconds", type=float, default=math.inf, help="for stage 1; default: until it is done")
    parser.add_argument("--threads", type=int, default=1, help="default: %(default)s")
    options = parser.parse_args(arguments)
    if options.steps < 0 or not options.seconds >= 0 or options.threads < 1 or not 0 <= options.focal_px < math.inf:
        parser.error("--steps, --seconds and --focal-px must be 0 or more, --threads 1 or more")
    return options


def fit(options: argparse.Namespace) -> None:
    torch.set_num_threads(options.threads)
    encoder = Encoder(options.bundle)
    prior_file = options.bundle / read_manifest(options.bundle)["prior"]["file"]
    data = prior_file.read_bytes()
    prior = prior_from_bytes(data, str(prior_file))
    photo = look_at(encoder, read_photo(options.photo), options.box, math.radians(options.roll), options.focal_px)
    start: AnchorFit = fit_anchors(prior, observations_of(photo))
    print(f"{start.inliers} of {start.cells} cells agree with a camera of {start.pose.camera().focal_px:.0f} px")
    if options.steps == 0 or options.seconds == 0:
        state = HeadState(torch.from_numpy(start.codes.astype(np.float32)), torch.zeros(prior.colour_codes), start.pose)
    else:
        with tqdm(total=options.steps, unit="step") as bar:

            def show(steps: int, loss: float) -> None:
                bar.update(steps - bar.n)
                bar.set_postfix(loss=f"{loss:.1f}")

            found = RayFit(prior, photo, start, FitOptions(options.steps, options.seconds)).run(show)
        print(f"loss {found.first_loss:.2f} -> {found.loss:.2f} in {found.steps} steps, ended by: {found.end}")
        state = found.state
    head = stored_head(prior, hashlib.sha256(data).hexdigest(), photo, state, start.covariance)
    write_head(head, options.out)
    print(f"{options.out}: {options.out.stat().st_size / 1000:.0f} KB")


def main(arguments: list[str] | None = None) -> None:
    options = parsed(arguments)
    try:
        fit(options)
    except (OSError, NoHead, PriorError, HeadFileError, ValueError) as error:
        raise SystemExit(f"No head was written: {error}") from error


if __name__ == "__main__":
    main()
