"""Where MediaPipe's 468 face points lie on the template head, by showing its network images of made heads.

    python -m export.heads.photos.face_points --data .data/heads/views --out export/heads/photos/face_points.json

Of each head one image from the front is shown; a point's place is the median of the template points at the pixels
where the network puts it. Points that wander over the heads (the outline of the face, what hair covers) are marked as
not used. Writes the JSON and, beside it in .data, an image of the points on a held-out head.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from tqdm import tqdm

from export.heads.head_shards import LABEL_STEP, POINT_SCALE, HeadImages, read_pictures

FILE = Path(__file__).with_name("face_points.json")
MAX_YAW, MAX_PITCH, MAX_ROLL = np.radians(30), np.radians(25), np.radians(25)
MAX_SPREAD = 0.05  # dm; of a point over heads
MIN_SEEN = 0.6  # share of the images in which the point lies on the head
_GREY = 127


@dataclass(frozen=True)
class FacePoints:
    """template float64 [468, 3] dm; normal [468, 3] there, outwards, in the head's frame; spread [468] dm, median
    distance over heads; seen [468], share of images with the point on the head; used bool [468]."""

    template: np.ndarray
    normal: np.ndarray
    spread: np.ndarray
    seen: np.ndarray
    used: np.ndarray


def read_face_points(path: Path = FILE) -> FacePoints:
    """Raises ValueError where the file is of another form."""
    stored = json.loads(path.read_text())
    if stored.get("columns") != _COLUMNS:
        raise ValueError(f"{path} has other columns: make it again with `python -m export.heads.photos.face_points`.")
    rows = np.array(stored["points"], np.float64)
    return FacePoints(rows[:, :3], rows[:, 3:6], rows[:, 6], rows[:, 7], rows[:, 8] > 0)


_COLUMNS = ["x", "y", "z", "normal_x", "normal_y", "normal_z", "spread", "seen", "used"]


def write_face_points(points: FacePoints, made: dict, path: Path) -> None:
    rows = np.concatenate(
        [points.template, points.normal, points.spread[:, None], points.seen[:, None], points.used[:, None]], 1
    )
    text = ",\n".join(json.dumps([round(float(v), 4) if v % 1 else int(v) for v in row]) for row in rows)
    head = json.dumps({"unit": "dm", **made, "columns": _COLUMNS}, indent=1)
    path.write_text(head[:-2] + ',\n "points": [\n' + text + "\n]\n}\n")


def frontal(pictures: HeadImages) -> np.ndarray:
    """Numbers of the images that show the face upright and from the front, the most frontal first."""
    rotation, shift = pictures.rotation.astype(np.float64), pictures.shift.astype(np.float64)
    camera = -np.einsum("kij,ki->kj", rotation, shift)  # in the head's frame
    yaw = np.arctan2(camera[:, 0], -camera[:, 1])
    pitch = np.arcsin(camera[:, 2] / np.linalg.norm(camera, axis=1))
    roll = np.arctan2(rotation[:, 0, 2], -rotation[:, 1, 2])
    kept = (abs(yaw) < MAX_YAW) & (abs(pitch) < MAX_PITCH) & (abs(roll) < MAX_ROLL)
    numbers = np.flatnonzero(kept)
    return numbers[np.argsort(abs(yaw[numbers]))]


def on_template(pictures: HeadImages, k: int, pixels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Template points [N, 3] (dm) and normals [N, 3] (head's frame) at pixels [N, 2] of image k, NaN off the head.

    Between the stored pixels template points are mixed where the surface is one piece."""
    template = pictures.template[k].astype(np.float64) / POINT_SCALE
    normal = pictures.normal[k].astype(np.float64) @ pictures.rotation[k].astype(np.float64)
    known = (pictures.normal[k] != 0).any(-1) & (pictures.masks[k][::LABEL_STEP, ::LABEL_STEP] == 255)
    at = pixels / LABEL_STEP
    last = len(template) - 1
    inside = ((at >= 0) & (at <= last)).all(1)
    low = np.clip(np.floor(at), 0, last - 1).astype(int)
    share = np.clip(at - low, 0, 1)
    found, weights = np.zeros((len(at), 6)), np.zeros(len(at))
    nearest = np.clip(np.round(at), 0, last).astype(int)
    there = template[nearest[:, 1], nearest[:, 0]]
    inside &= known[nearest[:, 1], nearest[:, 0]]
    for dy in (0, 1):
        for dx in (0, 1):
            x, y = low[:, 0] + dx, low[:, 1] + dy
            weight = abs(1 - dx - share[:, 0]) * abs(1 - dy - share[:, 1])
            one = known[y, x] & (np.linalg.norm(template[y, x] - there, axis=1) < 0.15)
            found += (weight * one)[:, None] * np.concatenate([template[y, x], normal[y, x]], 1)
            weights += weight * one
    inside &= weights > 0
    with np.errstate(invalid="ignore"):
        found = np.where(inside[:, None], found / np.where(inside, weights, 1)[:, None], np.nan)
        return found[:, :3], found[:, 3:] / np.linalg.norm(found[:, 3:], axis=1, keepdims=True)


