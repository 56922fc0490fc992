// A small prior of heads that tests make themselves, and photos of its heads: an ellipsoid with a nose, whose codes
// stretch and shear it.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

#include "head/camera/head_camera.h"
#include "head/field/field_engine.h"
#include "head/fit/observations.h"
#include "head/head_prior.h"

namespace synthetic_head {

using maq::Vec3;
using maq::head::FieldCodes;
using maq::head::FieldEngine;
using maq::head::FieldPoints;
using maq::head::FieldShape;
using maq::head::FieldWeights;
using maq::head::FieldWorkspace;
using maq::head::HeadCamera;
using maq::head::HeadPhoto;
using maq::head::HeadPrior;

inline constexpr int kShapeCodes = 4, kColourCodes = 2;

inline FieldShape field_shape() {
  FieldShape shape;
  shape.octaves = 0, shape.width = 32, shape.geometry_layers = 3, shape.feature = 12;
  shape.surface_width = 32, shape.surface_layers = 1;
  shape.personal_geometry_layers = shape.personal_surface_layers = 1;
  return shape;
}

// The distance that the field learns: an ellipsoid's, nearly, and a ball's for the nose, joined smoothly.
inline double mean_head(double x, double y, double z) {
  const double radii[3] = {0.75, 0.95, 1.15}, p[3] = {x, y, z};
  double k0 = 0, k1 = 0;
  for (int i = 0; i < 3; ++i) {
    k0 += p[i] * p[i] / (radii[i] * radii[i]);
    k1 += p[i] * p[i] / std::pow(radii[i], 4);
  }
  k0 = std::sqrt(k0), k1 = std::sqrt(k1);
  const double skull = k1 > 1e-6 ? k0 * (k0 - 1) / k1 : -0.75;
  const double nose = std::sqrt(x * x + (y + 0.95) * (y + 0.95) + (z + 0.1) * (z + 0.1)) - 0.22;
  const double h = std::max(0.15 - std::abs(skull - nose), 0.0) / 0.15;
  return std::min(skull, nose) - h * h * 0.15 / 4;
}

// The field of the mean head, learnt by the engine: distance, the point itself as template point, and a colour.
inline FieldWeights train_mean_head() {
  const FieldShape shape = field_shape();
  std::mt19937 random(7);
  FieldWeights weights(shape), gradient(shape), m(shape), v(shape);
  for (int index = 0; index < shape.layers(); ++index) {
    const maq::head::FieldLayer layer = weights.layer(index);
    std::normal_distribution<float> normal(0.0f, std::sqrt(1.5f / float(layer.inputs)));
    for (int o = 0; o < layer.outputs; ++o) {
      for (int i = 0; i < layer.inputs; ++i) layer.row(o)[i] = normal(random);
    }
  }
  FieldEngine engine(shape);
  FieldWorkspace workspace;
  constexpr size_t kCount = 256;
  constexpr int kSteps = 1500;
  std::vector<float> columns[3], values[7], by[7];
  for (auto& column : columns) column.resize(kCount);
  for (auto& column : values) column.resize(kCount);
  for (auto& column : by) column.resize(kCount);
  std::uniform_real_distribution<float> anywhere(-2, 2);
  std::normal_distribution<float> near(0, 1);
  for (int step = 0; step < kSteps; ++step) {
    for (size_t i = 0; i < kCount; ++i) {
      Vec3 p = {double(anywhere(random)), double(anywhere(random)), double(anywhere(random))};
      if (i % 4 != 0) {
        const Vec3 d = maq::normalized({double(near(random)), double(near(random)), double(near(random))});
        p = (1 + 0.15 * double(near(random))) * Vec3{0.75 * d.x, 0.95 * d.y, 1.15 * d.z};
        if (i % 8 == 1) p = Vec3{0, -1.0, -0.1} + 0.3 * d;
      }
      columns[0][i] = float(p.x), columns[1][i] = float(p.y), columns[2][i] = float(p.z);
    }
    // The colour and the template point know the point by the feature alone, so that they move with the codes.
    const maq::head::FieldLayer first = weights.layer(shape.first_surface_layer());
    for (int o = 0; o < first.outputs; ++o) std::fill_n(first.row(o) + 1 + shape.feature, 3, 0.0f);
    // The first half of the hidden layer makes the colour, the other the template point: colour codes move no point.
    const maq::head::FieldLayer last = weights.layer(shape.layers() - 1);
    for (int o = 0; o < last.outputs; ++o)
      std::fill_n(last.row(o) + (o < 3 ? last.inputs / 2 : 0), last.inputs / 2, 0.0f);
    engine.set_weights(weights);
    engine.forward({columns[0].data(), columns[1].data(), columns[2].data(), kCount}, workspace,
                   {values[0].data(),
                    {values[1].data(), values[2].data(), values[3].data()},
                    {values[4].data(), values[5].data(), values[6].data()},
                    {}});
    for (size_t i = 0; i < kCount; ++i) {
      const float p[3] = {columns[0][i], columns[1][i], columns[2][i]};
      const double f = mean_head(double(p[0]), double(p[1]), double(p[2]));
      const float weight = float(std::exp(-2 * std::abs(f)) / kCount);
      by[0][i] = 20 * weight * (values[0][i] - float(f));
      const float logits[3] = {1.5f * std::sin(2 * p[2]), 1.2f * p[1], 0.5f + std::cos(3 * p[0])};
      for (size_t c = 0; c < 3; ++c) {
        by[1 + c][i] = weight * (values[1 + c][i] - logits[c]);
        by[4 + c][i] = 10 * weight * (values[4 + c][i] - p[c]);
      }
    }
    gradient.set_zero();
    engine.backward(
        workspace,
        {by[0].data(), {by[1].data(), by[2].data(), by[3].data()}, {by[4].data(), by[5].data(), by[6].data()}},
        maq::head::WeightGradient::kAll, &gradient);
    const float rate = 0.01f * std::min(1.0f, 1.05f - float(step) / kSteps);
    for (size_t i = 0; i < weights.values().size(); ++i) {
      const float g = gradient.values()[i];
      m.values()[i] += 0.1f * (g - m.values()[i]);
      v.values()[i] += 0.01f * (g * g - v.values()[i]);
      weights.values()[i] -= rate * m.values()[i] / (std::sqrt(v.values()[i]) + 1e-8f);
    }
  }
  return weights;
}

// The change of a head's stretch S for one code: a point p of the head lies on the mean head at S p.
inline void add_stretch(int code, double s[3][3], double amount) {
  if (code < 3) {
    s[code][code] += 0.07 * amount;
  } else {
    s[1][2] += 0.07 * amount;
    s[2][1] += 0.07 * amount;
  }
}

inline std::vector<double> stretch(const std::vector<float>& codes) {
  double s[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (size_t k = 0; k < codes.size(); ++k) add_stretch(int(k), s, double(codes[k]));
  return {&s[0][0], &s[0][0] + 9};
}

// Where the segment from a to b first goes into the head: the fraction of its length, or -1.
inline std::vector<float> first_hits(const FieldWeights& weights, const std::vector<Vec3>& from,
                                     const std::vector<Vec3>& to) {
  FieldEngine engine(weights.shape());
  engine.set_weights(weights);
  FieldWorkspace workspace;
  constexpr int kSamples = 48;
  const size_t count = from.size();
  std::vector<float> columns[3], f(count), low(count, -1.0f), high(count, -1.0f), at(count);
  for (auto& column : columns) column.resize(count);
  std::vector<size_t> rays(count);  // that are looked at
  std::iota(rays.begin(), rays.end(), size_t{0});
  const auto evaluate = [&] {
    for (size_t k = 0; k < rays.size(); ++k) {
      const size_t i = rays[k];
      const Vec3 p = from[i] + double(at[i]) * (to[i] - from[i]);
      columns[0][k] = float(p.x), columns[1][k] = float(p.y), columns[2][k] = float(p.z);
    }
    engine.distances({columns[0].data(), columns[1].data(), columns[2].data(), rays.size()}, workspace, f.data());
  };
  for (int k = 0; k <= kSamples && !rays.empty(); ++k) {
    std::fill(at.begin(), at.end(), float(k) / kSamples);
    evaluate();
    std::vector<size_t> outside;
    for (size_t n = 0; n < rays.size(); ++n) {
      const size_t i = rays[n];
      if (f[n] <= 0)
        high[i] = at[i], low[i] = std::max(0.0f, at[i] - 1.0f / kSamples);
      else
        outside.push_back(i);
    }
    rays = std::move(outside);
  }
  rays.clear();
  for (size_t i = 0; i < count; ++i) {
    if (high[i] >= 0) rays.push_back(i);
  }
  for (int k = 0; k < 16 && !rays.empty(); ++k) {
    for (const size_t i : rays) at[i] = (low[i] + high[i]) / 2;
    evaluate();
    for (size_t n = 0; n < rays.size(); ++n) (f[n] <= 0 ? high : low)[rays[n]] = at[rays[n]];
  }
  for (size_t i = 0; i < count; ++i) at[i] = high[i] < 0 ? -1.0f : (low[i] + high[i]) / 2;
  return at;
}

inline HeadPrior make_prior() {
  HeadPrior prior(maq::head::WeightBases(field_shape(), kShapeCodes, kColourCodes));
  prior.bases.constant() = train_mean_head();
  const maq::head::ConstFieldLayer first = std::as_const(prior.bases).constant().layer(0);
  for (int code = 0; code < kShapeCodes; ++code) {
    double change[3][3] = {};
    add_stretch(code, change, 1);
    const maq::head::FieldLayer basis = prior.bases.basis_layer(0, code);
    for (int o = 0; o < first.outputs; ++o) {
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) basis.row(o)[i] += first.row(o)[j] * float(change[j][i]);
      }
    }
  }
  std::mt19937 random(8);
  std::normal_distribution<float> normal(0.0f, 0.15f);
  for (int code = 0; code < kColourCodes; ++code) {
    const maq::head::FieldLayer basis = prior.bases.basis_layer(field_shape().first_surface_layer(), code);
    for (int o = 0; o < basis.outputs / 2; ++o) basis.bias[o] = normal(random);
  }
  // Anchors: where rays from the middle leave the mean head.
  constexpr int kAnchors = 240;
  std::vector<Vec3> from, to(kAnchors);
  for (int i = 0; i < kAnchors; ++i) {
    const double z = 1 - (2 * i + 1.0) / kAnchors, r = std::sqrt(1 - z * z), angle = 2.399963 * i;
    from.push_back(2 * Vec3{r * std::cos(angle), r * std::sin(angle), z});
  }
  const std::vector<float> hits = first_hits(prior.bases.constant(), from, to);
  FieldEngine engine(field_shape());
  engine.set_weights(prior.bases.constant());
  FieldWorkspace workspace;
  for (size_t i = 0; i < from.size(); ++i) {
    const Vec3 p = (1 - double(hits[i])) * from[i];
    const float x[3] = {float(p.x), float(p.y), float(p.z)};
    float t[3];
    engine.forward({x, x + 1, x + 2, 1}, workspace, {nullptr, {}, {t, t + 1, t + 2}, {}});
    prior.anchors.template_points.insert(prior.anchors.template_points.end(), t, t + 3);
    prior.anchors.mean.insert(prior.anchors.mean.end(), x, x + 3);
    double by[3][kShapeCodes];
    for (int code = 0; code < kShapeCodes; ++code) {
      double change[3][3] = {};
      add_stretch(code, change, -1);
      for (int axis = 0; axis < 3; ++axis) {
        by[axis][code] = change[axis][0] * p.x + change[axis][1] * p.y + change[axis][2] * p.z;
      }
    }
    for (const auto& row : by) {
      for (const double value : row) prior.anchors.linear.push_back(float(value));
    }
    prior.anchors.sigma.push_back(0.015f);
  }
  prior.sharpness = 40;
  prior.cut.point = {0, 0, -1.6};
  prior.landmarks = {{"nose_tip", {0, -1.17f, -0.1f}}};
  return prior;
}

