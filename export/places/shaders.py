"""Programs of the graphics side for places: colour, depth, what lies behind everything, depth maps of lights.

`CUTTING` stands for the lines that leave out what is cut away; other words in capitals are numbers of `render.py`.
"""

VERTEX = """#version 330
in vec3 position; in vec3 normal; in vec2 uv; in float cut;
uniform mat4 projection, view;
out vec3 at; out vec3 v_normal; out vec2 v_uv; out float v_cut; out float depth;
void main() {
  vec4 seen = view * vec4(position, 1);
  gl_Position = projection * seen;
  at = position; v_normal = normal; v_uv = uv; v_cut = cut; depth = seen.z;
}"""

CUTTING = """
  if (v_cut < 0. || texture(albedo, v_uv).a < .5) discard;"""

DEPTH = """#version 330
in vec2 v_uv; in float v_cut; in float depth; uniform sampler2D albedo;
layout(location = 0) out float found;
void main() {CUTTING
  found = depth;
}"""

COLOUR = """#version 330
in vec3 at; in vec3 v_normal; in vec2 v_uv; in float v_cut;
uniform sampler2D albedo, surroundings; uniform sampler2DShadow key_map, sky_map;
uniform mat4 key_matrix, sky_matrix[SKY_LIGHTS];
uniform vec3 sky_towards[SKY_LIGHTS], sky_colour[SKY_LIGHTS], bounce, eye;
uniform vec4 light_at[LIGHTS]; uniform vec3 light_colour[LIGHTS];
uniform vec3 tint; uniform float specular, shininess, mirror, opacity, emission, exposure, reflection;
uniform float key_offset, sky_offset;
out vec4 colour;
float key_light(vec3 p) {
  vec4 q = key_matrix * vec4(p, 1);
  if (q.w <= 0.) return 1.;
  vec3 s = q.xyz / q.w * .5 + .5;
  if (any(lessThan(s.xy, vec2(0))) || any(greaterThan(s.xy, vec2(1))) || s.z > 1.) return 1.;
  vec3 step = vec3(1., -1., 0.) / KEY_MAP.;  // four looks, each of which averages four texels
  return (texture(key_map, s + step.xxz) + texture(key_map, s + step.xyz) + texture(key_map, s + step.yxz)
        + texture(key_map, s + step.yyz)) / 4.;
}
void main() {CUTTING
  vec3 flat_normal = normalize(cross(dFdx(at), dFdy(at)));
  vec3 ray = normalize(eye - at);
  if (dot(flat_normal, ray) < 0.) flat_normal = -flat_normal;
  vec3 n = dot(v_normal, v_normal) > 0. ? normalize(v_normal) : flat_normal;
  if (dot(n, flat_normal) < 0.) n = -n;
  vec3 base = pow(clamp(texture(albedo, v_uv).rgb * tint, 0., 1.), vec3(2.2));
  vec3 origin = at + sky_offset * flat_normal;
  vec3 light = bounce * (.75 - .25 * n.z), shine = vec3(0);
  float open = 0.;
  for (int k = 0; k < SKY_LIGHTS; ++k) {
    float facing = dot(n, sky_towards[k]);
    if (facing <= 0.) continue;
    vec3 s = (sky_matrix[k] * vec4(origin, 1)).xyz * .5 + .5;
    float lit = 1.;
    if (all(greaterThan(s, vec3(0))) && all(lessThan(s, vec3(1)))) {
      vec2 cell = vec2(mod(float(k), ATLAS.), floor(float(k) / ATLAS.));
      lit = texture(sky_map, vec3((cell + clamp(s.xy, .002, .998)) / ATLAS., s.z));
    }
    light += facing * lit * sky_colour[k];
    open += facing * lit;
  }
  for (int k = 0; k < LIGHTS; ++k) {
    vec3 to = light_at[k].xyz - at * light_at[k].w;
    float far2 = mix(1., dot(to, to), light_at[k].w);
    to = normalize(to);
    float facing = dot(n, to);
    if (facing <= 0. || light_colour[k] == vec3(0)) continue;
    vec3 arrives = light_colour[k] / (far2 + .1 * light_at[k].w);
    if (k == 0) arrives *= key_light(at + key_offset * flat_normal);
    light += facing * arrives;
    // The factor keeps the highlight's whole energy about the same for every exponent.
    shine += arrives * specular * (shininess + 8.) / 32. * pow(max(0., dot(n, normalize(to + ray))), shininess);
  }
  if (mirror > 0.) {
    vec3 d = reflect(-ray, n);
    float fresnel = mirror + (1. - mirror) * pow(1. - max(0., dot(n, ray)), 5.) * min(1., 4. * mirror);
    float level = max(0., 6. - .8 * log2(shininess));
    vec2 where = vec2(atan(d.y, d.x) / 6.2831853, acos(clamp(d.z, -1., 1.)) / 3.14159265);
    shine += fresnel * min(1., .3 + .35 * open) * reflection * textureLod(surroundings, where, level).rgb;
  }
  vec3 shown = base * (light + emission) + shine;
  shown = pow(1. - exp(-exposure * shown), vec3(1. / 2.2));
  colour = vec4(shown, clamp(opacity + dot(shine, vec3(.3)), 0., 1.));
}"""

BEHIND_VERTEX = """#version 330
in vec2 corner; out vec2 ndc;
void main() { ndc = corner; gl_Position = vec4(corner, 1, 1); }"""

BEHIND = """#version 330
in vec2 ndc; uniform sampler2D surroundings; uniform mat3 unproject; uniform float exposure; uniform vec4 plain;
out vec4 colour;
void main() {
  vec3 d = normalize(unproject * vec3(ndc, 1));
  vec2 where = vec2(atan(d.y, d.x) / 6.2831853, acos(clamp(d.z, -1., 1.)) / 3.14159265);
  vec3 shown = pow(1. - exp(-exposure * textureLod(surroundings, where, 0.).rgb), vec3(1. / 2.2));
  colour = vec4(mix(shown, plain.rgb, plain.a), 1);
}"""

SHADOW_VERTEX = """#version 330
in vec3 position; in vec2 uv; in float cut; uniform mat4 matrix; out vec2 v_uv; out float v_cut;
void main() { gl_Position = matrix * vec4(position, 1); v_uv = uv; v_cut = cut; }"""

SHADOW = """#version 330
in vec2 v_uv; in float v_cut; uniform sampler2D albedo;
void main() {CUTTING
}"""
