"""The recipe families of the training split: (random numbers, scale) to a solid that stands about the origin."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from OCP.TopoDS import TopoDS_Shape
from scipy.spatial.transform import Rotation

from export.solids import shapes as s
from export.solids.draw import (
    Rng,
    Scale,
    attempted,
    dims,
    outline,
    ring,
    rounded,
    row,
    spread,
    tilt,
    turn,
)


def primitive(rng: Rng, size: float) -> TopoDS_Shape:
    """A box, wedge, prism, cylinder, cone or sphere of about that size, standing at the origin."""
    w, d, h = size * rng.uniform(0.35, 1, 3)
    kind = rng.choice(6, p=[0.34, 0.12, 0.14, 0.2, 0.12, 0.08])
    if kind == 0:
        return s.box((w, d, h))
    if kind == 1:
        low = rng.uniform(0.0, 0.6) * h
        side = [(-w / 2, 0), (w / 2, 0), (w / 2, max(low, 0.05 * h)), (-w / 2, h)]
        upright = s.moved(s.prism(np.array(side), d), Rotation.from_euler("x", np.pi / 2).as_matrix())
        return s.moved(upright, None, (0, d / 2, 0))
    if kind == 2:
        return s.prism(ring(int(rng.integers(3, 9)), w / 2, rng.uniform(0, 6)), h)
    if kind == 3:
        return s.cylinder(w / 2, h)
    if kind == 4:
        return s.cone(w / 2, w / 2 * rng.choice([0.0, rng.uniform(0.2, 0.8)]), h)
    return s.moved(s.sphere(w / 2), None, (0, 0, w / 2 * rng.uniform(0.2, 1)))


def blocks(rng: Rng, scale: Scale) -> TopoDS_Shape:
    """Primitives fused, others cut away."""
    parts = [primitive(rng, scale.size * rng.uniform(0.6, 1))]
    for _ in range(rng.integers(1, 4)):
        rotation = turn(rng) if rng.random() < 0.6 else None
        shift = scale.size * rng.uniform(-0.3, 0.3, 3) * [1, 1, 0.5]
        if rng.random() < 0.5:
            shift[2] = 0
        parts.append(s.moved(primitive(rng, scale.size * rng.uniform(0.3, 0.8)), rotation, shift))
    shape = s.fused(parts)
    before = rng.random() < 0.3
    shape = rounded(rng, shape, scale) if before else shape
    tools = []
    for _ in range(rng.integers(0, 4)):
        rotation = tilt(rng, np.pi) if rng.random() < 0.5 else turn(rng)
        shift = scale.size * rng.uniform([-0.4, -0.4, 0], [0.4, 0.4, 0.8])
        tools.append(s.moved(primitive(rng, scale.size * rng.uniform(0.15, 0.5)), rotation, shift))
    shape = attempted(shape, s.cut, tools)
    return shape if before else rounded(rng, shape, scale)


def gem(rng: Rng, scale: Scale) -> TopoDS_Shape:
    """A box or cylinder cut by planes: flat faces at any angle."""
    w, d, h = dims(rng, scale, 0.4)
    shape = s.box((w, d, h)) if rng.random() < 0.75 else s.cylinder(w / 2, h)
    far = 4 * scale.size
    tools = []
    for _ in range(rng.integers(1, 8)):
        n = rng.normal(size=3)
        n /= np.linalg.norm(n)
        reach = np.abs(n) @ np.array([w, d, h]) / 2 * rng.uniform(0.55, 0.95)
        to_n = Rotation.align_vectors(n[None], np.array([[0, 0, 1.0]]))[0].as_matrix()
        tools.append(s.moved(s.box((far, far, far)), to_n, n * reach + [0, 0, h / 2]))
    return rounded(rng, s.cut(shape, tools), scale, 0.4)


def extrusion(rng: Rng, scale: Scale) -> TopoDS_Shape:
    """An outline of lines and arcs raised, with holes through it."""
    count = int(rng.integers(3, 10))
    points = outline(rng, count, scale.size / 2)
    bulges = np.where(rng.random(count) < 0.35, rng.uniform(-0.35, 0.6, count), 0)
    height = scale.size * spread(rng, 0.05, 1)
    shape = s.extruded(s.profile(points, bulges), height)
    inner = scale.size / 2 * 0.35
    tools = [
        s.moved(
            s.cylinder(inner * rng.uniform(0.1, 0.5), 3 * height)
            if rng.random() < 0.6
            else s.prism(ring(int(rng.integers(3, 7)), inner * rng.uniform(0.2, 0.6)), 3 * height),
            None,
            (*(rng.uniform(-1, 1, 2) * inner), -height if rng.random() < 0.7 else height * rng.uniform(0.2, 0.9)),
        )
        for _ in range(rng.integers(0, 4))
    ]
    return rounded(rng, attempted(shape, s.cut, tools), scale)


def revolution(rng: Rng, scale: Scale) -> TopoDS_Shape:
    """An outline turned about the vertical: vases, stepped shafts, rings."""
    steps = int(rng.integers(2, 7))
    z = np.concatenate([[0], np.cumsum(rng.uniform(0.3, 1, steps))])
    z *= scale.size * rng.uniform(0.4, 1) / z[-1]
    radius = scale.size / 2 * rng.uniform(0.3, 1, steps)
    outer = []
    for k in range(steps):
        outer += [(radius[k], z[k]), (radius[k] if rng.random() < 0.6 else radius[k] * rng.uniform(0.6, 1), z[k + 1])]
    bore = 0.0 if rng.random() < 0.6 else 0.5 * min(r for r, _ in outer)
    points = np.array([(bore, 0.0), *outer, (bore, z[-1])])
    bulges = np.where(rng.random(len(points)) < 0.25, rng.uniform(-0.25, 0.4, len(points)), 0)
    bulges[-1] = 0
    bulges[0] = 0
    bulges[-2] = 0
    keep = np.linalg.norm(points - np.roll(points, -1, 0), axis=1) > 1e-3 * scale.size
    points, bulges = points[keep], bulges[keep]
    angle = 2 * np.pi if rng.random() < 0.75 else rng.uniform(0.6, 5.5)
    return rounded(rng, s.revolved(s.profile(points, bulges, "xz"), angle), scale)


def sheet(rng: Rng, scale: Scale) -> TopoDS_Shape:
    """Bent sheet metal: an L, U, Z or hat of thin plate, with holes."""
    t = scale.size * spread(rng, 0.006, 0.06)
    heading, way = 0.0, [np.zeros(2)]
    for _ in range(rng.integers(2, 6)):
        way.append(way[-1] + scale.size * rng.uniform(0.2, 0.6) * np.array([np.cos(heading), np.sin(heading)]))
        heading += rng.choice([-1, 1]) * np.radians(rng.choice([90, 90, 90, rng.uniform(20, 110)]))
        heading = np.clip(heading, -np.pi / 2, np.pi / 2)
    bars = []
    width = scale.size * rng.uniform(0.3, 1)
    for a, b in pairwise(way):
        length = np.linalg.norm(b - a)
        angle = np.arctan2(*(b - a)[::-1])
        bar = s.box((length + t, t, width), (length / 2, 0, 0))
        bars.append(s.moved(bar, Rotation.from_euler("z", angle).as_matrix(), (*a, 0)))
    shape = s.fused(bars)
    tools = [
        s.moved(
            s.cylinder(scale.size * rng.uniform(0.02, 0.08), 4 * scale.size),
            Rotation.from_euler("x", np.pi / 2).as_matrix(),
            (rng.uniform(0, 0.8) * scale.size, 2 * scale.size, width * rng.uniform(0.2, 0.8)),
        )
        for _ in range(rng.integers(0, 5))
    ]
    shape = rounded(rng, attempted(shape, s.cut, tools), scale, 0.4)
    return s.moved(shape, Rotation.from_euler("x", rng.choice([0, np.pi / 2])).as_matrix())


def tray(rng: Rng, scale: Scale) -> TopoDS_Shape:
    """A hollow box, prism, cylinder or cone, open above."""
    w, d, h = dims(rng, scale, 0.3)
    kind = rng.choice(4)
    if kind == 0:
        solid = s.box((w, d, h))
    elif kind == 1:
        solid = s.prism(ring(int(rng.integers(3, 9)), w / 2), h)
    elif kind == 2:
        solid = s.cylinder(w / 2, h)
    else:
        solid = s.cone(w / 2, w / 2 * rng.uniform(0.5, 0.9), h)
    if kind < 2:
        solid = rounded(rng, solid, scale, 0.4)
    top = max(s.faces(solid), key=lambda f: s.bounds(f).mean(0)[2] - 10 * np.ptp(s.bounds(f)[:, 2]))
    hollow = s.shelled(solid, [top], min(w, d, h) * spread(rng, 0.015, 0.2))
    if rng.random() < 0.3:
        hollow = s.moved(hollow, Rotation.from_euler("x", np.pi).as_matrix())
    return rounded(rng, hollow, scale, 0.25)


def ridges(rng: Rng, scale: Scale) -> TopoDS_Shape:
    """A zigzag raised to a block: creases of any angle, from 3 degrees on, convex and concave."""
    count = int(rng.integers(2, 7))
    x = np.concatenate([[0], np.cumsum(rng.uniform(0.4, 1, count))])
    x *= scale.size / x[-1]
    slope = np.cumsum(rng.choice([-1, 1], count) * np.radians(np.exp(rng.uniform(np.log(4), np.log(80), count))))
    slope = np.clip(slope - slope.mean(), -1.2, 1.2)
    z = np.concatenate([[0], np.cumsum(np.diff(x) * np.tan(slope))])
    z += scale.size * rng.uniform(0.05, 0.4) - z.min()
    points = np.concatenate([np.stack([x, z], 1)[::-1], [[0, 0], [x[-1], 0]]])
    points[:, 0] -= x[-1] / 2
    depth = scale.size * rng.uniform(0.4, 1)
    upright = s.moved(s.prism(points, depth), Rotation.from_euler("x", np.pi / 2).as_matrix(), (0, depth / 2, 0))
    return rounded(rng, upright, scale, 0.35)


def pattern(rng: Rng, scale: Scale) -> TopoDS_Shape:
    """A plate or block with rows of ribs, pins, holes or pockets."""
    w, d, h = dims(rng, scale, 0.5)
    h *= spread(rng, 0.1, 1)
    nx, ny = int(rng.integers(1, 5)), int(rng.integers(1, 5))
    px, py = w / (nx + 0.5), d / (ny + 0.5)
    kind, deep = rng.choice(3), rng.random() < 0.5
    side = min(px, py) * rng.uniform(0.3, 0.8)
    tall = h * rng.uniform(0.2, 0.8) if deep else min(w, d) * rng.uniform(0.05, 0.4)
    parts = []
    for x in row(nx, px):
        for y in row(ny, py):
            at = (x, y, h - tall if deep else h - 0.02 * tall)
            height = tall * 1.02
            if kind == 0:
                parts.append(s.cylinder(side / 2, height, at))
            elif kind == 1:
                parts.append(s.box((px * 0.7, side, height), at))
            else:
                parts.append(s.cone(side / 2, side / 2 * rng.uniform(0.4, 0.9), height, at))
    base = s.box((w, d, h))
    shape = s.cut(base, parts) if deep else s.fused([base, *parts])
    return rounded(rng, shape, scale, 0.5)


def cartons(rng: Rng, scale: Scale) -> TopoDS_Shape:
    """Cartons stacked, turned a little against one another, some with flaps up or tape's height of lids."""
    unit = scale.size / rng.uniform(1.2, 2.6)
    parts, z = [], 0.0
    for level in range(int(rng.integers(1, 4))):
        height = unit * rng.uniform(0.3, 0.8)
        for x in row(int(rng.integers(1, 3)), unit * rng.uniform(0.7, 1.1)):
            size = (unit * rng.uniform(0.5, 1.0), unit * rng.uniform(0.5, 1.0), height)
            rotation = Rotation.from_euler("z", rng.normal(0, 0.12) if rng.random() < 0.7 else 0).as_matrix()
            shift = (x, unit * rng.normal(0, 0.08), z)
            parts.append(s.moved(s.box(size), rotation, shift))
            if level and rng.random() < 0.3:
                continue
            if rng.random() < 0.3:
                parts += [s.moved(f, rotation, shift) for f in _flaps(rng, size)]
        z += height
        unit *= rng.uniform(0.75, 1.0)
    return rounded(rng, s.fused(parts), scale, 0.25)


