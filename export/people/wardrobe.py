"""What a rendered person wears: garments cut from the helper meshes, fabrics, skin tones, hair.

The tights, skirt and hair helpers of the base mesh are skinned like the body; a garment is a choice of
their triangles, pushed outwards along the normals. Every corner of a garment carries the body point nearest
to it in rest pose.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np
from scipy.spatial import cKDTree

from export.people import assets
from export.people.atlas import REGIONS, Atlas, vertex_regions
from export.people.body import Body
from export.people.motion import split_of

# Skin tones from light to dark (RGB), and the mean colour of the skin texture that they re-tint.
_TONES = np.array(
    [(255, 222, 196), (244, 200, 165), (228, 176, 132), (200, 140, 98), (150, 95, 62), (100, 64, 44), (66, 42, 32)],
    float,
)  # fmt: skip
_SKIN_MEAN = np.array([185.0, 145.0, 123.0])
_HAIR_COLOURS = (
    np.array([(20, 16, 14), (40, 26, 18), (75, 48, 30), (120, 80, 45), (180, 140, 85),
              (215, 185, 130), (150, 150, 150), (110, 45, 22), (30, 30, 34)], float) / 255
)  # fmt: skip


@dataclass(frozen=True)
class Layer:
    """One draw call: triangles of the model, a texture (None = skin), and how the surface is pushed and shaded."""

    faces: np.ndarray
    texture: np.ndarray | None = None  # uint8 [256, 256, 3]
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0)
    offset: float = 0.0  # metres outwards
    bulge: float = 0.0  # metres of slow waves on top
    bulge_frequency: float = 20.0
    wrinkle: float = 0.0  # strength of waves in the shading normal
    wrinkle_frequency: float = 60.0
    specular: float = 0.0
    repeats: float = 3.0  # texture repeats a metre
    phase: np.ndarray = field(default_factory=lambda: np.zeros(3))


class Model:
    """The body with its helpers as one triangle list with per-corner labels, ready for the renderer."""

    def __init__(self, body: Body, atlas: Atlas) -> None:
        self.body = body
        rest = body.template.vertices
        eyes = np.concatenate([body.faces["helper-l-eye"], body.faces["helper-r-eye"]])
        pieces = [("body", body.faces["body"])] + [(n, body.faces[f"helper-{n}"]) for n in ("tights", "skirt", "hair")]
        pieces.append(("eyes", eyes))
        self.range, faces, point, texture = {}, [], [], []
        finder = _NearestPoint(atlas)
        start = 0
        for name, f in pieces:
            self.range[name] = np.arange(start, start + len(f))
            start += len(f)
            faces.append(f)
            if name == "body":
                point.append(rest[f])
                texture.append(body.texture_uv[body.face_uv["body"]])
            else:
                point.append(finder.points(rest[f], name in ("hair", "eyes")))
                texture.append(np.zeros((len(f), 3, 2), np.float32))
        self.faces = np.concatenate(faces)
        self.point = np.concatenate(point).astype(np.float32)  # [F, 3, 3] of the template's surface, below each corner
        self.texture_uv = np.concatenate(texture).astype(np.float32)
        self.rest = rest.astype(np.float32)
        self.bare = np.concatenate([self.range["body"], self.range["eyes"]])
        self._measure(vertex_regions(body))

    def _measure(self, weights: np.ndarray) -> None:
        """Region and position along the limb of every triangle: what garments are cut by."""
        centre = self.rest[self.faces].mean(1)
        self.centre = centre
        self.region = weights[self.faces].sum(1).argmax(1)
        head = {n: self.body.template.heads[k] for n, k in self.body.bone.items()}
        side = np.where(centre[:, 0] > 0, "L", "R")

        def along(start: str, end: str) -> np.ndarray:
            out = np.zeros(len(centre))
            for s in "LR":
                a, b = head[f"{start}.{s}"], head[f"{end}.{s}"]
                own = side == s
                out[own] = (centre[own] - a) @ (b - a) / ((b - a) @ (b - a))
            return out

        self.along = {
            "upper_arm": along("upperarm01", "lowerarm01"),
            "lower_arm": along("lowerarm01", "wrist"),
            "upper_leg": along("upperleg01", "lowerleg01"),
            "lower_leg": along("lowerleg01", "foot"),
        }
        hips, neck = head["upperleg01.L"][2], head["neck01"][2]
        self.height = (centre[:, 2] - hips) / (neck - hips)  # 0 at the hips, 1 at the neck
        self.neck_z = head["head"][2]
        skull = centre[self.range["body"]][self.region[self.range["body"]] == REGIONS.index("head")]
        self.eye_z = float(centre[self.range["eyes"]][:, 2].mean())
        upper = skull[skull[:, 2] > self.eye_z]
        self.head_radius = float(skull[:, 2].max() - self.eye_z)
        self.head_y = float((upper[:, 1].min() + upper[:, 1].max()) / 2)

    def within(self, mesh: str, region: str) -> np.ndarray:
        """Which triangles belong to a helper mesh and a body region: bool over all triangles."""
        mask = np.zeros(len(self.faces), bool)
        mask[self.range[mesh]] = True
        return mask & (self.region == REGIONS.index(region))


class _NearestPoint:
    """The body point nearest to something worn, by many points of the surface."""

    def __init__(self, atlas: Atlas, samples: int = 300_000) -> None:
        rng = np.random.default_rng(0)
        corners = atlas.rest[atlas.faces]
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        face = rng.choice(len(area), samples, p=area / area.sum())
        points = (corners[face] * rng.dirichlet([1, 1, 1], samples)[..., None]).sum(1)
        self._all = cKDTree(points)
        # Hair and eyes belong to the head, each side to its half, however far the hair hangs down.
        self._head = {p: cKDTree(points[atlas.part[face] == p]) for p in (23, 24)}

    def points(self, corners: np.ndarray, head_only: bool) -> np.ndarray:
        """corners [F, 3, 3] in rest pose -> body points [F, 3, 3]."""
        if not head_only:
            return self._all.data[self._all.query(corners)[1]]
        left = corners[..., 0].mean(1) > 0
        out = np.empty_like(corners)
        for own, part in ((left, 24), (~left, 23)):
            out[own] = self._head[part].data[self._head[part].query(corners[own])[1]]
        return out


class Fabrics:
    """Cloth for a split: crops of 0 A.D. skins and of photos of that split, and plain or striped procedural cloth."""

    def __init__(self, split: str, photos: list[np.ndarray]) -> None:
        self.photos = photos
        cache = assets.cache_dir() / f"fabrics-{split}.npz"
        if not cache.exists():
            assets.save_cache(cache, tiles=_game_fabrics(split))
        with np.load(cache) as data:
            self.tiles = data["tiles"]

    def draw(self, rng: np.random.Generator) -> np.ndarray:
        """A texture, uint8 [256, 256, 3]."""
        kind = rng.random()
        if kind < 0.45:
            return _plain(rng)
        if kind < 0.6:
            return _striped(rng)
        if kind < 0.8 and self.photos:
            photo = self.photos[rng.integers(len(self.photos))]
            side = int(rng.integers(60, min(photo.shape[:2])))
            y, x = (rng.integers(0, n - side + 1) for n in photo.shape[:2])
            tile = cv2.resize(photo[y : y + side, x : x + side], (256, 256), interpolation=cv2.INTER_AREA)
        else:
            tile = self.tiles[rng.integers(len(self.tiles))]
        if rng.random() < 0.5:
            mix = np.eye(3) * rng.uniform(0.5, 1) + rng.normal(0, 0.15, (3, 3))
            tile = np.clip(tile.astype(np.float32) @ mix.astype(np.float32), 0, 255).astype(np.uint8)
        return tile


def _game_fabrics(split: str) -> np.ndarray:
    """256-pixel crops of the game's clothing textures, two a file."""
    from PIL import Image  # reads DDS, which OpenCV does not

    rng = np.random.default_rng(0)
    wrong = ("norm", "spec", "_n.", "animal", "horse", "eleph", "camel", "_ao")
    root = assets.zero_ad() / "textures" / "skins" / "skeletal"
    files = [
        p for p in sorted(root.rglob("*.dds")) if split_of(p.stem) == split and not any(w in str(p) for w in wrong)
    ]
    tiles = []
    for path in files[:200]:
        try:
            image = np.asarray(Image.open(path).convert("RGB"))
        except (OSError, NotImplementedError):
            continue  # a compression that Pillow does not know
        side = min(image.shape[:2]) // 2
        for _ in range(2):
            y, x = (rng.integers(0, n - side + 1) for n in image.shape[:2])
            tiles.append(cv2.resize(image[y : y + side, x : x + side], (256, 256), interpolation=cv2.INTER_AREA))
    return np.stack(tiles)


