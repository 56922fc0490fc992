// Prints microseconds a point of the head field on one thread, for each width and instruction set: the minimum of many
// runs of a batch that fits the second-level cache.
//   measure_head_field [WIDTH...]
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <random>
#include <vector>

#include "head/field/field_engine.h"
#include "head/field/weight_bases.h"

namespace {

using maq::head::FieldEngine;
using maq::head::FieldIsa;
using maq::head::FieldShape;
using maq::head::FieldWeights;
using maq::head::WeightGradient;

constexpr size_t kPoints = 256;
constexpr double kSeconds = 0.4;  // for each metric

double microseconds(const std::function<void()>& work) {
  using Clock = std::chrono::steady_clock;
  double best = 1e9, total = 0;
  while (total < kSeconds) {
    const auto start = Clock::now();
    work();
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    best = std::min(best, seconds * 1e6);
    total += seconds;
  }
  return best;
}

void measure(FieldIsa isa, int width) {
  FieldShape shape;
  shape.width = shape.surface_width = width;
  FieldWeights weights(shape), gradient(shape);
  std::mt19937 random(1);
  std::normal_distribution<float> normal(0.0f, 0.15f);
  for (float& value : weights.values()) value = normal(random);  // padding too, which is never read
  FieldEngine engine(shape, isa);
  engine.set_weights(weights);
  std::vector<std::vector<float>> planes(16, std::vector<float>(kPoints, 0.1f));
  for (size_t plane = 0; plane < 3; ++plane) {
    for (float& value : planes[plane]) value = normal(random) * 8;
  }
  const auto p = [&](size_t plane) { return planes[plane].data(); };
  const maq::head::FieldPoints points{p(0), p(1), p(2), kPoints};
  maq::head::FieldWorkspace workspace;
  const auto forward = [&] { engine.forward(points, workspace, {p(3), {p(4), p(5), p(6)}, {p(7), p(8), p(9)}}); };
  const auto backward = [&](WeightGradient which) {
    engine.backward(workspace, {p(10), {p(10), p(11), p(12)}, {p(13), p(14), p(15)}}, which, &gradient,
                    {p(7), p(8), p(9)});
  };
  const auto print = [&](const char* what, const std::function<void()>& work) {
    std::printf("{\"isa\": \"%s\", \"width\": %d, \"what\": \"%s\", \"us\": %.4f}\n", field_isa_name(isa), width, what,
                microseconds(work) / double(kPoints));
  };
  print("distance", [&] { engine.distances(points, workspace, p(3)); });
  print("distance and gradient", [&] { engine.distances(points, workspace, p(3), {p(4), p(5), p(6)}); });
  print("geometry forward, back to all weights", [&] {
    engine.forward(points, workspace, {p(3), {}, {}});
    engine.backward(workspace, {p(10), {}, {}}, WeightGradient::kAll, &gradient);
  });
  print("forward", forward);
  print("forward, back to points", [&] {
    forward();
    backward(WeightGradient::kNone);
  });
  print("forward, back to personal weights", [&] {
    forward();
    backward(WeightGradient::kPersonal);
  });
  print("forward, back to all weights", [&] {
    forward();
    backward(WeightGradient::kAll);
  });
  print("distance and normal forward", [&] { engine.forward(points, workspace, {p(3), {}, {}, {p(4), p(5), p(6)}}); });
  print("all forward, back to all weights", [&] {
    engine.forward(points, workspace, {p(3), {p(4), p(5), p(6)}, {p(7), p(8), p(9)}, {p(7), p(8), p(9)}});
    engine.backward(workspace, {p(10), {p(10), p(11), p(12)}, {p(13), p(14), p(15)}}, WeightGradient::kAll, &gradient);
  });
  print("set weights (us / 256)", [&] { engine.set_weights(weights); });
  maq::head::WeightBases bases(shape, 64, 32, isa);
  maq::head::FieldCodes codes{std::vector<float>(64, 0.1f), std::vector<float>(32, 0.1f)};
  print("weights of codes (us / 256)", [&] { bases.combine(codes, weights); });
  print("gradient of codes (us / 256)", [&] { bases.code_gradient(gradient, codes); });
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<int> widths;
  for (int i = 1; i < argc; ++i) widths.push_back(std::atoi(argv[i]));
  if (widths.empty()) widths = {48, 64, 96, 128};
  for (const int width : widths) {
    if (width < 1 || width > maq::head::kMaxFieldWidth) {
      std::fprintf(stderr, "The width is %d, but must be 1 to %d.\n", width, maq::head::kMaxFieldWidth);
      return 2;
    }
  }
  for (const FieldIsa isa : maq::head::supported_field_isas()) {
    for (const int width : widths) measure(isa, width);
  }
}