def _flaps(rng: Rng, size) -> list[TopoDS_Shape]:
    """Flaps of a carton's lid, standing open."""
    w, d, h = size
    t = max(min(w, d) * 0.012, 1e-4)
    out = []
    for side in range(4):
        if rng.random() < 0.35:
            continue
        across, along = (w, d) if side % 2 == 0 else (d, w)
        length = across * rng.uniform(0.25, 0.5)
        plate = s.box((length, along * 0.98, t), (length / 2, 0, -t))
        up = Rotation.from_euler("y", -rng.uniform(0.1, 1.9)).as_matrix()
        plate = s.moved(plate, up, (across / 2 - t, 0, h + 0.3 * t))
        out.append(s.moved(plate, Rotation.from_euler("z", side * np.pi / 2).as_matrix()))
    return out


def desk(rng: Rng, scale: Scale) -> TopoDS_Shape:
    """A table with legs, perhaps a drawer box, and things on it."""
    w, d = scale.size, scale.size * rng.uniform(0.4, 0.9)
    h, t = scale.size * rng.uniform(0.35, 0.75), scale.size * rng.uniform(0.015, 0.06)
    leg = scale.size * rng.uniform(0.02, 0.06)
    parts = [s.box((w, d, t), (0, 0, h))]
    inset = leg * rng.uniform(0.5, 2)
    for sx in (-1, 1):
        for sy in (-1, 1):
            at = (sx * (w / 2 - inset), sy * (d / 2 - inset), 0)
            parts.append(s.box((leg, leg, h), at) if rng.random() < 0.7 else s.cylinder(leg / 2, h, at))
    if rng.random() < 0.5:
        parts.append(s.box((w * 0.35, d * 0.9, h * rng.uniform(0.2, 0.6)), (w * 0.25, 0, h * 0.4)))
    for _ in range(rng.integers(0, 4)):
        shift = (rng.uniform(-0.35, 0.35) * w, rng.uniform(-0.3, 0.3) * d, h + t)
        parts.append(s.moved(primitive(rng, scale.size * rng.uniform(0.08, 0.3)), turn(rng), shift))
    return rounded(rng, s.fused(parts), scale, 0.3)


