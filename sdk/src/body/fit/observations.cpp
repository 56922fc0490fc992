#include "body/fit/observations.h"

#include <algorithm>
#include <cmath>

namespace maq::body {
namespace {

constexpr double kKeypointWeight = 3;  // by the weight of a pixel of the surface

// Sums points with weights of joints, until kPointJoints of these are kept.
class PointSum {
 public:
  explicit PointSum(SeenPoint& sum) : sum_(sum) { sum_ = {}; }

  void add(const BodyPoint& point, double fraction, size_t shapes) {
    sum_.rest = sum_.rest + fraction * point.rest;
    for (size_t s = 0; s < shapes; ++s) sum_.basis[s] = sum_.basis[s] + fraction * point.basis[s];
    for (size_t k = 0; k < kWeights; ++k) weights_[point.joints[k]] += fraction * point.weights[k];
  }

  void finish() {
    double kept = 0;
    while (sum_.joint_count < kPointJoints) {
      const auto heaviest = std::max_element(weights_.begin(), weights_.end());
      if (!(*heaviest > 1e-3)) break;
      sum_.joints[sum_.joint_count] = uint8_t(heaviest - weights_.begin());
      sum_.weights[sum_.joint_count++] = *heaviest;
      kept += *heaviest;
      *heaviest = 0;
    }
    for (size_t k = 0; k < sum_.joint_count; ++k) sum_.weights[k] /= kept;
  }

 private:
  SeenPoint& sum_;
  std::array<double, kMaxJoints> weights_{};
};

}  // namespace

PeoplePixels find_people(const LabelImage& image) {
  PeoplePixels people{};
  for (int y = 0; y < image.height_px; ++y) {
    const size_t row = size_t(y) * image.stride_bytes;
    for (int x = 0; x < image.width_px; ++x) {
      if (image.part[row + size_t(x)] == 0) continue;
      PersonPixels& person = people[image.person == nullptr ? 1 : image.person[row + size_t(x)]];
      if (person.count++ == 0) person = {1, x, y, x, y};
      person.left = std::min(person.left, x);
      person.right = std::max(person.right, x + 1);
      person.bottom = y + 1;
    }
  }
  return people;
}

bool surface_point(const BodyModel& model, int part, double u, double v, SeenPoint& point) {
  const int nodes = model.surface_nodes;
  if (part < 1 || part > int(kParts) || !(u >= 0 && u <= 1 && v >= 0 && v <= 1)) return false;
  const double at_u = u * (nodes - 1), at_v = v * (nodes - 1);
  const int low_u = std::min(int(at_u), nodes - 2), low_v = std::min(int(at_v), nodes - 2);
  const double fraction_u = at_u - low_u, fraction_v = at_v - low_v;
  std::array<const SurfaceNode*, 4> node{};
  std::array<double, 4> fraction{};
  double total = 0;
  for (int k = 0; k < 4; ++k) {
    const int i = k / 2, j = k % 2;
    node[size_t(k)] = &model.surface[size_t(((part - 1) * nodes + low_u + i) * nodes + low_v + j)];
    if (node[size_t(k)]->triangle == kNoTriangle) continue;
    // A node counts a little even from afar, so that the rim of the chart has a point.
    fraction[size_t(k)] =
        std::max((i == 0 ? 1 - fraction_u : fraction_u) * (j == 0 ? 1 - fraction_v : fraction_v), 1e-6);
    total += fraction[size_t(k)];
  }
  if (total <= 0) return false;
  PointSum sum(point);
  for (size_t k = 0; k < 4; ++k) {
    if (fraction[k] <= 0) continue;
    for (size_t corner = 0; corner < 3; ++corner) {
      const uint32_t vertex = model.triangles[3 * size_t(node[k]->triangle) + corner];
      sum.add(model.vertices[vertex], fraction[k] / total * node[k]->fractions[corner], model.shape_count);
    }
  }
  sum.finish();
  return true;
}

void sample_person(const BodyModel& model, const LabelImage& image, uint8_t number, const PersonPixels& pixels,
                   int target, Observations& found) {
  found.points.clear();
  found.size_px = std::sqrt(double(pixels.count));
  const double step = std::max(1.0, std::sqrt(double(pixels.count) / target));
  // The steps whose middles lie within a length.
  const auto count_of = [&](int length) { return int(std::ceil((length + 0.5) / step - 0.5)); };
  for (int row = 0; row < count_of(pixels.bottom - pixels.top); ++row) {
    const int y = std::min(int(pixels.top + (row + 0.5) * step), image.height_px - 1);
    for (int column = 0; column < count_of(pixels.right - pixels.left); ++column) {
      const int x = std::min(int(pixels.left + (column + 0.5) * step), image.width_px - 1);
      const size_t at = size_t(y) * image.stride_bytes + size_t(x);
      if (image.person != nullptr && image.person[at] != number) continue;
      const int part = image.part[at];
      if (part == 0) continue;
      Observation observation;
      if (!surface_point(model, part, image.u[at] / 255.0, image.v[at] / 255.0, observation.point)) continue;
      observation.at = {double(x), double(y)};
      observation.part = uint8_t(part);
      found.points.push_back(observation);
    }
  }
  found.surface_count = found.points.size();
}

void add_keypoints(const BodyModel& model, const float* keypoints, double min_confidence, Observations& found) {
  for (size_t k = 0; k < kKeypoints; ++k) {
    const double x = double(keypoints[3 * k]), y = double(keypoints[3 * k + 1]),
                 confidence = double(keypoints[3 * k + 2]);
    if (!std::isfinite(x) || !std::isfinite(y) || !(confidence >= min_confidence)) continue;
    Observation observation;
    PointSum sum(observation.point);
    sum.add(model.keypoints[k], 1, model.shape_count);
    sum.finish();
    observation.at = {x - 0.5, y - 0.5};
    observation.weight = kKeypointWeight * std::min(confidence, 1.0);
    found.points.push_back(observation);
  }
}

}  // namespace maq::body
