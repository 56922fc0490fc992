#include "prediction/extrapolation.h"

#include <algorithm>

#include "core/rounding.h"

namespace maq {
namespace {

constexpr int kSampleStep = 7;           // for the median of a field
constexpr float kSameMotion_px = 0.25f;  // displacements that differ by less go on together
constexpr int kFetchRowsOfTask = 16;

float median_of(const std::vector<float>& values, std::vector<float>& sorted) {
  sorted.clear();
  for (size_t i = 0; i < values.size(); i += kSampleStep) sorted.push_back(values[i]);
  const auto middle = sorted.begin() + ptrdiff_t(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  return *middle;
}

// Of an image and packed memory of its format.
int samples_of(const ImageView& image, uint8_t* pixels, PlaneSamples* all) {
  const ImageView packed = packed_view(image.format, image.width_px, image.height_px, pixels);
  const auto plane = [&](int index, size_t offset, int channels, int channel_bytes, int pixel_bytes, int by_x,
                         int by_y) {
    const size_t begin = size_t(packed.planes[index].data - pixels) + offset;
    return PlaneSamples{image.planes[index].data + offset,
                        image.planes[index].stride_bytes,
                        pixels + begin,
                        packed.planes[index].stride_bytes,
                        divide_up(image.width_px, by_x),
                        divide_up(image.height_px, by_y),
                        channels,
                        channel_bytes,
                        pixel_bytes,
                        by_x,
                        by_y};
  };
  switch (image.format) {
    case MAQ_PIXEL_NV12:
      all[0] = plane(0, 0, 1, 1, 1, 1, 1);
      all[1] = plane(1, 0, 2, 1, 2, 2, 2);
      return 2;
    case MAQ_PIXEL_YUYV:
      all[0] = plane(0, 0, 1, 1, 2, 1, 1);
      all[1] = plane(0, 1, 2, 2, 4, 2, 1);
      return 2;
    default: {
      const int bytes = int(row_bytes(image.format, 0, 1));
      all[0] = plane(0, 0, bytes, 1, bytes, 1, 1);
      return 1;
    }
  }
}

}  // namespace

const FlowField& Extrapolation::project(const FlowField& flow, float intervals) {
  const int width = flow.width_px, height = flow.height_px;
  projected_.resize(width, height);
  priority_.assign(flow.dx_px.size(), 0.0f);
  const float common_x = median_of(flow.dx_px, sorted_), common_y = median_of(flow.dy_px, sorted_);
  for (size_t i = 0; i < flow.dx_px.size(); ++i) {
    projected_.dx_px[i] = flow.dx_px[i] * intervals;
    projected_.dy_px[i] = flow.dy_px[i] * intervals;
  }
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const size_t at = size_t(y) * size_t(width) + size_t(x);
      const float unlike_x = flow.dx_px[at] - common_x, unlike_y = flow.dy_px[at] - common_y;
      const float unlike = unlike_x * unlike_x + unlike_y * unlike_y;
      if (unlike * intervals * intervals < kSameMotion_px * kSameMotion_px) continue;
      // To the four pixels around where it comes to lie, or expansion would tear holes.
      const float dx = flow.dx_px[at] * intervals, dy = flow.dy_px[at] * intervals;
      const float to_x = float(x) - dx, to_y = float(y) - dy;
      if (!(to_x > -1 && to_y > -1 && to_x < float(width) && to_y < float(height))) continue;
      const int left = int(to_x + 1) - 1, top = int(to_y + 1) - 1;
      for (int i = std::max(top, 0); i <= std::min(top + 1, height - 1); ++i) {
        for (int j = std::max(left, 0); j <= std::min(left + 1, width - 1); ++j) {
          const size_t to = size_t(i) * size_t(width) + size_t(j);
          if (unlike <= priority_[to]) continue;
          priority_[to] = unlike;
          projected_.dx_px[to] = dx;
          projected_.dy_px[to] = dy;
        }
      }
    }
  }
  return projected_;
}

void Extrapolation::fetch(const ImageView& image, const FlowField& field, int scale, WorkerThreads& threads,
                          uint8_t* pixels) {
  rows_.resize(size_t(threads.count()));
  PlaneSamples planes[2];
  const int count = samples_of(image, pixels, planes);
  for (int plane = 0; plane < count; ++plane) {
    const PlaneSamples& samples = planes[plane];
    threads.run(size_t(divide_up(samples.height, kFetchRowsOfTask)), [&](size_t task, int worker) {
      for (int y = int(task) * kFetchRowsOfTask; y < std::min(int(task + 1) * kFetchRowsOfTask, samples.height); ++y) {
        fetch_row(samples, field, scale, y, rows_[size_t(worker)]);
      }
    });
  }
}

}  // namespace maq