inline const HeadPrior& prior() {
  static const HeadPrior made = make_prior();
  return made;
}

// In front of the face, turned by `turn` (rad, about the head's z).
inline HeadCamera camera_at(double distance_dm, double focal_px, double turn, double tilt = 0) {
  const maq::head::Mat3 frontal = {1, 0, 0, 0, 0, -1, 0, 1, 0};
  HeadCamera camera;
  camera.head_to_camera = {maq::head::exp_rotation({tilt, 0, 0}) * frontal * maq::head::exp_rotation({0, 0, turn}),
                           {0.2, -0.1, distance_dm}};
  camera.focal_px = focal_px, camera.cx_px = 320, camera.cy_px = 240;
  camera.width_px = 640, camera.height_px = 480;
  return camera;
}

struct Noise {
  double point_dm = 0.03;
  double outliers = 0.3;
  double normal = 0.1;
  unsigned seed = 1;
  bool has_colours = true;
};

inline double rotation_error(const HeadCamera& a, const HeadCamera& b) {
  return maq::length(maq::head::log_rotation(a.head_to_camera.rotation * maq::transposed(b.head_to_camera.rotation)));
}

// Camera points of an image's pixels, near and far, in the head's frame.
inline void rays_of(const HeadCamera& camera, const std::vector<maq::Point>& pixels, std::vector<Vec3>& from,
                    std::vector<Vec3>& to) {
  const maq::head::RigidMotion back = maq::head::inverse(camera.head_to_camera);
  const double depth = maq::length(camera.head_to_camera.translation);
  for (const maq::Point& pixel : pixels) {
    const Vec3 d = {(pixel.x - camera.cx_px) / camera.focal_px, (pixel.y - camera.cy_px) / camera.focal_px, 1};
    from.push_back(back * (std::max(0.1, depth - 2) * d));
    to.push_back(back * ((depth + 2) * d));
  }
}

