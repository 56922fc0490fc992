// GLSL 3.30: images of people, and the body that turns in the corner.
#pragma once

// Before each of the others. `in_atlas` looks up part `chart` + 1 in an atlas of 4 x 6 tiles, which do not bleed into
// each other: half a texel stays between.
constexpr char kShaderStart[] = R"(#version 330 core
vec4 in_atlas(sampler2D atlas, int chart, vec2 uv) {
  vec2 half_texel = 0.5 * vec2(4.0, 6.0) / vec2(textureSize(atlas, 0));
  vec2 in_tile = clamp(vec2(uv.x, 1.0 - uv.y), half_texel, 1.0 - half_texel);
  return textureLod(atlas, (vec2(chart / 6, chart % 6) + in_tile) / vec2(4.0, 6.0), 0.0);
})";

// Covers the viewport with one triangle; `at` is in the image, from its top left corner, 0 to 1.
constexpr char kPictureVertexShader[] = R"(
out vec2 at;
void main() {
  vec2 corner = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2);
  at = vec2(corner.x, 1.0 - corner.y);
  gl_Position = vec4(corner * 2.0 - 1.0, 0.0, 1.0);
})";

// `view` counts as View in options.h. Part, U, V are the label that most of the four nearest pixels have, and of these
// the bilinear mean, so that nothing bleeds from one chart into the next and edges are smooth at any size.
constexpr char kPeopleShader[] = R"(
in vec2 at;
out vec4 colour;
uniform sampler2D camera, outfit, iuv;
uniform sampler2DArray surface;
uniform vec3 part_colours[25];
uniform int view, people;
uniform bool outfit_is_atlas;
const float lines = 8.0;  // iso-lines of a chart, of U and as many of V

vec4 texel(ivec2 p) { return texelFetch(iuv, clamp(p, ivec2(0), textureSize(iuv, 0) - 1), 0) * 255.0; }

vec4 label(vec2 p, out float cover) {
  ivec2 corner = ivec2(floor(p));
  vec2 f = p - vec2(corner);
  vec4 near[4];
  float weight[4];
  for (int k = 0; k < 4; ++k) {
    ivec2 side = ivec2(k & 1, k >> 1);
    near[k] = texel(corner + side);
    weight[k] = (side.x == 1 ? f.x : 1.0 - f.x) * (side.y == 1 ? f.y : 1.0 - f.y);
  }
  cover = 0.0;
  vec4 best = vec4(0.0);
  float most = 0.0;
  for (int k = 0; k < 4; ++k) {
    if (near[k].x < 0.5) continue;
    cover += weight[k];
    vec4 sum = vec4(0.0);
    for (int j = 0; j < 4; ++j) {
      if (near[j].x == near[k].x && near[j].w == near[k].w) sum += vec4(near[j].yz, 0.0, 1.0) * weight[j];
    }
    if (sum.w > most) most = sum.w, best = vec4(near[k].x, sum.xy / (sum.w * 255.0), near[k].w);
  }
  return best;
}

// Blue to red by way of green and yellow.
vec3 by_value(float t) { return clamp(1.5 - abs(4.0 * t - vec3(3.0, 2.0, 1.0)), 0.0, 1.0); }

// How much of an iso-line of U (1) or V (2) lies here, from the slope over up to four pixels of one chart.
float contour(vec4 here, vec2 p, float screen_px, int plane) {
  vec2 slope = vec2(0.0);
  for (int axis = 0; axis < 2; ++axis) {
    ivec2 d = axis == 0 ? ivec2(2, 0) : ivec2(0, 2);
    vec4 a = texel(ivec2(round(p)) - d), b = texel(ivec2(round(p)) + d), middle = texel(ivec2(round(p)));
    float span = 4.0;
    if (a.x != here.x) a = middle, span -= 2.0;
    if (b.x != here.x) b = middle, span -= 2.0;
    if (span > 0.0 && middle.x == here.x) slope[axis] = (b[plane] - a[plane]) / (255.0 * span) * lines;
  }
  float steep = length(slope) / screen_px;
  float level = here[plane] * lines;
  float away_px = abs(level - round(level)) / max(steep, 1e-4);
  return steep < 1e-4 ? 0.0 : (1.0 - smoothstep(0.6, 1.6, away_px)) * (1.0 - smoothstep(0.25, 0.6, steep));
}

