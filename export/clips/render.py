"""Draws moving things with OpenGL (EGL, no window): colour with shadows; from the poses of two frames, exact motion.

World axes: z up, metres. Textures are patterns in the things' own coordinates, so they move with them. The motion is
that of surfaces: shadows and highlights move in their own way.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass

os.environ.setdefault("LP_NUM_THREADS", "1")  # the software rasteriser; processes are the parallelism here

import cv2
import moderngl
import numpy as np

from export.camera import Camera

PATTERNS = ("plain", "checks", "stripes", "grain")
_SAMPLING = 2  # of colour, a pixel and axis, at 320 px and more; small images take more
_SHADOW_MAP = 512
_NEAR, _FAR = 0.03, 60.0

_VERTEX = """#version 330
in vec3 position; in vec3 normal; in vec3 next_position;
uniform mat4 model, next_model, view, next_view, projection, shadow_matrix;
out vec3 own; out vec3 at; out vec3 v_normal; out vec3 next_seen; out vec3 in_light; out float depth;
void main() {
  vec4 world = model * vec4(position, 1), seen = view * world;
  gl_Position = projection * seen;
  own = position; at = world.xyz; v_normal = mat3(model) * normal; depth = seen.z;
  next_seen = (next_view * next_model * vec4(next_position, 1)).xyz;
  in_light = (shadow_matrix * world).xyz * .5 + .5;
}"""

_COLOUR = """#version 330
in vec3 own; in vec3 at; in vec3 v_normal; in vec3 in_light;
uniform sampler2DShadow shadow_map; uniform vec3 colour, second, sky, ground, towards_key, key, eye;
uniform float frequency, specular, shininess; uniform int pattern;
out vec4 shown;
float hash(vec3 p) { return fract(sin(dot(p, vec3(127.1, 311.7, 74.7))) * 43758.5453); }
float noise(vec3 p) {
  vec3 i = floor(p), f = p - i;
  f = f * f * (3. - 2. * f);
  return mix(mix(mix(hash(i), hash(i + vec3(1, 0, 0)), f.x),
                 mix(hash(i + vec3(0, 1, 0)), hash(i + vec3(1, 1, 0)), f.x), f.y),
             mix(mix(hash(i + vec3(0, 0, 1)), hash(i + vec3(1, 0, 1)), f.x),
                 mix(hash(i + vec3(0, 1, 1)), hash(i + vec3(1)), f.x), f.y), f.z);
}
void main() {
  vec3 ray = normalize(eye - at), n = normalize(v_normal);
  if (dot(n, ray) < 0.) n = -n;
  vec3 p = own * frequency + .317;
  float mixed = 0.;
  if (pattern == 1) mixed = mod(floor(p.x) + floor(p.y) + floor(p.z), 2.);
  if (pattern == 2) mixed = step(.5, fract(p.x + .4 * p.y + .2 * p.z));
  if (pattern == 3) mixed = .6 * noise(p) + .3 * noise(2.7 * p) + .1 * noise(7. * p);
  vec3 base = pow(mix(colour, second, mixed), vec3(2.2));
  float facing = max(0., dot(n, towards_key)), lit = 1.;
  if (all(greaterThan(in_light, vec3(0))) && all(lessThan(in_light, vec3(1)))) {
    vec3 s = vec3(in_light.xy, in_light.z - .003 - .004 * (1. - facing)), d = vec3(1.2, -1.2, 0) / SHADOW_MAP.;
    lit = (texture(shadow_map, s + d.xxz) + texture(shadow_map, s + d.xyz) + texture(shadow_map, s + d.yxz)
         + texture(shadow_map, s + d.yyz)) / 4.;
  }
  vec3 light = mix(ground, sky, n.z * .5 + .5) + lit * facing * key;
  vec3 sum = base * light + lit * specular * key * pow(max(0., dot(n, normalize(towards_key + ray))), shininess);
  shown = vec4(pow(clamp(sum, 0., 1.), vec3(1. / 2.2)), 1);
}"""

_LABEL = """#version 330
in vec3 next_seen; in float depth; uniform vec4 pinhole; uniform float thing;
layout(location = 0) out vec4 motion; layout(location = 1) out float found;
void main() {
  vec2 then = next_seen.xy / next_seen.z * pinhole.xy + pinhole.zw;
  motion = vec4(then - (gl_FragCoord.xy - .5), next_seen.z, thing);
  found = depth;
}"""

_SHADOW_VERTEX = """#version 330
in vec3 position; uniform mat4 model, shadow_matrix;
void main() { gl_Position = shadow_matrix * model * vec4(position, 1); }"""

_SHADOW = """#version 330
void main() {}"""


@dataclass(frozen=True)
class Surface:
    """colour, second: display values 0..1 that the pattern mixes; frequency: of the pattern, 1/m; specular 0..1."""

    colour: tuple[float, float, float]
    second: tuple[float, float, float] = (0.0, 0.0, 0.0)
    pattern: str = "plain"
    frequency: float = 10.0
    specular: float = 0.1
    shininess: float = 30.0


@dataclass(frozen=True, eq=False)
class Thing:
    """corners, normals float32 [F, 3, 3] in its own coordinates, metres."""

    corners: np.ndarray
    normals: np.ndarray
    surface: Surface
    casts_shadow: bool = True


@dataclass(frozen=True, eq=False)
class Light:
    """Linear colours [3]; towards_key: unit vector; the key light's shadows are drawn within `radius_m` of `middle`."""

    sky: np.ndarray
    ground: np.ndarray
    key: np.ndarray
    towards_key: np.ndarray
    middle: np.ndarray
    radius_m: float


