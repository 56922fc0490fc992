"""One file with all that training the encoder on another machine takes: heads, skin, backgrounds, real faces.

    python -m export.heads.encoder_training.pack heads.pack --heads 3000 --scans .data/heads/scans.npz

Half of the heads are of the scans where these are given. Heads are kept as weights of the principal shapes among them,
which loses what is printed; photographs as JPEG.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2
import numpy as np
from tqdm import tqdm

from export.heads.encoder_training.packed import jpegs
from export.heads.photos.faces import PhotoFaces, read_photos
from export.heads.scans.scanned_heads import ScannedHeads, read_scanned_heads, sample_scanned
from export.heads.shapes import HeadShapes
from export.heads.surface import HeadMaker
from export.heads.synthetic_heads import ADULT, generator, make_maker
from export.people.imaging import motion_kernel

BACKGROUND_PX = 256
SKIN_PX = 1024
KERNELS, KERNEL_PX = 128, 11


def squares(image: np.ndarray) -> list[np.ndarray]:
    """A photo as squares: its middle, or both ends where it is long."""
    height, width = image.shape[:2]
    side = min(height, width)
    starts = [0, max(height, width) - side] if max(height, width) > 1.3 * side else [(max(height, width) - side) // 2]
    parts = [image[:, s : s + side] if width > height else image[s : s + side] for s in starts]
    size = (BACKGROUND_PX, BACKGROUND_PX)
    return [cv2.resize(part, size, interpolation=cv2.INTER_AREA) for part in parts]


def packed_heads(
    maker: HeadMaker, count: int, bases: int, scans: ScannedHeads | None = None
) -> tuple[dict[str, np.ndarray], str]:
    """The arrays of `PackedHeads`, bases in int8, of the first heads of the training split; and what they lose. scans:
    of these is every second head."""
    shapes = maker.shapes
    rows, people = [], []
    for number in tqdm(range(count), unit="head", disable=None):
        if scans and number % 2:
            rng = generator("scans/train", number)
            vertices, person = sample_scanned(scans, shapes, rng), (float(rng.random()), ADULT)
        else:
            identity = shapes.sample(generator("train", number))
            vertices, person = shapes.vertices(identity), (identity.phenotype.gender, identity.phenotype.age)
        rows.append(vertices.astype(np.float32).reshape(-1))
        people.append(person)
    points = np.stack(rows)
    mean = points.mean(0)
    points -= mean
    # The principal shapes by the small Gram matrix, each scaled to use all of int8.
    vectors = np.linalg.eigh(points @ points.T)[1]
    principal = vectors[:, ::-1][:, :bases].T @ points
    scale = np.abs(principal).max(1, keepdims=True) / 127
    stored = np.round(principal / scale).astype(np.int8)
    # Weights of the bases as they are stored, so that rounding is made up for where it can be.
    whole = stored.astype(np.float32)
    gram = whole @ whole.T
    weights = np.linalg.solve(gram, whole @ points.T).T.astype(np.float16)
    off = (
        np.linalg.norm((points - weights.astype(np.float32) @ whole).reshape(count, -1, 3), axis=-1)[
            :, : shapes.head_vertices
        ]
        * 100
    )
    lost = f"{bases} bases lose {off.mean():.3f} mm in the mean, {np.percentile(off, 99):.3f} mm at 99 %"
    faces = np.concatenate([maker.faces, maker.caps])
    uv = np.concatenate([maker.uv, np.zeros((len(maker.caps), 3, 2))])
    loops = maker.cap_vertices
    arrays = {
        "template": shapes.template.astype(np.float32), "skin_faces": shapes.faces.astype(np.int16),
        "faces": faces.astype(np.int16), "uv": uv.astype(np.float32), "eye_faces": shapes.eye_faces.astype(np.int16),
        "bust_faces": shapes.bust_faces.astype(np.int16), "bust_uv": shapes.bust_uv.astype(np.float32),
        "loops": np.concatenate(loops).astype(np.int16), "loop_ends": np.cumsum([len(loop) for loop in loops]),
        "mean": mean.reshape(-1, 3), "bases": stored.reshape(bases, -1, 3), "weights": weights,
        "gender_age": np.array(people, np.float32), "eye": right_eye(shapes),
    }  # fmt: skip
    return arrays, lost


def right_eye(shapes: HeadShapes) -> np.ndarray:
    """The middle [3] of the template's right eye, dm."""
    eyes = shapes.template[np.unique(shapes.eye_faces)]
    right = eyes[eyes[:, 0] < 0]
    return (right.max(0) + right.min(0)) / 2


def photo_arrays(faces: list[PhotoFaces]) -> dict[str, np.ndarray]:
    """Real faces: `rgb_bytes`, `rgb_ends`, pixel, weight, template, matte in two bits a pixel."""
    matte = np.concatenate([f.matte for f in faces])
    coded = jpegs([image for f in faces for image in f.rgb])
    return {
        "photo_bytes": coded["bytes"], "photo_ends": coded["ends"],
        "photo_pixel": np.concatenate([f.pixel for f in faces]).astype(np.float32),
        "photo_weight": np.concatenate([f.weight for f in faces]).astype(np.float16),
        "photo_template": faces[0].template,
        "photo_head": np.packbits(matte == 255, -1), "photo_nothing": np.packbits(matte == 0, -1),
    }  # fmt: skip


def motion_kernels() -> np.ndarray:
    """float16 [128, 11, 11]: strokes of a moving camera."""
    rng, out = np.random.default_rng(0), np.zeros((KERNELS, KERNEL_PX, KERNEL_PX), np.float16)
    for kernel in out:
        stroke = motion_kernel(rng.uniform(2, 9), rng.uniform(0, 180))
        at = (KERNEL_PX - len(stroke)) // 2
        kernel[at : at + len(stroke), at : at + len(stroke)] = stroke
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pack", type=Path)
    parser.add_argument("--heads", type=int, default=3000)
    parser.add_argument("--bases", type=int, default=240)
    parser.add_argument("--backgrounds", type=Path, default=Path(".data/backgrounds/train"))
    parser.add_argument("--photos", type=Path, default=Path(".data/heads/photos"))
    parser.add_argument("--scans", type=Path, help="of `export.heads.scans.scanned_heads`")
    options = parser.parse_args()
    maker = make_maker()
    scans = read_scanned_heads(options.scans) if options.scans else None
    arrays, lost = packed_heads(maker, options.heads, options.bases, scans)
    print(lost)
    skin = maker.skin.astype(np.uint8)
    skin = jpegs([cv2.resize(skin, (SKIN_PX, SKIN_PX), interpolation=cv2.INTER_AREA)])
    images = [cv2.imread(str(path)) for path in sorted(options.backgrounds.rglob("*.jpg"))]
    backgrounds = jpegs([square[..., ::-1] for image in images for square in squares(image)])
    for name, coded in (("skin", skin), ("background", backgrounds)):
        arrays |= {f"{name}_bytes": coded["bytes"], f"{name}_ends": coded["ends"]}
    arrays |= photo_arrays(read_photos(options.photos, "train"))
    arrays["motion"] = motion_kernels()
    with options.pack.open("wb") as file:
        np.savez_compressed(file, **arrays)
    print(f"{options.pack}: {options.pack.stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
