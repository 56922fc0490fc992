#include "edges/kept_field.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/rounding.h"

namespace maq {
namespace {

constexpr int kKeptArea_px = 32;
constexpr int kMinKept_px = 16;  // pixels of an area, to tell motion from noise
// What the field does not show: it changes by a footprint where its edges move by that.
constexpr double kMaxShift_r = 1;
// Pixels of an area that jump, or come to be known or unknown, without an end of what is kept there.
constexpr int kMaxOdd_px = 8;
constexpr int kMinHole_px = 5;  // unknown pixels of 3 x 3 in a hole

}  // namespace

KeptField::KeptField(int frames) : frames_(frames) {}

PixelArea KeptField::area_at(int column, int row) const {
  const int left = column * kKeptArea_px, top = row * kKeptArea_px;
  return {left, top, std::min(left + kKeptArea_px, camera_.width_px), std::min(top + kKeptArea_px, camera_.height_px)};
}

// Sensors lose single pixels anywhere, other ones at every frame; where surfaces end, they mix both sides, too.
bool KeptField::is_flicker(const float* metres, int x, int y, float jump) const {
  float lowest = HUGE_VALF, highest = 0;
  int unknown = 0, unknown_before = 0;  // the pixel itself included
  for (int i = std::max(0, y - 1); i <= std::min(y + 1, camera_.height_px - 1); ++i) {
    for (int j = std::max(0, x - 1); j <= std::min(x + 1, camera_.width_px - 1); ++j) {
      const size_t at = size_t(i) * size_t(camera_.width_px) + size_t(j);
      const float inverse = inverse_[at];
      unknown += int(!(metres[at] > 0));
      if (!(inverse > 0)) {
        ++unknown_before;
        continue;
      }
      lowest = std::min(lowest, inverse);
      highest = std::max(highest, inverse);
    }
  }
  const size_t at = size_t(y) * size_t(camera_.width_px) + size_t(x);
  if (!(metres[at] > 0)) return unknown < kMinHole_px || unknown_before > 0 || highest - lowest > 4 * jump;
  if (!(inverse_[at] > 0) && unknown_before < kMinHole_px) return true;
  return 1 / metres[at] >= lowest - jump && 1 / metres[at] <= highest + jump;
}

bool KeptField::has_changed(const float* metres, const PixelArea& area) const {
  int both = 0, before = 0, odd = 0;
  double sum = 0;
  const auto for_each_pixel = [&](auto&& work) {
    for (int y = area.top; y < area.bottom; ++y) {
      for (int x = area.left; x < area.right; ++x) work(x, y, size_t(y) * size_t(camera_.width_px) + size_t(x));
    }
  };
  for_each_pixel([&](int, int, size_t at) {
    const bool was_known = inverse_[at] > 0;
    before += int(was_known);
    both += int(was_known && metres[at] > 0);
    sum += was_known ? double(inverse_[at]) : 0;
  });
  // As a difference of inverse depth.
  const double footprint = before == 0 ? 0 : sum / before / std::sqrt(camera_.fx_px * camera_.fy_px);
  float jump = float(kMaxShift_r * footprint);  // where little is known
  if (both >= kMinKept_px) {
    const AreaMotion motion = motion_of(metres, inverse_.data(), camera_.width_px, area);
    if (motion.moved && motion.shift > kMaxShift_r * footprint) return true;
    jump = std::max(jump, motion.jump);
  }
  for_each_pixel([&](int x, int y, size_t at) {
    const bool is_known = metres[at] > 0, was_known = inverse_[at] > 0;
    const bool is_same = is_known == was_known && (!is_known || std::abs(1 / metres[at] - inverse_[at]) <= jump);
    odd += int(!is_same && !is_flicker(metres, x, y, jump));
  });
  return odd > kMaxOdd_px;
}

FieldWindow KeptField::find(const DepthPlane& depth, const Intrinsics& camera, int multiple_px,
                            WorkerThreads& threads) {
  if (!(camera == camera_)) {
    camera_ = camera;
    columns_ = divide_up(camera.width_px, kKeptArea_px);
    rows_ = divide_up(camera.height_px, kKeptArea_px);
    const size_t areas = size_t(columns_) * size_t(rows_);
    const size_t pixels = size_t(camera.width_px) * size_t(camera.height_px);
    age_.assign(areas, 0);
    changed_.resize(areas);
    is_fresh_.resize(areas);
    kept_.resize(size_t(rows_));
    inverse_.resize(pixels);
    distance_r_.resize(pixels);
    spread_r_.resize(pixels);
    kind_.resize(pixels);
  }
  threads.run(size_t(rows_), [&](size_t row, int) {
    for (int column = 0; column < columns_; ++column) {
      const size_t index = row * size_t(columns_) + size_t(column);
      changed_[index] =
          age_[index] == 0 || age_[index] >= frames_ || has_changed(depth.metres, area_at(column, int(row)));
    }
  });
  FieldBounds fresh(depth.width_px, depth.height_px);
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      bool is_fresh = false;
      for (int y = std::max(0, row - 1); y <= std::min(row + 1, rows_ - 1); ++y) {
        for (int x = std::max(0, column - 1); x <= std::min(column + 1, columns_ - 1); ++x) {
          is_fresh = is_fresh || changed_[size_t(y * columns_ + x)] != 0;
        }
      }
      is_fresh_[size_t(row * columns_ + column)] = is_fresh;
      if (!is_fresh) continue;
      const PixelArea area = area_at(column, row);
      fresh.add(area.left, area.top, area.right, area.bottom);
    }
  }
  return window_around(fresh, depth.width_px, depth.height_px, multiple_px);
}

int64_t KeptField::merge_area(EdgeField& field, const PixelArea& area, size_t index) {
  const bool is_fresh = is_fresh_[index] != 0;
  const auto copy = [&](auto& found, auto& kept, size_t at) {
    const auto count = size_t(area.right - area.left);
    if (is_fresh) {
      std::copy_n(found.data() + at, count, kept.data() + at);
    } else {
      std::copy_n(kept.data() + at, count, found.data() + at);
    }
  };
  for (int y = area.top; y < area.bottom; ++y) {
    const size_t at = size_t(y) * size_t(field.width) + size_t(area.left);
    copy(field.distance_r, distance_r_, at);
    copy(field.spread_r, spread_r_, at);
    copy(field.kind, kind_, at);
    for (size_t i = at; is_fresh && i < at + size_t(area.right - area.left); ++i) {
      inverse_[i] = field.depth_m[i] > 0 ? 1 / field.depth_m[i] : 0;
    }
    // What has become unknown since has no edge, and what is known again waits for the network.
    for (size_t i = at; !is_fresh && i < at + size_t(area.right - area.left); ++i) {
      if (field.depth_m[i] > 0) continue;
      field.distance_r[i] = field.spread_r[i] = field.eps_r;
      field.kind[i] = kNoEdge;
    }
  }
  age_[index] = is_fresh ? uint8_t(1) : uint8_t(age_[index] + 1);
  return is_fresh ? 0 : int64_t(area.right - area.left) * (area.bottom - area.top);
}

int64_t KeptField::merge(EdgeField& field, WorkerThreads& threads) {
  threads.run(size_t(rows_), [&](size_t row, int) {
    kept_[row] = 0;
    for (int column = 0; column < columns_; ++column) {
      kept_[row] += merge_area(field, area_at(column, int(row)), row * size_t(columns_) + size_t(column));
    }
  });
  return std::accumulate(kept_.begin(), kept_.end(), int64_t(0));
}

}  // namespace maq
