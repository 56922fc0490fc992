"""Draws dressed people and things with OpenGL (EGL, no window): colour and, per pixel, part, U, V, instance, point.

Camera axes: x right, y down, z forward (metres). Colour is drawn at `SUPERSAMPLING` times the image size
and averaged; labels are taken from one of the samples, since labels must not be mixed.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace

os.environ.setdefault("LP_NUM_THREADS", "1")  # the software rasteriser; processes are the parallelism here

import cv2
import moderngl
import numpy as np
import scipy.sparse as sp

from export.camera import Camera
from export.people.lookup import LabelLookup
from export.people.props import Prop
from export.people.wardrobe import Layer, Model

SUPERSAMPLING = 2
_SHADOW_MAP = 512  # texels a side
_SHADOW_RADIUS = 5.0  # metres: what is farther from the middle of the people casts no shadow
_NEAR, _FAR = 0.05, 60.0  # metres
_OCCLUSION_RADIUS = 0.12  # metres: how far neighbours take light from each other

_VERTEX = """#version 330
in vec3 position; in vec3 normal; in vec3 rest; in vec2 texture_uv; in vec3 point; in float cut;
uniform mat4 projection; uniform float offset, bulge, bulge_frequency; uniform vec3 phase;
uniform mat3 fabric; uniform bool planar;
out vec3 v_normal; out vec2 v_uv; out vec3 v_rest; out vec3 v_view; out vec3 v_point; out float v_cut;
void main() {
  float f = bulge_frequency, wave = 0.;
  if (bulge > 0.)
    wave = sin(rest.x * f + phase.x) * sin(rest.z * f * .8 + phase.y)
         + .6 * sin(rest.y * f * 1.3 + rest.z * f * 1.7 + phase.z);
  vec3 p = position + normal * (offset + bulge * wave);
  gl_Position = projection * vec4(p, 1);
  v_normal = normal; v_rest = rest; v_view = -p; v_point = point; v_cut = cut;
  v_uv = planar ? (fabric * vec3(rest.x + .6 * rest.y, rest.z, 1)).xy : texture_uv;
}"""

# The rotation of the shadow's samples is "interleaved gradient noise" (Jimenez, SIGGRAPH 2014 course notes).
_FRAGMENT = """#version 330
#define CUT 1
in vec3 v_normal; in vec2 v_uv; in vec3 v_rest; in vec3 v_view; in vec3 v_point; in float v_cut;
uniform sampler2D albedo, folds, shadow_map; uniform mat4 shadow_matrix;
uniform vec3 tint, sky, ground, up, light1, colour1, light2, colour2, phase, panel_tint; uniform vec4 panel;
uniform float wrinkle, wrinkle_frequency, specular, gloss, sheen, instance, fray, fray_frequency;
uniform float shadow, softness, catcher;
layout(location = 0) out vec4 colour; layout(location = 1) out vec4 point;
float reached_by_light(vec3 n) {
  vec3 q = (shadow_matrix * vec4(.02 * n - v_view, 1)).xyz * .5 + .5;
  if (shadow == 0. || any(lessThan(q.xy, vec2(0))) || any(greaterThan(q.xy, vec2(1)))) return 1.;
  float turn = 6.2832 * fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(.06711056, .00583715))));
  vec2 tap = softness * vec2(cos(turn), sin(turn));
  float depth = min(q.z, 1.) - .003;
  return (float(texture(shadow_map, q.xy + tap).r > depth) + float(texture(shadow_map, q.xy - .8 * tap).r > depth)
        + float(texture(shadow_map, q.xy + .5 * vec2(tap.y, -tap.x)).r > depth)) / 3.;
}
void main() {
#if CUT
  float frayed = sin(fray_frequency * (v_rest.x + .7 * v_rest.y) + phase.x)
               + sin(fray_frequency * 2.7 * (v_rest.x - .6 * v_rest.y + .4 * v_rest.z) + phase.y);
  if (v_cut + fray * frayed < 0.) discard;
#endif
  if (catcher > 0.) {
    colour = vec4(0, 0, 0, catcher * (1. - reached_by_light(v_normal)));
    point = vec4(0, 0, 0, -1);
    return;
  }
  vec3 n = v_normal;
  if (wrinkle > 0.) {
    vec2 slope = texture(folds, vec2(v_rest.x + .6 * v_rest.y, v_rest.z) * wrinkle_frequency + phase.xy).rg - .5;
    n += 4. * wrinkle * vec3(slope.x, .6 * slope.x, slope.y);
  }
  n = normalize(n);
  vec3 view = normalize(v_view);
  if (dot(n, view) < 0.) n = -n;
  vec3 base = texture(albedo, v_uv).rgb * tint;
  vec2 inside = abs(v_rest.xz - panel.xy) - abs(panel.zw);
  if (max(inside.x, inside.y) < 0. && v_rest.y * panel.w < 0.)  // the sign of panel.w: chest or back
    base = texture(albedo, v_uv * 2.7 + .3).brg * panel_tint;
  float lit = mix(1., reached_by_light(n), shadow);
  vec3 light = mix(ground, sky, dot(n, up) * .5 + .5)
             + lit * colour1 * max(0., dot(n, light1)) + colour2 * max(0., dot(n, light2));
  vec3 shown = base * light;
  if (specular > 0.) shown += specular * pow(max(0., dot(n, normalize(light1 + view))), gloss) * lit * colour1;
  if (sheen > 0.) shown += sheen * pow(1. - abs(dot(n, view)), 3.) * (sky + ground);
  colour = vec4(shown, 1);
  point = vec4(v_point, instance);
}"""

_SHADOW_VERTEX = """#version 330
in vec3 position; uniform mat4 shadow_matrix;
void main() { gl_Position = shadow_matrix * vec4(position, 1); }"""

_SHADOW_FRAGMENT = """#version 330
void main() {}"""


@dataclass(frozen=True)
class Light:
    """Hemisphere light and two directional lights; directions and `up` in camera axes, colours about 0..1."""

    up: np.ndarray
    sky: np.ndarray
    ground: np.ndarray
    directions: np.ndarray  # [2, 3] towards the light
    colours: np.ndarray  # [2, 3]
    shadow: float = 0.0  # share of the first light that is taken away where something stands in its way
    softness: float = 0.004  # radius of a shadow's edge, as a share of the shadow map
    catcher: float = 0.0  # how dark shadows are on the ground of the photo behind (z = 0), 0..1
    occlusion: float = 0.0  # how much neighbouring surfaces darken each other, 0..1


@dataclass(frozen=True)
class Person:
    """vertices [V, 3] in world axes, metres, and what to draw on them; worn things that are not part of the mesh.
    cloth_seed: how fabrics lie, the same in every image; None: as the renderer's random numbers say."""

    vertices: np.ndarray
    layers: list[Layer]
    worn: tuple[Prop, ...] = ()
    cloth_seed: int | None = None

    def moved(self, x: float, y: float) -> Person:
        """The same person elsewhere on the ground."""
        return replace(self, vertices=self.vertices + [x, y, 0], worn=tuple(p.moved(x, y) for p in self.worn))


