"""A made-up place: a room with coloured boxes, painted by casting rays; exact cameras, cloud and depth."""

import json
from pathlib import Path

import cv2
import numpy as np

from export.camera import Camera


class BoxScene:
    """Checkered boxes [B, 2, 3] (least and greatest corner), the first of them the room around the others. Up is y."""

    def __init__(self, seed: int, boxes: int = 5) -> None:
        rng = np.random.default_rng(seed)
        centre = np.c_[rng.uniform(-1, 1, boxes), np.zeros(boxes), rng.uniform(-1, 1, boxes)]
        half = rng.uniform(0.15, 0.4, (boxes, 3))
        centre[:, 1] = half[:, 1] - 1
        room = np.array([[[-3, -1, -3], [3, 2, 3]]], float)
        self.boxes = np.concatenate([room, np.stack([centre - half, centre + half], 1)])
        self.colours = rng.uniform(0.1, 1, (boxes + 1, 3, 2, 3))  # box, axis of the face, square, RGB

    def cast(self, origin: np.ndarray, ray: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rays [..., 3] from a point: distances in lengths of the ray, colours [..., 3]."""
        ray = np.where(np.abs(ray) < 1e-9, 1e-9, ray)
        nearest, colour = np.full(ray.shape[:-1], np.inf), np.zeros(ray.shape)
        for k, (low, high) in enumerate(self.boxes):
            first, last = (low - origin) / ray, (high - origin) / ray
            enter, leave = np.minimum(first, last), np.maximum(first, last)
            # The room is seen from inside: its far wall counts.
            axis = leave.argmin(-1) if k == 0 else enter.argmax(-1)
            distance = leave.min(-1) if k == 0 else enter.max(-1)
            hit = distance > 0 if k == 0 else (enter.max(-1) < leave.min(-1)) & (enter.max(-1) > 0)
            hit &= distance < nearest
            place = origin + distance[..., None] * ray
            square = np.floor(place * 3 + 1e-6)
            keep = np.arange(3) != axis[..., None]
            parity = (np.where(keep, square, 0).sum(-1) % 2).astype(int)
            nearest = np.where(hit, distance, nearest)
            colour = np.where(hit[..., None], self.colours[k][axis, parity], colour)
        return nearest, colour

    def photo(self, camera: Camera, samples: int = 2) -> tuple[np.ndarray, np.ndarray]:
        """RGB [H, W, 3] in 0..1, several rays a pixel, and depth [H, W] along the axis at the centre of each."""
        total = 0
        for dy in (np.arange(samples) + 0.5) / samples - 0.5:
            for dx in (np.arange(samples) + 0.5) / samples - 0.5:
                total = total + self.cast(camera.centre, self._rays(camera, dx, dy))[1]
        depth, _ = self.cast(camera.centre, self._rays(camera, 0, 0))
        return (total / samples**2).astype(np.float32), depth

    @staticmethod
    def _rays(camera: Camera, dx: float, dy: float) -> np.ndarray:
        x, y = np.meshgrid(np.arange(camera.width_px) + dx, np.arange(camera.height_px) + dy)
        seen = np.stack([(x - camera.cx_px) / camera.fx_px, (y - camera.cy_px) / camera.fy_px, np.ones_like(x)], -1)
        return seen @ camera.rotation

    def cloud(self, cameras: list[Camera], every: int = 1) -> tuple[np.ndarray, np.ndarray]:
        """Places [P, 3] and colours [P, 3] of every so-manieth pixel of all cameras."""
        places, colours = [], []
        for camera in cameras:
            depth, colour = self.cast(camera.centre, self._rays(camera, 0, 0))
            rays = self._rays(camera, 0, 0)
            places.append((camera.centre + depth[..., None] * rays)[::every, ::every].reshape(-1, 3))
            colours.append(colour[::every, ::every].reshape(-1, 3))
        return np.concatenate(places), np.concatenate(colours)


def looking(centre, at, width: int = 96, height: int = 64, roll: float = 0.0, focal: float = 0.9) -> Camera:
    """A camera with up = y, rolled about its axis by so many radians."""
    forward = np.subtract(at, centre) / np.linalg.norm(np.subtract(at, centre))
    right = np.cross(forward, (0, 1, 0))
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    cosine, sine = np.cos(roll), np.sin(roll)
    rotation = np.stack([cosine * right + sine * down, cosine * down - sine * right, forward])
    middle = width / 2 - 0.5, height / 2 - 0.5
    return Camera(width, height, focal * width, focal * width, *middle, rotation, np.asarray(centre, float))


def ring(count: int, width: int = 96, height: int = 64, seed: int = 0) -> list[Camera]:
    """Cameras on an arc, a little rolled, as held by hand."""
    rng = np.random.default_rng(seed)
    angles = np.linspace(-0.8, 0.8, count)
    places = [(2.4 * np.sin(a), rng.uniform(-0.1, 0.6), 2.4 * np.cos(a)) for a in angles]
    return [looking(place, (0, -0.5, 0), width, height, rng.normal(0, 0.05)) for place in places]


def write_capture(folder: Path, seed: int, views: int = 8, width: int = 96, height: int = 64) -> None:
    """transforms.json, PNG photos and a binary cloud."""
    folder.mkdir(parents=True)
    scene, cameras, frames = BoxScene(seed), ring(views, width, height, seed), []
    for k, camera in enumerate(cameras):
        image, _ = scene.photo(camera)
        cv2.imwrite(str(folder / f"{k}.png"), np.rint(image[..., ::-1] * 255).astype(np.uint8))
        matrix = np.eye(4)
        matrix[:3, :3] = camera.rotation.T * (1, -1, -1)
        matrix[:3, 3] = camera.centre
        frames.append({"file_path": f"{k}.png", "transform_matrix": matrix.tolist()})
    first = cameras[0]
    table = {"w": width, "h": height, "fl_x": first.fx_px, "fl_y": first.fy_px}
    table |= {"cx": first.cx_px + 0.5, "cy": first.cy_px + 0.5, "frames": frames}
    (folder / "transforms.json").write_text(json.dumps(table))
    write_ply(folder / "cloud.ply", *scene.cloud(cameras, every=2))


def write_ply(path: Path, places: np.ndarray, colours: np.ndarray) -> None:
    rows = np.zeros(len(places), [(n, "<f4") for n in "xyz"] + [(n, "u1") for n in ("red", "green", "blue")])
    for k, axis in enumerate("xyz"):
        rows[axis] = places[:, k]
    for k, name in enumerate(("red", "green", "blue")):
        rows[name] = np.rint(colours[:, k] * 255)
    fields = "".join(f"property float {n}\n" for n in "xyz")
    fields += "".join(f"property uchar {n}\n" for n in ("red", "green", "blue"))
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(rows)}\n{fields}end_header\n"
    path.write_bytes(header.encode() + rows.tobytes())
