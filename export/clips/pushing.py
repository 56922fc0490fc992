"""Clips `pushing`: a robot arm pushes things about a table, as in the BAIR data set (physics: PyBullet).

Arm, things, table, room, light, camera and frame rate are drawn anew for each clip. Splits share no thing; the two arms
(Franka Panda, KUKA iiwa) are in all of them.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np
import pybullet
import pybullet_data
from pybullet_utils.bullet_client import BulletClient
from scipy.spatial.transform import Rotation

from export.camera import Camera
from export.clips.clip import FRAMES, LARGE_PX, SPLITS, Clip, generator
from export.clips.film import filmed
from export.clips.render import PATTERNS, Light, Moment, Renderer, Surface, Thing
from export.places.mesh import flat_normals, read_obj, smooth_normals

VERSION = "pushing-1"
RATES_FPS = (10, 15, 30)
STEPS_PER_S = 240
_CONTROL_STEPS = 8  # between two commands to the arm
_MIDDLE = np.array([0.52, 0.0, 0.0])  # of where things lie, metres from the arm's foot
_SIDE_M = (0.22, 0.30)  # half the sides of that area
_MISSING = {948}  # thing without a mesh in the package
_ASSETS = [
    {"name": "pybullet 3.2.7", "licence": "zlib", "used": "random_urdfs"},
    {"name": "pybullet 3.2.7: franka_panda", "licence": "Apache-2.0", "used": "arm"},
    {"name": "pybullet 3.2.7: kuka_iiwa", "licence": "BSD-2-Clause", "used": "arm"},
]


def things_of(split: str) -> list[int]:
    """Numbers of the package's random things of a split: of ten, one is for val and one for test."""
    at = {8: "val", 9: "test"}
    return [k for k in range(1000) if at.get(k % 10, "train") == split and k not in _MISSING]


@lru_cache(maxsize=256)
def _mesh(path: str) -> np.ndarray:
    """Corners [F, 3, 3] of a mesh of the package, in the file's units."""
    file = Path(path)
    if file.suffix.lower() == ".stl":  # the same mesh lies beside it
        file = file.with_suffix(".obj")
    return np.concatenate([corners for corners, _, _ in read_obj(file)]).astype(np.float32)


