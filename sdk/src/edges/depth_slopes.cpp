#include "edges/depth_slopes.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/rounding.h"
#include "core/simd_clones.h"

namespace maq {
namespace {

constexpr int kSlopeRowsOfTask = 16;  // folded
constexpr size_t kDepthRows = 3, kMirroredRows = 2, kPlaneRows = 6;

inline float is_known(float depth) { return depth > 0 ? 1.0f : 0.0f; }

// g / (1 + |g|) of g = f (z - z') / z', z' the depth of the neighbour, with one division. The difference of two close
// depths is exact; the difference of their inverses is not. Limited, so that no product overflows. A factor instead of
// a branch, which would keep compilers from making vectors.
inline float squashed_slope(float here, float there, float focal_px) {
  constexpr float kLimit = 1e30f;
  const float both_known = is_known(here) * is_known(there);
  const float rise = std::min(std::max(focal_px * (here - there), -kLimit), kLimit);
  return both_known * rise / (there + std::abs(rise) + (1 - both_known));
}

// Writes `count` pixels; `here` has one more.
MAQ_SIMD_CLONES void planes_of_row(const float* __restrict here, const float* __restrict below, size_t count,
                                   float fx_px, float fy_px, float* __restrict across, float* __restrict down,
                                   float* __restrict known) {
  for (size_t x = 0; x < count; ++x) {
    across[x] = squashed_slope(here[x], here[x + 1], fx_px);
    down[x] = squashed_slope(here[x], below[x], fy_px);
    known[x] = is_known(here[x]);
  }
}

// The part of row `y` that the window and one more pixel to the right see, unknown where there is no pixel.
void copy_row(const DepthPlane& depth, const FieldWindow& window, int y, float* row) {
  const int wanted = window.width_px + 1;
  const int inside = y < depth.height_px ? std::clamp(depth.width_px - window.left_px, 0, wanted) : 0;
  if (inside > 0) {
    std::copy_n(depth.metres + size_t(y) * size_t(depth.width_px) + size_t(window.left_px), inside, row);
  }
  std::fill(row + inside, row + wanted, 0.0f);
}

// Planes of a row, `count` pixels of which the frame has the first `inside`: the others mirror them. A slope has no
// value at the frame's last pixel, which has no neighbour, so that its mirror stands between the last two.
void mirror_columns(int inside, int count, float* across, float* down, float* known) {
  for (int x = inside - 1; x < count; ++x) across[x] = across[std::max(0, 2 * inside - 3 - x)];
  for (int x = inside; x < count; ++x) {
    const int mirrored = std::max(0, 2 * inside - 1 - x);
    down[x] = down[mirrored];
    known[x] = known[mirrored];
  }
}

}  // namespace

void DepthSlopes::make(const DepthPlane& depth, const Intrinsics& intrinsics, const FieldWindow& window,
                       WorkerThreads& threads, float* values) {
  const size_t width = size_t(window.width_px), cells = width / kFold;
  const int rows = window.height_px / kFold;
  const size_t scratch = (kDepthRows + kMirroredRows) * (width + 1) + (1 + kPlaneRows) * width;
  rows_.resize(scratch * size_t(threads.count()));
  const float fx = float(intrinsics.fx_px), fy = float(intrinsics.fy_px);
  const int inside = depth.width_px - window.left_px, height = depth.height_px;
  const bool is_wider = inside<window.width_px, is_higher = window.top_px + window.height_px> height;
  threads.run(size_t(divide_up(rows, kSlopeRowsOfTask)), [&](size_t task, int worker) {
    float* depths[kDepthRows];
    for (size_t i = 0; i < kDepthRows; ++i) depths[i] = rows_.data() + scratch * size_t(worker) + i * (width + 1);
    float* const mirrored = depths[2] + width + 1;
    float* const mirrored_below = mirrored + width + 1;
    float* const unused = mirrored_below + width + 1;
    float* const planes = unused + width;  // plane 0 of both rows, plane 1 of both, plane 2
    const int first = int(task) * kSlopeRowsOfTask, last = std::min(rows, first + kSlopeRowsOfTask);
    copy_row(depth, window, window.top_px + kFold * first, depths[0]);
    for (int row = first; row < last; ++row) {
      for (int y = 0; y < kFold; ++y) {
        const int at = window.top_px + kFold * row + y;
        float* const across = planes + size_t(y) * width;
        float* const down = planes + size_t(2 + y) * width;
        float* const known = planes + size_t(4 + y) * width;
        copy_row(depth, window, at + 1, depths[y + 1]);
        if (is_higher && at >= height - 1) {
          // Below the frame its rows are mirrored, as its columns are.
          const int above = std::max(0, 2 * height - 3 - at);
          copy_row(depth, window, above, mirrored);
          copy_row(depth, window, above + 1, mirrored_below);
          planes_of_row(mirrored, mirrored_below, width, fx, fy, across, down, known);
          copy_row(depth, window, at < height ? at : std::max(0, 2 * height - 1 - at), mirrored);
          planes_of_row(mirrored, mirrored_below, width, fx, fy, across, unused, known);
        } else {
          planes_of_row(depths[y], depths[y + 1], width, fx, fy, across, down, known);
        }
        if (is_wider) mirror_columns(inside, window.width_px, across, down, known);
      }
      float* cell = values + size_t(row) * cells * kChannels;
      for (size_t x = 0; x < width; x += kFold, cell += kChannels) {
        for (size_t i = 0; i < kPlaneRows; ++i)
          std::memcpy(cell + kFold * i, planes + i * width + x, 2 * sizeof(float));
      }
      std::swap(depths[0], depths[2]);
    }
  });
}

}  // namespace maq
