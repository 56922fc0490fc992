"""A room: floor, walls, perhaps a ceiling, windows and images; furniture, things on it, people; cameras inside."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np

from export.camera import Camera
from export.people.props import PropMaker, Solid, box, cylinder, joined
from export.places.cameras import Lens, looking
from export.places.catalogue import Asset, people_assets
from export.places.furnish import Heights, finished, placed, quad
from export.places.mesh import Material, Part, part_of, part_of_prop
from export.places.render import Lighting

_GROUND = "paving|tile|road|city|stone|wood|brick|pavement"
_FREE = re.compile(r"chair|stool|table|silla|thonet|osaka|piano|pool|plant|rock|crate|barrel|horse|deck", re.IGNORECASE)
_MARGIN = 0.3  # metres between cameras and walls


@dataclass
class Staged:
    """The result of a recipe. near: metres before which cameras see nothing."""

    kind: str
    parts: list[Part]
    lighting: Lighting
    cameras: list[Camera]
    assets: list[Asset] = field(default_factory=list)
    near: float = 0.03


def noise(rng: np.random.Generator, strength: float, side: int = 256) -> np.ndarray:
    """Plaster, paint: one colour with a grain, uint8 [side, side, 3], that repeats without a seam."""
    grain = rng.normal(0, 1, (side, side)).astype(np.float32)
    slow = np.fft.ifft2(np.fft.fft2(grain) / (1 + 40 * np.hypot(*np.meshgrid(*[np.fft.fftfreq(side)] * 2)))).real
    grey = 225 + strength * (0.5 * grain + 3 * slow / slow.std())
    return np.repeat(np.clip(grey, 0, 255).astype(np.uint8)[..., None], 3, 2)


def planks(rng: np.random.Generator, side: int = 512) -> np.ndarray:
    """Boards of wood: uint8 [side, side, 3]."""
    rows, at = int(rng.integers(5, 12)), np.arange(side)
    row = at * rows // side
    colour = np.array([rng.uniform(110, 200), rng.uniform(75, 140), rng.uniform(40, 95)])
    shade = rng.normal(1, 0.09, (rows, 4))
    joint = rng.integers(0, side, rows)
    column = ((at[None] + joint[row][:, None]) * 2 // side) % 4
    grain = np.cumsum(rng.normal(0, 1, (side, 1)), 0)
    wave = np.sin(grain + 0.02 * at[None] + 2 * np.sin(0.011 * at[None] + grain * 0.2))
    image = colour * (shade[row[:, None], column] + 0.05 * wave)[..., None]
    seam = (np.abs(at * rows / side - np.round(at * rows / side)) < rows / side)[:, None]
    joints = ((at[None] + joint[row][:, None]) * 2 % side) < 4
    image[np.broadcast_to(seam | joints, image.shape[:2])] *= 0.55
    return np.clip(image, 0, 255).astype(np.uint8)


def checks(rng: np.random.Generator, side: int = 256) -> np.ndarray:
    """Square tiles of two colours with joints."""
    one, two = rng.uniform(40, 240, (2, 1, 1, 1)) * (1 + rng.normal(0, 0.15, (2, 1, 1, 3)))
    at = np.arange(side) * 4 // side
    image = np.where(((at[:, None] + at[None]) % 2)[..., None] > 0, one, two * np.ones((side, side, 1)))
    joint = (np.arange(side) % (side // 4)) < 3
    image[joint] = image[:, joint] = 150
    return np.clip(image + rng.normal(0, 3, image.shape), 0, 255).astype(np.uint8)


class RoomMaker:
    """Builds one room from a stock; every draw comes from `rng`."""

    def __init__(self, stock, rng: np.random.Generator) -> None:
        self.stock, self.rng = stock, rng
        u = rng.uniform
        self.size = np.array([u(3.2, 6.5), u(3.2, 6.0), u(2.4, 3.1)])
        self.parts: list[Part] = []
        self.assets: list[Asset] = []
        half = self.size[:2] / 2
        self.ground = Heights.over(-half, half)  # what stands on the floor
        self.ground.top[:] = 0.0
        self.supports: list[Heights] = []
        self.count = 0
        self.middles: list[np.ndarray] = []  # of what stands on the floor

    # -- the shell ---------------------------------------------------------------------------------------------

    def floor_material(self) -> tuple[Material, float]:
        """A material and its repeats a metre."""
        rng, u = self.rng, self.rng.uniform
        kind = u()
        shine = {"specular": u(0, 0.5), "shininess": u(15, 150), "mirror": u(0, 0.15) if u() < 0.5 else 0.0}
        if kind < 0.4:
            texture, asset = self.stock.tile(rng, _GROUND)
            self.assets.append(asset)
            return Material(texture, (u(0.7, 1.1),) * 3, **shine), 1 / u(1, 2.5)
        if kind < 0.7:
            return Material(planks(rng), (u(0.7, 1.1),) * 3, **shine), 1 / u(0.8, 1.4)
        if kind < 0.9:
            return Material(checks(rng), (1.0,) * 3, **shine), 1 / u(0.8, 2.0)
        return Material(noise(rng, 8), tuple(u(0.3, 1, 3)), specular=0.05), 0.7

    def wall_material(self) -> tuple[Material, float]:
        rng, u = self.rng, self.rng.uniform
        if u() < 0.2:
            texture, asset = self.stock.tile(rng, "cliff|city|tile|paving|sand|clay|wall")
            self.assets.append(asset)
            return Material(texture, (u(0.8, 1.2),) * 3, specular=0.03), 1 / u(1, 2)
        colour = u(0.6, 1.05) * (1 + rng.normal(0, 0.08, 3))
        if u() < 0.25:
            colour = u(0.25, 1.0, 3)
        return Material(noise(rng, u(1, 7)), tuple(map(float, colour)), specular=u(0, 0.1), shininess=15.0), u(0.4, 1.5)

    def shell(self) -> None:
        rng, u = self.rng, self.rng.uniform
        w, d, h = self.size
        thick = 0.1
        material, repeats = self.floor_material()
        floor = box((w + 2 * thick, d + 2 * thick, thick), (0, 0, -thick / 2))
        self.parts.append(part_of(floor, material, repeats=repeats, shades=False))
        walls = self.wall_material()
        accent = self.wall_material() if u() < 0.35 else walls
        white = Material(colour=(u(0.75, 0.98),) * 3, specular=0.15, shininess=30.0)
        for k, (axis, side) in enumerate(((0, -1), (0, 1), (1, -1), (1, 1))):
            material, repeats = accent if k == 0 else walls
            long = (d, w)[axis] + 2 * thick
            size = (thick, long, h) if axis == 0 else (long, thick, h)
            centre = [0.0, 0.0, h / 2]
            centre[axis] = side * (self.size[axis] + thick) / 2
            self.parts.append(part_of(box(size, centre), material, repeats=repeats, shades=False))
            board = (0.015, long - 2 * thick, 0.08) if axis == 0 else (long - 2 * thick, 0.015, 0.08)
            at = [0.0, 0.0, 0.04]
            at[axis] = side * (self.size[axis] / 2 - 0.0075)
            self.parts.append(part_of(box(board, at), white, shades=False))
        self.ceiling = u() < 0.85
        if self.ceiling:
            paint = Material(noise(rng, 2), (u(0.85, 1.05),) * 3)
            lid = box((w + 2 * thick, d + 2 * thick, thick), (0, 0, h + thick / 2))
            self.parts.append(part_of(lid, paint, shades=False))
        self.spots = [(axis, side) for axis in (0, 1) for side in (-1, 1)]
        self.hung: dict[tuple[int, int], list[tuple[float, float]]] = {spot: [] for spot in self.spots}

    def wall_place(self, width: float) -> tuple[tuple[int, int], float] | None:
        """A wall and a place along it where nothing hangs yet."""
        for _ in range(12):
            spot = self.spots[self.rng.integers(4)]
            room = self.size[1 - spot[0]] / 2 - width / 2 - 0.1
            if room <= 0:
                continue
            at = float(self.rng.uniform(-room, room))
            if all(abs(at - other) > (width + wide) / 2 + 0.1 for other, wide in self.hung[spot]):
                self.hung[spot].append((at, width))
                return spot, at
        return None

    def on_wall(self, spot: tuple[int, int], along: float, z: float, out: float) -> tuple[np.ndarray, np.ndarray]:
        """A point `out` metres before a wall, and the direction into the room."""
        axis, side = spot
        at = np.zeros(3)
        at[axis], at[1 - axis], at[2] = side * (self.size[axis] / 2 - out), along, z
        inward = np.zeros(3)
        inward[axis] = -side
        return at, inward

    def picture(self, window: bool) -> None:
        """A framed photograph, or a window with one behind it."""
        rng, u = self.rng, self.rng.uniform
        photo, asset = self.stock.photo(rng)
        width = u(0.8, 1.8) if window else u(0.25, 1.1)
        height = width * (u(0.7, 1.3) if window else photo.shape[0] / photo.shape[1])
        height = min(height, self.size[2] - 1.0)
        place = self.wall_place(width + 0.12)
        if place is None:
            return
        z = min(u(1.3, 1.7), self.size[2] - height / 2 - 0.15)
        self.assets.append(asset)
        self.frame(photo, place[0], (place[1], max(z, height / 2 + 0.3)), (width, height), window)

    def frame(self, photo: np.ndarray, spot: tuple[int, int], middle, size, window: bool) -> None:
        """An image or a window of `size` (width, height) on a wall, its `middle` so far along the wall and so high."""
        u, (along, z), (width, height) = self.rng.uniform, middle, size
        at, inward = self.on_wall(spot, along, z, 0.02)
        right, up = np.cross([0, 0, 1.0], inward), np.array([0, 0, 1.0])
        if window:
            pane = Material(photo, specular=0.4, shininess=200.0, mirror=0.08, emission=u(0.8, 2.5))
        else:
            pane = Material(photo, specular=u(0, 0.5), shininess=u(20, 200), mirror=u(0, 0.1))
        self.parts.append(part_of(quad(at, right, up, width, height), pane, shades=False))
        wide, frame = u(0.02, 0.06), Material(colour=tuple(u(0.05, 1) * np.ones(3)), specular=u(0, 0.5), shininess=60.0)
        bars = []
        for x, y, long, tall in ((0, 1, width + 2 * wide, wide), (0, -1, width + 2 * wide, wide),
                                 (1, 0, wide, height), (-1, 0, wide, height)):  # fmt: skip
            middle = at + right * x * (width + wide) / 2 + up * y * (height + wide) / 2
            size = np.abs(right) * long + np.abs(inward) * 0.04 + up * tall
            bars.append(box(size, middle))
        if window and u() < 0.6:
            bars.append(box(np.abs(right) * 0.03 + np.abs(inward) * 0.04 + up * height, at))
        self.parts.append(part_of(joined(*bars), frame, shades=False))

    # -- what stands in it -------------------------------------------------------------------------------------

    def put(self, parts, size, yaw: float, at) -> list[Part]:
        """Stands something on the floor and remembers where."""
        own = placed(parts, (*at[:2], 0.0), yaw)
        self.parts += own
        mask = self.ground.cells(at, size, yaw)
        if mask is not None:
            self.ground.taken |= mask
        solid = [p for p in own if p.material.opacity >= 1]
        if solid:
            self.ground.add(solid, self.rng)
        self.count += 1
        self.middles.append(np.array([at[0], at[1], np.clip(0.6 * size[2], 0.3, 1.3)]))
        return own

    def stand(self, parts, size, at_wall: bool, gap: float = 0.06) -> list[Part] | None:
        """Finds a free place on the floor; None where there is none."""
        rng, u = self.rng, self.rng.uniform
        for _ in range(25):
            yaw = u(-np.pi, np.pi)
            x, y = u(-0.5, 0.5, 2) * self.size[:2]
            if at_wall:
                axis, side = self.spots[rng.integers(4)]
                inward = np.zeros(2)
                inward[axis] = -side
                yaw = float(np.arctan2(inward[0], -inward[1]))  # the front, -y, looks into the room
                at = np.array([x, y])
                at[axis] = side * (self.size[axis] / 2 - size[1] / 2 - 0.03)
                x, y = at
            mask = self.ground.cells((x, y), (size[0] + gap, size[1] + (0 if at_wall else gap)), yaw)
            if mask is not None and mask.any() and not self.ground.taken[mask].any():
                return self.put(parts, size, yaw, (x, y))
        return None

    def own_texture(self) -> np.ndarray:
        """Wood, paint, or a tile, for things that are made here."""
        kind = self.rng.random()
        if kind < 0.35:
            return planks(self.rng, 256)
        if kind < 0.6:
            return noise(self.rng, 6)
        texture, asset = self.stock.tile(self.rng, "")
        self.assets.append(asset)
        return texture

    def support(self, own: list[Part]) -> None:
        """Things may be put on what has just been placed."""
        corners = np.concatenate(
            [p.corners.reshape(-1, 3) for p in own if p.material.opacity >= 1] or [np.zeros((1, 3))]
        )
        if corners[:, 2].max() > 0.3:
            heights = Heights.over(corners.min(0), corners.max(0) + 1e-3)
            heights.add([p for p in own if p.material.opacity >= 1], self.rng)
            self.supports.append(heights)

    def furnish(self) -> None:
        rng, u = self.rng, self.rng.uniform
        models = self.stock.of_kind("floor")
        wanted = int(rng.integers(4, 10))
        for k in rng.permutation(len(models))[: wanted + 4]:
            if self.count >= wanted:
                break
            model = models[k]
            parts = finished(list(self.stock.parts(model)), rng)
            own = self.stand(parts, model.size, at_wall=not _FREE.search(model.name) and u() < 0.75)
            if own is not None:
                self.assets.append(model.asset)
                self.support(own)
        if not self.supports or u() < 0.5:
            parts, size = own_table(self.stock, rng, self.assets)
            own = self.stand(parts, size, at_wall=u() < 0.4)
            if own is not None:
                self.support(own)
        maker = PropMaker(lambda rng: self.own_texture())
        for _ in range(max(int(rng.integers(-2, 3)), wanted - self.count - 2)):
            part = part_of_prop(maker.standing(rng))
            low, high = part.corners.reshape(-1, 3).min(0), part.corners.reshape(-1, 3).max(0)
            part = part.moved(np.eye(3), [*(-(low + high)[:2] / 2), -low[2]])
            own = self.stand(finished([part], rng), tuple(map(float, high - low)), at_wall=u() < 0.5)
            if own is not None:
                self.support(own)
        if self.stock.people is not None and u() < 0.3:
            for _ in range(int(rng.integers(1, 3))):
                parts, size = self.stock.people.somebody(rng)
                if self.stand(parts, size, at_wall=False) is not None:
                    self.assets += people_assets()
        self.small_things(int(rng.integers(2, 8)))
        self.hang()

    def small_things(self, count: int) -> None:
        rng, u = self.rng, self.rng.uniform
        models = self.stock.of_kind("small")
        for k in rng.permutation(len(models))[:count]:
            model = models[k]
            parts = finished(list(self.stock.parts(model)), rng)
            own = self.put_on_top(parts, model.size) if u() < 0.85 else None
            if own is None and max(model.size) > 0.15:
                own = self.stand(parts, model.size, at_wall=False)
            if own is not None:
                self.assets.append(model.asset)

    def put_on_top(self, parts, size) -> list[Part] | None:
        rng = self.rng
        for _ in range(40 if self.supports else 0):
            heights = self.supports[rng.integers(len(self.supports))]
            extent = np.array(heights.top.shape[::-1]) * 0.04
            at = np.array([heights.x0, heights.y0]) + rng.uniform(0, 1, 2) * extent
            yaw = rng.uniform(-np.pi, np.pi)
            mask = heights.cells(at, size, yaw)
            level = None if mask is None else heights.level(mask)
            if level is not None and 0.25 < level < 1.6:
                heights.taken |= mask
                own = placed(parts, (*at, level), yaw)
                self.parts += own
                solid = [p for p in own if p.material.opacity >= 1]
                if solid:
                    self.ground.add(solid, rng)
                self.count += 1
                return own
        return None

    def hang(self) -> None:
        rng, u = self.rng, self.rng.uniform
        for window, count in ((True, rng.integers(0, 3)), (False, rng.integers(1, 5))):
            for _ in range(count):
                self.picture(window)
        models = self.stock.of_kind("wall")
        for k in rng.permutation(len(models))[: rng.integers(0, 3)]:
            model = models[k]
            place = self.wall_place(model.size[0]) if model.elevation + model.size[2] < self.size[2] else None
            if place is not None:
                at, inward = self.on_wall(*place, model.elevation, model.size[1] / 2 + 0.002)
                yaw = float(np.arctan2(inward[0], -inward[1]))
                self.parts += placed(finished(list(self.stock.parts(model)), rng), at, yaw)
                self.assets.append(model.asset)
        models = self.stock.of_kind("ceiling")
        if self.ceiling and models and u() < 0.6:
            model = models[rng.integers(len(models))]
            at = (*(u(-0.25, 0.25, 2) * self.size[:2]), self.size[2] - model.size[2])
            self.parts += placed(finished(list(self.stock.parts(model)), rng), at, u(0, 6))
            self.assets.append(model.asset)
        if u() < 0.4:
            w, d = u(0.25, 0.6, 2) * self.size[:2]
            texture, asset = self.stock.photo(rng) if u() < 0.3 else self.stock.tile(rng, "")
            self.assets.append(asset)
            rug = box((w, d, 0.008), (*(u(-0.1, 0.1, 2) * self.size[:2]), 0.004))
            rug = Solid(rug.corners, rug.uv / [w, d] + 0.5)
            self.parts.append(part_of(rug, Material(texture, (u(0.6, 1.0),) * 3), shades=False))

    # -- light and cameras -------------------------------------------------------------------------------------

    def light(self) -> Lighting:
        rng, u = self.rng, self.rng.uniform
        panorama, asset = self.stock.panorama(rng)
        self.assets.append(asset)

        def warm() -> np.ndarray:
            return 1 + np.array([1, 0.2, -1]) * rng.normal(0.06, 0.1)

        def lamp() -> np.ndarray:
            return np.array([*(u(-0.35, 0.35, 2) * self.size[:2]), self.size[2] - u(0.1, 0.5), 1.0])

        if u() < 0.65:
            first = (lamp(), u(1.5, 4) * warm())
        else:
            sun = np.array([*rng.normal(0, 0.7, 2), u(0.5, 1.2), 0.0])
            first = (sun, u(0.5, 1.4) * warm())
        more = [(lamp(), u(0.3, 1.5) * warm()) for _ in range(rng.integers(0, 3))]
        mean = max(float(panorama.mean()), 1e-4)
        sky, bounce = u(0.2, 0.6) * warm(), u(0.1, 0.35) * warm()
        around = panorama * (0.5 / mean)
        return Lighting((first, *more), sky, bounce, around, u(0.3, 1.0), plain=(0.0, 0.0, 0.0))

    def cameras(self, lens: Lens, count: int) -> list[Camera]:
        rng, u = self.rng, self.rng.uniform
        kind = rng.choice(["ring", "walk", "orbit"], p=[0.45, 0.3, 0.25])
        half = self.size[:2] / 2 - _MARGIN - 0.1
        low, high = np.sort(u(0.8, min(2.1, self.size[2] - 0.3), 2))
        target = np.array([*(u(-0.2, 0.2, 2) * self.size[:2]), u(0.5, 1.1)])
        if kind == "orbit":
            target = self._worth_a_look(target + 10)
        start, span, rounds = u(0, 2 * np.pi), np.radians(u(110, 360)), int(rng.integers(1, 3))
        legs = np.stack([u(-0.85, 0.85, 5) * half[0], u(-0.85, 0.85, 5) * half[1], u(low, high, 5)], 1)
        looks = np.array([self._worth_a_look(leg) for leg in legs])
        radius = u(0.9, 1.6)
        zoomed = rng.random() < 0.25
        cameras = []
        for k in range(count):
            share = k / max(count - 1, 1)
            for attempt in range(30):
                loose = 1 + 0.3 * attempt  # after failures, farther from the path
                angle = start + span * (share * rounds % 1 if rounds > 1 else share)
                if kind == "ring":
                    level = low + (high - low) * (int(min(share, 0.999) * rounds) + 0.5) / rounds
                    eye = np.array([half[0] * np.cos(angle), half[1] * np.sin(angle), level])
                    to = target
                elif kind == "orbit":
                    eye = target + radius * np.array([np.cos(angle), np.sin(angle), 0.25 + 0.5 * share])
                    to = target
                else:
                    place = share * 3.999
                    j, f = int(place), place % 1
                    eye, to = legs[j] * (1 - f) + legs[j + 1] * f, looks[j] * (1 - f) + looks[j + 1] * f
                eye = eye + rng.normal(0, 0.06 * loose, 3)
                eye[:2] = np.clip(eye[:2], -half - 0.1, half + 0.1)
                eye[2] = np.clip(eye[2], 0.3, self.size[2] - 0.25)
                to = to + rng.normal(0, 0.1, 3)
                reach = float(np.linalg.norm((to - eye)[:2]))
                if reach < 0.4:
                    continue
                to[2] = max(to[2], eye[2] - np.tan(np.radians(38)) * reach)  # else there is only floor to see
                missing = 0.2 - self.ground.clear(eye)
                if missing > 0 and eye[2] + missing < self.size[2] - 0.25:
                    eye[2] += missing
                    missing = 0.0
                if missing <= 0:
                    break
            zoom = float(np.exp(rng.normal(0, 0.1))) if zoomed else 1.0
            cameras.append(looking(lens, eye, to, float(rng.normal(0, 2)), zoom))
        return cameras

    def _worth_a_look(self, eye: np.ndarray) -> np.ndarray:
        """The middle of something that is not too near, or of the room."""
        far = [m for m in self.middles if np.linalg.norm((m - eye)[:2]) > 1.2]
        return far[self.rng.integers(len(far))] if far else np.array([0, 0, 0.8])


def own_table(stock, rng: np.random.Generator, assets: list[Asset]) -> tuple[list[Part], tuple[float, float, float]]:
    """A table or board of boxes or of a cylinder, of wood, stone or paint."""
    u = rng.uniform
    w, d, h, thick = u(0.7, 1.8), u(0.5, 1.0), u(0.4, 0.95), u(0.02, 0.06)
    if u() < 0.4:
        texture = planks(rng)
    else:
        texture, asset = stock.tile(rng, _GROUND)
        assets.append(asset)
    shine = {"specular": u(0, 0.6), "shininess": u(15, 200), "mirror": u(0, 0.25) if u() < 0.5 else 0.0}
    wood = Material(texture, (u(0.6, 1.1),) * 3, **shine)
    if u() < 0.3:
        d = w = min(w, 1.3)
        top = cylinder(w / 2, thick, (0, 0, h - thick / 2), sides=48)
        leg = joined(cylinder(0.05, h - thick, (0, 0, (h - thick) / 2)), cylinder(w / 4, 0.03, (0, 0, 0.015), sides=32))
        return [part_of(top, wood), part_of(leg, wood, smooth=True)], (w, d, h)
    legs = [
        box((0.05, 0.05, h - thick), (x * (w / 2 - 0.04), y * (d / 2 - 0.04), (h - thick) / 2))
        for x in (-1, 1)
        for y in (-1, 1)
    ]
    if u() < 0.3:
        legs.append(box((w - 0.1, d - 0.1, 0.02), (0, 0, h * u(0.2, 0.5))))
    return [part_of(joined(box((w, d, thick), (0, 0, h - thick / 2)), *legs), wood)], (w, d, h)


def draw_room(stock, rng: np.random.Generator, lens: Lens, count: int) -> Staged:
    maker = RoomMaker(stock, rng)
    maker.shell()
    maker.furnish()
    lighting = maker.light()
    return Staged("room", maker.parts, lighting, maker.cameras(lens, count), maker.assets)
