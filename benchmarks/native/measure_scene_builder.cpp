// Measures seconds and memory of each step of building a scene from noise photos and a synthetic room:
// `measure_scene_builder BUNDLE [points [views [width height [threads [roll in degrees]]]]]`. Each photo is rolled by
// an angle of its own, up to `roll`, like photos of a hand-held camera; with 0 all have one size.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>

#include "core/error.h"
#include "scene/assembly/descriptor_fitter.h"
#include "support/peak_memory.h"

namespace {

constexpr double kPi = 3.14159265358979;
constexpr float kHalfRoom[3] = {4, 3, 1.5f};

maq::PointCloud room(size_t count) {
  std::mt19937 random(1);
  std::normal_distribution<float> noise(0, 0.01f);
  std::uniform_real_distribution<float> across(-1, 1);
  maq::PointCloud cloud;
  cloud.reserve(count, false);
  for (size_t i = 0; i < count; ++i) {
    float at[3];
    for (int axis = 0; axis < 3; ++axis) at[axis] = kHalfRoom[axis] * across(random);
    const size_t wall = random() % 6;
    at[wall / 2] = (wall % 2 == 0 ? 1.0f : -1.0f) * kHalfRoom[wall / 2] + noise(random);
    cloud.add(double(at[0]), double(at[1]), double(at[2]));
  }
  return cloud;
}

maq::PinholeCamera camera_of(int width, int height, double angle, double roll) {
  maq::PinholeCamera camera;
  camera.width_px = width;
  camera.height_px = height;
  camera.fx_px = camera.fy_px = 0.9 * width;
  camera.cx_px = (width - 1) / 2.0;
  camera.cy_px = (height - 1) / 2.0;
  const double c = std::cos(angle), s = std::sin(angle), u = std::cos(roll), v = std::sin(roll);
  // Level: right (s, -c, 0), down (0, 0, -1), ahead (c, s, 0); then rotated about ahead.
  camera.rotation = {s * u, -c * u, -v, -s * v, c * v, -u, c, s, 0};
  camera.centre = {-2.5 * c, -1.8 * s, 0};
  return camera;
}

int number(int count, char** arguments, int index, int fallback) {
  return index < count ? std::atoi(arguments[index]) : fallback;
}

void measure(int count, char** arguments) {
  const int points = number(count, arguments, 2, 500'000), views = number(count, arguments, 3, 24);
  const int width = number(count, arguments, 4, 640), height = number(count, arguments, 5, 480);
  const int threads = number(count, arguments, 6, 2), roll_deg = number(count, arguments, 7, 0);

  const auto runtime = std::make_shared<maq::OnnxRuntimeLibrary>(MAQ_TEST_ONNXRUNTIME, maq::Log());
  maq::Frame photo;
  uint8_t* pixels = photo.allocate_bgr(width, height);
  std::mt19937 random(2);
  for (int i = 0; i < 3 * width * height; ++i) pixels[i] = uint8_t(random());

  double seconds = 0, first_ms = 0;
  maq::FittingTimes times;
  size_t seen = 0, observations = 0;
  uint64_t never_seen = 0;
  const double grown_mib = peak_memory_growth_mib([&] {
    maq::PointCloud cloud = room(size_t(points));
    const auto start = std::chrono::steady_clock::now();
    const auto seconds_since_start = [&] {
      return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    };
    maq::SceneNetworks networks(runtime, maq::read_bundle(arguments[1]), maq::SessionSettings{threads});
    maq::FittingOptions options;
    options.threads = threads;
    maq::DescriptorFitter fitter(std::move(cloud), {0, 0, 1}, networks, options);
    for (int view = 0; view < views; ++view) {
      const double roll = roll_deg * kPi / 180 * std::sin(2.4 * view);
      observations +=
          fitter.add_view(photo.image, nullptr, camera_of(width, height, 2 * kPi * view / views, roll)).value();
      if (view == 0) first_ms = 1000 * seconds_since_start();
    }
    networks.forget_extractor();
    const maq::FittedPoints made = fitter.finish_and_forget();
    seconds = seconds_since_start();
    seen = made.count();
    never_seen = made.never_seen;
    times = fitter.times();
  });
  std::printf("%d points, %d photos of %d x %d rolled by up to %d degrees, %d threads\n", points, views, width, height,
              roll_deg, threads);
  std::printf("%zu points seen %.1f times, %llu never\n", seen, double(observations) / double(seen),
              static_cast<unsigned long long>(never_seen));
  std::printf("seconds in all %.2f, until after the first photo %.2f, visibility %.2f, rotation %.2f, extractor %.2f, ",
              seconds, first_ms / 1000, times.visibility_ms / 1000, times.align_ms / 1000, times.extract_ms / 1000);
  std::printf("regression %.2f, solving %.2f; peak memory %.0f MiB\n", times.accumulate_ms / 1000,
              times.solve_ms / 1000, grown_mib);
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 2) {
    std::fprintf(stderr, "usage: measure_scene_builder BUNDLE [points [views [width height [threads [roll]]]]]\n");
    return 2;
  }
  try {
    measure(count, arguments);
  } catch (const maq::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