def box(half: np.ndarray, middle: np.ndarray, inward: bool = False) -> np.ndarray:
    """Corners float32 [12, 3, 3] of a box, half: half its sides; inward: seen from within."""
    faces = []
    for axis in range(3):
        for sign in (-1, 1):
            u, v = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
            n = sign * np.eye(3)[axis]
            quad = [n - u - v, n + u - v, n + u + v, n - u + v]
            if (sign < 0) != inward:
                quad = quad[::-1]
            faces += [[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]
    return (np.array(faces) * half + middle).astype(np.float32)


def _surface(rng: np.random.Generator, dull: bool = False) -> Surface:
    colour, second = rng.uniform(0.15, 0.95, (2, 3))
    if dull:
        colour = colour.mean() + 0.35 * (colour - colour.mean())
        second = colour + 0.5 * (second - colour)
    return Surface(
        tuple(colour), tuple(second), str(rng.choice(PATTERNS, p=[0.4, 0.15, 0.2, 0.25])),
        float(np.exp(rng.uniform(np.log(6), np.log(40)))), float(rng.uniform(0, 0.4)), float(rng.uniform(8, 60)),
    )  # fmt: skip


def _pose(position: np.ndarray, quaternion: np.ndarray) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = Rotation.from_quat(quaternion).as_matrix(), position
    return pose


class _Stage:
    """The physics of one clip, and what of it is drawn: things with the bodies and links that move them."""

    def __init__(self, client: BulletClient, split: str, rng: np.random.Generator) -> None:
        self.client, self.rng = client, rng
        self.things: list[Thing] = []
        self.moved_by: list[tuple[int, int, np.ndarray] | None] = []  # body, link, mesh in the link's mass frame
        client.setGravity(0, 0, -9.81)
        client.setTimeStep(1 / STEPS_PER_S)
        client.setPhysicsEngineParameter(deterministicOverlappingPairs=1)
        self._room()
        self._arm()
        self._put_things(split)

    def _still(self, corners: np.ndarray, surface: Surface, solid: bool, casts: bool = True) -> None:
        self.things.append(Thing(corners, flat_normals(corners), surface, casts))
        self.moved_by.append(None)
        if solid:
            low, high = corners.reshape(-1, 3).min(0), corners.reshape(-1, 3).max(0)
            shape = self.client.createCollisionShape(pybullet.GEOM_BOX, halfExtents=((high - low) / 2).tolist())
            self.client.createMultiBody(0, shape, basePosition=((high + low) / 2).tolist())

    def _room(self) -> None:
        rng = self.rng
        self._still(box(np.array([3, 3, 1.8]), np.array([0, 0, 1.0]), inward=True), _surface(rng, True), False, False)
        half = np.array([rng.uniform(0.5, 0.8), rng.uniform(0.6, 1.0), 0.02])
        self._still(box(half, np.array([0.4, 0, -0.02])), _surface(rng, True), True)
        if rng.uniform() < 0.5:  # a tray around the things
            wall, height = _surface(rng), rng.uniform(0.02, 0.05)
            for axis in (0, 1):
                for sign in (-1, 1):
                    side = np.array([_SIDE_M[0] + 0.05, _SIDE_M[1] + 0.05, height])
                    at = _MIDDLE + [0, 0, height]
                    at[axis] += sign * side[axis]
                    side[axis] = 0.01
                    self._still(box(side, at), wall, True)

    def _add_body(self, body: int, surfaces: list[Surface]) -> None:
        count = self.client.getNumJoints(body)
        drawn = 0
        for link in range(-1, count):
            for shape in self.client.getCollisionShapeData(body, link):
                corners = _mesh(shape[4].decode()) * np.array(shape[3], np.float32)
                self.things.append(Thing(corners, smooth_normals(corners), surfaces[drawn % len(surfaces)]))
                self.moved_by.append((body, link, _pose(shape[5], shape[6])))
                drawn += 1

    def _arm(self) -> None:
        rng, client = self.rng, self.client
        is_panda = rng.uniform() < 0.6
        name = "franka_panda/panda.urdf" if is_panda else "kuka_iiwa/model.urdf"
        flags = pybullet.URDF_IGNORE_VISUAL_SHAPES
        self.arm = client.loadURDF(f"{pybullet_data.getDataPath()}/{name}", useFixedBase=True, flags=flags)
        self.tip, self.joints = (11, list(range(7))) if is_panda else (6, list(range(7)))
        self.tip_above = 0.0 if is_panda else 0.07  # the KUKA's last frame lies so far behind its tip
        self.rest = [0, -0.3, 0, -2.2, 0, 2.0, 0.8] if is_panda else [0, 0.5, 0, -1.6, 0, 1.0, 0]
        for joint, angle in zip(self.joints, self.rest, strict=True):
            client.resetJointState(self.arm, joint, angle)
        light, dark = (
            Surface(tuple(rng.uniform(0.55, 1) * np.array([1, 1, rng.uniform(0.8, 1)])), specular=0.4),
            _surface(rng),
        )
        self._add_body(self.arm, [light, light, dark] if rng.uniform() < 0.5 else [light])
        self._straight_down = client.getQuaternionFromEuler([np.pi, 0, rng.uniform(-np.pi, np.pi)])
        self.target = self._random_target()
        for _ in range(30):
            self._command(self.target, reset=True)

    def _put_things(self, split: str) -> None:
        rng, client = self.rng, self.client
        self.bodies = []
        for number in rng.choice(things_of(split), rng.integers(3, 9), replace=False):
            place = _MIDDLE + [*(rng.uniform(-1, 1, 2) * _SIDE_M), rng.uniform(0.05, 0.12)]
            turn = Rotation.random(random_state=int(rng.integers(1 << 31))).as_quat()
            body = client.loadURDF(
                f"{pybullet_data.getDataPath()}/random_urdfs/{number:03d}/{number:03d}.urdf", place.tolist(),
                turn.tolist(), globalScaling=float(rng.uniform(0.8, 1.4)), flags=pybullet.URDF_IGNORE_VISUAL_SHAPES,
            )  # fmt: skip
            client.changeDynamics(
                body, -1, mass=0.2, lateralFriction=float(rng.uniform(0.3, 0.8)), rollingFriction=0.002
            )
            self.bodies.append(body)
            self._add_body(body, [_surface(rng)])
        self.path = np.array(self._tip())
        for _ in range(STEPS_PER_S // 2):
            self._command(self.path)
            client.stepSimulation()
        self.speed = rng.uniform(0.15, 0.5)

    def _tip(self) -> tuple[float, float, float]:
        return self.client.getLinkState(self.arm, self.tip, computeForwardKinematics=True)[4]

    def _random_target(self) -> np.ndarray:
        return _MIDDLE + [*(self.rng.uniform(-1, 1, 2) * _SIDE_M), self.rng.uniform(0.03, 0.2)]

    def _next_target(self) -> np.ndarray:
        """Mostly past one of the things, low enough to push it."""
        if self.rng.uniform() < 0.25:
            return self._random_target()
        body = self.bodies[self.rng.integers(len(self.bodies))]
        at = np.array(self.client.getBasePositionAndOrientation(body)[0])
        ahead = at[:2] - self.path[:2]
        past = at[:2] + 0.08 * ahead / max(np.linalg.norm(ahead), 0.05) + self.rng.normal(0, 0.02, 2)
        limited = np.clip(past, _MIDDLE[:2] - _SIDE_M, _MIDDLE[:2] + _SIDE_M)
        return np.array([*limited, self.rng.uniform(0.02, 0.05)])

    def _command(self, at: np.ndarray, reset: bool = False) -> None:
        goal = [at[0], at[1], at[2] + self.tip_above]
        angles = self.client.calculateInverseKinematics(self.arm, self.tip, goal, self._straight_down)[:7]
        if reset:
            for joint, angle in zip(self.joints, angles, strict=True):
                self.client.resetJointState(self.arm, joint, angle)
            return
        self.client.setJointMotorControlArray(
            self.arm, self.joints, pybullet.POSITION_CONTROL, angles, forces=[120.0] * 7
        )

    def advance(self, steps: int) -> None:
        for step in range(steps):
            if step % _CONTROL_STEPS == 0:
                towards = self.target - self.path
                distance = float(np.linalg.norm(towards))
                reach = self.speed * _CONTROL_STEPS / STEPS_PER_S
                self.path = self.path + towards * min(1.0, reach / max(distance, 1e-9))
                if distance <= reach:
                    self.target = self._next_target()
                    self.speed = self.rng.uniform(0.15, 0.5)
                self._command(self.path)
            self.client.stepSimulation()

    def poses(self) -> np.ndarray:
        """Float64 [N, 4, 4] of all that is drawn."""
        out = []
        for source in self.moved_by:
            if source is None:
                out.append(np.eye(4))
                continue
            body, link, own = source
            if link < 0:
                position, turn = self.client.getBasePositionAndOrientation(body)
            else:
                position, turn = self.client.getLinkState(body, link, computeForwardKinematics=True)[:2]
            out.append(_pose(position, turn) @ own)
        return np.stack(out)


@lru_cache(maxsize=1)
def _client() -> BulletClient:
    """One a process: each connection prints a line of its own."""
    return BulletClient(pybullet.DIRECT)


def _camera(rng: np.random.Generator, aspect: float) -> Camera:
    azimuth, elevation = np.radians(rng.uniform(-75, 75)), np.radians(rng.uniform(22, 65))
    towards = np.array([np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)])
    middle = _MIDDLE + rng.normal(0, 0.04, 3) + [0, 0, 0.06]
    centre = middle + rng.uniform(0.75, 1.25) * towards
    forward = (middle - centre) / np.linalg.norm(middle - centre)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    height = 240
    width = round(height * aspect)
    focal = height / 2 / np.tan(np.radians(rng.uniform(34, 56)) / 2)
    return Camera.centred(width, height, focal, rotation, centre).rolled(rng.normal(0, 2))


def _light(rng: np.random.Generator) -> Light:
    azimuth, elevation = rng.uniform(0, 2 * np.pi), np.radians(rng.uniform(30, 80))
    towards = np.array([np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)])
    tint = 1 + rng.normal(0, 0.06, (3, 3))
    strength = rng.uniform(0.6, 1.2)
    return Light(
        strength * 0.5 * tint[0], strength * 0.25 * tint[1], strength * rng.uniform(0.3, 1.0) * tint[2], towards,
        _MIDDLE, 1.0,
    )  # fmt: skip


def pushing_clip(split: str, number: int, large: bool) -> Clip:
    """A function of split and number. large: whether with frames of 320 x 240 as well."""
    if split not in SPLITS:
        raise ValueError(f"split is {split!r}; it must be one of {', '.join(SPLITS)}")
    rng = generator("pushing", split, number)
    fps = int(rng.choice(RATES_FPS))
    aspect = LARGE_PX[0] / LARGE_PX[1] if large else float(rng.choice([1, 4 / 3, 16 / 9]))
    camera, light = _camera(rng, aspect), _light(rng)
    client = _client()
    client.resetSimulation()
    stage = _Stage(client, split, rng)
    moments = []
    for _ in range(FRAMES):
        stage.advance(STEPS_PER_S // fps)
        moments.append(Moment(stage.poses(), camera, {}))
    with Renderer(stage.things, light) as renderer:
        small, big = filmed(renderer, moments, large)
    facts = {"set": "pushing", "split": split, "number": number, "fps": fps, "generator": VERSION, "assets": _ASSETS}
    return Clip(small, big, facts)