def _grey(values: np.ndarray) -> np.ndarray:
    return np.repeat(np.clip(values, 0, 255).astype(np.uint8), 3, -1)


def _plain(rng: np.random.Generator) -> np.ndarray:
    if rng.random() < 0.5:
        colour = rng.integers(5, 250, 3)
    else:
        colour = rng.integers(5, 250) + rng.integers(-12, 12, 3)
    return np.clip(colour + rng.normal(0, rng.uniform(1, 6), (256, 256, 1)), 0, 255).astype(np.uint8)


def _striped(rng: np.random.Generator) -> np.ndarray:
    cloth = rng.integers(10, 245, 3) + rng.normal(0, rng.uniform(1, 8), (256, 256, 1))
    at = np.arange(256)
    which = rng.integers(1, 4)
    for axis in (0, 1):
        if which & (1 << axis):
            wave = np.sin(at * 2 * np.pi / rng.choice([8, 16, 32, 64])) > rng.uniform(-0.5, 0.8)
            cloth = cloth + wave.reshape((-1, 1, 1) if axis == 0 else (1, -1, 1)) * rng.integers(-110, 110, 3)
    return np.clip(cloth, 0, 255).astype(np.uint8)


def dress(model: Model, fabrics: Fabrics, rng: np.random.Generator) -> list[Layer]:
    """Skin, eyes, clothes and hair of one person, in drawing order."""
    u = rng.uniform
    place = u() * 5.999
    tone = _TONES[int(place)] * (1 - place % 1) + _TONES[int(place) + 1] * (place % 1)
    skin = Layer(model.range["body"], tint=tuple(tone / _SKIN_MEAN * u(0.85, 1.1)), specular=u(0, 0.2))
    eyes = Layer(model.range["eyes"], _grey(np.clip(rng.normal(170, 60, (256, 256, 1)), 20, 255)), (0.9, 0.9, 0.9))
    return [skin, eyes, *_lower(model, fabrics, rng), *_upper(model, fabrics, rng), *_shoes(model, fabrics, rng),
            *_hair(model, fabrics, rng)]  # fmt: skip