@dataclass(frozen=True)
class Picture:
    """rgb float32 [H, W, 3] (0..255, premultiplied), alpha float32 [H, W], label uint8 [H, W, 4] = (I, U, V, instance),
    point float32 [H, W, 3] of the template's surface, metres."""

    rgb: np.ndarray
    alpha: np.ndarray
    label: np.ndarray
    point: np.ndarray


def fold_slopes(side: int = 256) -> np.ndarray:
    """Slopes of a cloth's folds that repeat without a seam: uint8 [side, side, 2], 128 = flat.

    Filtered noise, made of ridges: its spectrum falls off with frequency and is stretched in one direction.
    """
    frequency = np.fft.fftfreq(side, 1 / side)
    x, y = np.meshgrid(frequency, frequency)
    noise = np.fft.fft2(np.random.default_rng(0).normal(size=(2, side, side)))
    power = np.hypot(1.6 * x, y)
    smooth = np.fft.ifft2(noise * (power > 0) / np.maximum(power, 2) ** 1.6).real
    ridges = -np.abs(smooth[0] / smooth[0].std()) + 0.4 * smooth[1] / smooth[1].std()
    slope = np.stack([ridges - np.roll(ridges, 1, 1), ridges - np.roll(ridges, 1, 0)], -1)
    return np.clip(128 + 40 * slope / slope.std(), 0, 255).astype(np.uint8)


