// The time from the distance field of a frame to its curves, on one thread, with that of its first steps: the minimum
// of many runs, for exact scenes with and without noise. One JSON object a line.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>

#include "edges/curves/curve_extractor.h"
#include "edges/measuring/boxes.h"
#include "support/samples/analytic_scenes.h"

namespace {

using namespace maq::test;

constexpr int kRuns = 60;

double milliseconds(const std::function<void()>& work) {
  double best = 1e9;
  for (int i = 0; i < kRuns; ++i) {
    const auto start = std::chrono::steady_clock::now();
    work();
    best = std::min(best, std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  }
  return best;
}

void measure(const char* name, SolidScene scene, int width, int height, double noise_r) {
  SeenScene seen = see(std::move(scene), camera_of(width, height, width * 300.0 / 320));
  if (noise_r > 0) damage(seen, {0.5, noise_r, false, 3, 0.1}, 1);
  const maq::CurveOptions options;
  maq::CurveCounts counts;
  maq::RidgeVotes votes;
  maq::RidgeChains chains;
  maq::CurveExtractor extractor(options);
  maq::BoxFinder box_finder;
  std::vector<maq::MeasuredBox> boxes;
  const double votes_ms = milliseconds([&] { votes.gather(seen.field, options.select_px, counts); });
  const double chains_ms = milliseconds([&] { chains.trace(votes, options, counts); });
  const double all_ms = milliseconds([&] { extractor.extract(seen.field); });
  const maq::EdgeCurves& found = extractor.extract(seen.field);
  const double boxes_ms = milliseconds([&] { box_finder.find(seen.field, found, boxes); });
  std::printf(
      "{\"scene\": \"%s\", \"width\": %d, \"height\": %d, \"noise_r\": %.1f, \"curves\": %zu, \"votes_ms\": %.3f, "
      "\"chains_ms\": %.3f, \"curves_ms\": %.3f, \"boxes_ms\": %.3f, \"f_score\": %.4f}\n",
      name, width, height, noise_r, found.curves.size(), votes_ms, chains_ms, all_ms, boxes_ms,
      score(seen, found).f_score);
}

}  // namespace

int main() {
  for (const double noise_r : {0.0, 0.5}) {
    measure("nothing", SolidScene(), 320, 240, noise_r);
    measure("one box", lone_box(), 320, 240, noise_r);
    measure("carton on a table in a room", room(), 320, 240, noise_r);
    measure("carton on a table in a room", room(), 640, 480, noise_r);
  }
}