def pipes(rng: Rng, scale: Scale) -> TopoDS_Shape:
    """Tubes and rods that cross, with collars, hollow or not, and rings."""
    radius = scale.size * rng.uniform(0.08, 0.25)
    lie = Rotation.from_euler("x", np.pi / 2).as_matrix()
    parts = [s.cylinder(radius, scale.size)]
    for _ in range(rng.integers(1, 3)):
        other = radius * rng.uniform(0.4, 1.0)
        length = scale.size * rng.uniform(0.4, 1)
        start = length / 2 if rng.random() < 0.5 else 0
        branch = s.moved(s.cylinder(other, length), lie, (0, start, 0))
        lean = Rotation.from_euler("zx", [rng.uniform(0, 6.28), rng.choice([0, rng.uniform(-0.7, 0.7)])]).as_matrix()
        parts.append(s.moved(branch, lean, (0, 0, scale.size * rng.uniform(0.25, 0.75))))
    for _ in range(rng.integers(0, 3)):
        z = scale.size * rng.uniform(0, 0.9)
        parts.append(
            s.cylinder(radius * rng.uniform(1.2, 1.8), scale.size * rng.uniform(0.02, 0.1), (0, 0, z))
            if rng.random() < 0.7
            else s.torus(radius, radius * rng.uniform(0.1, 0.4), (0, 0, z + 0.1 * scale.size))
        )
    shape = s.fused(parts)
    if rng.random() < 0.5:
        bore = s.cylinder(radius * rng.uniform(0.5, 0.85), 3 * scale.size, (0, 0, scale.size * rng.uniform(-1, 0.8)))
        shape = attempted(shape, s.cut, [bore])
    return rounded(rng, shape, scale, 0.3)


