"""One thing, one person, or a table with small things, before a photographed surrounding or a plain colour."""

from __future__ import annotations

import numpy as np

from export.people.panoramas import Panorama
from export.people.props import cylinder
from export.places.cameras import Lens, arc, looking
from export.places.catalogue import Asset, people_assets
from export.places.furnish import Heights, finished, placed
from export.places.mesh import Material, Part, part_of
from export.places.render import Lighting
from export.places.rooms import Staged, checks, own_table, planks


def outdoors(stock, rng: np.random.Generator, assets: list[Asset]) -> Lighting:
    """The light of a panorama: its brightest spots as lamps far away, the rest as sky and ground."""
    u = rng.uniform
    radiance, asset = stock.panorama(rng)
    assets.append(asset)
    yaw = int(rng.integers(radiance.shape[1]))
    # Columns run once around from +x; a turned place is the image rolled.
    panorama = Panorama(np.roll(radiance, yaw, 1))
    scale = panorama.exposure(u(0.7, 1.3))
    lamps = [(np.array([*towards, 0.0]), np.minimum(colour * scale, 4.0)) for towards, colour in panorama.lamps]
    lamps = [(at, colour) if at[2] > 0.15 else (at, colour * 0.3) for at, colour in lamps]
    first = lamps[0][0].copy()
    first[2] = max(first[2], 0.3)  # else shadows run over the whole ground
    lamps[0] = (first, lamps[0][1])
    extra = np.array([*rng.normal(0, 1, 2), u(0.4, 1.2), 0.0])
    lamps.append((extra, u(0, 0.5) * (1 + rng.normal(0, 0.1, 3))))
    plain = None
    if u() < 0.4:
        grey = u(0, 1) if u() < 0.5 else float(rng.integers(2))
        plain = tuple(map(float, np.clip(grey + rng.normal(0, 0.05, 3), 0, 1)))
    sky, bounce, around = (scale * a for a in (panorama.sky, 0.6 * panorama.ground, panorama.radiance))
    return Lighting(tuple(lamps), sky, bounce, around, u(0.5, 1), plain)


def ground(stock, rng: np.random.Generator, assets: list[Asset], radius: float, repeats: float | None = None) -> Part:
    """A disc to stand on, its top at z = 0; repeats: of its texture, a metre, instead of a few on the disc."""
    u = rng.uniform
    kind = u()
    if kind < 0.7:
        texture, asset = stock.tile(rng, "")
        assets.append(asset)
    else:
        texture = planks(rng) if kind < 0.85 else checks(rng)
    shine = {"specular": u(0, 0.4), "shininess": u(15, 120), "mirror": u(0, 0.12) if u() < 0.4 else 0.0}
    material = Material(texture, (u(0.7, 1.1),) * 3, **shine)
    solid = cylinder(radius, 0.02 * radius, (0, 0, -0.01 * radius), sides=96)
    own_repeats = 1 / (radius * u(0.3, 0.9))
    return part_of(solid, material, repeats=repeats or own_repeats, shades=False)


def draw_subject(stock, rng: np.random.Generator, lens: Lens, count: int) -> Staged:
    """A model of any kind, or somebody, on a disc of ground, seen from all around or from an arc."""
    u = rng.uniform
    assets: list[Asset] = []
    if stock.people is not None and u() < 0.3:
        parts, size = stock.people.somebody(rng)
        assets += people_assets()
        kind = "person"
    else:
        models = stock.of_kind("floor", "small", "large")
        model = models[rng.integers(len(models))]
        parts, size, kind = finished(list(stock.parts(model)), rng, 0.5), model.size, "object"
        assets.append(model.asset)
    lighting = outdoors(stock, rng, assets)
    reach = float(np.linalg.norm(size)) / 2
    disc = ground(stock, rng, assets, reach * u(1.6, 4))
    middle = np.array([0, 0, size[2] * u(0.4, 0.6)])
    cameras = _around(rng, lens, count, middle, reach, floor=0.05 * reach)
    return Staged(kind, [*placed(parts, (0, 0, 0), u(0, 6)), disc], lighting, cameras, assets, near=0.1 * reach)


def draw_still_life(stock, rng: np.random.Generator, lens: Lens, count: int) -> Staged:
    """Small things on a table."""
    u = rng.uniform
    assets: list[Asset] = []
    table, size = own_table(stock, rng, assets)
    heights = Heights.over((-size[0] / 2, -size[1] / 2), (size[0] / 2, size[1] / 2))
    heights.add(table, rng)
    parts = list(table)
    models = stock.of_kind("small")
    crowded = u(0.25, 0.5)  # how far from the middle of the table things are put, of its size
    for k in rng.permutation(len(models))[: rng.integers(4, 12)]:
        model = models[k]
        for _ in range(25):
            at, yaw = u(-crowded, crowded, 2) * size[:2], u(-np.pi, np.pi)
            mask = heights.cells(at, model.size, yaw)
            level = None if mask is None else heights.level(mask)
            if level is not None and level > size[2] - 0.02:
                heights.taken |= mask
                parts += placed(finished(list(stock.parts(model)), rng, 0.5), (*at, level), yaw)
                assets.append(model.asset)
                break
    lighting = outdoors(stock, rng, assets)
    parts.append(ground(stock, rng, assets, u(1.5, 4)))
    middle = np.array([*u(-0.1, 0.1, 2), size[2] + u(0, 0.1)])
    cameras = _around(rng, lens, count, middle, crowded * max(size[:2]) * u(0.7, 1.1), floor=size[2] + 0.12)
    return Staged("still life", parts, lighting, cameras, assets, near=0.03)


def _around(rng: np.random.Generator, lens: Lens, count: int, middle, reach: float, floor: float) -> list:
    """Cameras that see a ball of radius `reach` about fill their shorter side, none below z = `floor`."""
    half = np.arctan(np.tan(np.radians(lens.degrees) / 2) * min(lens.width, lens.height) / max(lens.width, lens.height))
    distance = reach / np.sin(half) * rng.uniform(0.8, 1.35)
    eyes = arc(rng, count, middle, distance, whole=rng.random() < 0.6)
    cameras = []
    for eye in eyes:
        eye[2] = max(eye[2], floor)
        to = middle + rng.normal(0, 0.08 * reach, 3)
        cameras.append(looking(lens, eye, to, float(rng.normal(0, 2))))
    return cameras
