#include "edges/field_decode.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "core/rounding.h"
#include "core/simd_clones.h"

namespace maq {
namespace {

constexpr int kDecodeRowsOfTask = 16;  // folded
constexpr size_t kOutputFold = DepthSlopes::kFold, kPlanes = 4;
// Limits of the logarithm of the expected error / eps_r, the same as in training (export/edges/losses.py).
constexpr float kMinLogSpread = -7, kMaxLogSpread = 1;

struct OutputRow {
  const float* depth_m;
  float* distance_r;
  float* expected_error_r;
  uint8_t* kind;
};

// Comparisons are such that NaN gives the limit on their right. Returns how many distances are NaN.
MAQ_SIMD_CLONES int decode_row(const float* __restrict distance, const float* __restrict log_spread,
                               const float* __restrict crease, const float* __restrict boundary, size_t count,
                               float eps_r, const OutputRow& row) {
  const float* __restrict depth_m = row.depth_m;
  float* __restrict distance_r = row.distance_r;
  float* __restrict expected_error_r = row.expected_error_r;
  uint8_t* __restrict kind = row.kind;
  const float largest_spread = eps_r * std::exp(kMaxLogSpread);
  int broken = 0;
  for (size_t x = 0; x < count; ++x) {
    const float given = distance[x] * eps_r;
    broken += given != given ? 1 : 0;
    const float near = given < eps_r ? given : eps_r;
    const float limited = near > 0 ? near : 0.0f;
    distance_r[x] = depth_m[x] > 0 ? limited : eps_r;
    const float low = log_spread[x] < kMaxLogSpread ? log_spread[x] : kMaxLogSpread;
    expected_error_r[x] = low > kMinLogSpread ? low : kMinLogSpread;
  }
  // Apart, or compilers make branches of the limits.
  for (size_t x = 0; x < count; ++x)
    expected_error_r[x] = exp_of_negative(expected_error_r[x] - kMaxLogSpread) * largest_spread;
  for (size_t x = 0; x < count; ++x) {
    const int which = crease[x] >= boundary[x] ? int(kCreaseEdge) : int(kBoundaryEdge);
    kind[x] = uint8_t(distance_r[x] < eps_r ? which : int(kNoEdge));
    expected_error_r[x] = depth_m[x] > 0 ? expected_error_r[x] : eps_r;
  }
  return broken;
}

}  // namespace

int64_t FieldDecode::write(const float* planes, const FieldWindow& window, WorkerThreads& threads, EdgeField& field) {
  const size_t width = size_t(window.width_px), cells = width / kOutputFold;
  const int rows = window.height_px / int(kOutputFold);
  rows_.resize(kPlanes * kOutputFold * width * size_t(threads.count()));
  broken_.assign(size_t(threads.count()), 0);
  const size_t inside = size_t(std::clamp(field.width - window.left_px, 0, window.width_px));
  threads.run(size_t(divide_up(rows, kDecodeRowsOfTask)), [&](size_t task, int worker) {
    float* const scratch =
        rows_.data() + kPlanes * kOutputFold * width * size_t(worker);  // row y of plane c is at 2 c + y
    const int first = int(task) * kDecodeRowsOfTask, last = std::min(rows, first + kDecodeRowsOfTask);
    for (int row = first; row < last; ++row) {
      const float* cell = planes + size_t(row) * cells * kChannels;
      for (size_t x = 0; x < width; x += kOutputFold, cell += kChannels) {
        for (size_t i = 0; i < kPlanes * kOutputFold; ++i) {
          std::memcpy(scratch + i * width + x, cell + kOutputFold * i, kOutputFold * sizeof(float));
        }
      }
      for (size_t y = 0; y < kOutputFold; ++y) {
        const int at = window.top_px + row * int(kOutputFold) + int(y);
        if (at >= field.height) break;
        const size_t begin = size_t(at) * size_t(field.width) + size_t(window.left_px);
        const auto plane = [&](size_t c) { return scratch + (kOutputFold * c + y) * width; };
        broken_[size_t(worker)] += decode_row(plane(0), plane(1), plane(2), plane(3), inside, field.eps_r,
                                              {field.depth_m.data() + begin, field.distance_r.data() + begin,
                                               field.expected_error_r.data() + begin, field.kind.data() + begin});
      }
    }
  });
  return std::accumulate(broken_.begin(), broken_.end(), int64_t(0));
}

void clear_outside(const FieldWindow& window, EdgeField& field) {
  const auto clear = [&](size_t begin, size_t end) {
    std::fill(field.distance_r.begin() + std::ptrdiff_t(begin), field.distance_r.begin() + std::ptrdiff_t(end),
              field.eps_r);
    std::fill(field.expected_error_r.begin() + std::ptrdiff_t(begin),
              field.expected_error_r.begin() + std::ptrdiff_t(end), field.eps_r);
    std::fill(field.kind.begin() + std::ptrdiff_t(begin), field.kind.begin() + std::ptrdiff_t(end), kNoEdge);
  };
  const int left = std::clamp(window.left_px, 0, field.width);
  const int right = std::clamp(window.left_px + window.width_px, left, field.width);
  for (int y = 0; y < field.height; ++y) {
    const size_t row = size_t(y) * size_t(field.width);
    if (y < window.top_px || y >= window.top_px + window.height_px) {
      clear(row, row + size_t(field.width));
    } else {
      clear(row, row + size_t(left));
      clear(row + size_t(right), row + size_t(field.width));
    }
  }
}

}  // namespace maq