def niche(rng: Rng, scale: Scale) -> TopoDS_Shape:
    """A piece of wall with openings, recesses, ledges and a step before it."""
    w, h, t = scale.size, scale.size * rng.uniform(0.6, 1.0), scale.size * rng.uniform(0.08, 0.25)
    tools, parts = [], [s.box((w, t, h))]
    for _ in range(rng.integers(1, 4)):
        size = (w * rng.uniform(0.15, 0.45), t * rng.choice([0.4, 3.0]), h * rng.uniform(0.15, 0.6))
        at = (w * rng.uniform(-0.35, 0.35), -t / 2, h * rng.choice([0.0, rng.uniform(0.1, 0.6)]))
        if rng.random() < 0.8:
            tools.append(s.box(size, at))
        else:
            lie = Rotation.from_euler("x", np.pi / 2).as_matrix()
            tools.append(s.moved(s.cylinder(size[0] / 2, 4 * t), lie, (at[0], 2 * t, h * 0.6)))
    shape = s.cut(parts[0], tools)
    extra = [
        s.box((w * rng.uniform(0.2, 1), t * rng.uniform(0.3, 1.5), h * rng.uniform(0.02, 0.15)),
              (w * rng.uniform(-0.2, 0.2), -t * 0.6, h * rng.choice([0.0, rng.uniform(0, 0.8)])))
        for _ in range(rng.integers(0, 4))
    ]  # fmt: skip
    return rounded(rng, attempted(shape, lambda a: s.fused([a, *extra])), scale, 0.4)


TRAIN = {
    "blocks": blocks, "gem": gem, "extrusion": extrusion, "revolution": revolution, "sheet": sheet, "tray": tray,
    "ridges": ridges, "pattern": pattern, "cartons": cartons, "desk": desk, "pipes": pipes, "niche": niche,
}  # fmt: skip
WEIGHTS = {"blocks": 3.0, "cartons": 2.0, "gem": 1.5}  # 1 for all others
