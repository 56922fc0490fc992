#include "edges/curves/ridge_votes.h"

#include <algorithm>
#include <cmath>

namespace maq {
namespace {

constexpr int kGradientRadius_px = 2;  // gradients are of 5x5 pixels

// On one surface the field cannot change faster than this between neighbouring pixels, in r, unless it is seen at a
// grazing angle: a faster change means another surface.
constexpr float kSteepest = 4;

constexpr float kJump_r = 6;

// The share of the votes that smoothing leaves on a crest. They are spread over two pixels before: 0.25 to 0.375.
constexpr float kCrest = 0.3f;

struct Gradient {
  float x = 0, y = 0;
  bool is_known = false;
};

// Fits the gradient by least squares to the pixels around (x, y) that lie on the same surface according to the field.
Gradient gradient_at(const EdgeField& field, int x, int y) {
  const float here = field.distance_r[size_t(y) * size_t(field.width) + size_t(x)];
  float n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, syy = 0, sd = 0, sxd = 0, syd = 0;
  for (int dy = std::max(-kGradientRadius_px, -y); dy <= std::min(kGradientRadius_px, field.height - 1 - y); ++dy) {
    const float* row = &field.distance_r[size_t(y + dy) * size_t(field.width) + size_t(x)];
    for (int dx = std::max(-kGradientRadius_px, -x); dx <= std::min(kGradientRadius_px, field.width - 1 - x); ++dx) {
      const float d = row[dx] - here;
      if (!(d * d <= kSteepest * kSteepest * float(dx * dx + dy * dy))) continue;
      n += 1;
      sx += float(dx), sy += float(dy);
      sxx += float(dx * dx), sxy += float(dx * dy), syy += float(dy * dy);
      sd += d, sxd += float(dx) * d, syd += float(dy) * d;
    }
  }
  if (n < 5) return {};
  const float cxx = sxx - sx * sx / n, cxy = sxy - sx * sy / n, cyy = syy - sy * sy / n;
  const float cxd = sxd - sx * sd / n, cyd = syd - sy * sd / n, determinant = cxx * cyy - cxy * cxy;
  if (!(determinant > 0.5f)) return {};
  return {(cyy * cxd - cxy * cyd) / determinant, (cxx * cyd - cxy * cxd) / determinant, true};
}

// (1 4 6 4 1) / 16 along rows and columns, in place; frames end in zeros.
void smooth(std::vector<float>& plane, int width, int height, std::vector<float>& scratch) {
  const auto w = size_t(width);
  const size_t padded = w + 4;
  scratch.assign(padded * 6, 0.0f);
  float* line = scratch.data() + 5 * padded;  // one row, with two zeros at either end
  const auto ring = [&](int y) { return scratch.data() + size_t((y + 5) % 5) * padded; };
  for (int y = 0; y < height + 2; ++y) {
    float* to = ring(y);
    if (y < height) {
      std::copy_n(plane.data() + size_t(y) * w, w, line + 2);
      for (size_t x = 0; x < w; ++x) to[x] = line[x] + line[x + 4] + 4 * (line[x + 1] + line[x + 3]) + 6 * line[x + 2];
    } else {
      std::fill_n(to, w, 0.0f);
    }
    if (y < 2) continue;
    const float *a = ring(y - 4), *b = ring(y - 3), *c = ring(y - 2), *d = ring(y - 1), *e = to;
    float* out = plane.data() + size_t(y - 2) * w;
    for (size_t x = 0; x < w; ++x) out[x] = (a[x] + e[x] + 4 * (b[x] + d[x]) + 6 * c[x]) * (1.0f / 256);
  }
}

// A surface ends beside a jump of the field, and the network may have mixed both sides there.
bool is_at_jump(const EdgeField& field, int x, int y) {
  const size_t at = size_t(y) * size_t(field.width) + size_t(x), row = size_t(field.width);
  const float most = field.distance_r[at] + kJump_r;
  return (x > 0 && field.distance_r[at - 1] > most) || (x + 1 < field.width && field.distance_r[at + 1] > most) ||
         (y > 0 && field.distance_r[at - row] > most) || (y + 1 < field.height && field.distance_r[at + row] > most);
}

// A lower bound of the slope, in r for each pixel, from neighbouring pixels: pixels that are too far are left out.
float quick_slope(const EdgeField& field, int x, int y) {
  const size_t at = size_t(y) * size_t(field.width) + size_t(x), row = size_t(field.width);
  const auto& d = field.distance_r;
  const float dx = d[x + 1 < field.width ? at + 1 : at] - d[x > 0 ? at - 1 : at];
  const float dy = d[y + 1 < field.height ? at + row : at] - d[y > 0 ? at - row : at];
  return 0.5f * (std::abs(dx) + std::abs(dy));
}

}  // namespace

void RidgeVotes::gather(const EdgeField& field, CurveCounts& counts) {
  width = field.width, height = field.height;
  const size_t pixels = size_t(width) * size_t(height);
  for (auto* plane : {&weight, &cos2, &sin2}) plane->assign(pixels, 0.0f);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const size_t at = size_t(y) * size_t(width) + size_t(x);
      const float distance = field.distance_r[at];
      if (!(distance >= 0 && distance <= field.eps_r)) {
        ++counts.bad_pixels;
        continue;
      }
      if (distance >= field.eps_r || distance > kVoteRadiusPx * std::max(1.0f, 1.2f * quick_slope(field, x, y)))
        continue;
      const Gradient g = gradient_at(field, x, y);
      const float slope = std::hypot(g.x, g.y);
      // A pixel is at least one r wide: a smaller slope means a ridge within the window. On the ridge itself both sides
      // cancel. A field without a slope casts no vote.
      const float step_px = distance / std::max(slope, 1.0f);
      if (!g.is_known || !(slope > 0.25f) || step_px > kVoteRadiusPx || is_at_jump(field, x, y)) continue;
      ++counts.voting_pixels;
      const float to_x = float(x) - g.x * step_px / slope, to_y = float(y) - g.y * step_px / slope;
      const auto left = int(std::floor(to_x)), top = int(std::floor(to_y));
      if (left < 0 || top < 0 || left + 1 >= width || top + 1 >= height) continue;
      const float spread = field.expected_error_r[at],
                  vote = 1 / (kVoteRadiusPx * kCrest * (1 + 0.25f * spread * spread));
      if (!(vote > 0)) continue;
      const float fx = to_x - float(left), fy = to_y - float(top);
      const float c2 = (g.x * g.x - g.y * g.y) / (slope * slope), s2 = 2 * g.x * g.y / (slope * slope);
      const size_t cell = size_t(top) * size_t(width) + size_t(left);
      const float parts[4] = {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy};
      const size_t cells[4] = {cell, cell + 1, cell + size_t(width), cell + size_t(width) + 1};
      for (int k = 0; k < 4; ++k) {
        weight[cells[k]] += vote * parts[k];
        cos2[cells[k]] += vote * parts[k] * c2;
        sin2[cells[k]] += vote * parts[k] * s2;
      }
    }
  }
  for (auto* plane : {&weight, &cos2, &sin2}) smooth(*plane, width, height, scratch);
}

}  // namespace maq
