"""Measures the sizes of fitted bodies on rendered people whose shape is known.

    python -m export.evaluation.body_sizes --split val --people 300 --out sizes.json

Each image shows one dressed person of the split, in a pose, before a photo; every fourth is cut off at the hips. Dense
pose and the fit see one image of a person (no earlier frame), with the intrinsics of the camera, and once with and once
without the true height. The true sizes are those of the whole MakeHuman body, without clothes, at rest, by the
definitions of sdk/src/body/sizes/body_sizes.h.

For each size: `error`, mean of |fitted / true - 1|; `bias`, mean of fitted / true - 1; `width`, mean half width of the
90 % interval, relative; `inside`, how many true sizes lie in it; `average`, the error of the mean of these people
instead, scaled to the height where that is known. --fit prints by which factor the intervals of the library
should grow (kSpread in sdk/src/body/sizes/size_intervals.cpp).
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from pathlib import Path

import cv2
import maquette
import numpy as np
from scipy.spatial import ConvexHull

from export.camera import Camera
from export.people.body import Body, Shape
from export.people.motion import clip_pose, drawn_pose
from export.people.scene import SPLITS, Studio, camera_faults, composed, photo_light

SIZES = ("height", "chest", "waist", "hip", "inseam")
LEVELS = {"chest": 0.65, "waist": 0.35, "hip": -0.05}  # between hip joints and neck
HEIGHT_RANGE_M = 1.3, 2.3  # of heights that the fit accepts
_ARMS = ("upperarm", "lowerarm", "wrist", "finger", "metacarpal")
_MIDDLE_M = 0.012
_MAX_BODIES = 1 << 20


class Tailor:
    """Takes the sizes of bodies at rest."""

    def __init__(self, body: Body) -> None:
        self._body = body
        arms = [k for k, bone in enumerate(body.bones) if bone.startswith(_ARMS)]
        faces = body.faces["body"]
        self._torso = faces[(body.skin[:, arms].sum(1)[faces] < 0.5).all(1)]
        pelvis = [k for k, bone in enumerate(body.bones) if bone.startswith(("root", "pelvis", "spine05"))]
        rest, skin = body.template.vertices, body.groups["body"]
        middle = skin[(np.abs(rest[skin, 0]) <= _MIDDLE_M) & (body.skin[skin][:, pelvis].sum(1) >= 0.5)]
        self._crotch = middle[rest[middle, 2].argmin()]

    def sizes_m(self, shape: Shape) -> np.ndarray:
        """In the order of SIZES."""
        bone, vertices = self._body.bone, shape.vertices
        z = vertices[self._body.groups["body"], 2]
        hips = (shape.heads[bone["upperleg01.L"], 2] + shape.heads[bone["upperleg01.R"], 2]) / 2
        neck = shape.heads[bone["neck01"], 2]
        girths = [self._girth(vertices, hips + level * (neck - hips)) for level in LEVELS.values()]
        return np.array([z.max() - z.min(), *girths, vertices[self._crotch, 2] - z.min()])

    def _girth(self, vertices: np.ndarray, z: float) -> float:
        corners = vertices[self._torso]
        above = corners[..., 2] - z
        points = []
        for i, j in ((0, 1), (1, 2), (2, 0)):
            cut = (above[:, i] < 0) != (above[:, j] < 0)
            t = above[cut, i] / (above[cut, i] - above[cut, j])
            points.append(corners[cut, i, :2] + t[:, None] * (corners[cut, j, :2] - corners[cut, i, :2]))
        return float(ConvexHull(np.concatenate(points)).area)


def camera_at(rng: np.random.Generator, width: int, height: int, tall: float, extent: float) -> Camera:
    """A camera that shows a person at the origin, whole, or to the hips."""
    is_whole = rng.random() < 0.75
    visible = extent * (rng.uniform(1.05, 1.8) if is_whole else rng.uniform(0.45, 0.6))
    z = tall * 0.5 if is_whole else tall - 0.45 * visible
    pitch = rng.normal(4, 6)
    tangent = np.tan(np.radians(rng.uniform(30, 65)) / 2)
    distance = max(visible / (2 * tangent), 0.8)
    turn = np.radians(pitch)
    look = np.array([[1, 0, 0], [0, -np.sin(turn), -np.cos(turn)], [0, np.cos(turn), -np.sin(turn)]])
    target = np.array([rng.uniform(-0.15, 0.15) * visible, 0, z])
    return Camera.centred(width, height, height / (2 * tangent), look, target - distance * look[2])


def people(split: str, count: int, seed: int, places: Path) -> Iterator[tuple[np.ndarray, np.ndarray, Camera, Shape]]:
    """Image BGR uint8, labels [H, W, 4], camera and shape of each person."""
    width, height = 480, 640
    studio = Studio(split, width, height, places, points=False)
    director, drawn = studio.director, []
    director.bodies = _MAX_BODIES

    def remembered(number: int) -> Shape:
        drawn.append(studio.shape(number))
        return drawn[-1]

    director.shape = remembered
    for k in range(count):
        rng = np.random.default_rng([SPLITS[split], 99, seed, k])
        pose = clip_pose(rng, director.clips) if rng.random() < 0.5 else drawn_pose(rng, 0.15)
        yaw = np.radians(rng.normal(0, 40)) if rng.random() < 0.6 else rng.uniform(-np.pi, np.pi)
        actor = director.actor(rng, pose, yaw)
        camera = camera_at(rng, width, height, actor.tall, actor.extent)
        behind = studio._background(rng, width, height)
        light = photo_light(rng, camera, behind, indoors=False)
        picture = studio.renderer.draw([actor.person], camera, light, rng, [])
        image = camera_faults(rng, composed(rng, picture, behind))
        yield np.clip(image, 0, 255).astype(np.uint8), picture.label, camera, drawn[-1]


def best_person(found: maquette.DensePoseResult, true: np.ndarray) -> int | None:
    """The index of the found person who covers most of the true one; None where nobody covers a half."""
    counts = np.bincount(found.person[true > 0], minlength=2)
    index = int(counts[1:].argmax())
    return index if counts[1 + index] > 0.5 * (true > 0).sum() else None


def measured(split: str, count: int, options: argparse.Namespace) -> dict[str, np.ndarray]:
    """By labels and knowledge ("network, height known"): [N, 5, 4] of true size, fitted, low, high."""
    body = maquette.Body(options.bundle)
    densepose = maquette.DensePose(options.densepose, preset="photo", has_keypoints=True)
    tailor = Tailor(Body())
    rows: dict[str, list[np.ndarray]] = {}
    for image, label, camera, shape in people(split, count, options.seed, options.places):
        true = tailor.sizes_m(shape)
        intrinsics = maquette.Intrinsics(
            camera.width_px, camera.height_px, camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px
        )
        densepose.reset()
        found = densepose.run(np.ascontiguousarray(image[..., ::-1]))
        index = best_person(found, label[..., 3])
        for kind in ("network", "exact"):
            if kind == "network" and index is None:
                continue
            for known in (False, True):
                if known and not HEIGHT_RANGE_M[0] <= true[0] <= HEIGHT_RANGE_M[1]:
                    continue
                height = float(true[0]) if known else 0.0
                if kind == "exact":
                    result = body.run_planes(label[..., :3], label[..., 3], [0], None, intrinsics, 0, [height])
                    person = result.people[0]
                else:
                    result = body.run(found, intrinsics, 0, [height] * len(found.people))
                    person = result.people[index]
                if person.sizes is None:
                    continue
                values = [getattr(person.sizes, name) for name in SIZES]
                row = np.array([[t, s.value_m, s.low_m, s.high_m] for t, s in zip(true, values, strict=True)])
                rows.setdefault(f"{kind}, height {'known' if known else 'unknown'}", []).append(row)
    return {name: np.array(found) for name, found in rows.items()}


def summary(rows: np.ndarray, is_height_known: bool) -> dict[str, dict[str, float]]:
    """By size; rows as `measured` returns them."""
    out = {}
    unit = rows[:, :1, 0] if is_height_known else np.ones((len(rows), 1))
    average = (rows[..., 0] / unit).mean(0) * unit
    for k, name in enumerate(SIZES):
        true, value, low, high = rows[:, k].T
        out[name] = {
            "error": float(np.abs(value / true - 1).mean()),
            "bias": float((value / true - 1).mean()),
            "width": float(np.log(high / low).mean() / 2),
            "average": float(np.abs(average[:, k] / true - 1).mean()),
            "inside": float(((low <= true * (1 + 1e-6)) & (true <= high * (1 + 1e-6))).mean()),
        }
    return out


def needed_factors(rows: np.ndarray) -> list[float]:
    """For each size, the factor of all intervals (kSpread of size_intervals.cpp) with which 90 % of true sizes are
    inside."""
    out = []
    for k in range(len(SIZES)):
        true, value, low, high = rows[:, k].T
        width = np.log(high / low) / 2
        out.append(float(np.quantile(np.abs(np.log(value / true)) / width, 0.9)) if (width > 1e-9).all() else 1.0)
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--split", choices=SPLITS, default="test")
    parser.add_argument("--people", type=int, default=300)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--bundle", type=Path, default=Path("sdk/models/body"))
    parser.add_argument("--densepose", type=Path, default=Path("sdk/models/densepose-b-int8"))
    parser.add_argument("--places", type=Path, default=Path(".data"), help="folder of backgrounds and panoramas")
    parser.add_argument("--fit", action="store_true", help="print factors of the intervals")
    parser.add_argument("--out", type=Path, help="JSON")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    rows = measured(options.split, options.people, options)
    table = {name: {"people": len(found), **summary(found, name.endswith(" known"))} for name, found in rows.items()}
    for name, row in table.items():
        print(f"{name}: {row['people']} people")
        for size in SIZES:
            print(f"    {size:7}", "  ".join(f"{key} {100 * value:.1f} %" for key, value in row[size].items()))
    if options.fit:
        for name, found in rows.items():
            print(name, ", ".join(f"{factor:.3f}" for factor in needed_factors(found)))
    if options.out:
        options.out.write_text(json.dumps({"table": table, "rows": {n: r.tolist() for n, r in rows.items()}}) + "\n")


if __name__ == "__main__":
    main()
