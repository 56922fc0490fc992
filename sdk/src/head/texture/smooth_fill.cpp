#include "head/texture/smooth_fill.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace maq::head {
namespace {

struct FillLevel {
  int side = 0;
  std::vector<float> weights, values;
};

FillLevel halved(const FillLevel& fine) {
  FillLevel coarse;
  coarse.side = (fine.side + 1) / 2;
  const size_t side = size_t(coarse.side), fine_side = size_t(fine.side);
  coarse.weights.assign(side * side, 0), coarse.values.assign(3 * side * side, 0);
  for (size_t y = 0; y < fine_side; ++y) {
    for (size_t x = 0; x < fine_side; ++x) {
      const size_t from = y * fine_side + x, to = y / 2 * side + x / 2;
      coarse.weights[to] += fine.weights[from];
      for (size_t c = 0; c < 3; ++c) coarse.values[3 * to + c] += fine.weights[from] * fine.values[3 * from + c];
    }
  }
  for (size_t i = 0; i < coarse.weights.size(); ++i) {
    if (coarse.weights[i] <= 0) continue;
    for (size_t c = 0; c < 3; ++c) coarse.values[3 * i + c] /= coarse.weights[i];
    coarse.weights[i] = std::min(1.0f, coarse.weights[i]);
  }
  return coarse;
}

// Bilinear, at the middle of the fine image's pixel.
void fill_from(const FillLevel& coarse, FillLevel& fine) {
  const auto taps = [&](int at, int(&index)[2], float(&share)[2]) {
    const float place = (float(at) + 0.5f) / 2 - 0.5f;
    const float low = std::floor(place);
    index[0] = std::clamp(int(low), 0, coarse.side - 1), index[1] = std::clamp(int(low) + 1, 0, coarse.side - 1);
    share[1] = place - low, share[0] = 1 - share[1];
  };
  for (int y = 0; y < fine.side; ++y) {
    int rows[2];
    float of_rows[2];
    taps(y, rows, of_rows);
    for (int x = 0; x < fine.side; ++x) {
      const size_t at = size_t(y) * size_t(fine.side) + size_t(x);
      const float known = fine.weights[at];
      if (known >= 1) continue;
      int columns[2];
      float of_columns[2];
      taps(x, columns, of_columns);
      float sums[3] = {};
      for (size_t i = 0; i < 2; ++i) {
        for (size_t j = 0; j < 2; ++j) {
          const float* const from = &coarse.values[3 * (size_t(rows[i]) * size_t(coarse.side) + size_t(columns[j]))];
          for (size_t c = 0; c < 3; ++c) sums[c] += of_rows[i] * of_columns[j] * from[c];
        }
      }
      for (size_t c = 0; c < 3; ++c) {
        float& value = fine.values[3 * at + c];
        value = (known > 0 ? known * value : 0) + (1 - known) * sums[c];
      }
    }
  }
}

}  // namespace

void fill_smoothly(int side, const std::vector<float>& weights, std::vector<float>& values) {
  std::vector<FillLevel> levels(1);
  levels[0].side = side, levels[0].weights = weights, levels[0].values = std::move(values);
  while (levels.back().side > 1) levels.push_back(halved(levels.back()));
  for (size_t level = levels.size() - 1; level-- > 0;) fill_from(levels[level + 1], levels[level]);
  values = std::move(levels[0].values);
}

std::vector<float> distance_to_known(int side, const std::vector<float>& weights) {
  constexpr float kFar = 1e9f, kStraight = 1, kDiagonal = 4.0f / 3;
  std::vector<float> distances(weights.size());
  for (size_t i = 0; i < weights.size(); ++i) distances[i] = weights[i] >= 0.5f ? 0 : kFar;
  const auto at = [&](int x, int y) -> float& { return distances[size_t(y) * size_t(side) + size_t(x)]; };
  const auto look = [&](int x, int y, int dx, int dy) {
    if (x + dx < 0 || x + dx >= side || y + dy < 0 || y + dy >= side) return;
    at(x, y) = std::min(at(x, y), at(x + dx, y + dy) + (dx != 0 && dy != 0 ? kDiagonal : kStraight));
  };
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) look(x, y, -1, 0), look(x, y, -1, -1), look(x, y, 0, -1), look(x, y, 1, -1);
  }
  for (int y = side - 1; y >= 0; --y) {
    for (int x = side - 1; x >= 0; --x) look(x, y, 1, 0), look(x, y, 1, 1), look(x, y, 0, 1), look(x, y, -1, 1);
  }
  return distances;
}

}  // namespace maq::head
