#include "prediction/flow/optical_flow.h"

#include <algorithm>
#include <cmath>

#include "core/rounding.h"

namespace maq {
namespace {

constexpr int kStep_px = kPatch_px / 2;  // patches overlap by half
// Standing still explains the image where moving leaves more than this part of the squared differences; plus the error
// of rounding to whole grey levels.
constexpr float kMovedFraction = 0.7f, kOwnFraction = 0.85f, kRounding = 0.1f;
constexpr int kNeighbours = 3;     // patches to each side that are judged together
constexpr float kAlike_px = 0.5f;  // displacements of neighbours that need not be tried

int begin_of(int index, int side) { return std::min(index * kStep_px, side - kPatch_px); }

}  // namespace

void FlowField::resize(int width, int height) {
  width_px = width;
  height_px = height;
  dx_px.resize(size_t(width) * size_t(height));
  dy_px.resize(dx_px.size());
}

void OpticalFlow::match(const LumaLevel& from, const LumaLevel& to, const FlowField* coarser, WorkerThreads& threads) {
  columns_ = divide_up(from.width_px - kPatch_px, kStep_px) + 1;
  rows_ = divide_up(from.height_px - kPatch_px, kStep_px) + 1;
  patches_.resize(size_t(columns_) * size_t(rows_));
  threads.run(size_t(rows_), [&](size_t row, int) {
    for (int column = 0; column < columns_; ++column) {
      const int x = begin_of(column, from.width_px), y = begin_of(int(row), from.height_px);
      Displacement candidates[2] = {};
      if (coarser != nullptr) {
        const size_t at = size_t((y + kPatch_px / 2) / 2) * size_t(coarser->width_px) + size_t((x + kPatch_px / 2) / 2);
        candidates[1] = {2 * coarser->dx_px[at], 2 * coarser->dy_px[at]};
      }
      search_patch(from, to, x, y, candidates, coarser != nullptr ? 2 : 1, false,
                   patches_[row * size_t(columns_) + size_t(column)]);
    }
  });
  // Each looks at its neighbours as they were, so that the result does not depend on who was first.
  next_ = patches_;
  threads.run(size_t(rows_), [&](size_t row, int) {
    for (int column = 0; column < columns_; ++column) {
      const size_t at = row * size_t(columns_) + size_t(column);
      Patch& patch = next_[at];
      Displacement candidates[4];
      int count = 0;
      const auto add_neighbour = [&](bool is_there, size_t neighbour) {
        if (!is_there) return;
        const Patch& other = patches_[neighbour];
        if (std::max(std::abs(other.dx - patch.dx), std::abs(other.dy - patch.dy)) < kAlike_px) return;
        candidates[count++] = {other.dx, other.dy};
      };
      add_neighbour(column > 0, at - 1);
      add_neighbour(column + 1 < columns_, at + 1);
      add_neighbour(row > 0, at - size_t(columns_));
      add_neighbour(int(row) + 1 < rows_, at + size_t(columns_));
      if (count == 0) continue;
      search_patch(from, to, begin_of(column, from.width_px), begin_of(int(row), from.height_px), candidates, count,
                   true, patch);
    }
  });
  patches_.swap(next_);
}

// Judged over a neighbourhood, because a patch alone can be fitted to its noise; and each by itself where its texture
// would show motion.
void OpticalFlow::hold_still(WorkerThreads& threads) {
  next_ = patches_;
  threads.run(size_t(rows_), [&](size_t row, int) {
    const int top = std::max(int(row) - kNeighbours, 0), bottom = std::min(int(row) + kNeighbours + 1, rows_);
    for (int column = 0; column < columns_; ++column) {
      const int left = std::max(column - kNeighbours, 0), right = std::min(column + kNeighbours + 1, columns_);
      float still = 0, moved = 0;
      for (int i = top; i < bottom; ++i) {
        for (int j = left; j < right; ++j) {
          still += patches_[size_t(i * columns_ + j)].still;
          moved += patches_[size_t(i * columns_ + j)].moved + kRounding;
        }
      }
      Patch& patch = next_[row * size_t(columns_) + size_t(column)];
      const bool has_seen = patch.contrast > 4 * patch.still && patch.moved + kRounding > kOwnFraction * patch.still;
      if (has_seen || moved > kMovedFraction * still) {
        patch.dx = patch.dy = 0;
        patch.moved = patch.still;
      }
    }
  });
  patches_.swap(next_);
}

void OpticalFlow::densify(const LumaLevel& from, const LumaLevel& to, WorkerThreads& threads, FlowField& flow) {
  flow.resize(from.width_px, from.height_px);
  if (votes_.size() < size_t(threads.count())) votes_.resize(size_t(threads.count()));
  const size_t width = size_t(from.width_px);
  threads.run(size_t(divide_up(from.height_px, kStep_px)), [&](size_t band, int worker) {
    std::vector<float>& votes = votes_[size_t(worker)];
    votes.resize(3 * width);
    float *const weights = votes.data(), *const dx = weights + width, *const dy = dx + width;
    const int begin = int(band) * kStep_px, end = std::min(begin + kStep_px, from.height_px);
    for (int y = begin; y < end; ++y) {
      std::fill(votes.begin(), votes.end(), 0.0f);
      for (int row = std::max((y - kPatch_px) / kStep_px, 0); row < rows_; ++row) {
        const int top = begin_of(row, from.height_px);
        if (top > y) break;
        if (top + kPatch_px <= y) continue;
        for (int column = 0; column < columns_; ++column) {
          const int x = begin_of(column, from.width_px);
          vote(from, to, x, top, y - top, patches_[size_t(row * columns_ + column)], weights + x, dx + x, dy + x);
        }
      }
      const size_t at = size_t(y) * width;
      for (size_t x = 0; x < width; ++x) {
        flow.dx_px[at + x] = dx[x] / weights[x];
        flow.dy_px[at + x] = dy[x] / weights[x];
      }
    }
  });
}

// Means over 5 x 5 pixels: errors of neighbours cancel, and they would grow with the time ahead. Values with zeros
// around stay 0.
void OpticalFlow::smooth(WorkerThreads& threads, FlowField& flow) {
  constexpr int kRadius_px = 2;
  const int width = flow.width_px, height = flow.height_px;
  across_.resize(width, height);
  threads.run(size_t(height), [&](size_t y, int worker) {
    std::vector<float>& row = votes_[size_t(worker)];
    row.resize(size_t(width + 2 * kRadius_px));
    for (const auto& [from, to] : {std::pair{&flow.dx_px, &across_.dx_px}, {&flow.dy_px, &across_.dy_px}}) {
      const float* const begin = from->data() + y * size_t(width);
      std::fill(row.begin(), row.begin() + kRadius_px, begin[0]);
      std::copy(begin, begin + width, row.begin() + kRadius_px);
      std::fill(row.end() - kRadius_px, row.end(), begin[width - 1]);
      const float* const rows[] = {row.data(), row.data() + 1, row.data() + 2, row.data() + 3, row.data() + 4};
      mean_of_five(rows, width, to->data() + y * size_t(width));
    }
  });
  threads.run(size_t(height), [&](size_t y, int) {
    for (const auto& [from, to] : {std::pair{&across_.dx_px, &flow.dx_px}, {&across_.dy_px, &flow.dy_px}}) {
      const float* rows[2 * kRadius_px + 1];
      for (int i = -kRadius_px; i <= kRadius_px; ++i) {
        rows[i + kRadius_px] = from->data() + size_t(std::clamp(int(y) + i, 0, height - 1)) * size_t(width);
      }
      mean_of_five(rows, width, to->data() + y * size_t(width));
    }
  });
}

FlowFit OpticalFlow::find(const LumaPyramid& from, const LumaPyramid& to, WorkerThreads& threads, FlowField& flow) {
  const LumaLevel& finest = from.level(0);
  if (std::min(finest.width_px, finest.height_px) < kPatch_px) {
    flow.resize(finest.width_px, finest.height_px);
    std::fill(flow.dx_px.begin(), flow.dx_px.end(), 0.0f);
    std::fill(flow.dy_px.begin(), flow.dy_px.end(), 0.0f);
    return {};
  }
  if (fields_.size() < from.level_count()) fields_.resize(from.level_count());
  const FlowField* coarser = nullptr;
  for (size_t i = from.level_count(); i-- > 0;) {
    match(from.level(i), to.level(i), coarser, threads);
    if (i == 0) break;
    densify(from.level(i), to.level(i), threads, fields_[i]);
    coarser = &fields_[i];
  }
  hold_still(threads);
  densify(finest, to.level(0), threads, flow);
  smooth(threads, flow);
  FlowFit fit;
  const float each = 1.0f / float(patches_.size());
  for (const Patch& patch : patches_) {
    fit.contrast += patch.contrast * each;
    fit.still += patch.still * each;
    fit.moved += patch.moved * each;
  }
  return fit;
}

}  // namespace maq