@dataclass(frozen=True, eq=False)
class Moment:
    """Where everything is at one time. poses: float64 [N, 4, 4], own to world coordinates, one a thing; corners: of
    things that change their shape, by number, float32 [F, 3, 3] (normals are kept)."""

    poses: np.ndarray
    camera: Camera
    corners: dict[int, np.ndarray]


@dataclass(frozen=True, eq=False)
class Labels:
    """motion float32 [H, W, 2] px to the next moment; next_depth, depth float32 [H, W], metres, then and now; thing
    int [H, W]: number from 1, 0: nothing."""

    motion: np.ndarray
    next_depth: np.ndarray
    depth: np.ndarray
    thing: np.ndarray


def _shadow_matrix(light: Light) -> np.ndarray:
    towards = light.towards_key
    side = np.cross(towards, [0.31, 0.17, 0.93])
    side /= np.linalg.norm(side)
    axes = np.stack([side, np.cross(towards, side), -towards]) / light.radius_m
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = axes, -axes @ light.middle
    return matrix


def projection(camera: Camera, near: float = _NEAR, far: float = _FAR) -> np.ndarray:
    """Camera to clip space, [4, 4]; the image's first row is drawn first, so that it is read first. near, far:
    metres."""
    w, h = camera.width_px, camera.height_px
    a, b = (far + near) / (far - near), -2 * far * near / (far - near)
    return np.array([
        [2 * camera.fx_px / w, 0, (2 * camera.cx_px + 1) / w - 1, 0],
        [0, 2 * camera.fy_px / h, (2 * camera.cy_px + 1) / h - 1, 0],
        [0, 0, a, b],
        [0, 0, 1, 0],
    ])  # fmt: skip


def view_matrix(camera: Camera) -> np.ndarray:
    """World to camera, [4, 4]."""
    return np.concatenate([camera.world_to_camera, [[0, 0, 0, 1]]])


