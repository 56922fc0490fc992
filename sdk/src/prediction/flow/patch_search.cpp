#include "prediction/flow/patch_search.h"

#include <algorithm>
#include <cmath>

#include "core/simd_clones.h"

namespace maq {
namespace {

constexpr int kPixels = kPatch_px * kPatch_px;
constexpr int kMaxIterations = 5;
constexpr float kSettled_px = 0.02f;      // a step that ends the search
constexpr float kMaxDisplacement_px = 8;  // of one level, from where the search began: farther it is lost
constexpr float kMinDeterminant = 1e-3f;  // of the gradients' covariance (grey levels a pixel, squared): no texture
constexpr float kBetter = 0.95f;          // of what is left along a neighbour's displacement, to be taken over
using Row = float __attribute__((vector_size(4 * kPatch_px)));

// Memory of any alignment.
struct UnalignedRow {
  Row row;
} __attribute__((packed, may_alias));

#define MAQ_LOAD_ROW(pointer) (reinterpret_cast<const UnalignedRow*>(pointer)->row)
#define MAQ_ROW_AT(pointer) (reinterpret_cast<UnalignedRow*>(pointer)->row)

// A patch of the first image, without its mean, and its gradients.
struct Template {
  Row brightness[kPatch_px], x[kPatch_px], y[kPatch_px];
  float inverse[3];  // of the covariance of the gradients: xx, xy, yy; 0 without texture
  float mean_x, mean_y;
  float contrast;
};

inline float sum_of(const Row& row) {
  return ((row[0] + row[4]) + (row[1] + row[5])) + ((row[2] + row[6]) + (row[3] + row[7]));
}

inline void read_template(const float* at, size_t stride, Template& made) {
  Row sum{}, sum_x{}, sum_y{}, squares{}, xx{}, xy{}, yy{};
  for (int i = 0; i < kPatch_px; ++i) {
    const float* const row = at + size_t(i) * stride;
    made.brightness[i] = MAQ_LOAD_ROW(row);
    made.x[i] = (MAQ_LOAD_ROW(row + 1) - MAQ_LOAD_ROW(row - 1)) * 0.5f;
    made.y[i] = (MAQ_LOAD_ROW(row + stride) - MAQ_LOAD_ROW(row - stride)) * 0.5f;
    sum += made.brightness[i];
    sum_x += made.x[i];
    sum_y += made.y[i];
    xx += made.x[i] * made.x[i];
    xy += made.x[i] * made.y[i];
    yy += made.y[i] * made.y[i];
  }
  constexpr float kMean = 1.0f / kPixels;
  const float mean = sum_of(sum) * kMean;
  for (int i = 0; i < kPatch_px; ++i) {
    made.brightness[i] -= mean;
    squares += made.brightness[i] * made.brightness[i];
  }
  made.contrast = sum_of(squares) * kMean;
  made.mean_x = sum_of(sum_x) * kMean;
  made.mean_y = sum_of(sum_y) * kMean;
  const float a = sum_of(xx) * kMean - made.mean_x * made.mean_x, b = sum_of(xy) * kMean - made.mean_x * made.mean_y,
              d = sum_of(yy) * kMean - made.mean_y * made.mean_y;
  const float determinant = a * d - b * b;
  const float factor = determinant > kMinDeterminant * (1 + a + d) ? 1 / determinant : 0;
  made.inverse[0] = d * factor;
  made.inverse[1] = -b * factor;
  made.inverse[2] = a * factor;
}

// Where a patch lies in the second image: a whole pixel and the weights of it and its right and lower neighbours.
struct Position {
  const float* at;
  float right, below;
};

// (x, y) is clamped so that the patch and a pixel around it lie within the level's border.
inline Position position_of(const LumaLevel& level, float x, float y) {
  constexpr float kOutside = float(LumaLevel::kBorder_px - 2);
  x = std::min(std::max(x, -kOutside), float(level.width_px) + kOutside - float(kPatch_px));
  y = std::min(std::max(y, -kOutside), float(level.height_px) + kOutside - float(kPatch_px));
  const int left = int(x + kOutside) - int(kOutside), top = int(y + kOutside) - int(kOutside);
  return {level.at(left, top), x - float(left), y - float(top)};
}

struct Residual {
  float mean_square;  // around the mean
  float x, y;         // its products with the gradients
};

inline Residual residual_of(const Template& patch, const Position& position, size_t stride) {
  const float right = position.right, left = 1 - right, below = position.below, above = 1 - below;
  Row sum{}, squares{}, sum_x{}, sum_y{};
  Row before = MAQ_LOAD_ROW(position.at) * left + MAQ_LOAD_ROW(position.at + 1) * right;
  for (int i = 0; i < kPatch_px; ++i) {
    const float* const row = position.at + size_t(i + 1) * stride;
    const Row after = MAQ_LOAD_ROW(row) * left + MAQ_LOAD_ROW(row + 1) * right;
    const Row difference = before * above + after * below - patch.brightness[i];
    before = after;
    sum += difference;
    squares += difference * difference;
    sum_x += difference * patch.x[i];
    sum_y += difference * patch.y[i];
  }
  constexpr float kMean = 1.0f / kPixels;
  const float mean = sum_of(sum) * kMean;
  return {std::max(sum_of(squares) * kMean - mean * mean, 0.0f), sum_of(sum_x) * kMean - mean * patch.mean_x,
          sum_of(sum_y) * kMean - mean * patch.mean_y};
}

MAQ_SIMD_CLONES void search_clones(const LumaLevel& from, const LumaLevel& to, int x, int y,
                                   const Displacement* candidates, int count, bool is_found, Patch& found) {
  Template patch;
  read_template(from.at(x, y), from.stride(), patch);
  Displacement best{found.dx, found.dy}, begin{}, next{};
  Residual at_best{found.moved, 0, 0};
  int chosen = -1;
  for (int i = 0; i <= count + kMaxIterations; ++i) {
    if (i < count) {
      next = candidates[i];
    } else {
      if (chosen < 0 || patch.inverse[0] == 0) break;
      if (i == count) begin = best;
      const float step_x = patch.inverse[0] * at_best.x + patch.inverse[1] * at_best.y,
                  step_y = patch.inverse[1] * at_best.x + patch.inverse[2] * at_best.y;
      next = {best.dx - step_x, best.dy - step_y};
      const bool is_near =
          std::abs(next.dx - begin.dx) < kMaxDisplacement_px && std::abs(next.dy - begin.dy) < kMaxDisplacement_px;
      if (!is_near || step_x * step_x + step_y * step_y < kSettled_px * kSettled_px) break;
    }
    const Residual now = residual_of(patch, position_of(to, float(x) + next.dx, float(y) + next.dy), to.stride());
    bool is_better = now.mean_square < at_best.mean_square;
    if (i < count && is_found) is_better = now.mean_square < kBetter * at_best.mean_square;
    // Without texture the two may tie: the coarser level saw more of the image.
    if (i < count && !is_found) is_better = i == 0 || now.mean_square <= at_best.mean_square;
    if (i == 0 && !is_found) found.still = now.mean_square;
    if (is_better) {
      best = next;
      at_best = now;
      if (i < count) chosen = i;
    } else if (i >= count) {
      break;
    }
  }
  if (chosen < 0) return;
  found.dx = best.dx;
  found.dy = best.dy;
  found.moved = at_best.mean_square;
  found.contrast = patch.contrast;
}

MAQ_SIMD_CLONES void vote_clones(const LumaLevel& from, const LumaLevel& to, int x, int y, int row, const Patch& patch,
                                 float* weights, float* dx, float* dy) {
  const Position position = position_of(to, float(x) + patch.dx, float(y) + patch.dy);
  const float* const above = position.at + size_t(row) * to.stride();
  const float* const below = above + to.stride();
  const float* const here = from.at(x, y + row);
  const float right = position.right, down = position.below;
  const Row upper = MAQ_LOAD_ROW(above) * (1 - right) + MAQ_LOAD_ROW(above + 1) * right,
            lower = MAQ_LOAD_ROW(below) * (1 - right) + MAQ_LOAD_ROW(below + 1) * right;
  const Row difference = upper * (1 - down) + lower * down - MAQ_LOAD_ROW(here);
  const Row weight = 1.0f / (difference * difference + 1.0f);
  MAQ_ROW_AT(weights) += weight;
  MAQ_ROW_AT(dx) += weight * patch.dx;
  MAQ_ROW_AT(dy) += weight * patch.dy;
}

}  // namespace

void search_patch(const LumaLevel& from, const LumaLevel& to, int x, int y, const Displacement* candidates, int count,
                  bool is_found, Patch& patch) {
  search_clones(from, to, x, y, candidates, count, is_found, patch);
}

void vote(const LumaLevel& from, const LumaLevel& to, int x, int y, int row, const Patch& patch, float* weights,
          float* dx, float* dy) {
  vote_clones(from, to, x, y, row, patch, weights, dx, dy);
}

void mean_of_five(const float* const* rows, int count, float* mean) {
  int i = 0;
  for (; i + kPatch_px <= count; i += kPatch_px) {
    const Row outer = MAQ_LOAD_ROW(rows[0] + i) + MAQ_LOAD_ROW(rows[4] + i),
              inner = MAQ_LOAD_ROW(rows[1] + i) + MAQ_LOAD_ROW(rows[3] + i);
    MAQ_ROW_AT(mean + i) = (outer + inner + MAQ_LOAD_ROW(rows[2] + i)) * 0.2f;
  }
  for (; i < count; ++i) mean[i] = (rows[0][i] + rows[4][i] + (rows[1][i] + rows[3][i]) + rows[2][i]) * 0.2f;
}

}  // namespace maq
