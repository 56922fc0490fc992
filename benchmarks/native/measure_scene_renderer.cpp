// Measures milliseconds of each step of rendering synthetic scenes: `measure_scene_renderer BUNDLE [points [width
// height [threads [frames]]]]`. Prints medians over the frames of an orbit, and the work of the last frame. The first
// frame, which prepares the refiner, is listed separately.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>

#include "core/error.h"
#include "scene/format/scene_packing.h"
#include "scene/render/scene_renderer.h"

namespace {

using maq::kBasis;
using maq::kFeatures;

enum class Kind { kRoom, kObject };

// A room is seen from inside, one part at a time; an object is fully inside the image.
maq::FittedPoints points_of(Kind kind, size_t count) {
  std::mt19937 random(1);
  std::normal_distribution<float> normal;
  std::uniform_real_distribution<float> across(-1, 1);
  maq::FittedPoints points;
  points.up = {0, 0, 1};
  for (size_t i = 0; i < count; ++i) {
    float at[3];
    if (kind == Kind::kRoom) {
      const float size[3] = {4, 3, 1.5f};
      for (int axis = 0; axis < 3; ++axis) at[axis] = size[axis] * across(random);
      const size_t wall = random() % 6;
      at[wall / 2] = (wall % 2 == 0 ? 1.0f : -1.0f) * size[wall / 2] + 0.01f * normal(random);
    } else {
      float length = 0;
      for (float& value : at) value = normal(random), length += value * value;
      const float radius = (1 + 0.1f * std::sin(7 * at[0]) + 0.003f * normal(random)) / std::sqrt(length);
      for (float& value : at) value *= radius;
    }
    points.x.push_back(at[0]);
    points.y.push_back(at[1]);
    points.z.push_back(at[2]);
    // Half of the points are view-dependent.
    points.view_dependence.push_back(random() % 2 == 0 ? 0.0f : 1.0f);
    points.views.push_back(1);
    for (int c = 0; c < kFeatures; ++c)
      points.constant_terms.push_back(0.5f + 0.3f * std::sin(5 * at[c % 3] + float(c)));
    for (int k = 0; k < kBasis * kFeatures; ++k) points.linear_terms.push_back(0.05f * normal(random));
  }
  return points;
}

maq::PinholeCamera camera_of(Kind kind, int width, int height, double angle, double roll) {
  maq::PinholeCamera camera;
  camera.width_px = width;
  camera.height_px = height;
  camera.fx_px = camera.fy_px = 0.9 * width;
  camera.cx_px = (width - 1) / 2.0;
  camera.cy_px = (height - 1) / 2.0;
  const double c = std::cos(angle), s = std::sin(angle);
  const double forward[3] = {c, s, 0}, right[3] = {s, -c, 0}, down[3] = {0, 0, -1};
  for (size_t i = 0; i < 3; ++i) {
    camera.rotation[i] = std::cos(roll) * right[i] + std::sin(roll) * down[i];
    camera.rotation[3 + i] = std::cos(roll) * down[i] - std::sin(roll) * right[i];
    camera.rotation[6 + i] = forward[i];
    camera.centre[i] = kind == Kind::kRoom ? 0.5 * forward[i] : -3.2 * forward[i];
  }
  return camera;
}

void measure(const char* name, maq::SceneRenderer& renderer, Kind kind, int width, int height, double roll,
             int frames) {
  using Figure = double maq::RenderCounts::*;
  const std::pair<const char*, Figure> figures[] = {{"project", &maq::RenderCounts::project_ms},
                                                    {"shade", &maq::RenderCounts::shade_ms},
                                                    {"reduce", &maq::RenderCounts::reduce_ms},
                                                    {"refine", &maq::RenderCounts::refine_ms},
                                                    {"coverage", &maq::RenderCounts::coverage_ms},
                                                    {"rotate", &maq::RenderCounts::rotate_ms},
                                                    {"all", &maq::RenderCounts::all_ms}};
  maq::RenderedImage picture;
  std::vector<maq::RenderCounts> all;
  for (int frame = 0; frame <= frames; ++frame) {
    all.push_back(renderer.render(camera_of(kind, width, height, 0.05 * frame, roll), picture));
  }
  std::printf("%-14s first %6.1f |", name, all[0].all_ms);
  for (const auto& [title, figure] : figures) {
    std::vector<double> values;
    for (size_t i = 1; i < all.size(); ++i) values.push_back(all[i].*figure);
    std::sort(values.begin(), values.end());
    std::printf(" %s %5.2f", title, values[values.size() / 2]);
  }
  const maq::RenderCounts& last = all.back();
  std::printf(" ms | blocks %u/%u points %llu shaded %llu view_dependent %llu refined %llu/%llu px\n",
              last.projected_blocks, last.blocks, (unsigned long long)last.projected_points,
              (unsigned long long)last.shaded_points, (unsigned long long)last.view_dependent_points,
              (unsigned long long)last.refined_pixels, (unsigned long long)last.frame_pixels);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return std::puts("measure_scene_renderer BUNDLE [points [width height [threads [frames]]]]"), 2;
  const auto number = [&](int i, int fallback) { return argc > i ? std::atoi(argv[i]) : fallback; };
  const int count = number(2, 500000), width = number(3, 640), height = number(4, 480), threads = number(5, 2);
  try {
    const auto runtime = std::make_shared<maq::OnnxRuntimeLibrary>(MAQ_TEST_ONNXRUNTIME, maq::Log());
    maq::SessionSettings settings;
    settings.threads = threads;
    const auto networks = std::make_shared<maq::SceneNetworks>(runtime, maq::read_bundle(argv[1]), settings);
    for (const Kind kind : {Kind::kRoom, Kind::kObject}) {
      const maq::FittedPoints points = points_of(kind, size_t(count));
      for (const auto coefficients : {maq::CoefficientFormat::kInt8, maq::CoefficientFormat::kFloat32}) {
        const bool is_int8 = coefficients == maq::CoefficientFormat::kInt8;
        maq::ScenePacking packing;
        packing.positions = is_int8 ? maq::PositionFormat::kUint16 : maq::PositionFormat::kFloat32;
        packing.coefficients = coefficients;
        packing.min_view_dependence = is_int8 ? 0.5f : 0;
        maq::RenderOptions options;
        options.threads = threads;
        maq::SceneRenderer renderer(make_scene(points, packing), networks, options);
        const std::string name = std::string(kind == Kind::kRoom ? "room" : "object") + (is_int8 ? " int8" : " float");
        measure(name.c_str(), renderer, kind, width, height, 0, number(6, 30));
        if (is_int8) measure((name + " roll").c_str(), renderer, kind, width, height, 0.2, number(6, 30));
      }
    }
  } catch (const maq::Error& error) {
    return std::fprintf(stderr, "%s\n", error.what()), 1;
  }
  return 0;
}
