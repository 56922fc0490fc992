#include "scene/stereo/view_selection.h"

#include <algorithm>
#include <cmath>

namespace maq {
namespace {

constexpr double kDegreesInRadian = 57.29577951308232;
constexpr double kBestAngle = 6, kAngleWidth = 6;  // degrees between two cameras at a point
constexpr double kMinAngle = 0.1;                  // below it depth cannot be measured
constexpr double kShareOfAll = 0.05;               // of a photo's goodness for points that have two good ones already
constexpr size_t kMinShared = 12;
// Points of a larger cloud are taken at even steps; more would not change the order of neighbours.
constexpr size_t kMinSample = 512, kMaxSample = 4096;
constexpr double kPairTests = 3e8;  // of a camera, a camera and a point
constexpr double kNearFraction = 0.01, kNearMargin = 0.9, kFarMargin = 1.1;

struct Seen {
  uint32_t point;
  double depth;
};

std::vector<Seen> points_in_image(const PinholeCamera& camera, const std::vector<std::array<double, 3>>& points) {
  std::vector<Seen> seen;
  const auto& r = camera.rotation;
  for (size_t i = 0; i < points.size(); ++i) {
    double at[3] = {0, 0, 0};
    for (size_t k = 0; k < 3; ++k) {
      const double away = points[i][k] - camera.centre[k];
      for (size_t row = 0; row < 3; ++row) at[row] += r[3 * row + k] * away;
    }
    if (!(at[2] > 0)) continue;
    const double x = at[0] / at[2] * camera.fx_px + camera.cx_px, y = at[1] / at[2] * camera.fy_px + camera.cy_px;
    if (x >= 0 && y >= 0 && x <= camera.width_px - 1 && y <= camera.height_px - 1) seen.push_back({uint32_t(i), at[2]});
  }
  return seen;
}

double value_at_fraction(std::vector<double>& values, double fraction) {
  const auto at = values.begin() + std::ptrdiff_t(fraction * double(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// How well another photo measures the depth of each point that both see.
struct Pair {
  std::vector<float> goodness;  // 0 to 1; 0 for points that it does not see
  double sum = 0;               // 0 for photos that are no neighbours
};

Pair compare_photos(const PinholeCamera& a, const PinholeCamera& b, const std::vector<Seen>& of_a,
                    const std::vector<Seen>& of_b, const std::vector<std::array<double, 3>>& points) {
  Pair pair;
  pair.goodness.resize(of_a.size());
  std::vector<double> angles;
  for (size_t i = 0, j = 0; i < of_a.size() && j < of_b.size();) {
    if (of_a[i].point != of_b[j].point) {
      ++(of_a[i].point < of_b[j].point ? i : j);
      continue;
    }
    const auto& at = points[of_a[i].point];
    double dot = 0, length_a = 0, length_b = 0;
    for (size_t k = 0; k < 3; ++k) {
      const double to_a = a.centre[k] - at[k], to_b = b.centre[k] - at[k];
      dot += to_a * to_b;
      length_a += to_a * to_a;
      length_b += to_b * to_b;
    }
    const double cosine = dot / std::sqrt(length_a * length_b);
    if (std::isfinite(cosine)) {
      const double angle = std::acos(std::min(std::max(cosine, -1.0), 1.0)) * kDegreesInRadian;
      const double off = (angle - kBestAngle) / kAngleWidth;
      angles.push_back(angle);
      pair.goodness[i] = float(std::exp(-off * off));
    }
    ++i, ++j;
  }
  if (angles.size() < kMinShared || !(value_at_fraction(angles, 0.5) >= kMinAngle)) return pair;
  for (const float goodness : pair.goodness) pair.sum += double(goodness);
  return pair;
}

// Near things are seen at larger angles than far ones: photos are taken one after the other so that each point has two
// good ones, as a depth counts that two photos agree with. Then come those that are best for all points.
std::vector<uint32_t> chosen_neighbours(std::vector<Pair>& pairs, size_t points, size_t max_neighbours) {
  std::vector<float> best(points), second(points);
  std::vector<uint32_t> chosen;
  while (chosen.size() < max_neighbours) {
    size_t next = pairs.size();
    double most = 0;
    for (size_t k = 0; k < pairs.size(); ++k) {
      if (!(pairs[k].sum > 0)) continue;
      double gain = kShareOfAll * pairs[k].sum;
      for (size_t i = 0; i < points; ++i) gain += double(std::max(pairs[k].goodness[i] - second[i], 0.0f));
      if (gain > most) most = gain, next = k;
    }
    if (next == pairs.size()) break;
    for (size_t i = 0; i < points; ++i) {
      const float goodness = pairs[next].goodness[i];
      second[i] = std::max(second[i], std::min(best[i], goodness));
      best[i] = std::max(best[i], goodness);
    }
    pairs[next].sum = 0;
    chosen.push_back(uint32_t(next));
  }
  return chosen;
}

}  // namespace

std::vector<ViewPlan> plan_views(const std::vector<PinholeCamera>& cameras, const PointPositions& cloud,
                                 size_t max_neighbours) {
  const size_t views = cameras.size();
  const double affordable = kPairTests / std::max(1.0, double(views) * double(views));
  const size_t most = size_t(std::min(std::max(affordable, double(kMinSample)), double(kMaxSample)));
  const size_t count = std::min(cloud.count, most);
  std::vector<std::array<double, 3>> points(count);
  for (size_t i = 0; i < count; ++i) {
    const size_t from = size_t(uint64_t(i) * cloud.count / count);
    points[i] = {cloud.origin[0] + double(cloud.x[from]), cloud.origin[1] + double(cloud.y[from]),
                 cloud.origin[2] + double(cloud.z[from])};
  }
  std::vector<std::vector<Seen>> seen;
  for (const PinholeCamera& camera : cameras) seen.push_back(points_in_image(camera, points));
  std::vector<ViewPlan> plans(views);
  for (size_t i = 0; i < views; ++i) {
    if (seen[i].size() < kMinShared) continue;
    std::vector<Pair> pairs(views);
    for (size_t j = 0; j < views; ++j) {
      if (j != i) pairs[j] = compare_photos(cameras[i], cameras[j], seen[i], seen[j], points);
    }
    plans[i].neighbours = chosen_neighbours(pairs, seen[i].size(), max_neighbours);
    std::vector<double> depths;
    for (const Seen& point : seen[i]) depths.push_back(point.depth);
    plans[i].near = kNearMargin * value_at_fraction(depths, kNearFraction);
    plans[i].far = kFarMargin * value_at_fraction(depths, 1 - kNearFraction);
  }
  return plans;
}

}  // namespace maq
