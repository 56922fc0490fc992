"""Draws the bodies of a .glb file that `maquette body` wrote, over frames of their clip or on a plain ground.

    maquette body clip.mp4 --out bodies.glb
    python -m export.body.picture bodies.glb --frames clip.mp4 --at 0.5 1.5 2.5 --out bodies.png

A reader of its own for these files, independent of the SDK: nodes, skins and animations by the rules of glTF 2.0. The
camera is the one that the files assume: a focal length of 1.2 times the longer side, unless --focal-length is given.
"""

from __future__ import annotations

import argparse
import json
import struct
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

_TYPES = {5121: np.uint8, 5125: np.uint32, 5126: np.float32}
_WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_LIGHT = np.array([0.3, -0.45, -0.84])  # camera axes, from the light


@dataclass(frozen=True, eq=False)
class Glb:
    """json: the document. data: its bytes."""

    json: dict
    data: bytes

    @staticmethod
    def read(path: Path) -> Glb:
        """Raises ValueError for another file."""
        whole = path.read_bytes()
        magic, version, size, json_bytes, _ = struct.unpack_from("<4sIIII", whole)
        if magic != b"glTF" or version != 2 or size != len(whole):
            raise ValueError(f"{path} is not a .glb file of glTF 2.0.")
        return Glb(json.loads(whole[20 : 20 + json_bytes]), whole[28 + json_bytes :])

    def numbers(self, accessor: int) -> np.ndarray:
        """[count, width] of an accessor."""
        of = self.json["accessors"][accessor]
        view = self.json["bufferViews"][of["bufferView"]]
        width = _WIDTHS[of["type"]]
        values = np.frombuffer(self.data, _TYPES[of["componentType"]], of["count"] * width, view["byteOffset"])
        return values.reshape(-1, width) / 255 if of.get("normalized") else values.reshape(-1, width)

    def local(self, seconds: float) -> list[np.ndarray]:
        """Matrices [4, 4] of all nodes at a time: of the key that is nearest."""
        moved: dict[tuple[int, str], np.ndarray] = {}
        for animation in self.json.get("animations", ()):
            for channel in animation["channels"]:
                sampler = animation["samplers"][channel["sampler"]]
                times = self.numbers(sampler["input"])[:, 0]
                key = int(np.abs(times - seconds).argmin())
                moved[channel["target"]["node"], channel["target"]["path"]] = self.numbers(sampler["output"])[key]
        out = []
        for number, node in enumerate(self.json["nodes"]):
            matrix = np.eye(4)
            turn = moved.get((number, "rotation"), node.get("rotation"))
            shift = moved.get((number, "translation"), node.get("translation"))
            if turn is not None:
                matrix[:3, :3] = Rotation.from_quat(turn).as_matrix()
            if shift is not None:
                matrix[:3, 3] = shift
            out.append(matrix)
        return out

    def times(self, person: int) -> np.ndarray:
        """Times of the keys of a person's animation, seconds; [0] without one."""
        first = self.json["skins"][person]["joints"][0]
        for animation in self.json.get("animations", ()):
            for channel in animation["channels"]:
                if channel["target"]["node"] == first:
                    return self.numbers(animation["samplers"][channel["sampler"]]["input"])[:, 0]
        return np.zeros(1)

    def people(self, seconds: float, slack_s: float = 0.1) -> list[tuple[np.ndarray, np.ndarray]]:
        """Vertices [V, 3] in the world of the file and triangles [F, 3] of all people who have a key near a time."""
        world = self.local(seconds)
        for number, node in enumerate(self.json["nodes"]):
            for child in node.get("children", ()):  # parents come before their children
                world[child] = world[number] @ world[child]
        out = []
        for node in self.json["nodes"]:
            if "skin" not in node or np.abs(self.times(node["skin"]) - seconds).min() > slack_s:
                continue
            skin = self.json["skins"][node["skin"]]
            (primitive,) = self.json["meshes"][node["mesh"]]["primitives"]
            inverse = self.numbers(skin["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
            bones = np.stack([world[joint] for joint in skin["joints"]]) @ inverse
            part = {name: self.numbers(at) for name, at in primitive["attributes"].items()}
            rest = np.concatenate([part["POSITION"], np.ones((len(part["POSITION"]), 1))], 1)
            of_each = bones[part["JOINTS_0"].astype(int)] * part["WEIGHTS_0"][..., None, None]
            out.append((np.einsum("vij,vj->vi", of_each.sum(1), rest)[:, :3],
                        self.numbers(primitive["indices"]).reshape(-1, 3).astype(int)))  # fmt: skip
        return out


def drawn(image: np.ndarray, people: list[tuple[np.ndarray, np.ndarray]], focal_px: float) -> np.ndarray:
    """image: uint8 [H, W, 3] BGR. A copy with the people, from the farthest to the nearest triangle."""
    out, centre = image.copy(), np.array([image.shape[1] - 1, image.shape[0] - 1]) / 2
    corners = [(vertices * [1, -1, -1])[triangles] for vertices, triangles in people]
    every = np.concatenate(corners) if corners else np.zeros((0, 3, 3))
    every = every[(every[..., 2] > 0.1).all(1)]
    normal = np.cross(every[:, 1] - every[:, 0], every[:, 2] - every[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True) + 1e-12
    at = focal_px * every[..., :2] / every[..., 2:] + centre
    facing = (normal * every.mean(1)).sum(1) < 0
    shade = 0.35 + 0.65 * np.clip(normal @ _LIGHT, 0, 1)
    for k in np.argsort(-every[..., 2].mean(1)):
        if facing[k]:
            colour = (shade[k] * np.array([185, 205, 225])).tolist()
            cv2.fillConvexPoly(out, np.round(16 * at[k]).astype(np.int32), colour, cv2.LINE_AA, 4)
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("glb", type=Path)
    parser.add_argument("--frames", help="photo, clip or URI whose bodies these are")
    parser.add_argument("--at", type=float, nargs="+", default=[0.0], help="seconds")
    parser.add_argument("--focal-length", type=float, help="pixels")
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    glb, rows = Glb.read(options.glb), []
    frames = {}
    if options.frames:
        import maquette

        start = None
        for frame in maquette.Source(options.frames):
            start = frame.timestamp_ns if start is None else start
            frames[(frame.timestamp_ns - start) / 1e9] = frame.pixels()[..., ::-1].copy()
            if min(frames, key=lambda t: abs(t - max(options.at))) != max(frames):
                break
    for seconds in options.at:
        image = frames[min(frames, key=lambda t: abs(t - seconds))] if frames else np.full((480, 640, 3), 60, np.uint8)
        focal = options.focal_length or 1.2 * max(image.shape[:2])
        rows.append(np.vstack([image, drawn(image, glb.people(seconds), focal)]))
    cv2.imwrite(str(options.out), np.hstack(rows))


if __name__ == "__main__":
    main()