class Renderer:
    """Owns an OpenGL context and the things of one clip; use it in a `with` statement."""

    def __init__(self, things: Sequence[Thing], light: Light) -> None:
        self.things, self.light = list(things), light
        self._context = moderngl.create_context(standalone=True, backend="egl")
        context = self._context
        context.enable(moderngl.DEPTH_TEST)
        fragment = _COLOUR.replace("SHADOW_MAP", str(_SHADOW_MAP))
        self._colour = context.program(vertex_shader=_VERTEX, fragment_shader=fragment)
        self._label = context.program(vertex_shader=_VERTEX, fragment_shader=_LABEL)
        self._shadow = context.program(vertex_shader=_SHADOW_VERTEX, fragment_shader=_SHADOW)
        self._positions = [context.buffer(np.ascontiguousarray(t.corners, np.float32).tobytes()) for t in self.things]
        self._next = [context.buffer(np.ascontiguousarray(t.corners, np.float32).tobytes()) for t in self.things]
        normals = [context.buffer(np.ascontiguousarray(t.normals, np.float32).tobytes()) for t in self.things]
        self._arrays = {}
        for program in (self._colour, self._label, self._shadow):
            taken = {name for name in program if isinstance(program[name], moderngl.Attribute)}
            self._arrays[program] = [
                context.vertex_array(program, [
                    (buffer, "3f", name)
                    for buffer, name in ((p, "position"), (n, "normal"), (q, "next_position")) if name in taken
                ])
                for p, n, q in zip(self._positions, normals, self._next, strict=True)
            ]  # fmt: skip
        self._shadow_map = context.depth_texture((_SHADOW_MAP, _SHADOW_MAP))
        self._shadow_map.compare_func = "<="
        self._shadow_map.repeat_x = self._shadow_map.repeat_y = False
        self._shadow_target = context.framebuffer([], self._shadow_map)
        self._targets: dict[tuple, moderngl.Framebuffer] = {}

    def __enter__(self) -> Renderer:
        return self

    def __exit__(self, *_: object) -> None:
        self._context.gc_mode = "context_gc"
        self._context.release()

    @staticmethod
    def _set(program: moderngl.Program, name: str, value: np.ndarray | float | int | tuple) -> None:
        if name not in program:  # the compiler left it out
            return
        if isinstance(value, np.ndarray):
            value = np.ascontiguousarray(value.T if value.ndim == 2 else value, np.float32).tobytes()
            program[name].write(value)
        else:
            program[name].value = value

    def _target(self, kind: str, width: int, height: int) -> moderngl.Framebuffer:
        key = (kind, width, height)
        if key not in self._targets:
            context, size = self._context, (width, height)
            if kind == "colour":
                planes = [context.texture(size, 3)]
            else:
                planes = [context.texture(size, 4, dtype="f4"), context.texture(size, 1, dtype="f4")]
            self._targets[key] = context.framebuffer(planes, context.depth_renderbuffer(size))
        return self._targets[key]

    def _upload(self, buffers: list[moderngl.Buffer], moment: Moment) -> None:
        for k, corners in moment.corners.items():
            buffers[k].write(np.ascontiguousarray(corners, np.float32).tobytes())

    def _draw(self, program: moderngl.Program, now: Moment, then: Moment, camera: Camera, camera_then: Camera) -> None:
        self._set(program, "view", view_matrix(camera))
        self._set(program, "next_view", view_matrix(camera_then))
        self._set(program, "projection", projection(camera))
        self._set(program, "shadow_matrix", _shadow_matrix(self.light))
        self._set(program, "pinhole", (camera_then.fx_px, camera_then.fy_px, camera_then.cx_px, camera_then.cy_px))
        for k, thing in enumerate(self.things):
            if program is self._shadow and not thing.casts_shadow:
                continue
            self._set(program, "model", now.poses[k])
            self._set(program, "next_model", then.poses[k])
            self._set(program, "thing", float(k + 1))
            surface = thing.surface
            for name in ("colour", "second", "frequency", "specular", "shininess"):
                self._set(program, name, getattr(surface, name))
            self._set(program, "pattern", PATTERNS.index(surface.pattern))
            self._arrays[program][k].render()

    def colour(self, moment: Moment, sizes: Sequence[tuple[int, int]]) -> list[np.ndarray]:
        """The image, drawn once and averaged down to each (width, height), the last the largest: uint8 [H, W, 3]."""
        self._upload(self._positions, moment)
        self._shadow_target.use()
        self._shadow_target.clear()
        self._draw(self._shadow, moment, moment, moment.camera, moment.camera)
        factor = max(_SAMPLING, round(192 / max(sizes[-1])))
        camera = moment.camera.resized(sizes[-1][0] * factor, sizes[-1][1] * factor)
        target = self._target("colour", camera.width_px, camera.height_px)
        target.use()
        target.clear()
        light, program = self.light, self._colour
        for name in ("sky", "ground", "key", "towards_key"):
            self._set(program, name, tuple(map(float, getattr(light, name))))
        self._set(program, "eye", tuple(map(float, camera.centre)))
        self._shadow_map.use(0)
        self._draw(program, moment, moment, camera, camera)
        raw = np.frombuffer(target.read(components=3, alignment=1), np.uint8)
        image = raw.reshape(camera.height_px, camera.width_px, 3)
        return [cv2.resize(image, size, interpolation=cv2.INTER_AREA) for size in sizes]

    def labels(self, moment: Moment, then: Moment, size: tuple[int, int]) -> Labels:
        """At the centres of the pixels of an image of that (width, height)."""
        self._upload(self._positions, moment)
        self._upload(self._next, then)
        camera, camera_then = moment.camera.resized(*size), then.camera.resized(*size)
        target = self._target("label", *size)
        target.use()
        target.clear()
        self._draw(self._label, moment, then, camera, camera_then)
        planes = np.frombuffer(target.read(components=4, dtype="f4"), np.float32).reshape(size[1], size[0], 4)
        depth = np.frombuffer(target.read(components=1, attachment=1, dtype="f4"), np.float32).reshape(size[1], size[0])
        return Labels(planes[..., :2].copy(), planes[..., 2].copy(), depth.copy(), planes[..., 3].astype(int))
