#include "scene/format/descriptor_outliers.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "scene/format/scene_layout.h"

namespace maq {
namespace {

constexpr double kOutOfProportion = 32;
constexpr size_t kSampled = 4096;  // points that proportions are taken from
constexpr size_t kMostGroups = 4;

// The value that a share of the others is below of.
float quantile(std::vector<float>& values, double share) {
  const auto at = values.begin() + std::ptrdiff_t(share * double(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// What is ordinary for one kind of numbers, kColumns a point.
template <size_t kColumns>
class Proportions {
 public:
  Proportions(const float* numbers, const std::vector<uint32_t>& points, bool from_median) : numbers_(numbers) {
    std::fill_n(most_, kColumns, HUGE_VAL);
    if (points.size() < 3) return;  // of two numbers, which is the wild one?
    const size_t stride = (points.size() + kSampled - 1) / kSampled;
    std::vector<float> sample;
    for (size_t c = 0; c < kColumns; ++c) {
      sample.clear();
      for (size_t k = 0; k < points.size(); k += stride) sample.push_back(numbers[points[k] * kColumns + c]);
      if (from_median) middle_[c] = quantile(sample, 0.5);
      for (float& value : sample) value = std::abs(value - middle_[c]);
      most_[c] = kOutOfProportion * quantile(sample, 0.875);
    }
  }

  bool are_exceeded_by(uint32_t point) const {
    const float* row = numbers_ + point * kColumns;
    bool is_over = false;
    for (size_t c = 0; c < kColumns; ++c) is_over |= std::abs(double(row[c]) - middle_[c]) > most_[c];
    return is_over;
  }

 private:
  const float* numbers_;
  float middle_[kColumns] = {};
  double most_[kColumns];
};

}  // namespace

bool look_varies(const ModelledPoints& points, uint32_t index, float least_variation) {
  if (points.variations[index] < least_variation) return false;
  const float* slope = &points.slopes[index * kSlopes];
  return std::any_of(slope, slope + kSlopes, [](float value) { return value != 0; });
}

std::vector<std::vector<uint32_t>> set_wild_apart(const ModelledPoints& points, float least_variation, bool has_steps) {
  std::vector<std::vector<uint32_t>> groups(1);
  groups[0].resize(points.count());
  std::iota(groups[0].begin(), groups[0].end(), 0);
  const auto varies = [&](uint32_t i) { return look_varies(points, i, least_variation); };
  while (has_steps && groups.size() < kMostGroups) {
    std::vector<uint32_t>& group = groups.back();
    std::vector<uint32_t> varying;
    std::copy_if(group.begin(), group.end(), std::back_inserter(varying), varies);
    const Proportions<kFeatures> means(points.means.data(), group, true);
    const Proportions<kSlopes> slopes(points.slopes.data(), varying, false);
    const auto is_ordinary = [&](uint32_t i) {
      return !means.are_exceeded_by(i) && !(varies(i) && slopes.are_exceeded_by(i));
    };
    const auto wild = std::stable_partition(group.begin(), group.end(), is_ordinary);
    const auto wild_count = size_t(group.end() - wild);
    if (wild_count == 0 || 2 * wild_count > group.size()) {
      std::sort(group.begin(), group.end());
      break;
    }
    std::vector<uint32_t> next(wild, group.end());
    group.erase(wild, group.end());
    groups.push_back(std::move(next));
  }
  return groups;
}

}  // namespace maq
