#include "scene/stereo/semi_global.h"

#include <algorithm>
#include <cstring>

#include "core/simd_clones.h"

namespace maq {
namespace {

constexpr int kDepthPlanes = DepthPlanes::kCount;
// Costs of a step of one plane between neighbours, and of more, as parts of MatchingCost::kWorst. A large step costs as
// much as bytes have room for. Both, and the limit of what is believed, are chosen by docs/research/scenes.md, "Depth
// and fusion": doubtful depth is better than none, since nothing is rendered where no point is.
constexpr uint8_t kSmallStep = 8, kLargeStep = 68;
constexpr uint8_t kMaxCost = 90;  // of a depth that is believed
static_assert(3 * (MatchingCost::kWorst + kLargeStep) / 2 <= 255, "the halves of three paths are a byte");
constexpr int kStripColumns = 16;

// Costs of a path's last pixel, with a plane that is never taken on either side.
struct PathCost {
  PathCost() { std::memset(costs, 255, sizeof costs); }
  void begin() { std::memset(&costs[kBefore], 0, kDepthPlanes); }
  uint8_t* planes() { return &costs[kBefore]; }

  static constexpr int kBefore = 32;
  uint8_t costs[kBefore + kDepthPlanes + kBefore];
};

// Lengthens a path by a pixel, and subtracts the path's least cost before, which keeps numbers small: they are at most
// kWorst + kLargeStep.
inline void step_path(const uint8_t* __restrict costs, uint8_t* __restrict path) {
  uint8_t least = 255;
  for (int i = 0; i < kDepthPlanes; ++i) least = path[i] < least ? path[i] : least;
  const uint8_t jump = uint8_t(least + kLargeStep);
  uint8_t next[kDepthPlanes];
  for (int i = 0; i < kDepthPlanes; ++i) {
    const uint8_t before = path[i - 1] < 255 - kSmallStep ? uint8_t(path[i - 1] + kSmallStep) : uint8_t(255);
    const uint8_t after = path[i + 1] < 255 - kSmallStep ? uint8_t(path[i + 1] + kSmallStep) : uint8_t(255);
    const uint8_t side = before < after ? before : after, same = path[i] < jump ? path[i] : jump;
    next[i] = uint8_t((side < same ? side : same) - least + costs[i]);
  }
  std::memcpy(path, next, kDepthPlanes);
}

// Paths along a row, from both ends; half of their sum.
MAQ_SIMD_CLONES void sum_along_row(const uint8_t* __restrict costs, int width, uint8_t* __restrict sums) {
  PathCost path;
  path.begin();
  for (int x = 0; x < width; ++x) {
    step_path(costs + x * kDepthPlanes, path.planes());
    std::memcpy(sums + x * kDepthPlanes, path.planes(), kDepthPlanes);
  }
  path.begin();
  for (int x = width; x-- > 0;) {
    step_path(costs + x * kDepthPlanes, path.planes());
    uint8_t* const sum = sums + x * kDepthPlanes;
    const uint8_t* const back = path.planes();
    for (int i = 0; i < kDepthPlanes; ++i) sum[i] = uint8_t((sum[i] + back[i]) >> 1);
  }
}

MAQ_SIMD_CLONES void add_downwards(const uint8_t* __restrict costs, PathCost* __restrict paths, int columns,
                                   uint8_t* __restrict sums) {
  for (int x = 0; x < columns; ++x) {
    step_path(costs + x * kDepthPlanes, paths[x].planes());
    const uint8_t* const path = paths[x].planes();
    uint8_t* const sum = sums + x * kDepthPlanes;
    for (int i = 0; i < kDepthPlanes; ++i) sum[i] = uint8_t(sum[i] + (path[i] >> 1));
  }
}

// The last path, and the best plane of all four: -1 where none is believed.
MAQ_SIMD_CLONES void solve_upwards(const uint8_t* __restrict costs, PathCost* __restrict paths, int columns,
                                   const uint8_t* __restrict sums, float* __restrict planes) {
  for (int x = 0; x < columns; ++x) {
    step_path(costs + x * kDepthPlanes, paths[x].planes());
    const uint8_t* const path = paths[x].planes();
    const uint8_t* const sum = sums + x * kDepthPlanes;
    uint16_t total[kDepthPlanes];
    uint16_t least = 0xffff;
    for (int i = 0; i < kDepthPlanes; ++i) {
      total[i] = uint16_t(2 * sum[i] + path[i]);
      least = total[i] < least ? total[i] : least;
    }
    int best = 0;
    while (total[best] != least) ++best;
    planes[x] = -1;
    if (best == 0 || best == kDepthPlanes - 1 || costs[x * kDepthPlanes + best] >= kMaxCost) continue;
    const int before = total[best - 1], after = total[best + 1], bend = before - 2 * least + after;
    planes[x] = float(best) + (bend > 0 ? 0.5f * float(before - after) / float(bend) : 0.0f);
  }
}

}  // namespace

void SemiGlobal::solve(const MatchingCost& costs, const DepthPlanes& planes, WorkerThreads& threads,
                       std::vector<float>& depth) {
  const int width = costs.width_px(), height = costs.height_px();
  const size_t row_bytes = size_t(width) * kDepthPlanes;
  sums_.resize(row_bytes * size_t(height));
  depth.resize(size_t(width) * size_t(height));
  threads.run(size_t(height),
              [&](size_t y, int) { sum_along_row(costs.pixel(0, int(y)), width, &sums_[y * row_bytes]); });
  threads.run(size_t(width + kStripColumns - 1) / kStripColumns, [&](size_t strip, int) {
    const int left = int(strip) * kStripColumns, columns = std::min(kStripColumns, width - left);
    const auto sums = [&](int y) { return &sums_[size_t(y) * row_bytes + size_t(left) * kDepthPlanes]; };
    PathCost paths[kStripColumns];
    for (PathCost& path : paths) path.begin();
    for (int y = 0; y < height; ++y) add_downwards(costs.pixel(left, y), paths, columns, sums(y));
    for (PathCost& path : paths) path.begin();
    for (int y = height; y-- > 0;) {
      float* const row = &depth[size_t(y) * size_t(width) + size_t(left)];
      solve_upwards(costs.pixel(left, y), paths, columns, sums(y), row);
      for (int x = 0; x < columns; ++x) row[x] = row[x] < 0 ? 0.0f : float(1 / planes.inverse_depth(double(row[x])));
    }
  });
}

}  // namespace maq
