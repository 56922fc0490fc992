#include "prediction/flow/extrapolation.h"

#include <algorithm>

#include "core/rounding.h"
#include "prediction/flow/plane_samples.h"

namespace maq {
namespace {

constexpr int kSampleStep = 31;  // for the median of a field
constexpr float kMaxMedian_px = 64;
constexpr float kSameMotion_px = 0.25f;  // displacements that differ by less go on together
constexpr int kFetchRowsOfTask = 16;

// To a hundredth of a pixel.
float median_of(const std::vector<float>& displacements_px) {
  float low = -kMaxMedian_px, high = kMaxMedian_px;
  while (high - low > 0.01f) {
    const float middle = (low + high) / 2;
    ptrdiff_t below = 0;
    for (size_t i = 0; i < displacements_px.size(); i += kSampleStep) below += displacements_px[i] < middle ? 1 : -1;
    (below > 0 ? high : low) = middle;
  }
  return (low + high) / 2;
}

}  // namespace

const FlowField& Extrapolation::project(const FlowField& flow, float intervals) {
  const int width = flow.width_px, height = flow.height_px;
  projected_.resize(width, height);
  priority_.assign(flow.dx_px.size(), 0.0f);
  const float common_x = median_of(flow.dx_px), common_y = median_of(flow.dy_px);
  for (size_t i = 0; i < flow.dx_px.size(); ++i) {
    projected_.dx_px[i] = flow.dx_px[i] * intervals;
    projected_.dy_px[i] = flow.dy_px[i] * intervals;
  }
  const float alike = kSameMotion_px / std::max(intervals, kSameMotion_px);
  const float *const from_x = flow.dx_px.data(), *const from_y = flow.dy_px.data();
  float *const to_x = projected_.dx_px.data(), *const to_y = projected_.dy_px.data(),
               *const priority = priority_.data();
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const size_t at = size_t(y) * size_t(width) + size_t(x);
      const float unlike_x = from_x[at] - common_x, unlike_y = from_y[at] - common_y;
      const float unlike = unlike_x * unlike_x + unlike_y * unlike_y;
      if (unlike < alike * alike) continue;
      const float dx = from_x[at] * intervals, dy = from_y[at] * intervals;
      const float left = float(x) - dx, top = float(y) - dy;
      if (!(left >= 0 && top >= 0 && left < float(width - 1) && top < float(height - 1))) continue;
      // To the four pixels around where it comes to lie, or expansion would tear holes.
      const size_t first = size_t(top) * size_t(width) + size_t(left);
      for (const size_t to : {first, first + 1, first + size_t(width), first + size_t(width) + 1}) {
        if (unlike <= priority[to]) continue;
        priority[to] = unlike;
        to_x[to] = dx;
        to_y[to] = dy;
      }
    }
  }
  return projected_;
}

void Extrapolation::warp(const ImageView& image, const FlowField& field, int scale, const CellWeights* weights,
                         WorkerThreads& threads, uint8_t* pixels) {
  if (rows_.size() < size_t(threads.count())) rows_.resize(size_t(threads.count()));
  PlaneSamples planes[2];
  const int count = plane_samples(image, pixels, planes);
  for (int plane = 0; plane < count; ++plane) {
    const PlaneSamples& samples = planes[plane];
    threads.run(size_t(divide_up(samples.height, kFetchRowsOfTask)), [&](size_t task, int worker) {
      for (int y = int(task) * kFetchRowsOfTask; y < std::min(int(task + 1) * kFetchRowsOfTask, samples.height); ++y) {
        warp_row(samples, field, scale, y, rows_[size_t(worker)]);
        if (weights != nullptr) blend_row(samples, *weights, scale, y, rows_[size_t(worker)]);
      }
    });
  }
}

}  // namespace maq
