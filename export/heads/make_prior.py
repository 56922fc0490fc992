"""Writes the prior that the SDK reads from a trained one.

    python -m export.heads.make_prior --weights .data/runs/heads-prior/weights.pt --out .data/heads/prior.maqp

Anchors are places of the template whose visible point (of skin, or of the hair above it) is a linear function of the
shape codes: fitted here over the heads that the prior was trained on, with what is left as their sigma.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import torch

from export.heads.field import FieldBases
from export.heads.head_shards import read_points
from export.heads.prior import FieldShape, Layer, Prior
from export.heads.prior_file import write_prior
from export.heads.shapes import CUT_NORMAL, CUT_POINT, DOMAIN, HeadShapes
from export.heads.surface import HeadMaker, cut_distance
from export.heads.synthetic_heads import make_maker

ANCHORS = 800
SHARPNESS = 150.0  # 1/dm: a surface some 0.3 mm thick, that of the prior's own error
RIDGE = 4.0
MIN_SIGMA_DM = 0.01


def spread(points: np.ndarray, count: int) -> np.ndarray:
    """Numbers of `count` of the points [N, 3], each as far as can be from those before it."""
    chosen = [int(np.argmin(points[:, 1]))]
    away = np.linalg.norm(points - points[chosen[0]], axis=1)
    for _ in range(count - 1):
        chosen.append(int(np.argmax(away)))
        away = np.minimum(away, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return np.array(chosen)


def landmarks(shapes: HeadShapes, skin: np.ndarray) -> dict[str, np.ndarray]:
    """Landmarks of the template, dm. skin: numbers of vertices that are seen from outside."""
    p = shapes.template[skin]
    eyes = shapes.template[np.unique(shapes.eye_faces)]
    middle = np.abs(p[:, 0]) < 0.05

    def foremost(low: float, high: float) -> np.ndarray:
        some = p[middle & (p[:, 2] > low) & (p[:, 2] < high)]
        return some[np.argmin(some[:, 1])] * [0, 1, 1]

    out = {
        "nose_tip": foremost(-0.5, -0.15),
        "nose_bridge": foremost(0.0, 0.1),
        "chin": foremost(-1.15, -0.95),
        "crown": p[np.argmax(p[:, 2])] * [0, 1, 1],
    }
    for name, side in (("left", 1), ("right", -1)):
        eye = eyes[eyes[:, 0] * side > 0]
        out[f"pupil_{name}"] = eye[np.argmin(eye[:, 1])]
        own = p[p[:, 0] * side > 0]
        temple = own[(np.abs(own[:, 2] - 0.15) < 0.1) & (np.abs(own[:, 1] + 0.35) < 0.15)]
        out[f"temple_{name}"] = temple[np.argmax(np.abs(temple[:, 0]))]
        ear = own[(np.abs(own[:, 0]) > 0.78) & (np.abs(own[:, 1] - 0.15) < 0.4) & (own[:, 2] > -0.6)]
        out[f"ear_top_{name}"] = ear[np.argmax(ear[:, 2])]
        out[f"ear_bottom_{name}"] = ear[np.argmin(ear[:, 2])]
    return out


def linear_anchors(codes: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Codes [H, K] (whitened), points [H, M, 3] -> mean [M, 3], linear [M, 3, K], sigma [M] (each coordinate)."""
    mean = points.mean(0)
    flat = (points - mean).reshape(len(points), -1)
    linear = np.linalg.solve(codes.T @ codes + RIDGE * np.eye(codes.shape[1]), codes.T @ flat)
    left = (flat - codes @ linear).reshape(points.shape)
    # As many numbers were fitted as there are codes.
    freedom = max(len(codes) - codes.shape[1], 1)
    sigma = np.sqrt((left**2).sum((0, 2)) / 3 / freedom)
    return mean, linear.T.reshape(*mean.shape, -1), np.maximum(sigma, MIN_SIGMA_DM)


def layers_of(weights: list[torch.Tensor]) -> list[Layer]:
    arrays = [w.detach().numpy().astype(np.float32) for w in weights]
    return [Layer(a[..., :-1].copy(), a[..., -1].copy()) for a in arrays]


def make_prior(saved: dict, maker: HeadMaker, visible: np.ndarray) -> Prior:
    """saved: what `export.heads.train_prior` wrote as weights.pt; visible [H, V, 3]: of the heads it was trained on."""
    shape = FieldShape(**saved["shape"])
    codes = saved["z"].double().numpy()
    bases = FieldBases(shape, codes.shape[1], saved["c"].shape[1])
    bases.load_state_dict(saved["bases"])
    shapes = maker.shapes
    skin = np.unique(maker.faces)
    skin = skin[cut_distance(shapes.template[skin]) < 0]
    skin = skin[spread(shapes.template[skin], ANCHORS)]
    mean, linear, sigma = linear_anchors(codes, visible[:, skin].astype(np.float64))
    single = np.float32
    personal = [[bases.bases[str(layer)] for layer in part] for part in shape.personal]
    return Prior(
        shape=shape,
        constant=layers_of(list(bases.constant)),
        shape_bases=layers_of(personal[0]),
        colour_bases=layers_of(personal[1]),
        sharpness=SHARPNESS,
        cut_point=CUT_POINT.astype(single),
        cut_normal=(CUT_NORMAL / np.linalg.norm(CUT_NORMAL)).astype(single),
        bounds_min=np.full(3, -DOMAIN, single),
        bounds_max=np.full(3, DOMAIN, single),
        template_points=shapes.template[skin].astype(single),
        anchor_mean=mean.astype(single),
        anchor_linear=linear.astype(single),
        anchor_sigma=sigma.astype(single),
        landmarks={name: p.astype(single) for name, p in landmarks(shapes, np.unique(maker.faces)).items()},
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--weights", type=Path, default=Path(".data/runs/heads-prior/weights.pt"))
    parser.add_argument("--data", type=Path, nargs="+", default=[Path(".data/heads/points")], help="one a source")
    parser.add_argument("--out", type=Path, default=Path(".data/heads/prior.maqp"))
    parser.add_argument("--bases", choices=("int8", "float16", "float32"), default="int8")
    arguments = parser.parse_args()
    visible = np.stack([head.visible for folder in arguments.data for head in read_points(folder, "train")])
    prior = make_prior(torch.load(arguments.weights, weights_only=True), make_maker(), visible)
    write_prior(prior, arguments.out, arguments.bases)
    print(
        f"{arguments.out}: {arguments.out.stat().st_size / 1e6:.2f} MB, {len(prior.anchor_sigma)} anchors, their sigma"
    )
    print(f"{100 * np.median(prior.anchor_sigma):.1f} mm (median), {100 * prior.anchor_sigma.max():.1f} mm (largest)")


if __name__ == "__main__":
    main()