def _cloth(rng: np.random.Generator, **more) -> dict:
    u = rng.uniform
    return {"offset": u(0.003, 0.013), "bulge": u(0, 0.007), "bulge_frequency": u(8, 30), "wrinkle": u(0, 0.45),
                "wrinkle_frequency": u(20, 90), "repeats": u(1, 5), "specular": 0.0 if u() < 0.8 else u(0, 0.2),
                "phase": u(0, 6, 3)} | more  # fmt: skip


def _lower(model: Model, fabrics: Fabrics, rng: np.random.Generator) -> list[Layer]:
    u = rng.uniform
    kind = rng.choice(["trousers", "shorts", "skirt", "briefs"], p=[0.6, 0.17, 0.18, 0.05])
    torso, upper, lower = (model.within("tights", n) for n in ("torso", "upper_leg", "lower_leg"))
    fabric, cloth = fabrics.draw(rng), _cloth(rng)
    waist = torso & (model.height < u(0.1, 0.3))
    if kind == "trousers":
        return [
            Layer(
                np.flatnonzero(waist | upper | (lower & (model.along["lower_leg"] < u(0.8, 1.1)))),
                fabric,
                **cloth,
            )
        ]
    if kind == "shorts":
        return [Layer(np.flatnonzero(waist | (upper & (model.along["upper_leg"] < u(0.3, 1)))), fabric, **cloth)]
    under = Layer(
        np.flatnonzero((torso & (model.height < 0.15)) | (upper & (model.along["upper_leg"] < 0.3))),
        fabric,
        **cloth,
    )
    if kind == "briefs":
        return [under]
    skirt = model.range["skirt"]
    z = model.centre[skirt, 2]
    return [under, Layer(skirt[z > u(z.min(), z.min() + 0.55 * np.ptp(z))], fabric, **cloth)]


