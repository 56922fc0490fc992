#include "scene/format/descriptor_outliers.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "scene/format/scene.h"

namespace maq {
namespace {

constexpr double kOutlierFactor = 32;
constexpr size_t kSampled = 4096;  // points that the range is taken from
constexpr size_t kMaxGroups = 4;

// The value that this fraction of the others is below.
float quantile(std::vector<float>& values, double fraction) {
  const auto at = values.begin() + std::ptrdiff_t(fraction * double(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// The range of inliers of one kind of numbers, kColumns a point.
template <size_t kColumns>
class InlierRange {
 public:
  InlierRange(const float* numbers, const std::vector<uint32_t>& points, bool from_median) : numbers_(numbers) {
    std::fill_n(most_, kColumns, HUGE_VAL);
    if (points.size() < 3) return;  // of two numbers, which is the outlier?
    const size_t stride = (points.size() + kSampled - 1) / kSampled;
    std::vector<float> sample;
    for (size_t c = 0; c < kColumns; ++c) {
      sample.clear();
      for (size_t k = 0; k < points.size(); k += stride) sample.push_back(numbers[points[k] * kColumns + c]);
      if (from_median) middle_[c] = quantile(sample, 0.5);
      for (float& value : sample) value = std::abs(value - middle_[c]);
      most_[c] = kOutlierFactor * quantile(sample, 0.875);
    }
  }

  bool is_exceeded_by(uint32_t point) const {
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

bool is_view_dependent(const FittedPoints& points, uint32_t index, float min_view_dependence) {
  if (points.view_dependence[index] < min_view_dependence) return false;
  const float* terms = &points.linear_terms[index * kLinearTerms];
  return std::any_of(terms, terms + kLinearTerms, [](float value) { return value != 0; });
}

std::vector<std::vector<uint32_t>> separate_outliers(const FittedPoints& points, float min_view_dependence,
                                                     bool has_steps) {
  std::vector<std::vector<uint32_t>> groups(1);
  groups[0].resize(points.count());
  std::iota(groups[0].begin(), groups[0].end(), 0);
  const auto is_dependent = [&](uint32_t i) { return is_view_dependent(points, i, min_view_dependence); };
  while (has_steps && groups.size() < kMaxGroups) {
    std::vector<uint32_t>& group = groups.back();
    std::vector<uint32_t> dependent;
    std::copy_if(group.begin(), group.end(), std::back_inserter(dependent), is_dependent);
    const InlierRange<kFeatures> constant(points.constant_terms.data(), group, true);
    const InlierRange<kLinearTerms> linear(points.linear_terms.data(), dependent, false);
    const auto is_inlier = [&](uint32_t i) {
      return !constant.is_exceeded_by(i) && !(is_dependent(i) && linear.is_exceeded_by(i));
    };
    const auto outliers = std::stable_partition(group.begin(), group.end(), is_inlier);
    const auto outlier_count = size_t(group.end() - outliers);
    if (outlier_count == 0 || 2 * outlier_count > group.size()) {
      std::sort(group.begin(), group.end());
      break;
    }
    std::vector<uint32_t> next(outliers, group.end());
    group.erase(outliers, group.end());
    groups.push_back(std::move(next));
  }
  return groups;
}

}  // namespace maq
