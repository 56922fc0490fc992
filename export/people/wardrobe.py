"""Clothes of rendered people: garments cut from the helper meshes, fabrics, skin tones, hair.

The tights, skirt and hair helpers of the base mesh are skinned like the body; a garment is a choice of
their triangles, pushed outwards along the normals. Every corner of a garment carries the body point nearest
to it in rest pose.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field

import cv2
import numpy as np
from scipy.spatial import cKDTree

from export.people import assets
from export.people.atlas import REGIONS, Atlas, vertex_regions
from export.people.augmentation import CLOSE, Variety
from export.people.body import Body
from export.people.motion import split_of
from export.people.props import Prop

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
    gloss: float = 20.0  # exponent of the highlight
    sheen: float = 0.0  # light at grazing angles: wool and velvet
    cut: np.ndarray | None = None  # [F, 3] at the corners of `faces`, metres inside the edge; drawn where above 0
    fray: float = 0.0  # metres by which the edge wavers
    fray_frequency: float = 100.0
    panel: tuple[float, float, float, float] = (
        0.0,
        0.0,
        0.0,
        0.0,
    )  # x, z, half sizes in rest pose; last < 0: at the back
    panel_tint: tuple[float, float, float] = (1.0, 1.0, 1.0)
    name: str = ""


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
        self._within: dict[tuple[str, ...], np.ndarray] = {}
        self._measure(vertex_regions(body))

    def _measure(self, weights: np.ndarray) -> None:
        """Where on the body triangles and their corners are: what garments are cut by.

        Garments end at lines, not at triangles, so what they are cut by is known at corners: position `corner`
        [F, 3, 3], `height` (0 at the hips, 1 at the neck), `arm` and `leg` (0 at the shoulder or hip joint, 1 at the
        elbow or knee, 2 at the wrist or ankle; at most 0 off the limb), each [F, 3].
        """
        centre = self.rest[self.faces].mean(1)
        self.centre = centre
        self.region = weights[self.faces].sum(1).argmax(1)
        head = {n: self.body.template.heads[k] for n, k in self.body.bone.items()}
        own = weights.argmax(1)

        def along(limb: tuple[str, str, str], regions: tuple[str, ...]) -> np.ndarray:
            out = np.zeros(len(self.rest))
            for side, half in (("L", self.rest[:, 0] > 0), ("R", self.rest[:, 0] <= 0)):
                joints = [head[f"{name}.{side}"] for name in limb]
                first, second = (
                    (self.rest[half] - a) @ (b - a) / ((b - a) @ (b - a)) for a, b in itertools.pairwise(joints)
                )
                out[half] = np.minimum(first, 1) + np.maximum(second, 0)
            on_limb = np.isin(own, [REGIONS.index(r) for r in regions])
            return np.where(on_limb, out, np.minimum(out, 0))[self.faces]

        self.corner = self.rest[self.faces]
        self.arm = along(("upperarm01", "lowerarm01", "wrist"), ("upper_arm", "lower_arm", "hand"))
        self.leg = along(("upperleg01", "lowerleg01", "foot"), ("upper_leg", "lower_leg", "foot"))
        hips, neck = head["upperleg01.L"][2], head["neck01"][2]
        self.trunk = float(neck - hips)  # metres
        self.height = (self.corner[..., 2] - hips) / self.trunk
        self.neck_z = head["head"][2]
        skull = centre[self.range["body"]][self.region[self.range["body"]] == REGIONS.index("head")]
        self.eye_z = float(centre[self.range["eyes"]][:, 2].mean())
        upper = skull[skull[:, 2] > self.eye_z]
        self.head_radius = float(skull[:, 2].max() - self.eye_z)
        self.head_y = float((upper[:, 1].min() + upper[:, 1].max()) / 2)
        eyes = self.corner[self.range["eyes"]].reshape(-1, 3)
        self.eye_x, self.eye_y = float(np.abs(eyes[:, 0]).mean()), float(eyes[:, 1].min())
        # Vertices that tell where to put a seat, what is held, a hat's brim.
        bare = _mask(self.body.groups["body"], len(own))
        member = {name: bare & (own == k) for k, name in enumerate(REGIONS)}
        left = self.rest[:, 0] > 0
        self.torso = np.flatnonzero(member["torso"])
        at_hips = np.abs(self.rest[:, 2] - hips) < 0.12
        self.buttocks = np.flatnonzero(at_hips & (member["torso"] | member["upper_leg"]))
        self.hand, self.lower_arm = (
            [np.flatnonzero(member[name] & half) for half in (left, ~left)] for name in ("hand", "lower_arm")
        )
        self.skull = np.flatnonzero(member["head"] & (self.rest[:, 2] > self.eye_z))

    def within(self, mesh: str, *regions: str) -> np.ndarray:
        """Numbers of the triangles that belong to a helper mesh and to one of the body regions."""
        key = (mesh, *regions)
        if key not in self._within:
            own = np.isin(self.region[self.range[mesh]], [REGIONS.index(r) for r in regions])
            self._within[key] = self.range[mesh][own]
        return self._within[key]


def _mask(members: np.ndarray, count: int) -> np.ndarray:
    mask = np.zeros(count, bool)
    mask[members] = True
    return mask


def cut_out(faces: np.ndarray, *insides: np.ndarray) -> dict[str, np.ndarray]:
    """Fields of a `Layer`: those of `faces` [F] with a corner where all `insides` [F, 3] (metres) are above 0."""
    inside = np.minimum.reduce(insides)
    shown = np.maximum(np.maximum(inside[:, 0], inside[:, 1]), inside[:, 2]) > 0
    return {"faces": faces[shown], "cut": inside[shown].astype(np.float32)}


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

    def __init__(self, split: str, photos: list[np.ndarray], bare: bool = False) -> None:
        self.bare = bare  # nobody wears anything: to see what clothes teach
        self.photos = photos
        cache = assets.cache_dir() / f"fabrics-{split}.npz"
        if not cache.exists():
            assets.save_cache(cache, tiles=_game_fabrics(split))
        with np.load(cache) as data:
            self.tiles = data["tiles"]

    def draw(self, rng: np.random.Generator, worn: bool = True) -> np.ndarray:
        """A texture, uint8 [256, 256, 3]; not `worn`: none of the game's skins, which may show bare limbs."""
        kind = rng.random() * (1 if worn else 0.8)
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
    """One colour; most clothes are dark, white or muted rather than bright."""
    kind = rng.random()
    if kind < 0.25:
        colour = rng.integers(5, 250, 3)
    else:
        value = rng.choice([rng.uniform(8, 60), rng.uniform(60, 190), rng.uniform(190, 250)], p=[0.45, 0.3, 0.25])
        colour = value * (1 + rng.normal(0, 0.03 if kind < 0.55 else 0.22, 3))
    # Woven or knitted: noise along threads beside the noise of single texels.
    threads = rng.normal(0, rng.uniform(0, 6), (256, 1, 1)) + rng.normal(0, rng.uniform(0, 6), (1, 256, 1))
    return np.clip(
        colour + threads + rng.standard_normal((256, 256, 1), np.float32) * rng.uniform(1, 6), 0, 255
    ).astype(np.uint8)


