"""The recipe families of the validation and the test split, which training never sees."""

from __future__ import annotations

import numpy as np
from OCP.TopoDS import TopoDS_Shape
from scipy.spatial.transform import Rotation

from export.solids import shapes as s
from export.solids.draw import Rng, Scale, attempted, ring, rounded, row, spread

_LIE = Rotation.from_euler("x", np.pi / 2).as_matrix()  # what stands along z lies along -y


def steps(rng: Rng, scale: Scale) -> TopoDS_Shape:
    """A staircase, straight or with a landing."""
    count = int(rng.integers(3, 9))
    width, run, rise = scale.size * rng.uniform(0.4, 1), scale.size / count, scale.size * rng.uniform(0.4, 0.9) / count
    parts = [s.box((scale.size - k * run, width, (k + 1) * rise), (k * run / 2, 0, 0)) for k in range(count)]
    if rng.random() < 0.4:
        parts.append(s.box((run * 1.5, width * 2, count * rise), (scale.size / 2, width / 2, 0)))
    return rounded(rng, s.fused(parts), scale, 0.4)


def knob(rng: Rng, scale: Scale) -> TopoDS_Shape:
    """A turned grip with notches around it and a shaft."""
    radius, h = scale.size / 2, scale.size * rng.uniform(0.25, 0.7)
    grip = s.cone(radius, radius * rng.uniform(0.7, 1.0) - 1e-3 * radius, h)
    notch = radius * rng.uniform(0.08, 0.25)
    count = int(rng.integers(3, 11))
    tools = [s.cylinder(notch, 3 * h, (*p, h * rng.choice([-1, 0.2]))) for p in ring(count, radius)]
    shape = rounded(rng, attempted(grip, s.cut, tools), scale, 0.5)
    shaft = s.cylinder(radius * rng.uniform(0.2, 0.5), h * rng.uniform(1.2, 2.2))
    return s.fused([shape, shaft])


def crate(rng: Rng, scale: Scale) -> TopoDS_Shape:
    """An open crate of slats."""
    w, d, h = scale.size * np.array([1.0, rng.uniform(0.5, 1), rng.uniform(0.3, 0.8)])
    t, levels = scale.size * rng.uniform(0.012, 0.04), int(rng.integers(2, 5))
    slat = h / levels * rng.uniform(0.5, 0.85)
    parts = [s.box((w, d, t))]
    for z in (np.arange(levels) + 0.5) * h / levels - slat / 2 + t:
        parts += [s.box((w, t, slat), (0, side * (d - t) / 2, z)) for side in (-1, 1)]
        parts += [s.box((t, d, slat), (side * (w - t) / 2, 0, z)) for side in (-1, 1)]
    parts += [s.box((3 * t, 3 * t, h + t), (x * (w / 2 - 1.5 * t), y * (d / 2 - 1.5 * t), 0))
              for x in (-1, 1) for y in (-1, 1)]  # fmt: skip
    return rounded(rng, s.fused(parts), scale, 0.15)


def flange(rng: Rng, scale: Scale) -> TopoDS_Shape:
    """A disc with a hub, a bore and a circle of bolt holes."""
    radius, t = scale.size / 2, scale.size * rng.uniform(0.05, 0.2)
    hub = radius * rng.uniform(0.3, 0.6)
    shape = s.fused([s.cylinder(radius, t), s.cylinder(hub, t + scale.size * rng.uniform(0.05, 0.5))])
    shape = rounded(rng, shape, scale, 0.5)
    hole, through = (radius - hub) * rng.uniform(0.1, 0.3), 4 * scale.size
    places = ring(int(rng.integers(3, 9)), (radius + hub) / 2)
    tools = [s.cylinder(hole, through, (*p, -scale.size)) for p in places]
    if rng.random() < 0.8:
        tools.append(s.cylinder(hub * rng.uniform(0.3, 0.8), through, (0, 0, -scale.size)))
    return s.cut(shape, tools)


def chair(rng: Rng, scale: Scale) -> TopoDS_Shape:
    """A chair or stool, of round or square bars."""
    h = scale.size
    w, seat, t, leg = h * rng.uniform(0.4, 0.55), h * rng.uniform(0.4, 0.55), h * rng.uniform(0.02, 0.06), h * 0.04
    inset = w / 2 - leg / 2
    square = rng.random() < 0.5
    parts = [s.box((w, w, t), (0, 0, seat))]
    for x, y in ((-1, -1), (1, -1), (-1, 1), (1, 1)):
        length = h if y > 0 else seat
        at = (x * inset, y * inset, 0)
        parts.append(s.box((leg, leg, length), at) if square else s.cylinder(leg / 2, length, at))
    parts += [s.box((2 * inset, leg * 0.6, h * rng.uniform(0.04, 0.12)), (0, inset, seat + (h - seat) * z))
              for z in np.linspace(0.35, 0.8, int(rng.integers(1, 4)))]  # fmt: skip
    return rounded(rng, s.fused(parts), scale, 0.35)


