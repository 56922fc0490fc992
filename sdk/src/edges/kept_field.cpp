#include "edges/kept_field.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/rounding.h"

namespace maq {
namespace {

constexpr int kKeptArea_px = 32;
// Pixels of an area that jump, or come to be known or unknown, without an end of what is kept there: a few do at every
// frame where surfaces end.
constexpr int kMaxOdd_px = 8;

}  // namespace

KeptField::KeptField(int frames) : frames_(frames) {}

PixelArea KeptField::area_at(int column, int row) const {
  const int left = column * kKeptArea_px, top = row * kKeptArea_px;
  return {left, top, std::min(left + kKeptArea_px, camera_.width_px), std::min(top + kKeptArea_px, camera_.height_px)};
}

bool KeptField::has_changed(const float* metres, const PixelArea& area) const {
  int both = 0, odd = 0;
  const auto for_each_pixel = [&](auto&& work) {
    for (int y = area.top; y < area.bottom; ++y) {
      for (int x = area.left; x < area.right; ++x) work(size_t(y) * size_t(camera_.width_px) + size_t(x));
    }
  };
  for_each_pixel([&](size_t at) {
    const bool is_known = metres[at] > 0, was_known = inverse_[at] > 0;
    both += int(is_known && was_known);
    odd += int(is_known != was_known);
  });
  if (both == 0 || odd > kMaxOdd_px) return odd > kMaxOdd_px;
  const auto [moved, jump] = motion_of(metres, inverse_.data(), camera_.width_px, area);
  if (moved) return true;
  for_each_pixel([&, limit = jump](size_t at) {
    odd += int(metres[at] > 0 && inverse_[at] > 0 && std::abs(1 / metres[at] - inverse_[at]) > limit);
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