def neighbour_shade(depth: np.ndarray, focal_px: float) -> np.ndarray:
    """How much light nearer neighbours take away, 0..1: unsharp masking of the depth buffer (Luft et al. 2006).

    depth: float32 [H, W], metres, infinite where nothing is. Returns float32 [H, W].
    """
    seen = np.isfinite(depth)
    if not seen.any():
        return np.zeros_like(depth)
    filled = np.where(seen, depth, depth[seen].max() + _OCCLUSION_RADIUS).astype(np.float32)
    sigma = np.clip(focal_px * _OCCLUSION_RADIUS / np.median(depth[seen]), 2, 25)
    # A smooth image needs few pixels: the mean of the neighbourhood is computed at a quarter of the size.
    small = cv2.resize(filled, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA)
    around = cv2.resize(cv2.GaussianBlur(small, (0, 0), float(sigma) / 4), filled.shape[::-1])
    # A neighbour far in front of a surface does not touch it: without this, people would have dark outlines.
    reach = int(sigma / 4 * 2) * 2 + 1
    nearest = cv2.resize(cv2.erode(small, np.ones((reach, reach))), filled.shape[::-1])
    touching = np.clip(2 - (filled - nearest) / (1.5 * _OCCLUSION_RADIUS), 0, 1)
    return np.where(seen, touching * np.clip((filled - around) / _OCCLUSION_RADIUS * 2, 0, 1), 0)