def shelf(rng: Rng, scale: Scale) -> TopoDS_Shape:
    """A rack with books and boxes on its boards."""
    h, w, d = scale.size, scale.size * rng.uniform(0.4, 0.9), scale.size * rng.uniform(0.15, 0.35)
    t, boards = scale.size * rng.uniform(0.012, 0.03), int(rng.integers(2, 5))
    parts = [s.box((t, d, h), (x * (w - t) / 2, 0, 0)) for x in (-1, 1)]
    if rng.random() < 0.6:
        parts.append(s.box((w, t, h), (0, (d - t) / 2, 0)))
    pitch = (h - t) / boards
    parts += [s.box((w, d, t), (0, 0, k * pitch)) for k in range(boards + 1)]
    for k in range(boards):
        x = -w / 2 + t
        while x < w / 2 - 2 * t:
            width = min(w * spread(rng, 0.03, 0.3), w / 2 - t - x)
            if rng.random() < 0.6:
                deep, tall = d * rng.uniform(0.5, 0.9), (pitch - t) * rng.uniform(0.35, 0.92)
                parts.append(s.box((width, deep, tall), (x + width / 2, d * 0.45 - deep / 2 - t, k * pitch + t)))
            x += width * rng.uniform(1, 1.4)
    return rounded(rng, s.fused(parts), scale, 0.15)


def bolt(rng: Rng, scale: Scale) -> TopoDS_Shape:
    """A screw's head and shank, a washer, a nut."""
    radius, length = scale.size * rng.uniform(0.08, 0.16), scale.size
    head = radius * rng.uniform(1.6, 2.2)
    thick = head * rng.uniform(0.5, 0.9)
    top = s.prism(ring(6, head), thick) if rng.random() < 0.7 else s.cylinder(head, thick)
    if rng.random() < 0.5:
        top = s.cut(top, [s.prism(ring(6, head * 0.5), thick * 0.6)])
    parts = [top, s.cylinder(radius, length - thick, (0, 0, thick * 0.7))]
    if rng.random() < 0.6:
        parts.append(s.cylinder(head * 1.3, thick * 0.25, (0, 0, thick)))
    if rng.random() < 0.6:
        parts.append(s.moved(s.prism(ring(6, head), thick), None, (0, 0, length * rng.uniform(0.4, 0.7))))
    return rounded(rng, s.fused(parts), scale, 0.4)


def house(rng: Rng, scale: Scale) -> TopoDS_Shape:
    """Walls with a gable roof that stands over, a chimney, a dormer, openings."""
    w, d, h = scale.size * np.array([1.0, rng.uniform(0.6, 1), rng.uniform(0.3, 0.7)])
    eave = w * rng.uniform(0.02, 0.12)
    rise = (d / 2 + eave) * np.tan(np.radians(rng.uniform(14, 55)))

    def roof(half: float, up: float, length: float) -> TopoDS_Shape:
        gable = s.prism(np.array([(-half, 0), (half, 0), (0, up)]), length)
        return s.moved(s.moved(gable, _LIE, (0, length / 2, 0)), Rotation.from_euler("z", np.pi / 2).as_matrix())

    parts = [s.box((w, d, h)), s.moved(roof(d / 2 + eave, rise, w + 2 * eave), None, (0, 0, h))]
    if rng.random() < 0.7:
        side = w * rng.uniform(0.06, 0.12)
        parts.append(s.box((side, side, rise * 1.2), (w * rng.uniform(-0.3, 0.3), d * 0.1, h)))
    if rng.random() < 0.6:
        parts.append(s.box((w * 0.35, d * 0.8, h * 0.6), (w * rng.uniform(-0.3, 0.3), -d * 0.5, 0)))
    tools = [s.box((w * 0.12, d * 0.2, h * 0.3), (x, d / 2 * rng.choice([-1, 1]), h * rng.choice([0.0, 0.35])))
             for x in row(int(rng.integers(1, 4)), w * 0.28)]  # fmt: skip
    return rounded(rng, attempted(s.fused(parts), s.cut, tools), scale, 0.2)


def bracket(rng: Rng, scale: Scale) -> TopoDS_Shape:
    """An angle with gussets and slots."""
    w, t = scale.size * rng.uniform(0.3, 0.9), scale.size * rng.uniform(0.03, 0.12)
    a, b = scale.size * rng.uniform(0.5, 1, 2)
    parts = [s.box((a, w, t), (a / 2, 0, 0)), s.box((t, w, b), (t / 2, 0, 0))]
    reach = min(a, b) * rng.uniform(0.4, 0.9)
    for y in row(int(rng.integers(1, 3)), w * 0.6):
        web = s.prism(np.array([(0, 0), (reach, 0), (0, reach)]), t * 0.8)
        parts.append(s.moved(web, _LIE, (t * 0.5, y + t * 0.4, t * 0.5)))
    hole = scale.size * rng.uniform(0.02, 0.06)
    tools = [s.cylinder(hole, 4 * t, (a * rng.uniform(0.3, 0.9), y, -2 * t)) for y in row(2, w * 0.3)]
    return rounded(rng, attempted(s.fused(parts), s.cut, tools), scale, 0.5)


VAL = {"steps": steps, "knob": knob, "crate": crate}
TEST = {"flange": flange, "chair": chair, "shelf": shelf, "bolt": bolt, "house": house, "bracket": bracket}
