"""Measures fitted bodies on clips of people: the mean distance of 15 joints from the true ones.

    python -m export.people.clips.dataset --split test --clips 2
    python -m export.evaluation.body .data/people-clips/test --every 3

Distances are in millimetres after a similarity transform (Procrustes), so size, place and orientation do not count, and
before it, from the pelvis, in axes of the camera. `true` fits to the exact labels, `network` to those of dense pose.
`baseline` is the mean body in the mean pose of the prior. A person counts where the image shows at least --min-pixels
of them; `whole`: people with at least 12 of the 15 joints in the image.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import maquette
import numpy as np

from export.body.body_file import FILE, read_body
from export.people.clips.cast import JOINTS
from export.people.clips.clip_file import PeopleClip, clip_paths, read_clip

_BODY_JOINT = {"shoulder": "upper_arm", "elbow": "lower_arm", "wrist": "hand", "hip": "upper_leg", "knee": "lower_leg",
               "ankle": "foot"}  # fmt: skip
_WHOLE_JOINTS = 12
_MIN_OVERLAP = 0.5  # of the masks of a person who was found and a true one


def body_joint(name: str) -> str:
    """The joint of a bundle that is the joint `name` of a clip."""
    side, _, base = name.rpartition("_")
    return f"{_BODY_JOINT[base]}.{side[0].upper()}" if side else name


def aligned(points: np.ndarray, onto: np.ndarray) -> np.ndarray:
    """points [K, 3] after the similarity transform that brings them nearest to `onto` (Umeyama, 1991)."""
    centre, target = points.mean(0), onto.mean(0)
    u, stretch, v = np.linalg.svd((onto - target).T @ (points - centre))
    sign = np.array([1, 1, np.sign(np.linalg.det(u @ v))])
    rotation = (u * sign) @ v
    scale = (stretch * sign).sum() / max(((points - centre) ** 2).sum(), 1e-12)
    return scale * (points - centre) @ rotation.T + target


def distance_mm(found: np.ndarray, true: np.ndarray) -> float:
    return float(1000 * np.linalg.norm(found - true, axis=1).mean())


@dataclass(frozen=True)
class Answer:
    """One person in one frame. fit: as of maquette.BodyPerson, or "not_found"; aligned_mm, pelvis_mm: NaN unless it is
    fitted; baseline_mm; is_whole."""

    fit: str
    is_whole: bool
    baseline_mm: float
    aligned_mm: float = float("nan")
    pelvis_mm: float = float("nan")
    iterations: int = 0


class Labels:
    """Where the labels of a frame come from: the truth, or a network."""

    def __init__(self, clip: PeopleClip, densepose: maquette.DensePose | None) -> None:
        self._clip, self._densepose = clip, densepose
        self._source = None if densepose is None else iter(maquette.Source(f"rec:{clip.recording}"))
        if densepose is not None:
            densepose.reset()

    def of(self, frame: int) -> tuple[np.ndarray, np.ndarray, list[int], np.ndarray | None]:
        """Part, U, V [H, W, 3]; person [H, W]; ids; keypoints [P, 33, 3]. Frames must rise."""
        if self._densepose is None or self._source is None:
            label = self._clip.label(frame)
            return label[..., :3], label[..., 3], list(range(1, self._clip.truth.people + 1)), None
        result = self._densepose.run(next(self._source))
        keypoints = [person.keypoints for person in result.people]
        known = np.stack(keypoints) if keypoints else None
        return result.iuv, result.person, [person.id for person in result.people], known


def matches(found: np.ndarray, true: np.ndarray, people: int) -> dict[int, int]:
    """For each true person (from 0), the index of the found person whose mask overlaps most."""
    out = {}
    for person in range(people):
        mask = true == person + 1
        numbers, counts = np.unique(found[mask], return_counts=True)
        for number, count in sorted(zip(numbers, counts, strict=True), key=lambda pair: -pair[1]):
            if number > 0 and count > _MIN_OVERLAP * (mask | (found == number)).sum():
                out[person] = int(number) - 1
                break
    return out


def answers(
    clip: PeopleClip, body: maquette.Body, labels: Labels, options: argparse.Namespace, mean_joints: np.ndarray
) -> Iterator[Answer]:
    """The answers of each person and frame of a clip. Every frame is fitted, and every options.every-th counts."""
    truth = clip.truth
    assert tuple(truth.facts["joints"]) == JOINTS
    order = [body.mesh.joint_names.index(body_joint(name)) for name in JOINTS]
    fx, fy, cx, cy = truth.intrinsics
    size = clip.label(0).shape[1], clip.label(0).shape[0]
    camera = maquette.Intrinsics(*size, fx, fy, cx, cy) if options.intrinsics else None
    body.reset()
    frames = min(truth.frames, options.frames or truth.frames)
    for frame in range(frames):
        iuv, person, ids, keypoints = labels.of(frame)
        if not options.warm:
            ids = [0] * len(ids)
        time_ns = int(truth.time_ns[frame])
        found = body.run_planes(iuv, person, ids, keypoints if options.keypoints else None, camera, time_ns).people
        if frame % options.every:
            continue
        match = matches(person, clip.label(frame)[..., 3], truth.people)
        turn = truth.world_to_camera[frame][:, :3]
        for k in range(truth.people):
            if truth.visible_px[frame, k] < options.min_pixels:
                continue
            true = truth.joints_m[frame, k] @ turn.T
            whole = bool(truth.joint_visible[frame, k].sum() >= _WHOLE_JOINTS)
            baseline = distance_mm(aligned(mean_joints[order], true), true)
            fitted = found[match[k]] if k in match else None
            if fitted is None or fitted.joints_m is None:
                yield Answer("not_found" if fitted is None else fitted.fit, whole, baseline)
                continue
            joints = fitted.joints_m[order].astype(np.float64)
            yield Answer(fitted.fit, whole, baseline, distance_mm(aligned(joints, true), true),
                         distance_mm(joints - joints[0], true - true[0]), fitted.iteration_count)  # fmt: skip


def summary(found: Sequence[Answer]) -> dict[str, float]:
    fitted = [answer for answer in found if answer.fit == "fitted"]
    if not fitted:
        return {"people": len(found), "fitted": 0.0}
    values = np.array([answer.aligned_mm for answer in fitted])
    return {
        "people": len(found),
        "fitted": len(fitted) / len(found),
        "aligned_mm": float(values.mean()),
        "aligned_p90_mm": float(np.quantile(values, 0.9)),
        "pelvis_mm": float(np.mean([answer.pelvis_mm for answer in fitted])),
        "baseline_mm": float(np.mean([answer.baseline_mm for answer in fitted])),
        "iterations": float(np.mean([answer.iterations for answer in fitted])),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clips", type=Path, help="folder of clip-*.npz")
    parser.add_argument("--bundle", type=Path, default=Path("sdk/models/body"))
    parser.add_argument("--densepose", type=Path, default=Path("sdk/models/densepose-b-int8"))
    parser.add_argument("--every", type=int, default=1, help="frames of which one counts (default %(default)s)")
    parser.add_argument("--frames", type=int, help="only the first N of each clip")
    parser.add_argument("--min-pixels", type=int, default=600)
    parser.add_argument("--labels", choices=("true", "network", "both"), default="both")
    parser.add_argument("--preset", choices=("stream", "photo"), default="stream", help="of dense pose")
    parser.add_argument("--no-intrinsics", dest="intrinsics", action="store_false", help="weak perspective")
    parser.add_argument("--no-keypoints", dest="keypoints", action="store_false", help="the surface alone")
    parser.add_argument("--cold", dest="warm", action="store_false", help="every frame for itself")
    parser.add_argument("--out", type=Path, help="JSON")
    options = parser.parse_args()
    model = read_body(options.bundle / FILE)
    mean_joints = mean_pose_joints(model)
    body = maquette.Body(options.bundle)
    rows = {}
    for kind in ("true", "network") if options.labels == "both" else (options.labels,):
        densepose = None
        if kind == "network":
            densepose = maquette.DensePose(options.densepose, has_keypoints=True, preset=options.preset)
        found: list[Answer] = []
        for path in clip_paths(options.clips):
            clip = read_clip(path)
            found += answers(clip, body, Labels(clip, densepose), options, mean_joints)
        rows[kind] = {"all": summary(found), "whole": summary([answer for answer in found if answer.is_whole])}
        for group, row in rows[kind].items():
            print(f"{kind:8} {group:6}", "  ".join(f"{key} {value:.3g}" for key, value in row.items()))
    if options.out:
        options.out.write_text(json.dumps(rows, indent=2) + "\n")


def mean_pose_joints(model) -> np.ndarray:
    """Joints [19, 3] of the mean body in the mean pose of the prior, body axes."""
    from scipy.spatial.transform import Rotation

    local = Rotation.from_rotvec(np.concatenate([np.zeros((1, 3)), model.prior.mean.reshape(-1, 3)])).as_matrix()
    turn, place = [local[0]], [model.joint_rest[0]]
    for k, parent in enumerate(model.parents[1:], 1):
        turn.append(turn[parent] @ local[k])
        place.append(place[parent] + turn[parent] @ (model.joint_rest[k] - model.joint_rest[parent]))
    return np.array(place)


if __name__ == "__main__":
    main()