def shown(pictures: HeadImages, k: int) -> np.ndarray:
    """Image k before grey, BGR."""
    empty = pictures.masks[k] == 0
    return np.where(empty[..., None], np.uint8(_GREY), pictures.rgb[k])[..., ::-1].copy()


def median_points(template: np.ndarray, normal: np.ndarray) -> FacePoints:
    """template, normal: [K, 468, 3] of K images, NaN where off the head."""
    seen = np.isfinite(template[..., 0]).mean(0)
    if (seen == 0).any():
        raise ValueError("some points lie on no head at all: show more pictures.")
    middle = np.nanmedian(template, 0)
    spread = np.nanmedian(np.linalg.norm(template - middle, axis=2), 0)
    outward = np.nanmean(normal, 0)
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    return FacePoints(middle, outward, spread, seen, (spread < MAX_SPREAD) & (seen > MIN_SEEN))


def asymmetry(points: FacePoints) -> float:
    """Median distance (dm) from a used point's mirror image to the nearest point."""
    mirrored = points.template[points.used] * [-1, 1, 1]
    away = np.linalg.norm(mirrored[:, None] - points.template[None], axis=2)
    return float(np.median(away.min(1)))


def collect(folder: Path, count: int) -> tuple[np.ndarray, np.ndarray, int]:
    """Template points and normals [K, 468, 3] of the first `count` heads with a face found, and how many were shown."""
    from export.teachers.faces import POINTS, FaceDetector, FaceNetwork, faces_of

    detector, network = FaceDetector(), FaceNetwork()
    rows, asked = [], 0
    for path in tqdm(sorted(folder.glob("head-[0-9]*[0-9].npz"))[: 2 * count], unit="head"):
        pictures = read_pictures(path)
        for k in frontal(pictures)[:1]:
            asked += 1
            faces = faces_of(detector, network, shown(pictures, k))
            if faces:
                rows.append(on_template(pictures, k, faces[0].point))
        if len(rows) == count:
            break
    if not rows:
        raise FileNotFoundError(f"{folder} holds no pictures: run `python -m export.heads.view_shards train`")
    template, normal = (np.stack(column) for column in zip(*rows, strict=True))
    assert template.shape[1] == POINTS
    return template, normal, asked


def drawn(points: FacePoints, pictures: HeadImages, k: int, zoom: int = 3) -> np.ndarray:
    """Image k with the points where its template labels say they are: used ones green, others red. BGR."""
    image = cv2.resize(shown(pictures, k), None, fx=zoom, fy=zoom, interpolation=cv2.INTER_CUBIC)
    template = pictures.template[k].astype(np.float64) / POINT_SCALE
    y, x = np.nonzero((pictures.normal[k] != 0).any(-1))
    for point, used in zip(points.template, points.used, strict=True):
        away = np.linalg.norm(template[y, x] - point, axis=1)
        near = int(away.argmin())
        if away[near] < 0.08:
            at = (np.array([x[near], y[near]]) * LABEL_STEP * zoom).tolist()
            cv2.circle(image, at, 2, (0, 230, 0) if used else (0, 0, 255), -1)
    return image


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=Path(".data/heads/views"))
    parser.add_argument("--count", type=int, default=300, help="images, one a head")
    parser.add_argument("--out", type=Path, default=FILE)
    parser.add_argument("--picture", type=Path, default=Path(".data/heads/face_points.png"))
    arguments = parser.parse_args()
    cv2.setNumThreads(1)
    template, normal, asked = collect(arguments.data / "train", arguments.count)
    points = median_points(template, normal)
    made = {
        "made": "export.heads.photos.face_points: MediaPipe face_landmark.tflite (Apache-2.0), shown made heads",
        "pictures": len(template), "shown": asked, "asymmetry": round(asymmetry(points), 4),
    }  # fmt: skip
    write_face_points(points, made, arguments.out)
    heads = [read_pictures(path) for path in sorted((arguments.data / "val").glob("head-[0-9]*[0-9].npz"))[:6]]
    cells = [drawn(points, head, frontal(head)[0]) for head in heads if len(frontal(head))][:4]
    if cells:
        cv2.imwrite(str(arguments.picture), np.hstack(cells))
    spread = points.spread * 100
    print(
        f"{len(template)} of {asked} faces found; {points.used.sum()} points used; spread of all "
        f"{np.median(spread):.1f} mm, of used {np.median(spread[points.used]):.1f}; "
        f"asymmetry {100 * asymmetry(points):.1f}"
    )


if __name__ == "__main__":
    main()
