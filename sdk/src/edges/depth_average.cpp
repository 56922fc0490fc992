#include "edges/depth_average.h"

#include <algorithm>
#include <cmath>

#include "core/rounding.h"

namespace maq {
namespace {

constexpr int kArea_px = 32;
constexpr int kMinKnown_px = 16;  // pixels known in both, needed to detect motion in an area
constexpr double kTrim = 4;       // mean absolute differences: beyond this a pixel has jumped and is ignored
// The share of squared differences that a plane explains: for white noise 3 in 1,024; for stereo noise, where 7 x 7
// pixels share one error, about 1 in 9.
constexpr double kMotion = 0.4;
constexpr float kJumpDifferences = 5;  // mean absolute differences: 4 standard deviations

bool is_same(const Intrinsics& a, const Intrinsics& b) {
  return a.width_px == b.width_px && a.height_px == b.height_px && a.fx_px == b.fx_px && a.fy_px == b.fy_px &&
         a.cx_px == b.cx_px && a.cy_px == b.cy_px;
}

// Differences from the mean over pixels of an area.
struct Sums {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0, d = 0, dx = 0, dy = 0, dd = 0, size = 0;

  void add(double at_x, double at_y, double difference) {
    n += 1;
    x += at_x;
    y += at_y;
    xx += at_x * at_x;
    xy += at_x * at_y;
    yy += at_y * at_y;
    d += difference;
    dx += difference * at_x;
    dy += difference * at_y;
    dd += difference * difference;
    size += std::abs(difference);
  }

  // Returns whether the differences are from a surface that moved.
  bool is_motion() const {
    if (n < kMinKnown_px) return true;  // too few to show that it is static
    const double cxx = xx - x * x / n, cxy = xy - x * y / n, cyy = yy - y * y / n;
    const double cxd = dx - x * d / n, cyd = dy - y * d / n;
    const double determinant = cxx * cyy - cxy * cxy;
    double explained = d * d / n;
    if (determinant > 1e-9 * cxx * cyy) {
      explained += (cyy * cxd * cxd - 2 * cxy * cxd * cyd + cxx * cyd * cyd) / determinant;
    }
    return explained > kMotion * dd;
  }
};

}  // namespace

struct DepthAverage::Area {
  int left, top, right, bottom;
};

DepthAverage::DepthAverage(int frames) : frames_(frames) {}

int64_t DepthAverage::add(float* metres, const Intrinsics& camera, WorkerThreads& threads) {
  if (frames_ == 1) return 0;
  if (!is_same(camera, camera_)) {
    camera_ = camera;
    const size_t pixels = size_t(camera.width_px) * size_t(camera.height_px);
    inverse_.assign(pixels, 0);
    count_.assign(pixels, 0);
  }
  averaged_.assign(size_t(divide_up(camera.height_px, kArea_px)), 0);
  threads.run(averaged_.size(), [&](size_t row, int) { averaged_[row] = add_row_of_areas(metres, int(row)); });
  int64_t total = 0;
  for (const int64_t count : averaged_) total += count;
  return total;
}

int64_t DepthAverage::add_row_of_areas(float* metres, int row) {
  int64_t averaged = 0;
  const int top = row * kArea_px, bottom = std::min(top + kArea_px, camera_.height_px);
  for (int left = 0; left < camera_.width_px; left += kArea_px) {
    averaged += add_area(metres, {left, top, std::min(left + kArea_px, camera_.width_px), bottom});
  }
  return averaged;
}

int64_t DepthAverage::add_area(float* metres, const Area& area) {
  const auto for_each_pixel = [&](auto&& work) {
    for (int y = area.top; y < area.bottom; ++y) {
      for (int x = area.left; x < area.right; ++x) work(x, y, size_t(y) * size_t(camera_.width_px) + size_t(x));
    }
  };
  // Two rounds; the second one ignores pixels that jumped.
  Sums sums;
  double limit = HUGE_VAL;
  for (int round = 0; round < 2; ++round) {
    sums = {};
    for_each_pixel([&](int x, int y, size_t at) {
      if (!(metres[at] > 0) || count_[at] == 0) return;
      const double difference = double(1 / metres[at]) - double(inverse_[at]);
      if (std::abs(difference) <= limit) sums.add(x - area.left, y - area.top, difference);
    });
    limit = sums.n > 0 ? kTrim * sums.size / sums.n : 0;
  }
  const bool moved = sums.is_motion();
  const float jump = sums.n > 0 ? kJumpDifferences * float(sums.size / sums.n) : 0;
  int64_t averaged = 0;
  for_each_pixel([&](int, int, size_t at) {
    if (!(metres[at] > 0)) {
      if (moved) count_[at] = 0;
      return;
    }
    const float now = 1 / metres[at];
    if (moved || count_[at] == 0 || std::abs(now - inverse_[at]) > jump) {
      inverse_[at] = now;
      count_[at] = 1;
      return;
    }
    count_[at] = uint8_t(std::min(int(count_[at]) + 1, frames_));
    inverse_[at] += (now - inverse_[at]) / float(count_[at]);
    metres[at] = 1 / inverse_[at];
    ++averaged;
  });
  return averaged;
}

}  // namespace maq