vec3 worn(vec4 here) {
  int part = int(here.x + 0.5) - 1;
  if (outfit_is_atlas) return in_atlas(outfit, part, here.yz).rgb;
  vec3 point = texture(surface, vec3(here.yz, part)).xyz;  // metres
  vec2 shape = vec2(textureSize(outfit, 0));
  vec2 place = vec2(point.y < 0.0 ? point.x : -point.x, 1.45 - point.z) / 0.45;
  return textureLod(outfit, vec2(0.5 + place.x, place.y * shape.x / shape.y), 0.0).rgb;
}

void main() {
  vec2 p = at * vec2(textureSize(iuv, 0)) - 0.5;
  float screen_px = 1.0 / dFdx(p.x);  // for each pixel of the frame
  vec3 seen = texture(camera, at).rgb;
  colour = vec4(seen, 1.0);
  if (view == 0 || view == 4) return;
  float cover;
  vec4 here = label(p, cover);
  float inside = smoothstep(0.3, 0.7, cover);
  if (people > 0) seen *= view == 3 ? mix(0.22, 1.0, inside) : 0.82;
  if (here.x < 0.5) { colour.rgb = seen; return; }
  int part = int(here.x + 0.5);
  if (view == 1) {
    seen = mix(seen, part_colours[part], 0.7 * inside);
  } else if (view == 2) {
    seen = mix(seen, by_value(here.y), inside * contour(here, p, screen_px, 1));
    seen = mix(seen, by_value(here.z), inside * contour(here, p, screen_px, 2));
  } else if (view == 3) {
    seen = mix(seen, part_colours[1 + (int(here.w) * 7) % 24], 0.55 * inside);
  } else {
    // Folds and shadows of the clothes show through.
    float light = 0.65 + 0.6 * dot(texture(camera, at).rgb, vec3(0.299, 0.587, 0.114));
    seen = mix(seen, worn(here) * light, inside);
  }
  colour.rgb = seen;
})";

// Photo left of the slider and rendering right of it, or the error alone.
constexpr char kSceneShader[] = R"(
in vec2 at;
out vec4 colour;
uniform sampler2D rendering, photo, drawn;
uniform float slider;
void main() {
  colour = slider > 1.5 ? texture(drawn, at) : at.x < slider ? texture(photo, at) : texture(rendering, at);
  colour.a = 1.0;
})";

constexpr char kBodyVertexShader[] = R"(
layout(location = 0) in vec3 point;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 label;  // part - 1, U, V
uniform mat4 projection;
out vec3 place, facing;
flat out int part;
out vec2 uv;
void main() {
  place = point;
  facing = normal;
  part = int(label.x + 0.5);
  uv = label.yz;
  gl_Position = projection * vec4(point, 1.0);
})";

constexpr char kBodyShader[] = R"(
in vec3 place, facing;
flat in int part;
in vec2 uv;
out vec4 colour;
uniform sampler2DArray seen;
uniform sampler2D person;
uniform vec3 part_colours[25], towards_eye;
uniform bool in_own_colours;
void main() {
  float slope = abs(dot(normalize(facing), towards_eye)), light = 0.35 + 0.65 * slope;
  vec3 shown = part_colours[part + 1] * 1.15;
  float known = smoothstep(0.1, 0.6, texture(seen, vec3(uv, part)).r);
  if (in_own_colours) {
    vec4 texel = in_atlas(person, part, uv);
    shown = texel.rgb, known = smoothstep(0.0, 0.5, texel.a);
    light = mix(light, 0.75 + 0.25 * slope, known);  // the photo has its own light
  }
  colour = vec4(mix(vec3(0.30, 0.31, 0.34), shown, known) * light, 1.0);
})";