def _denim(rng: np.random.Generator) -> np.ndarray:
    """Blue, grey or black twill, worn unevenly."""
    colour = np.array([(52, 68, 102), (88, 110, 148), (32, 38, 58), (70, 72, 76), (26, 26, 29)][rng.integers(5)], float)
    worn = cv2.resize(rng.normal(0, 1, (6, 6)).astype(np.float32), (256, 256), interpolation=cv2.INTER_CUBIC)[..., None]
    noise = 6 * rng.standard_normal((256, 256, 1), np.float32)
    return np.clip(colour * (1 + rng.uniform(0, 0.22) * worn) + noise, 0, 255).astype(np.uint8)


def _striped(rng: np.random.Generator) -> np.ndarray:
    cloth = rng.integers(10, 245, 3) + rng.normal(0, rng.uniform(1, 8), (256, 256, 1))
    at = np.arange(256)
    which = rng.integers(1, 4)
    for axis in (0, 1):
        if which & (1 << axis):
            wave = np.sin(at * 2 * np.pi / rng.choice([8, 16, 32, 64])) > rng.uniform(-0.5, 0.8)
            cloth = cloth + wave.reshape((-1, 1, 1) if axis == 0 else (1, -1, 1)) * rng.integers(-110, 110, 3)
    return np.clip(cloth, 0, 255).astype(np.uint8)


