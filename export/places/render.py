"""Draws a place with OpenGL (EGL, no window): colour and exact depth, as often as wanted from one upload.

Light is kept in the world, not on the screen, so that two views agree on everything but what depends on the view:
highlights (Blinn-Phong, each material its own exponent), reflections of the surroundings, glass.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field, replace

os.environ.setdefault("LP_NUM_THREADS", "1")  # the software rasteriser; processes are the parallelism here

import moderngl
import numpy as np

from export.camera import Camera
from export.places import shaders
from export.places.mesh import Part

FAR = 4000.0  # times the distance before which nothing is seen
_SAMPLES = 4  # of colour, a pixel; depth is that of the pixel's centre
_KEY_MAP, _SKY_MAP, _SKY = 2048, 512, 8  # texels a side, texels a side, directions that light comes from
_ATLAS = 3  # sky maps in a row of their common texture
_LIGHTS = 4
_BRIGHTEST = 15.0  # of the surroundings: mirrored lamps would be white patches else
_OFFSET = 2.0  # texels before a surface, where its own roughness in a depth map does not shade it


@dataclass(frozen=True, eq=False)
class Lighting:
    """Linear light. lights: position [4] (last 0: a direction towards a light far away, 1: metres) and colour [3], the
    first casts shadows; sky: colour [3] of the light from above and around, bounce: of that from everywhere.

    surroundings: radiance float32 [H, W, 3], rows from straight up to straight down; seen in shiny things, and behind
    everything unless `plain` (display values 0..1) is.
    """

    lights: tuple[tuple[np.ndarray, np.ndarray], ...]
    sky: np.ndarray
    bounce: np.ndarray
    surroundings: np.ndarray
    reflection: float = 1.0
    plain: tuple[float, float, float] | None = None
    towards_key: np.ndarray = field(default_factory=lambda: np.array([0, 0, -1.0]))  # where a lamp with shadows looks


def _sky_directions() -> np.ndarray:
    """Directions spread evenly over the upper half, and a little below the horizon: [_SKY, 3]."""
    k = np.arange(_SKY) + 0.5
    z = 1 - 1.1 * k / _SKY
    around = np.pi * (1 + 5**0.5) * k
    flat = np.sqrt(1 - z**2)
    return np.stack([flat * np.cos(around), flat * np.sin(around), z], 1)


def _from_far(towards: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """World -> [-1, 1] cube of a light far away in direction `towards`, around the box low..high: [4, 4]."""
    centre, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2 + 1e-3
    side = np.cross(towards, [0.31, 0.17, 0.93])
    side /= np.linalg.norm(side)
    axes = np.stack([side, np.cross(towards, side), -towards]) / radius
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = axes, -axes @ centre
    return matrix


def _from_lamp(at: np.ndarray, towards: np.ndarray, degrees: float = 150.0) -> np.ndarray:
    """World -> clip space of a lamp that throws shadows within a cone: [4, 4]."""
    side = np.cross(towards, [0.31, 0.87, 0.39])
    side /= np.linalg.norm(side)
    rotation = np.stack([side, np.cross(towards, side), towards])
    view = np.eye(4)
    view[:3, :3], view[:3, 3] = rotation, -rotation @ at
    f, near, far = 1 / np.tan(np.radians(degrees) / 2), 0.05, 30.0
    a, b = (far + near) / (far - near), -2 * far * near / (far - near)
    return np.array([[f, 0, 0, 0], [0, f, 0, 0], [0, 0, a, b], [0, 0, 1, 0]]) @ view


def _packed(part: Part) -> np.ndarray:
    """The vertex buffer of a part: float32 [F, 3, 9]."""
    cut = np.ones(part.corners.shape[:2], np.float32) if part.cut is None else part.cut
    return np.concatenate([part.corners, part.normals, part.uv, cut[..., None]], 2).astype(np.float32)


@dataclass(eq=False)
class _Drawn:
    """A part on the graphics side. buffer: of each corner position [3], normal [3], uv [2] and cut, float32."""

    part: Part
    buffer: moderngl.Buffer
    arrays: dict[str, moderngl.VertexArray]
    texture: moderngl.Texture
    middle: np.ndarray
    program: str  # "whole" or "cut"


class Renderer:
    """Owns an OpenGL context and one place; use it in a `with` statement, or call `close`.

    near: metres before which cameras see nothing.
    """

    def __init__(self, parts: list[Part], lighting: Lighting, near: float = 0.03) -> None:
        self.near = near
        self.context = moderngl.create_context(standalone=True, backend="egl")
        self.lighting = lighting
        self.programs = {}
        for name, cutting in (("whole", ""), ("cut", shaders.CUTTING)):
            for kind, vertex, fragment in (
                ("colour", shaders.VERTEX, shaders.COLOUR),
                ("depth", shaders.VERTEX, shaders.DEPTH),
                ("shadow", shaders.SHADOW_VERTEX, shaders.SHADOW),
            ):
                fragment = fragment.replace("CUTTING", cutting)
                for figure, value in (
                    ("KEY_MAP", _KEY_MAP),
                    ("SKY_LIGHTS", _SKY),
                    ("LIGHTS", _LIGHTS),
                    ("ATLAS", _ATLAS),
                ):
                    fragment = fragment.replace(figure, str(value))
                self.programs[kind, name] = self.context.program(vertex_shader=vertex, fragment_shader=fragment)
        self.behind = self.context.program(vertex_shader=shaders.BEHIND_VERTEX, fragment_shader=shaders.BEHIND)
        corners = np.array([[-1, -1], [3, -1], [-1, 3]], np.float32)
        self.behind_array = self.context.vertex_array(
            self.behind, [(self.context.buffer(corners.tobytes()), "2f", "corner")]
        )
        self.textures: dict[int, moderngl.Texture] = {}
        self.white = self._texture(np.full((1, 1, 4), 255, np.uint8))
        self.drawn = [self._upload(p) for p in parts if len(p.corners)]
        self.targets: dict[tuple[int, int], tuple] = {}
        around = np.ascontiguousarray(np.minimum(lighting.surroundings, _BRIGHTEST).astype(np.float16))
        self.surroundings = self.context.texture(around.shape[1::-1], 3, around.tobytes(), dtype="f2", alignment=1)
        self.surroundings.repeat_y = False
        self.surroundings.build_mipmaps()
        self._place_lights()
        self._cast_shadows()
        self._light()

    def __enter__(self) -> Renderer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        self.context.release()

    def _texture(self, image: np.ndarray) -> moderngl.Texture:
        flipped = np.ascontiguousarray(image[::-1])
        texture = self.context.texture(flipped.shape[1::-1], flipped.shape[2], flipped.tobytes(), alignment=1)
        texture.build_mipmaps()
        texture.anisotropy = 8.0
        return texture

    def show(self, parts: list[Part], shadows: bool = True) -> None:
        """The last of the parts that the place was made of, elsewhere or in another shape: each with as many triangles
        as before; materials stay. shadows: whether they are cast anew."""
        self.context.__enter__()
        for drawn, part in zip(self.drawn[-len(parts) :] if parts else [], parts, strict=True):
            drawn.part = replace(part, material=drawn.part.material)
            drawn.buffer.write(_packed(part).tobytes())
        if shadows and parts:
            self._cast_shadows()

    def _upload(self, part: Part) -> _Drawn:
        buffer = self.context.buffer(_packed(part).tobytes())
        image = part.material.texture
        if image is not None and id(image) not in self.textures:
            self.textures[id(image)] = self._texture(image)
        texture = self.white if image is None else self.textures[id(image)]
        name = "cut" if part.cut is not None or (image is not None and image.shape[2] == 4) else "whole"
        arrays = {}
        for kind in ("colour", "depth", "shadow"):
            program = self.programs[kind, name]
            wanted = (("position", 3), ("normal", 3), ("uv", 2), ("cut", 1))
            kept = [(n, size) if n in program else (None, size) for n, size in wanted]
            layout = " ".join(f"{size}f" if n else f"{4 * size}x" for n, size in kept)
            arrays[kind] = self.context.vertex_array(program, [(buffer, layout, *[n for n, _ in kept if n])])
        middle = (part.corners.reshape(-1, 3).min(0) + part.corners.reshape(-1, 3).max(0)) / 2
        return _Drawn(part, buffer, arrays, texture, middle, name)

    def _set(self, program: moderngl.Program, name: str, value) -> None:
        if name in program:  # the compiler drops those that nothing uses
            if isinstance(value, np.ndarray):
                program[name].write(np.ascontiguousarray(value, np.float32).tobytes())
            else:
                program[name].value = value

    def _casting(self) -> list[_Drawn]:
        return [d for d in self.drawn if d.part.shades and d.part.material.opacity >= 1]

    def _place_lights(self) -> None:
        """Views of the environment from the key light and from directions all over the sky, and their depth maps."""
        casting = self._casting()
        points = np.concatenate([d.part.corners.reshape(-1, 3) for d in casting] or [np.zeros((1, 3))])
        low, high = points.min(0).astype(np.float64), points.max(0).astype(np.float64)
        self.reach = float(np.linalg.norm(high - low)) + 2e-3
        at = self.lighting.lights[0][0]
        if at[3]:
            self.key_matrix = _from_lamp(at[:3], self.lighting.towards_key)
            self.key_offset = 0.01  # metres: a lamp's texels, a few metres off
        else:
            self.key_matrix = _from_far(at[:3] / np.linalg.norm(at[:3]), low, high)
            self.key_offset = _OFFSET * self.reach / _KEY_MAP
        self.sky = _sky_directions()
        self.sky_matrices = [_from_far(towards, low, high) for towards in self.sky]
        self.key_map = self._depth_map((_KEY_MAP, _KEY_MAP))
        self.sky_map = self._depth_map((_SKY_MAP * _ATLAS, _SKY_MAP * _ATLAS))

    def _cast_shadows(self) -> None:
        """Draws the depth maps."""
        casting = self._casting()
        self.context.enable_only(moderngl.DEPTH_TEST)
        self._fill(self.key_map, [(self.key_matrix, (0, 0, _KEY_MAP, _KEY_MAP))], casting)
        cells = [(k % _ATLAS * _SKY_MAP, k // _ATLAS * _SKY_MAP, _SKY_MAP, _SKY_MAP) for k in range(_SKY)]
        self._fill(self.sky_map, list(zip(self.sky_matrices, cells, strict=True)), casting)

    def _depth_map(self, size: tuple[int, int]) -> moderngl.Texture:
        texture = self.context.depth_texture(size)
        texture.compare_func = "<="
        texture.repeat_x = texture.repeat_y = False
        return texture

    def _fill(self, texture: moderngl.Texture, maps: list, casting: list[_Drawn]) -> None:
        target = self.context.framebuffer([], texture)
        target.use()
        target.clear(depth=1.0)
        for matrix, cell in maps:
            target.viewport = cell
            for drawn in casting:
                self._set(self.programs["shadow", drawn.program], "matrix", matrix.T)
                drawn.texture.use(0)
                drawn.arrays["shadow"].render()
        target.release()

    def _light(self) -> None:
        """Uniforms that stay for all views."""
        lights = list(self.lighting.lights)[:_LIGHTS]
        lights += [(np.array([0, 0, 1.0, 0]), np.zeros(3))] * (_LIGHTS - len(lights))
        # Facing the whole sky, the directions together give its colour once.
        share = 1 / np.maximum(self.sky[:, 2], 0).sum()
        for name in ("whole", "cut"):
            program = self.programs["colour", name]
            for unit, sampler in enumerate(("albedo", "surroundings", "key_map", "sky_map")):
                self._set(program, sampler, unit)
            self._set(program, "key_matrix", self.key_matrix.T)
            self._set(program, "key_offset", self.key_offset)
            self._set(program, "sky_offset", _OFFSET * self.reach / _SKY_MAP)
            self._set(program, "sky_matrix", np.stack([m.T for m in self.sky_matrices]))
            self._set(program, "sky_towards", self.sky)
            self._set(program, "sky_colour", np.repeat(self.lighting.sky[None] * share, _SKY, 0))
            self._set(program, "bounce", tuple(map(float, self.lighting.bounce)))
            self._set(program, "light_at", np.stack([at for at, _ in lights]))
            self._set(program, "light_colour", np.stack([colour for _, colour in lights]))
            self._set(program, "reflection", float(self.lighting.reflection))
        self._set(self.behind, "surroundings", 1)

    def _target(self, width: int, height: int):
        if (width, height) not in self.targets:
            size = (width, height)
            many = self.context.framebuffer(
                [self.context.renderbuffer(size, 4, samples=_SAMPLES)],
                self.context.depth_renderbuffer(size, samples=_SAMPLES),
            )
            one = self.context.framebuffer([self.context.texture(size, 4)])
            depth = self.context.framebuffer(
                [self.context.texture(size, 1, dtype="f4")], self.context.depth_renderbuffer(size)
            )
            self.targets[width, height] = many, one, depth
        return self.targets[width, height]

    def _set_view(self, kind: str, camera: Camera) -> None:
        fx, fy, cx, cy = camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px
        w, h = camera.width_px, camera.height_px
        far = FAR * self.near
        a, b = (far + self.near) / (far - self.near), -2 * far * self.near / (far - self.near)
        # y stays "down", so that the first row read back is the top row.
        projection = np.array(
            [
                [2 * fx / w, 0, (2 * cx + 1) / w - 1, 0],
                [0, 2 * fy / h, (2 * cy + 1) / h - 1, 0],
                [0, 0, a, b],
                [0, 0, 1, 0],
            ]
        )
        view = np.concatenate([camera.world_to_camera, [[0, 0, 0, 1]]])
        for name in ("whole", "cut"):
            program = self.programs[kind, name]
            self._set(program, "projection", projection.T)
            self._set(program, "view", view.T)
            self._set(program, "eye", tuple(map(float, camera.centre)))

    def _nearest_first(self, camera: Camera) -> list[_Drawn]:
        """Walls and floors last: what is hidden need not be shaded."""
        return sorted(
            self.drawn, key=lambda d: (not d.part.shades, round(float(np.linalg.norm(d.middle - camera.centre)), 6))
        )

    def depth(self, camera: Camera) -> np.ndarray:
        """Distance along the optical axis of what the centre of each pixel sees: float32 [H, W] metres; 0: nothing.

        Glass is looked through.
        """
        self.context.__enter__()
        target = self._target(camera.width_px, camera.height_px)[2]
        target.use()
        target.clear(0, 0, 0, 0, depth=1.0)
        self.context.enable_only(moderngl.DEPTH_TEST)
        self._set_view("depth", camera)
        for drawn in self._nearest_first(camera):
            if drawn.part.material.opacity >= 1:
                drawn.texture.use(0)
                drawn.arrays["depth"].render()
        raw = target.read(components=1, dtype="f4", alignment=1)
        return np.frombuffer(raw, np.float32).reshape(camera.height_px, camera.width_px).copy()

    def colour(self, camera: Camera, exposure: float) -> np.ndarray:
        """uint8 [H, W, 3] RGB."""
        self.context.__enter__()
        many, one, _ = self._target(camera.width_px, camera.height_px)
        many.use()
        many.clear(0, 0, 0, 1, depth=1.0)
        self.context.enable_only(moderngl.DEPTH_TEST)
        self._set_view("colour", camera)
        self.surroundings.use(1)
        self.key_map.use(2)
        self.sky_map.use(3)
        order = self._nearest_first(camera)
        for drawn in order:
            if drawn.part.material.opacity >= 1:
                self._draw(drawn, exposure)
        self._draw_behind(camera, exposure)
        self.context.enable_only(moderngl.DEPTH_TEST | moderngl.BLEND)
        many.depth_mask = False
        for drawn in reversed(order):
            if drawn.part.material.opacity < 1:
                self._draw(drawn, exposure)
        many.depth_mask = True
        self.context.copy_framebuffer(one, many)
        return (
            np.frombuffer(one.read(components=3, alignment=1), np.uint8)
            .reshape(camera.height_px, camera.width_px, 3)
            .copy()
        )

    def _draw(self, drawn: _Drawn, exposure: float) -> None:
        program, material = self.programs["colour", drawn.program], drawn.part.material
        self._set(program, "tint", tuple(map(float, material.colour)))
        for name in ("specular", "shininess", "mirror", "opacity", "emission"):
            self._set(program, name, float(getattr(material, name)))
        self._set(program, "exposure", float(exposure))
        drawn.texture.use(0)
        drawn.arrays["colour"].render()

    def _draw_behind(self, camera: Camera, exposure: float) -> None:
        fx, fy, cx, cy = camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px
        w, h = camera.width_px, camera.height_px
        to_ray = np.array(
            [[w / 2 / fx, 0, ((w - 1) / 2 - cx) / fx], [0, h / 2 / fy, ((h - 1) / 2 - cy) / fy], [0, 0, 1]]
        )
        self._set(self.behind, "unproject", (camera.rotation.T @ to_ray).T)
        self._set(self.behind, "exposure", float(exposure))
        plain = self.lighting.plain
        self._set(self.behind, "plain", (0.0, 0, 0, 0) if plain is None else (*map(float, plain), 1.0))
        self.context.depth_func = "<="
        self.behind_array.render()
        self.context.depth_func = "<"
