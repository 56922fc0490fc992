#include "edges/resting_depth.h"

#include <algorithm>
#include <cmath>

#include "core/rounding.h"

namespace maq {
namespace {

constexpr int kArea_px = 32;

bool is_same(const Intrinsics& a, const Intrinsics& b) {
  return a.width_px == b.width_px && a.height_px == b.height_px && a.fx_px == b.fx_px && a.fy_px == b.fy_px &&
         a.cx_px == b.cx_px && a.cy_px == b.cy_px;
}

}  // namespace

RestingDepth::RestingDepth(int frames) : frames_(frames) {}

int64_t RestingDepth::add(float* metres, const Intrinsics& camera, WorkerThreads& threads) {
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

int64_t RestingDepth::add_row_of_areas(float* metres, int row) {
  int64_t averaged = 0;
  const int top = row * kArea_px, bottom = std::min(top + kArea_px, camera_.height_px);
  for (int left = 0; left < camera_.width_px; left += kArea_px) {
    averaged += add_area(metres, {left, top, std::min(left + kArea_px, camera_.width_px), bottom});
  }
  return averaged;
}

int64_t RestingDepth::add_area(float* metres, const PixelArea& area) {
  const auto for_each_pixel = [&](auto&& work) {
    for (int y = area.top; y < area.bottom; ++y) {
      for (int x = area.left; x < area.right; ++x) work(x, y, size_t(y) * size_t(camera_.width_px) + size_t(x));
    }
  };
  const AreaMotion motion = motion_of(metres, inverse_.data(), camera_.width_px, area);
  const bool moved = motion.moved;
  const float jump = motion.jump;
  int64_t averaged = 0;
  for_each_pixel([&](int, int, size_t at) {
    if (!(metres[at] > 0)) {
      if (moved) inverse_[at] = 0;
      return;
    }
    const float now = 1 / metres[at];
    if (moved || inverse_[at] == 0 || std::abs(now - inverse_[at]) > jump) {
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