def dress(model: Model, fabrics: Fabrics, rng: np.random.Generator, variety: Variety = CLOSE) -> list[Layer]:
    """Skin, eyes, clothes, hair and what is on the head of one person, in drawing order."""
    u = rng.uniform
    place = u() * 5.999
    tone = _TONES[int(place)] * (1 - place % 1) + _TONES[int(place) + 1] * (place % 1)
    skin = Layer(model.range["body"], tint=tuple(tone / _SKIN_MEAN * u(0.85, 1.1)), specular=u(0, 0.2), gloss=u(6, 30),
                 sheen=u(0, 0.1))  # fmt: skip
    eyes = Layer(
        model.range["eyes"], _grey(np.clip(rng.normal(u(60, 130), 50, (256, 256, 1)), 10, 230)), (0.9, 0.9, 0.9)
    )
    if fabrics.bare:
        return [skin, eyes, *_hair(model, rng)]
    upper = _upper(model, fabrics, rng, variety.bare_chest)
    return [skin, eyes, *_lower(model, fabrics, rng), *upper, *_shoes(model, fabrics, rng), *_hair(model, rng),
            *_on_head(model, fabrics, upper, rng, variety)]  # fmt: skip


def _cloth(rng: np.random.Generator, **more) -> dict:
    u = rng.uniform
    shiny = u() < 0.2
    return {"offset": u(0.003, 0.013), "bulge": u(0, 0.007), "bulge_frequency": u(8, 30), "wrinkle": u(0, 0.5),
            "wrinkle_frequency": u(0.7, 3.5), "repeats": u(1, 5), "specular": u(0.05, 0.4) if shiny else 0.0,
            "gloss": u(5, 40), "sheen": u(0, 0.25) if u() < 0.4 else 0.0, "phase": u(0, 6, 3),
            "fray": u(0, 0.002), "fray_frequency": u(30, 120)} | more  # fmt: skip


def _lower(model: Model, fabrics: Fabrics, rng: np.random.Generator) -> list[Layer]:
    u = rng.uniform
    kind = rng.choice(["trousers", "shorts", "skirt", "briefs"], p=[0.6, 0.17, 0.18, 0.05])
    fabric, cloth = _denim(rng) if kind != "skirt" and u() < 0.3 else fabrics.draw(rng), _cloth(rng)
    region = model.within("tights", "torso", "upper_leg", "lower_leg", "foot")
    below_waist = (u(0.1, 0.3) - model.height[region]) * model.trunk
    end = {"trousers": u(1.8, 2.1), "shorts": u(0.3, 1.0)}.get(kind, 0.3)
    layer = Layer(**cut_out(region, below_waist, (end - model.leg[region]) * 0.4), texture=fabric, **cloth)
    if kind != "skirt":
        return [layer]
    skirt = model.range["skirt"]
    z = model.corner[skirt][..., 2]
    end = u(z.min(), z.min() + 0.55 * np.ptp(z))
    return [layer, Layer(**cut_out(skirt, z - end), texture=fabric, **cloth)]