class Renderer:
    """Owns an OpenGL context. There may be several in a process: each draws into its own."""

    def __init__(self, model: Model, labels: LabelLookup, skin: np.ndarray, width: int, height: int) -> None:
        self.model, self.labels = model, labels
        self.context = moderngl.create_context(standalone=True, backend="egl")
        # Hidden pixels are skipped before shading only where no `discard` may come: whole surfaces have their own.
        self.cutting = self.context.program(vertex_shader=_VERTEX, fragment_shader=_FRAGMENT)
        self.whole = self.context.program(
            vertex_shader=_VERTEX, fragment_shader=_FRAGMENT.replace("#define CUT 1", "#define CUT 0")
        )
        self.uniforms: dict[str, list[moderngl.Uniform]] = {}
        self.attributes: dict[int, set[str]] = {}
        for program in (self.cutting, self.whole):
            self.attributes[program.glo] = {n for n in program if isinstance(program[n], moderngl.Attribute)}
            for name in program:
                if isinstance(program[name], moderngl.Uniform):
                    self.uniforms.setdefault(name, []).append(program[name])
        self.shadow_program = self.context.program(vertex_shader=_SHADOW_VERTEX, fragment_shader=_SHADOW_FRAGMENT)
        size = (width * SUPERSAMPLING, height * SUPERSAMPLING)
        targets = [self.context.texture(size, 4), self.context.texture(size, 4, dtype="f4")]
        self.depth = self.context.depth_texture(size)
        self.target = self.context.framebuffer(targets, self.depth)
        self.shadow_map = self.context.depth_texture((_SHADOW_MAP, _SHADOW_MAP))
        self.shadow_map.compare_func = ""
        self.shadow_map.repeat_x = self.shadow_map.repeat_y = False
        self.shadow_target = self.context.framebuffer([], self.shadow_map)
        self.size = size
        faces, count = model.faces, len(model.faces)
        fixed = [model.rest[faces], model.texture_uv, model.point]
        self.fixed = self.context.buffer(np.concatenate(fixed, 2).astype(np.float32).tobytes())
        self.moving: list[moderngl.Buffer] = []  # one a person
        self.cuts = self.context.buffer(np.ones(count * 3, np.float32).tobytes())
        self.body = self.context.buffer(faces[model.range["body"]].astype(np.int32).tobytes())
        self.body_vertices = self.context.buffer(reserve=len(model.rest) * 12)
        ones = np.ones(count * 3, np.float32)
        corner_of = (faces.reshape(-1), np.repeat(np.arange(count), 3))
        self.gather = sp.csr_matrix((ones, corner_of), shape=(len(model.rest), count))
        self.skin = self.context.texture(skin.shape[1::-1], 3, np.ascontiguousarray(skin[::-1]).tobytes())
        self.skin.build_mipmaps()
        folds = fold_slopes()
        self.folds = self.context.texture(folds.shape[1::-1], 2, folds.tobytes())
        for unit, name in enumerate(("albedo", "folds", "shadow_map")):
            self._set(name, unit)

    def _set(self, name: str, value) -> None:
        for uniform in self.uniforms.get(name, ()):  # the compiler drops those that nothing uses
            if isinstance(value, np.ndarray):
                uniform.write(value.astype(np.float32).T.tobytes())
            else:
                uniform.value = value

    def draw(
        self,
        people: list[Person],
        camera: Camera,
        light: Light,
        rng: np.random.Generator,
        props: list[Prop] = (),
    ) -> Picture:
        """Instances are numbered 1.. in the order of `people`; props are background that can occlude them. camera: its
        principal point is taken to be in the middle."""
        # OpenGL works on the context that was made or entered last, in which names mean other objects.
        self.context.__enter__()
        rotation, shift = camera.world_to_camera[:, :3], camera.world_to_camera[:, 3]
        while len(self.moving) < len(people):
            self.moving.append(self.context.buffer(reserve=len(self.model.faces) * 3 * 24))
        seen = [(p.vertices @ rotation.T + shift).astype(np.float32) for p in people]
        for vertices, buffer in zip(seen, self.moving, strict=False):
            buffer.write(self._corners(vertices))
        things = [(p, self.context.buffer(p.corners_in(rotation, shift).tobytes())) for p in props]
        worn = [
            (p, number, self.context.buffer(p.corners_in(rotation, shift).tobytes()))
            for number, person in enumerate(people, 1)
            for p in person.worn
        ]
        self.context.enable(moderngl.DEPTH_TEST)
        matrix = np.eye(4)
        if light.shadow or light.catcher:
            matrix = self._draw_shadows(seen, [b for *_, b in things + worn], light.directions[0])
        self._set_view(camera, light, matrix)
        for number, person in enumerate(people, 1):
            self._set("instance", float(number))
            near = max(float(np.quantile(seen[number - 1][::50, 2], 0.1)), 0.2)
            cloth = rng if person.cloth_seed is None else np.random.default_rng(person.cloth_seed)
            for layer in reversed(person.layers):  # the outermost first: what it hides need not be shaded
                self._layer(layer, self.moving[number - 1], SUPERSAMPLING * camera.fx_px / near, cloth)
        for prop, buffer in things:
            self._prop(prop, buffer, 0)
        for prop, number, buffer in worn:
            self._prop(prop, buffer, number)
        if light.catcher:
            self._catch_shadows(people, rotation, shift, light)
        return self._read(camera, light)

    def _set_view(self, camera: Camera, light: Light, shadow_matrix: np.ndarray) -> None:
        self.target.use()
        self.target.clear(0, 0, 0, 0)
        x, y = 2 * camera.fx_px / camera.width_px, 2 * camera.fy_px / camera.height_px
        a, b = (_FAR + _NEAR) / (_FAR - _NEAR), -2 * _FAR * _NEAR / (_FAR - _NEAR)
        # y stays "down", so that the first row read back is the top row.
        matrix = np.array([[x, 0, 0, 0], [0, y, 0, 0], [0, 0, a, b], [0, 0, 1, 0]], np.float32)
        self._set("projection", matrix)
        self._set("shadow_matrix", shadow_matrix)
        for name in ("up", "sky", "ground"):
            self._set(name, tuple(getattr(light, name)))
        for k in (0, 1):
            self._set(f"light{k + 1}", tuple(light.directions[k]))
            self._set(f"colour{k + 1}", tuple(light.colours[k]))
        self._set("shadow", float(light.shadow))
        self._set("softness", float(light.softness))
        self._set("catcher", 0.0)
        self.folds.use(1)
        self.shadow_map.use(2)

    def _draw_shadows(self, people: list[np.ndarray], things: list[moderngl.Buffer], towards: np.ndarray) -> np.ndarray:
        """Depth of bodies and things as seen from a light far away; returns camera axes -> shadow map, [4, 4]."""
        points = np.concatenate([p[::40] for p in people]) if people else np.zeros((1, 3))
        centre = (points.min(0) + points.max(0)) / 2
        radius = min(float(np.linalg.norm(points - centre, axis=1).max()) + 0.5, _SHADOW_RADIUS)
        side = np.cross(towards, [0.31, 0.17, 0.93])
        side /= np.linalg.norm(side)
        # An object that casts a shadow may stand far in front of the people in its shadow.
        axes = np.stack([side, np.cross(towards, side), -towards / 3]) / radius
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = axes, -axes @ centre
        self.shadow_target.use()
        self.shadow_target.clear(depth=1.0)
        self.shadow_program["shadow_matrix"].write(matrix.astype(np.float32).T.tobytes())
        for vertices in people:
            self.body_vertices.write(vertices.tobytes())
            array = self.context.vertex_array(self.shadow_program, [(self.body_vertices, "3f", "position")], self.body)
            array.render()
            array.release()
        for buffer in things:
            array = self.context.vertex_array(self.shadow_program, [(buffer, "3f 12x", "position")])
            array.render()
            array.release()
        return matrix

    def _catch_shadows(self, people: list[Person], rotation: np.ndarray, shift: np.ndarray, light: Light) -> None:
        """Draws the ground around people as black that covers the photo only where the light does not reach."""
        if not people:
            return
        points = np.concatenate([p.vertices[::40, :2] for p in people])
        (x0, y0), (x1, y1) = points.min(0) - 2, points.max(0) + 2
        quad = np.array([[x0, y0, 0], [x1, y0, 0], [x1, y1, 0], [x0, y0, 0], [x1, y1, 0], [x0, y1, 0]])
        ground = Prop(quad.reshape(2, 3, 3), np.zeros((2, 3, 2)), np.zeros((1, 1, 3), np.uint8))
        self._set("shadow", 1.0)
        self._set("catcher", float(light.catcher))
        self._prop(ground, self.context.buffer(ground.corners_in(rotation, shift).tobytes()), 0)

    def _corners(self, vertices: np.ndarray) -> np.ndarray:
        """Position and normal of every triangle corner, float32 [F, 3, 6]."""
        corners = vertices[self.model.faces]
        a, b = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
        face_normal = np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]], 1)
        normal = self.gather @ face_normal
        normal /= np.linalg.norm(normal, axis=1, keepdims=True) + 1e-12
        return np.concatenate([corners, normal[self.model.faces]], 2).astype(np.float32)

    def _set_surface(self, layer: Layer | None, prop: Prop | None) -> None:
        plain = Layer(np.zeros(0, int))
        source = layer or plain
        for name in (
            "offset", "bulge", "bulge_frequency", "wrinkle", "wrinkle_frequency", "specular", "gloss", "sheen",
            "fray", "fray_frequency",
        ):  # fmt: skip
            self._set(name, float(getattr(source, name)))
        self._set("phase", tuple(map(float, source.phase)))
        self._set("panel", tuple(map(float, source.panel)))
        self._set("panel_tint", tuple(map(float, source.panel_tint)))
        self._set("tint", tuple(map(float, prop.tint if prop else source.tint)))
        if prop:
            self._set("specular", prop.specular)

    def _array(self, program, buffers: list[tuple[moderngl.Buffer, list[tuple[str, int]]]], indices=None):
        """A vertex array of those attributes (name, floats) that the compiler has kept."""
        content, kept = [], self.attributes[program.glo]
        for buffer, attributes in buffers:
            layout = " ".join(f"{n}f" if name in kept else f"{4 * n}x" for name, n in attributes)
            content.append((buffer, layout, *[name for name, _ in attributes if name in kept]))
        return self.context.vertex_array(program, [c for c in content if len(c) > 2], indices)

    def _layer(self, layer: Layer, moving: moderngl.Buffer, px_per_metre: float, rng: np.random.Generator) -> None:
        planar = layer.texture is not None
        turn = rng.uniform(0, 2 * np.pi) if rng.random() < 0.3 else 0.0
        shift = rng.uniform(0, 1, 2)
        if not len(layer.faces):
            return
        texture = self._cloth_texture(layer, px_per_metre) if planar else self.skin
        texture.use(0)
        fabric = np.eye(3, dtype=np.float32)
        fabric[:2, :2] = layer.repeats * np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        fabric[:2, 2] = shift
        self._set("fabric", fabric)
        self._set("planar", planar)
        self._set_surface(layer, None)
        index = (layer.faces[:, None] * 3 + np.arange(3)).astype(np.int32)
        program = self.whole
        if layer.cut is not None:
            program = self.cutting
            first, last = index.min(), index.max() + 1
            cut = np.zeros(last - first, np.float32)
            cut[index - first] = layer.cut
            self.cuts.write(cut, offset=int(first) * 4)
        indices = self.context.buffer(index.tobytes())
        array = self._array(
            program,
            [(moving, [("position", 3), ("normal", 3)]),
             (self.fixed, [("rest", 3), ("texture_uv", 2), ("point", 3)]),
             (self.cuts, [("cut", 1)])], indices,
        )  # fmt: skip
        array.render()
        array.release()
        indices.release()
        if planar:
            texture.release()

    def _cloth_texture(self, layer: Layer, px_per_metre: float) -> moderngl.Texture:
        """The cloth at the size in which the camera sees it: one level instead of the many of a mip map."""
        side = len(layer.texture)
        level = np.clip(np.log2(side * layer.repeats / px_per_metre), 0, np.log2(side) - 1)
        shown = side >> round(float(level))
        small = cv2.resize(layer.texture, (shown, shown), interpolation=cv2.INTER_AREA)
        return self.context.texture((shown, shown), 3, np.ascontiguousarray(small).tobytes(), alignment=1)

    def _prop(self, prop: Prop, moving: moderngl.Buffer, instance: int) -> None:
        texture = self.context.texture(prop.texture.shape[1::-1], 3, np.ascontiguousarray(prop.texture), alignment=1)
        texture.use(0)
        self._set("planar", False)
        self._set("instance", float(instance))
        self._set_surface(None, prop)
        points = np.zeros_like(prop.corners) if prop.points is None else prop.points
        fixed = np.concatenate([prop.corners, prop.uv, points], 2)
        buffer = self.context.buffer(fixed.astype(np.float32).tobytes())
        array = self._array(
            self.whole,
            [(moving, [("position", 3), ("normal", 3)]),
             (buffer, [("rest", 3), ("texture_uv", 2), ("point", 3)])],
        )  # fmt: skip
        array.render()
        for used in (array, buffer, moving, texture):
            used.release()

    def _read(self, camera: Camera, light: Light) -> Picture:
        width, height = self.size
        small = (width // SUPERSAMPLING, height // SUPERSAMPLING)

        def plane(attachment: int, dtype: str, kind: type) -> np.ndarray:
            raw = self.target.read(components=4, attachment=attachment, dtype=dtype)
            return np.frombuffer(raw, kind).reshape(height, width, 4)

        colour, surface_point = plane(0, "f1", np.uint8), plane(1, "f4", np.float32)
        mean = cv2.resize(colour, small, interpolation=cv2.INTER_AREA).astype(np.float32)
        rgb, alpha = mean[..., :3], mean[..., 3] / 255
        pick = np.s_[SUPERSAMPLING // 2 :: SUPERSAMPLING, SUPERSAMPLING // 2 :: SUPERSAMPLING]
        surface_point = surface_point[pick]
        if light.occlusion:
            stored = np.frombuffer(self.depth.read(alignment=1), np.float32).reshape(height, width)[pick]
            depth = 2 * _FAR * _NEAR / (_FAR + _NEAR - (2 * stored - 1) * (_FAR - _NEAR))
            left = 1 - light.occlusion * neighbour_shade(np.where(stored < 1, depth, np.inf), camera.fx_px)
            # On the ground of the photo, darker means that more of the photo is covered by black.
            alpha = np.where(surface_point[..., 3] < 0, 1 - (1 - alpha) * left, alpha)
            rgb = rgb * left[..., None]
        label = np.zeros(surface_point.shape, np.uint8)
        label[..., 3] = np.maximum(surface_point[..., 3], 0)
        body = label[..., 3] > 0
        label[body, :3] = self.labels.iuv(surface_point[body, :3])
        return Picture(rgb, alpha, label, surface_point[..., :3].copy())
