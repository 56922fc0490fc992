#include "app/edge_picture.h"

#include <algorithm>
#include <cmath>

namespace maquette {
namespace {

// At even distances from far to near; close to Turbo (A. Mikhailov, 2019), in which depth has more steps to tell apart
// than from blue to red alone.
constexpr std::array<std::array<float, 3>, 11> kRamp = {{{48, 18, 59},
                                                         {69, 92, 207},
                                                         {62, 155, 254},
                                                         {25, 213, 205},
                                                         {70, 248, 132},
                                                         {164, 252, 60},
                                                         {225, 221, 55},
                                                         {254, 167, 50},
                                                         {240, 91, 18},
                                                         {195, 37, 3},
                                                         {122, 4, 3}}};

void set_pixel(uint8_t* to, float level, float bright) {
  const float at = std::clamp(level, 0.0f, 1.0f) * float(kRamp.size() - 1);
  const size_t low = std::min(size_t(at), kRamp.size() - 2);
  for (size_t k = 0; k < 3; ++k) {
    const float colour = kRamp[low][k] + (kRamp[low + 1][k] - kRamp[low][k]) * (at - float(low));
    to[k] = uint8_t(std::lround(colour * bright));
  }
}

// Range of inverse depth, since depth is precise in its inverse: 2 % of known depths are below `low`, 2 % above `high`.
struct InverseRange {
  float low = 0, high = 1;
  float level(float depth_m) const { return (1 / depth_m - low) / std::max(high - low, 1e-3f * high); }
};

InverseRange range_of(const float* depth_m, size_t count) {
  std::vector<float> inverse;
  inverse.reserve(count);
  for (size_t i = 0; i < count; ++i) {
    if (depth_m[i] > 0) inverse.push_back(1 / depth_m[i]);
  }
  if (inverse.empty()) return {};
  const auto quantile = [&](size_t at) {
    std::nth_element(inverse.begin(), inverse.begin() + std::ptrdiff_t(at), inverse.end());
    return inverse[at];
  };
  const size_t outside = inverse.size() / 50;
  const float low = quantile(outside);
  return {low, quantile(inverse.size() - 1 - outside)};
}

// How bright the surface at a pixel is with light from the upper left, from its slopes.
float shade(const float* depth_m, int width, int height, int x, int y, const maq_intrinsics& camera) {
  const float* const here = depth_m + size_t(y) * size_t(width) + x;
  const auto slope = [&](bool is_inside, int step, double focal_px) {
    const float next = is_inside ? here[step] : 0;
    return next > 0 ? float(focal_px) * (*here - next) / next : 0.0f;
  };
  const float across = slope(x + 1 < width, 1, camera.fx_px), down = slope(y + 1 < height, width, camera.fy_px);
  const float facing = (1 + 0.5f * across + 0.7f * down) / std::sqrt(1 + across * across + down * down);
  return std::clamp(0.45f + 0.4f * facing, 0.25f, 1.0f);
}

}  // namespace

EdgeGroup group_of(const maq_edges_curve& curve) {
  if (curve.kind == MAQ_EDGES_KIND_BOUNDARY) return EdgeGroup::kBoundary;
  return curve.convexity == MAQ_EDGES_CONVEXITY_CONCAVE ? EdgeGroup::kConcave : EdgeGroup::kConvex;
}

void draw_edge_layer(const EdgesResult& result, EdgeLayer layer, RgbaImage* picture) {
  const int width = result.width_px(), height = result.height_px();
  const float *const depth_m = result.depth_m(), *const distance_r = result.distance_r();
  const maq_edges_field& field = result.field();
  const InverseRange range =
      layer == EdgeLayer::kDepth ? range_of(depth_m, size_t(width) * size_t(height)) : InverseRange();
  picture->resize(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const size_t at = size_t(y) * size_t(width) + size_t(x);
      uint8_t* const to = picture->rgba.data() + 4 * at;
      to[0] = to[1] = to[2] = 0;
      to[3] = 255;
      if (!(depth_m[at] > 0)) continue;
      if (layer == EdgeLayer::kDistance) {
        set_pixel(to, 0.95f * (1 - distance_r[at] / field.eps_r), 1);
        continue;
      }
      const float bright = shade(depth_m, width, height, x, y, field.intrinsics);
      if (layer == EdgeLayer::kDepth) set_pixel(to, range.level(depth_m[at]), bright);
      if (layer == EdgeLayer::kPlain) to[0] = to[1] = to[2] = uint8_t(std::lround(200 * bright));
    }
  }
}

BoxLines lines_of(const maq_edges_box& box) {
  BoxLines lines;
  for (size_t axis = 0; axis < 3; ++axis) {
    const size_t others[] = {(axis + 1) % 3, (axis + 2) % 3};
    for (size_t which = 0; which < 4; ++which) {
      Point3 middle;
      std::copy(box.centre_m, box.centre_m + 3, middle.begin());
      const auto move = [&](Point3* point, size_t along, double sides) {
        for (size_t k = 0; k < 3; ++k) (*point)[k] += sides * box.size_m[along] * box.axes[along][k];
      };
      for (size_t k = 0; k < 2; ++k) move(&middle, others[k], (which >> k & 1) != 0 ? 0.5 : -0.5);
      auto& edge = lines.edges[4 * axis + which];
      edge = {middle, middle};
      move(&edge[0], axis, -0.5);
      move(&edge[1], axis, 0.5);
      if (which == 0 || middle[2] < lines.labels[axis][2]) lines.labels[axis] = middle;
    }
  }
  return lines;
}

}  // namespace maquette