def _upper(model: Model, fabrics: Fabrics, rng: np.random.Generator, bare_chest: float) -> list[Layer]:
    u = rng.uniform
    if u() < bare_chest:
        return []
    region = model.within("tights", "torso", "head", "upper_arm", "lower_arm", "upper_leg")
    x, y, height, arm = (*model.corner[region][..., :2].transpose(2, 0, 1), model.height[region], model.arm[region])
    middle = model.centre[model.within("tights", "torso"), 1].mean()
    front = 1 / (1 + np.exp((y - middle) / 0.015))
    on_arm = arm > 0

    def top(sleeve: int, hem: float, neckline: float, opening: float) -> dict[str, np.ndarray]:
        end = (u(0.02, 0.2), u(0.35, 1), u(1.2, 1.7), u(1.85, 2.05))[sleeve]
        collar = 1 + u(-0.03, 0.08) - neckline * np.exp(-((x / u(0.05, 0.12)) ** 2)) * front
        insides = [
            np.where(on_arm, 1, (height - hem) * model.trunk),
            (end - arm) * 0.25,
            np.where(on_arm, 1, (collar - height) * model.trunk),
        ]
        if opening:
            insides.append(np.where(on_arm, 1, np.maximum(np.abs(x) - opening, y - middle)))
        return cut_out(region, *insides)

    sleeve = int(rng.choice(4, p=[0.14, 0.34, 0.07, 0.45]))
    cloth = _cloth(rng)
    chest = model.neck_z - 0.14 - 0.28 * model.trunk
    print_ = {}
    if u() < 0.3:  # a print, mostly on the chest, or the row of buttons
        size = (u(0.03, 0.12), u(0.02, 0.12) * (1 if u() < 0.75 else -1))
        print_ = {"panel": (0.0, chest, *size), "panel_tint": tuple(u(0.3, 1.8, 3))}
    elif u() < 0.25:
        print_ = {"panel": (0.0, chest - 0.1, u(0.004, 0.015), 0.4), "panel_tint": (u(0.2, 1.5),) * 3}
    layers = [Layer(**top(sleeve, u(-0.12, 0.18), u(0, 0.35), 0), texture=fabrics.draw(rng), **cloth, **print_)]
    if u() < 0.28:
        opening = u(0.02, 0.1) if u() < 0.6 else 0
        jacket = cloth | {"offset": cloth["offset"] + u(0.008, 0.025), "bulge": u(0, 0.008)}
        if not opening:
            jacket |= {"panel": (0.0, chest - 0.1, u(0.003, 0.012), 0.5), "panel_tint": (u(0.2, 1.6),) * 3}
        layers.append(Layer(**top(3, u(-0.35, 0.1), u(0, 0.5), opening), texture=fabrics.draw(rng), **jacket))
    return layers


def _shoes(model: Model, fabrics: Fabrics, rng: np.random.Generator) -> list[Layer]:
    u = rng.uniform
    if u() < 0.1:
        return []
    region = model.within("tights", "foot", "lower_leg")
    inside = (model.leg[region] - (u(1.85, 2.0) if u() < 0.75 else u(1.2, 1.85))) * 0.4
    leather = _cloth(rng, offset=u(0.004, 0.012), bulge=0.0, wrinkle=0.1, fray=0.0)
    return [Layer(**cut_out(region, inside), texture=fabrics.draw(rng), **leather)]