// An encoder's output for the head with these codes, with noise, and the crop's pixels. The crop shows `crop_dm`.
inline HeadPhoto photo_of(const FieldCodes& codes, const HeadCamera& camera, const Noise& noise = {}, double roll = 0.1,
                          double crop_dm = 4) {
  const FieldWeights weights = prior().bases.combine(codes);
  const Vec3 middle = camera.head_to_camera * Vec3{};
  const double scale = camera.focal_px / middle.z * crop_dm / 192;
  maq::AffineMap map;
  map.xx = scale * std::cos(roll), map.xy = -scale * std::sin(roll);
  map.yx = -map.xy, map.yy = map.xx;
  map.shift_x = camera.focal_px * middle.x / middle.z + camera.cx_px + 0.5 - 96 * (map.xx + map.xy);
  map.shift_y = camera.focal_px * middle.y / middle.z + camera.cy_px + 0.5 - 96 * (map.yx + map.yy);

  const auto look = [&](int side, double cell_px, auto&& use) {
    std::vector<maq::Point> pixels;
    for (int i = 0; i < side * side; ++i) {
      const int row = i / side, column = i % side;
      const maq::Point at = map({(column + 0.5) * cell_px, (row + 0.5) * cell_px});
      pixels.push_back({at.x - 0.5, at.y - 0.5});
    }
    std::vector<Vec3> from, to;
    rays_of(camera, pixels, from, to);
    const std::vector<float> hits = first_hits(weights, from, to);
    FieldEngine engine(weights.shape());
    engine.set_weights(weights);
    FieldWorkspace workspace;
    std::array<std::vector<float>, 3> at;
    for (size_t i = 0; i < hits.size(); ++i) {
      if (hits[i] < 0) continue;
      const Vec3 p = from[i] + double(hits[i]) * (to[i] - from[i]);
      at[0].push_back(float(p.x)), at[1].push_back(float(p.y)), at[2].push_back(float(p.z));
    }
    const size_t count = at[0].size();
    std::vector<float> found(10 * count);
    const auto three = [&](size_t k) {
      return std::array<float*, 3>{&found[k * count], &found[(k + 1) * count], &found[(k + 2) * count]};
    };
    if (count > 0) {
      engine.forward({at[0].data(), at[1].data(), at[2].data(), count}, workspace,
                     {found.data(), three(1), three(4), three(7)});
    }
    for (size_t i = 0, hit = 0; i < hits.size(); ++i) {
      float out[10] = {};
      if (hits[i] >= 0) {
        for (size_t k = 0; k < 10; ++k) out[k] = found[k * count + hit];
        ++hit;
      }
      use(i, hits[i] >= 0, out);
    }
  };

  std::mt19937 random(noise.seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  std::vector<float> cells(48 * 48 * maq::head::kCellChannels);
  const double cosine = std::cos(roll), sine = std::sin(roll);
  look(48, 4, [&](size_t i, bool is_hit, const float* out) {
    float* cell = &cells[i * maq::head::kCellChannels];
    const Vec3 n =
        maq::normalized(camera.head_to_camera.rotation * Vec3{double(out[7]), double(out[8]), double(out[9])});
    const double in_crop[3] = {cosine * n.x + sine * n.y, -sine * n.x + cosine * n.y, n.z};
    const Vec3 d = maq::normalized({normal(random), normal(random), normal(random)});
    const bool is_wrong = is_hit && uniform(random) < noise.outliers;
    const double wrong[3] = {0.75 * d.x, 0.95 * d.y, 1.15 * d.z};
    for (size_t c = 0; c < 3; ++c) {
      cell[c] = is_wrong ? float(wrong[c]) : out[4 + c] + float(noise.point_dm * normal(random));
      cell[5 + c] = float((is_wrong ? wrong[c] : in_crop[c]) + noise.normal * normal(random));
    }
    cell[3] = float(std::log(std::max(noise.point_dm, 0.01)));
    cell[4] = is_hit ? 4.0f : -4.0f;
  });
  HeadPhoto photo;
  photo.width_px = camera.width_px, photo.height_px = camera.height_px;
  photo.seen = maq::head::read_observations(cells.data(), {}, map, photo.width_px, photo.height_px);
  photo.focal_px = camera.focal_px, photo.log_focal_sigma = 0;
  photo.cx_px = camera.cx_px, photo.cy_px = camera.cy_px;
  if (noise.has_colours) {
    photo.rgb_side = 192;
    photo.rgb.resize(192 * 192 * 3);
    look(192, 1, [&](size_t i, bool is_hit, const float* out) {
      for (size_t c = 0; c < 3; ++c) {
        photo.rgb[3 * i + c] = is_hit ? 255 / (1 + std::exp(-out[1 + c])) : 60.0f;
      }
    });
  }
  return photo;
}

}  // namespace synthetic_head