def _upper(model: Model, fabrics: Fabrics, rng: np.random.Generator) -> list[Layer]:
    u = rng.uniform
    if u() < 0.06:
        return []
    torso, head, upper, lower, leg = (
        model.within("tights", n) for n in ("torso", "head", "upper_arm", "lower_arm", "upper_leg")
    )
    front = model.centre[:, 1] < model.centre[torso][:, 1].mean()

    def top(sleeve: int, hem: float, neckline: float, opening: float) -> np.ndarray:
        mask = (torso & (model.height > hem)) | (head & (model.height < 1))
        if hem < 0:
            mask |= leg & (model.height > hem)
        if sleeve < 2:
            mask |= upper & (model.along["upper_arm"] < (u(0, 0.15) if sleeve == 0 else u(0.35, 1)))
        else:
            mask |= upper | (lower & (model.along["lower_arm"] < (u(0.2, 0.7) if sleeve == 2 else u(0.85, 1.05))))
        x = model.centre[:, 0]
        mask &= ~(front & (model.height > 1 - neckline * np.exp(-((x / u(0.05, 0.12)) ** 2))))
        if opening:
            mask &= ~(front & (np.abs(x) < opening) & ~upper & ~lower)
        return np.flatnonzero(mask)

    sleeve = int(rng.choice(4, p=[0.14, 0.34, 0.07, 0.45]))
    cloth = _cloth(rng)
    layers = [Layer(top(sleeve, u(-0.12, 0.18), u(0, 0.35), 0), fabrics.draw(rng), **cloth)]
    if u() < 0.28:
        opening = u(0.02, 0.1) if u() < 0.6 else 0
        jacket = cloth | {"offset": cloth["offset"] + u(0.008, 0.025), "bulge": u(0, 0.008)}
        layers.append(Layer(top(3, u(-0.35, 0.1), u(0, 0.5), opening), fabrics.draw(rng), **jacket))
    return layers


def _shoes(model: Model, fabrics: Fabrics, rng: np.random.Generator) -> list[Layer]:
    u = rng.uniform
    if u() < 0.1:
        return []
    shaft = model.within("tights", "lower_leg") & (model.along["lower_leg"] > u(0.85, 1.2))
    faces = np.flatnonzero(model.within("tights", "foot") | shaft)
    return [Layer(faces, fabrics.draw(rng), **_cloth(rng, offset=u(0.004, 0.012), bulge=0.0, wrinkle=0.1))]


def _long_hair(model: Model, rng: np.random.Generator) -> np.ndarray:
    """Triangles of the hair helper down to a drawn length, without the strands that hang over the face."""
    hair, radius = model.range["hair"], model.head_radius
    x, y, z = model.centre[hair].T
    before_face = (y < model.head_y - 0.15 * radius) & (np.abs(x) < 0.66 * radius) & (z > model.neck_z - 0.06)
    fringe = before_face & (z > model.eye_z + 0.35 * radius)
    shown = ~before_face | (fringe & (rng.random() < 0.3))
    return hair[shown & (z > rng.uniform(z.min() - 0.2, model.neck_z))]


def _hair(model: Model, fabrics: Fabrics, rng: np.random.Generator) -> list[Layer]:
    u = rng.uniform
    colour = tuple(_HAIR_COLOURS[rng.integers(len(_HAIR_COLOURS))] * u(0.6, 1.3) * 2)
    strands = _grey(128 + rng.normal(0, u(10, 45), (1, 256, 1)) + rng.normal(0, 12, (256, 256, 1)))
    centre, eye, radius = model.centre, model.eye_z, model.head_radius
    skull = model.within("body", "head")
    layers = []
    style = {"wrinkle": u(0.1, 0.6), "repeats": u(3, 14), "specular": u(0, 0.15), "phase": u(0, 6, 3)}
    if u() < 0.93:
        tilt = np.array([0, u(0.6, 1.6), 1])
        above = (centre - [0, model.head_y, eye + 0.45 * radius]) @ (tilt / np.linalg.norm(tilt)) / radius
        cap = skull & (above > u(-0.5, 0.1)) & (centre[:, 2] > model.neck_z - u(-0.01, 0.1))
        hat = u() < 0.08
        layers.append(
            Layer(np.flatnonzero(cap), fabrics.draw(rng) if hat else strands, (1.0, 1.0, 1.0) if hat else colour,
                  offset=u(0.003, 0.03), bulge=u(0, 0.012), bulge_frequency=u(20, 70),
                  wrinkle_frequency=u(60, 300), **style)
        )  # fmt: skip
        if u() < 0.33:
            layers.append(
                Layer(_long_hair(model, rng), strands, colour, offset=u(-0.005, 0.015), bulge=u(0, 0.01),
                      bulge_frequency=30.0, wrinkle_frequency=u(60, 200), **style)
            )  # fmt: skip
    if u() < 0.15:
        chin = skull & (centre[:, 1] < model.head_y - 0.25 * radius) & (centre[:, 2] > model.neck_z - 0.02)
        beard = chin & (centre[:, 2] < eye - u(0.5, 0.65) * radius)
        layers.append(
            Layer(np.flatnonzero(beard), strands, colour, offset=u(0.001, 0.01), bulge=0.002, bulge_frequency=60.0,
                  wrinkle=0.4, wrinkle_frequency=150.0, repeats=8.0)
        )  # fmt: skip
    return layers
