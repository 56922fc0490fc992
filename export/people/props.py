"""Things beside people: furniture, what lies on it, what is held and worn; boxes, cylinders and discs with a texture.

Everything is background (label 0) and hides what is behind it, unless a prop carries points of the body's surface.
Axes as in `body.py`: x to the left of who sits, y to the back, z up; metres.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation


@dataclass(frozen=True)
class Prop:
    """corners [F, 3, 3] in world axes, uv [F, 3, 2] of a texture uint8 [h, w, 3] that repeats.

    points [F, 3, 3], if given, lie on the template's surface below each corner: the prop is worn and labelled.
    normals [F, 3, 3], if given, are those of a round surface; else each triangle is flat.
    """

    corners: np.ndarray
    uv: np.ndarray
    texture: np.ndarray
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0)
    specular: float = 0.0
    points: np.ndarray | None = None
    normals: np.ndarray | None = None

    def corners_in(self, rotation: np.ndarray, shift: np.ndarray) -> np.ndarray:
        """Position and normal of each corner in camera axes, float32 [F, 3, 6]."""
        at = self.corners @ rotation.T + shift
        if self.normals is None:
            normal = np.cross(at[:, 1] - at[:, 0], at[:, 2] - at[:, 0])
            normal = np.repeat(normal[:, None], 3, 1)
        else:
            normal = self.normals @ rotation.T
        normal = normal / (np.linalg.norm(normal, axis=2, keepdims=True) + 1e-12)
        return np.concatenate([at, normal], 2).astype(np.float32)

    def moved(self, x: float, y: float, yaw: float = 0.0) -> Prop:
        """Turned about the vertical through the origin by `yaw` radians, then shifted."""
        turn = Rotation.from_euler("z", yaw).as_matrix()
        normals = None if self.normals is None else self.normals @ turn.T
        return replace(self, corners=self.corners @ turn.T + [x, y, 0], normals=normals)


@dataclass(frozen=True)
class Solid:
    """corners [F, 3, 3] and uv [F, 3, 2] in metres."""

    corners: np.ndarray
    uv: np.ndarray

    def turned(self, turn: np.ndarray, centre=(0, 0, 0)) -> Solid:
        return Solid(self.corners @ np.asarray(turn).T + np.asarray(centre), self.uv)


def joined(*solids: Solid) -> Solid:
    return Solid(np.concatenate([s.corners for s in solids]), np.concatenate([s.uv for s in solids]))


def box(size, centre=(0, 0, 0)) -> Solid:
    """An axis-parallel box of `size` (x, y, z)."""
    corners, uv = [], []
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]]) / 2
    for axis in range(3):
        a, b = (k for k in range(3) if k != axis)
        for side in (-0.5, 0.5):
            face = np.zeros((6, 3))
            face[:, [a, b]], face[:, axis] = square, side
            corners.append(face * size)
            uv.append(square * [size[a], size[b]])
    return Solid(np.concatenate(corners).reshape(-1, 3, 3) + centre, np.concatenate(uv).reshape(-1, 3, 2))


def cylinder(radius: float, height: float, centre=(0, 0, 0), top: float | None = None, sides: int = 14) -> Solid:
    """An upright cylinder, or a cone with another radius at the top, with its lids."""
    angle = np.arange(sides + 1) * 2 * np.pi / sides
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], 1)
    low, high = ring * radius - [0, 0, height / 2], ring * (radius if top is None else top) + [0, 0, height / 2]
    around = np.stack([angle * radius, np.zeros_like(angle)], 1)
    a, b, c, d = low[:-1], low[1:], high[1:], high[:-1]
    wall = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    up = np.array([0, height])
    ua, ub = around[:-1], around[1:]
    wall_uv = np.concatenate([np.stack([ua, ub, ub + up], 1), np.stack([ua, ub + up, ua + up], 1)])
    lids = [np.stack([np.broadcast_to(r.mean(0), a.shape), r[:-1], r[1:]], 1) for r in (low, high)]
    return Solid(np.concatenate([wall, *lids]) + centre, np.concatenate([wall_uv, *(lid[..., :2] for lid in lids)]))


def sphere(radii, centre=(0, 0, 0), rings: int = 8, sides: int = 12) -> Solid:
    """An ellipsoid with half axes `radii`."""
    across, around = np.meshgrid(np.linspace(0, np.pi, rings + 1), np.linspace(0, 2 * np.pi, sides + 1), indexing="ij")
    at = np.stack([np.sin(across) * np.cos(around), np.sin(across) * np.sin(around), np.cos(across)], -1) * radii
    uv = np.stack([around, across], -1) * np.mean(radii)

    def triangles(grid: np.ndarray) -> np.ndarray:
        a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
        return np.stack([a, b, c, a, c, d], 2).reshape(-1, 3, grid.shape[-1])

    return Solid(triangles(at) + centre, triangles(uv))


def leaning(degrees: float) -> np.ndarray:
    """Rotation about x: positive leans the top to the back."""
    return Rotation.from_euler("x", -degrees, degrees=True).as_matrix()


class PropMaker:
    """Draws things at random, with textures of `cloth()` (uint8 [256, 256, 3], as `Fabrics.draw` gives)."""

    def __init__(self, cloth) -> None:
        self._cloth = cloth

    def finished(self, rng: np.random.Generator, *solids: Solid, repeats: float | None = None) -> Prop:
        """The solids with one texture for all: cloth, photo or plain paint."""
        solid = joined(*solids)
        texture = self._cloth(rng)[::4, ::4]
        u = rng.uniform
        repeats = u(0.4, 3) if repeats is None else repeats
        tint = tuple(u(0.4, 1.1) * (1 + rng.normal(0, 0.08, 3)))
        return Prop(solid.corners, solid.uv * repeats + u(0, 1, 2), texture, tint, u(0, 0.3) if u() < 0.3 else 0.0)

    def seat(self, rng: np.random.Generator, height: float, back: float) -> list[Prop]:
        """Under somebody whose buttocks are at the origin, `height` above the ground; the torso ends at y = `back`."""
        u = rng.uniform
        kind = rng.choice(["chair", "armchair", "stool", "bench", "sofa"], p=[0.4, 0.15, 0.12, 0.13, 0.2])
        if height < 0.25:
            kind = "sofa" if u() < 0.5 else "bench"
        width = {"chair": u(0.38, 0.5), "armchair": u(0.5, 0.65), "stool": u(0.3, 0.42), "bench": u(0.9, 2.0),
                 "sofa": u(1.2, 2.4)}[kind]  # fmt: skip
        front = u(-0.32, -0.12)
        depth = back - front
        middle = (front + back) / 2
        off = u(-0.3, 0.3) * width if kind in ("bench", "sofa") else 0.0
        if kind == "stool":
            return [
                self.finished(
                    rng,
                    cylinder(width / 2, 0.05, (0, 0, height - 0.025)),
                    cylinder(u(0.02, 0.05), max(height - 0.05, 0.05), (0, 0, (height - 0.05) / 2)),
                    cylinder(0.2, 0.02, (0, 0, 0.01)),
                )
            ]
        thick = u(0.03, 0.09) if kind in ("chair", "bench") else min(u(0.15, 0.35), height)
        parts = [box((width, depth, thick), (off, middle, height - thick / 2))]
        leg = max(height - thick, 0.01)
        for x in (-1, 1):
            for y in (front + 0.03, back - 0.03):
                parts.append(box((0.035, 0.035, leg), (off + x * (width / 2 - 0.03), y, leg / 2)))
        if kind != "bench" or u() < 0.4:
            tall = u(0.3, 0.55) if kind in ("chair", "bench") else u(0.35, 0.75)
            gap = 0.0 if kind == "sofa" else u(0, 0.15)
            rest = box((width * u(0.85, 1), 0.04 if kind == "chair" else u(0.06, 0.2), tall), (0, 0, tall / 2))
            parts.append(rest.turned(leaning(u(0, 12)), (off, back + 0.04, height + gap)))
            if gap:
                parts += [box((0.03, 0.03, gap + 0.05), (off + x * width * 0.4, back + 0.03, height + gap / 2))
                          for x in (-1, 1)]  # fmt: skip
        if kind in ("armchair", "sofa") and u() < 0.7:
            arm = u(0.05, 0.18)
            high = u(0.15, 0.28)
            parts += [
                box((arm, depth, high), (off + x * (width + arm) / 2, middle, height + high / 2)) for x in (-1, 1)
            ]
        return [self.finished(rng, *parts)]

    def bed(self, rng: np.random.Generator, low, high) -> list[Prop]:
        """A sofa, bed or mat under somebody who lies on z = `low[2]` between `low` and `high` (x, y)."""
        u = rng.uniform
        x0, y0, z = low
        x1, y1, _ = high
        margin = u(-0.05, 0.4, 4)
        size = np.array([x1 - x0 + margin[0] + margin[1], y1 - y0 + margin[2] + margin[3], max(z, 0.02)])
        centre = ((x0 - margin[0] + x1 + margin[1]) / 2, (y0 - margin[2] + y1 + margin[3]) / 2, size[2] / 2)
        return [self.finished(rng, box(size, centre))]

    def table(self, rng: np.random.Generator, height: float, front: float) -> list[Prop]:
        """A table whose near edge is at y = `front` (it reaches towards -y), with things on it."""
        u = rng.uniform
        width, depth, thick = u(0.7, 2.0), u(0.45, 0.9), u(0.02, 0.06)
        middle, off = front - depth / 2, u(-0.25, 0.25)
        parts = [box((width, depth, thick), (off, middle, height - thick / 2))]
        if u() < 0.6:
            for x in (-1, 1):
                for y in (-1, 1):
                    at = (off + x * (width / 2 - 0.05), middle + y * (depth / 2 - 0.05), (height - thick) / 2)
                    parts.append(box((0.05, 0.05, height - thick), at))
        else:
            parts.append(
                box((width * u(0.5, 1), 0.03, height - thick), (off, front - depth * u(0.1, 0.95), height / 2))
            )
        props = [self.finished(rng, *parts)]
        for _ in range(rng.integers(0, 5)):
            at = (off + u(-0.45, 0.45) * width, middle + u(-0.4, 0.4) * depth)
            thing = self.small(rng, at, height)
            props.append(thing)
        if u() < 0.45:
            props += self.screen(rng, (u(-0.15, 0.15), front - u(0.22, 0.4)), height)
        return props

    def screen(self, rng: np.random.Generator, at, z: float) -> list[Prop]:
        """A laptop or a monitor that looks towards +y."""
        u = rng.uniform
        turn = Rotation.from_euler("z", rng.normal(0, 12), degrees=True).as_matrix()
        place = (at[0], at[1], z)
        if u() < 0.7:
            lid = box((0.34, 0.008, 0.23), (0, 0, 0.115)).turned(leaning(-u(5, 30)), (0, -0.12, 0.015))
            parts = [box((0.34, 0.24, 0.015), (0, 0, 0.008)), lid]
        else:
            width = u(0.45, 0.75)
            panel = box((width, 0.03, width * 0.58), (0, 0, 0.1 + width * 0.29))
            parts = [panel, box((0.06, 0.03, 0.15), (0, -0.03, 0.07)), box((0.22, 0.18, 0.015), (0, -0.02, 0.008))]
        grey = np.full((1, 1, 3), rng.choice([25, 40, 120, 190, 225]), np.uint8)
        solid = joined(*parts).turned(turn, place)
        return [Prop(solid.corners, solid.uv, grey, specular=u(0, 0.4))]

    def small(self, rng: np.random.Generator, at, z: float) -> Prop:
        """A cup, bottle, book, box, bowl, plant pot or ball that stands on height z."""
        u = rng.uniform
        x, y = at
        kind = rng.integers(6)
        if kind == 0:
            solid = cylinder(0.036, 0.1, (x, y, z + 0.05), top=0.042)
        elif kind == 1:
            solid = joined(cylinder(0.036, 0.2, (x, y, z + 0.1)), cylinder(0.033, 0.07, (x, y, z + 0.235), top=0.014))
        elif kind == 2:
            turn = Rotation.from_euler("z", u(0, 3)).as_matrix()
            solid = box((0.15, 0.22, u(0.01, 0.06))).turned(turn, (x, y, z + 0.03))
        elif kind == 3:
            size = u(0.06, 0.4, 3)
            solid = box(size, (x, y, z + size[2] / 2))
        elif kind == 4:
            pot = u(0.05, 0.12)
            solid = cylinder(pot * 0.8, 2 * pot, (x, y, z + pot), top=pot)
            for _ in range(4):
                dx, dy = rng.normal(0, 0.08, 2)
                solid = joined(solid, sphere(u(0.04, 0.2, 3), (x + dx, y + dy, z + 2 * pot + u(0, 0.3))))
        else:
            radius = u(0.04, 0.15)
            solid = sphere(np.full(3, radius), (x, y, z + radius))
        return self.finished(rng, solid, repeats=u(1, 8))

    def standing(self, rng: np.random.Generator) -> Prop:
        """Something that stands on the ground at the origin: what a careless eye may take for a person is among it."""
        u = rng.uniform
        kind = rng.integers(6)
        tall = u(0.5, 1.9)
        if kind == 0:  # cupboard, wall, sign
            size = (u(0.3, 1.6), u(0.03, 0.6), tall)
            solid = box(size, (0, 0, tall / 2))
        elif kind == 1:  # post, tree trunk, bin
            radius = u(0.03, 0.3)
            solid = cylinder(radius, tall, (0, 0, tall / 2), top=radius * u(0.6, 1.1))
        elif kind == 2:  # floor lamp, parasol, bollard with a round top
            top = u(0.1, 0.3)
            solid = joined(cylinder(u(0.01, 0.08), tall, (0, 0, tall / 2)), sphere(u(0.8, 1.2, 3) * top, (0, 0, tall)))
        elif kind == 3:  # coat on a stand, sack, shop-window dummy without limbs
            width = u(0.12, 0.24)
            solid = joined(
                cylinder(width * u(0.7, 1), tall * 0.6, (0, 0, tall * 0.62), top=width * u(0.5, 1)),
                cylinder(0.02, tall * 0.4, (0, 0, tall * 0.2)),
                sphere((width, width * 0.7, 0.08), (0, 0, tall * 0.92)),
            )
        elif kind == 4:  # railing, fence
            width = u(1, 4)
            high = u(0.7, 1.1)
            bars = [box((0.025, 0.025, high), (x, 0, high / 2)) for x in np.arange(-width / 2, width / 2, u(0.1, 0.4))]
            solid = joined(box((width, 0.05, 0.05), (0, 0, high)), *bars)
        else:  # bush, balloons, boxes
            solid = joined(
                *(sphere(u(0.1, 0.35, 3), (*rng.normal(0, 0.25, 2), u(0.1, tall))) for _ in range(rng.integers(2, 7)))
            )
        return self.finished(rng, solid)

    def held(self, rng: np.random.Generator, hand: np.ndarray, arm: np.ndarray) -> Prop:
        """A phone, cup, bottle, book, bag or ball in a hand; `hand` and `arm`: middles of hand and lower arm [3]."""
        u = rng.uniform
        along = (hand - arm) / (np.linalg.norm(hand - arm) + 1e-9)
        turn = Rotation.from_euler("xyz", rng.normal(0, [0.3, 0.3, 1.5])).as_matrix()
        grip = hand + along * u(0, 0.04) + rng.normal(0, 0.012, 3)
        kind = rng.choice(6, p=[0.35, 0.2, 0.1, 0.15, 0.15, 0.05])
        if kind == 0:
            phone = box((0.075, 0.009, 0.15)).turned(turn, grip + [0, 0, 0.04])
            grey = np.full((1, 1, 3), rng.choice([15, 30, 60, 220]), np.uint8)
            return Prop(phone.corners, phone.uv, grey, specular=0.3)
        if kind == 1:
            solid = cylinder(0.035, 0.1, top=0.042).turned(turn, grip)
        elif kind == 2:
            solid = joined(cylinder(0.034, 0.18), cylinder(0.033, 0.06, (0, 0, 0.12), top=0.014)).turned(turn, grip)
        elif kind == 3:
            solid = box((u(0.12, 0.32), u(0.005, 0.04), u(0.18, 0.3))).turned(turn, grip)
        elif kind == 4:
            high = u(0.2, 0.4)
            size = (u(0.08, 0.2), u(0.2, 0.4), high)
            about = Rotation.from_euler("z", u(0, 3)).as_matrix()
            strap = box((0.01, size[1] * 0.6, 0.1), (0, 0, high / 2 + 0.05))
            solid = joined(box(size), strap).turned(about, grip - [0, 0, high / 2 + 0.1])
        else:
            radius = u(0.06, 0.13)
            solid = sphere(np.full(3, radius), grip + along * radius)
        return self.finished(rng, solid, repeats=u(1, 8))

    def room(self, rng: np.random.Generator, eye: np.ndarray, far: float) -> list[Prop]:
        """A floor at z = 0 and a wall at y = `far` behind everybody, perhaps one at a side."""
        u = rng.uniform
        floor = box((16, 16, 0.02), (eye[0], far - 7.9, -0.011))
        wall = box((16, 0.05, 6), (eye[0], far, 2.9))
        props = [self.finished(rng, floor, repeats=u(0.3, 2)), self.finished(rng, wall, repeats=u(0.1, 1.2))]
        # Most walls are light.
        props[1] = replace(props[1], tint=tuple(u(0.8, 1.5) * np.array(props[1].tint)))
        if u() < 0.5:
            side = 1 if u() < 0.5 else -1
            props.append(self.finished(rng, box((0.05, 16, 6), (eye[0] + side * u(1.5, 4), far - 7.9, 2.9))))
        if u() < 0.5:  # a window, a door or an image
            size, high = u(0.4, 1.6, 2), u(0.9, 2)
            props.append(
                self.finished(rng, box((size[0], 0.04, size[1]), (eye[0] + u(-2, 2), far - 0.05, high)), repeats=0.7)
            )
        return props