def _long_hair(model: Model, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """The hair helper down to a drawn length, without the strands that hang over the face."""
    radius = model.head_radius
    hair = model.range["hair"]
    x, y, z = model.centre[hair].T
    before_face = (y < model.head_y - 0.15 * radius) & (np.abs(x) < 0.66 * radius) & (z > model.neck_z - 0.06)
    fringe = before_face & (z > model.eye_z + 0.35 * radius)
    shown = ~before_face | (fringe & (rng.random() < 0.3))
    corner_z = model.corner[hair[shown]][..., 2]
    end = rng.uniform(z.min() - 0.2, model.neck_z)
    return cut_out(hair[shown], corner_z - end)


def _hair(model: Model, rng: np.random.Generator) -> list[Layer]:
    u = rng.uniform
    colour = tuple(_HAIR_COLOURS[rng.integers(len(_HAIR_COLOURS))] * u(0.6, 1.3) * 2)
    strands = _grey(128 + rng.normal(0, u(10, 45), (1, 256, 1)) + rng.normal(0, 12, (256, 256, 1)))
    eye, radius = model.eye_z, model.head_radius
    skull = model.within("body", "head")
    y, z = model.corner[skull][..., 1], model.corner[skull][..., 2]
    layers = []
    style = {"wrinkle": u(0.1, 0.6), "repeats": u(3, 14), "specular": u(0, 0.25), "gloss": u(8, 30),
             "phase": u(0, 6, 3)}  # fmt: skip
    if u() < 0.93:
        tilt = u(0.6, 1.6)
        above = (tilt * (y - model.head_y) + z - eye - 0.45 * radius) / np.hypot(1, tilt)
        cap = cut_out(skull, above - u(-0.6, 0.05) * radius, z - model.neck_z + u(-0.01, 0.1))
        layers.append(
            Layer(**cap, texture=strands, tint=colour, offset=u(0.003, 0.03), bulge=u(0, 0.012),
                  bulge_frequency=u(20, 70), wrinkle_frequency=u(4, 12), fray=u(0.001, 0.006),
                  fray_frequency=u(100, 400), **style)
        )  # fmt: skip
        if u() < 0.33:
            layers.append(
                Layer(**_long_hair(model, rng), texture=strands, tint=colour, offset=u(-0.005, 0.015), bulge=u(0, 0.01),
                      bulge_frequency=30.0, wrinkle_frequency=u(3, 8), fray=u(0.003, 0.015),
                      fray_frequency=u(60, 250), **style)
            )  # fmt: skip
    if u() < 0.15:
        inside = np.minimum(model.head_y - 0.25 * radius - y, eye - u(0.5, 0.65) * radius - z)
        layers.append(
            Layer(**cut_out(skull, inside, z - model.neck_z + 0.02), texture=strands, tint=colour,
                  offset=u(0.003, 0.01), bulge=0.002, bulge_frequency=60.0, wrinkle=0.4, wrinkle_frequency=6.0,
                  repeats=8.0, fray=u(0.001, 0.004), fray_frequency=u(150, 400))
        )  # fmt: skip
    return layers


def _on_head(
    model: Model, fabrics: Fabrics, upper: list[Layer], rng: np.random.Generator, variety: Variety
) -> list[Layer]:
    """Hat, hood or headscarf; glasses; a mask over mouth and nose. Each follows the head's surface."""
    u = rng.uniform
    radius, skull = model.head_radius, model.within("body", "head")
    x, y, z = model.corner[skull].transpose(2, 0, 1)
    layers = []
    kind = u()
    if kind < variety.hat:  # hat; `brim` gives some of them a brim
        tilt = u(-0.1, 0.5)
        above = (tilt * (y - model.head_y) + z - model.eye_z - u(0.25, 0.55) * radius) / np.hypot(1, tilt)
        layers.append(
            Layer(**cut_out(skull, above), texture=fabrics.draw(rng), name="hat", **_cloth(rng, offset=u(0.03, 0.04)))
        )
    elif kind < variety.hat + variety.hood:  # hood or headscarf: open at the face
        width, high = u(0.55, 0.8) * radius, u(0.8, 1.0) * radius
        face = np.hypot(x / width, (z - model.eye_z + 0.3 * radius) / high)
        open_ = np.where(y < model.head_y, (face - 1) * width, 1.0)
        cloth = _cloth(rng, offset=u(0.03, 0.045))
        fabric = upper[-1].texture if upper and u() < 0.6 else fabrics.draw(rng)
        layers.append(Layer(**cut_out(skull, open_, z - model.neck_z + u(0.05, 0.12)), texture=fabric, **cloth))
    if u() < 0.2:
        layers.append(_glasses(model, skull, rng))
    if u() < 0.02:
        low, high = model.eye_z - 1.3 * radius, model.eye_z - u(0.2, 0.35) * radius
        inside = np.minimum(np.minimum(z - low, high - z), model.head_y - 0.1 * radius - y)
        plain = np.full((256, 256, 3), rng.choice([20, 150, 230]), np.uint8)
        layers.append(Layer(**cut_out(skull, inside), texture=plain, offset=0.008))
    return layers


def _glasses(model: Model, skull: np.ndarray, rng: np.random.Generator) -> Layer:
    """Frames, or dark lenses, as rings around the eyes on the face's surface, with bridge and temples."""
    u = rng.uniform
    x, y, z = model.corner[skull].transpose(2, 0, 1)
    lens, thick = u(0.42, 0.7) * model.eye_x, u(0.0025, 0.005)
    ring = np.hypot((np.abs(x) - model.eye_x) / u(1.0, 1.4), z - model.eye_z) - lens
    rim = -ring if u() < 0.35 else thick - np.abs(ring)
    bridge_and_temples = np.abs(np.abs(x) - model.eye_x) > lens
    inside = np.maximum(rim, np.where(bridge_and_temples, thick - np.abs(z - model.eye_z - 0.3 * lens), -1))
    grey = np.full((256, 256, 3), rng.choice([12, 25, 60, 150]), np.uint8)
    before_ears = model.head_y + 0.1 * model.head_radius - y
    return Layer(**cut_out(skull, inside, before_ears), texture=grey, offset=0.008, specular=u(0, 0.5), gloss=30.0)


def brim(model: Model, layers: list[Layer], vertices: np.ndarray, rng: np.random.Generator) -> tuple[Prop, ...]:
    """The brim or peak of the hat among `layers`, if there is one and it has one; vertices [V, 3] of the posed body."""
    hat = next((layer for layer in layers if layer.name == "hat"), None)
    if hat is None or rng.random() < 0.35:
        return ()
    from_rest, at = model.rest[model.skull], vertices[model.skull]
    middle, there = from_rest.mean(0), at.mean(0)
    # Similarity that takes the head at rest to where it is (Umeyama 1991).
    left, size, right = np.linalg.svd((at - there).T @ (from_rest - middle))
    turn = left @ np.diag([1, 1, np.linalg.det(left @ right)]) @ right
    scale = size.sum() / ((from_rest - middle) ** 2).sum()
    u, radius = rng.uniform, model.head_radius
    all_around = u() < 0.4
    z = model.corner[hat.faces][hat.cut > 0][:, 2].min() + 0.01
    half = np.linspace(-np.pi, np.pi, 25) if all_around else np.linspace(-0.42, 0.42, 9) * np.pi
    inner = np.array([0.75, 0.95]) * radius
    outer = inner + (u(0.04, 0.1) if all_around else u(0.05, 0.08) * np.cos(half * 1.1)[:, None])
    heading = np.stack([np.sin(half), -np.cos(half)], 1)  # 0 = forward, which is -y
    rings = [np.concatenate([heading * r + [0, model.head_y], np.full((len(half), 1), height)], 1)
             for r, height in ((inner, z), (outer, z - u(0.0, 0.025)))]  # fmt: skip
    a, b, c, d = rings[0][:-1], rings[0][1:], rings[1][1:], rings[1][:-1]
    corners = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    nearest = cKDTree(from_rest).query(corners)[1]
    return (
        Prop((corners - middle) @ (scale * turn).T + there, corners[..., :2] * 5, hat.texture[::4, ::4].copy(),
             points=model.rest[model.skull][nearest].astype(np.float64)),
    )  # fmt: skip
