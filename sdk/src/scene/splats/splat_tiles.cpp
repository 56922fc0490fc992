#include "scene/splats/splat_tiles.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace maq {
namespace {

// Depths are sorted by the upper bits of their range, in two rounds.
constexpr int kDigitBits = 11, kDigits = 1 << kDigitBits;
// Entries of lists at a time: 128 MB. A tile alone may have more.
constexpr uint64_t kMaxListEntries = uint64_t(1) << 25;
// Narrower splats are in the corners of their rectangle, too: that costs less than to find out.
constexpr int kWideTiles = 3;
constexpr float kListMarginPx = 0.01f;  // of rounding

// Positive floats are in the order of their bits.
uint32_t depth_bits(float depth) {
  uint32_t bits;
  std::memcpy(&bits, &depth, sizeof bits);
  return bits;
}

// Calls use(tile) for each tile of the splat in [first_tile, end_tile).
template <class Use>
void for_each_tile(const ProjectedSplat* splats, uint32_t index, const TileRectangle& tiles, int columns,
                   int first_tile, int end_tile, Use&& use) {
  const int first_row = std::max(int(tiles.top), first_tile / columns);
  const int end_row = std::min(int(tiles.bottom), (end_tile - 1) / columns + 1);
  const bool is_small = tiles.bottom - tiles.top == 1 || tiles.right - tiles.left < kWideTiles;
  for (int row = first_row; row < end_row; ++row) {
    const TileColumns reached = is_small ? TileColumns{tiles.left, tiles.right} : columns_in_row(splats[index], row);
    const int begin = std::max(row * columns + reached.first, first_tile);
    const int end = std::min(row * columns + reached.end, end_tile);
    for (int tile = begin; tile < end; ++tile) use(size_t(tile));
  }
}

}  // namespace

TileColumns columns_in_row(const ProjectedSplat& splat, int tile_row) {
  const float budget = splat.log_opacity + kMaxFalloff;
  // In units in which half of a variance is the inverse of a curvature.
  const float variance_y = 0.5f / splat.falloff;
  const float variance_x = 0.5f / splat.curvature + splat.slope * splat.slope * variance_y;
  const float half_height = std::sqrt(2 * budget * variance_y);
  // Where the ellipse reaches farthest to the right: there dy is this, to the left it is the negative.
  const float farthest = -splat.slope * variance_y * std::sqrt(2 * budget / variance_x);
  const float top = std::max(float(tile_row * kTileHeight_px) - splat.y, -half_height),
              bottom = std::min(float(tile_row * kTileHeight_px + kTileHeight_px - 1) - splat.y, half_height);
  if (!(top <= bottom)) return {0, 0};
  const auto edge = [&](float dy, float sign) {
    const float within = std::max(budget - splat.falloff * dy * dy, 0.0f) / splat.curvature;
    return splat.x - splat.slope * dy + sign * (std::sqrt(within) + kListMarginPx);
  };
  const float left = edge(std::clamp(-farthest, top, bottom), -1), right = edge(std::clamp(farthest, top, bottom), 1);
  const float last = float(splat.tiles.right) * kTileWidth_px;
  const int first = int(std::clamp(std::ceil(left), 0.0f, last)) / kTileWidth_px;
  const int end = right < 0 ? 0 : int(std::min(right, last)) / kTileWidth_px + 1;
  return {std::max(first, int(splat.tiles.left)), std::min(end, int(splat.tiles.right))};
}

void SplatTiles::sort(const ProjectedSplat* splats, const std::vector<std::pair<uint32_t, uint32_t>>& spans,
                      int columns, int rows, WorkerThreads& threads) {
  splats_ = splats;
  columns_ = columns;
  rows_ = rows;
  first_tile_ = end_tile_ = 0;
  std::vector<size_t> offsets(spans.size() + 1, 0);
  for (size_t i = 0; i < spans.size(); ++i) offsets[i + 1] = offsets[i] + (spans[i].second - spans[i].first);
  order_.resize(offsets.back());
  constexpr size_t kSpansAtOnce = 64;
  threads.run((spans.size() + kSpansAtOnce - 1) / kSpansAtOnce, [&](size_t task, int) {
    const size_t end = std::min(spans.size(), (task + 1) * kSpansAtOnce);
    for (size_t i = task * kSpansAtOnce; i < end; ++i) {
      DepthEntry* to = order_.data() + offsets[i];
      for (uint32_t k = spans[i].first; k < spans[i].second; ++k)
        *to++ = {depth_bits(splats[k].depth), k, splats[k].tiles};
    }
  });
  sort_by_depth(threads);
  count(threads);
}

void SplatTiles::sort_by_depth(WorkerThreads& threads) {
  if (order_.empty()) return;
  const auto [low, high] = std::minmax_element(order_.begin(), order_.end(),
                                               [](const DepthEntry& a, const DepthEntry& b) { return a.key < b.key; });
  const uint32_t first = low->key;
  int shift = 0;
  while ((high->key - first) >> shift >= uint32_t(kDigits) * kDigits) ++shift;
  swapped_.resize(order_.size());
  const size_t parts = size_t(threads.count());
  digits_.resize(parts);
  for (const int from : {shift, shift + kDigitBits}) {
    const auto digit = [&](const DepthEntry& entry) { return size_t((entry.key - first) >> from) & (kDigits - 1); };
    const auto part_begin = [&](size_t part) { return order_.size() * part / parts; };
    threads.run(parts, [&](size_t part, int) {
      digits_[part].assign(kDigits, 0);
      for (size_t i = part_begin(part); i < part_begin(part + 1); ++i) ++digits_[part][digit(order_[i])];
    });
    uint32_t sum = 0;
    for (size_t value = 0; value < kDigits; ++value) {
      for (size_t part = 0; part < parts; ++part) {
        const uint32_t here = digits_[part][value];
        digits_[part][value] = sum;
        sum += here;
      }
    }
    threads.run(parts, [&](size_t part, int) {
      for (size_t i = part_begin(part); i < part_begin(part + 1); ++i) {
        swapped_[digits_[part][digit(order_[i])]++] = order_[i];
      }
    });
    order_.swap(swapped_);
  }
}

void SplatTiles::count(WorkerThreads& threads) {
  const size_t tiles = size_t(columns_) * size_t(rows_), parts = size_t(threads.count());
  counts_.assign(parts * tiles, 0);
  threads.run(parts, [&](size_t part, int) {
    uint32_t* const counts = counts_.data() + part * tiles;
    for (size_t i = order_.size() * part / parts; i < order_.size() * (part + 1) / parts; ++i) {
      for_each_tile(splats_, order_[i].index, order_[i].tiles, columns_, 0, int(tiles),
                    [&](size_t tile) { ++counts[tile]; });
    }
  });
  totals_.assign(tiles, 0);
  for (size_t part = 0; part < parts; ++part) {
    for (size_t tile = 0; tile < tiles; ++tile) totals_[tile] += counts_[part * tiles + tile];
  }
}

bool SplatTiles::fill_next(WorkerThreads& threads) {
  const size_t tiles = totals_.size(), parts = size_t(threads.count());
  first_tile_ = end_tile_;
  if (size_t(first_tile_) == tiles) return false;
  starts_.assign(1, 0);
  uint64_t sum = 0;
  while (size_t(end_tile_) < tiles &&
         (end_tile_ == first_tile_ || sum + totals_[size_t(end_tile_)] <= kMaxListEntries)) {
    const size_t tile = size_t(end_tile_++);
    size_t at = size_t(sum);
    sum += totals_[tile];
    starts_.push_back(size_t(sum));
    // From the number of a part's splats in the tile to the place of its first.
    for (size_t part = 0; part < parts; ++part) {
      const uint32_t here = counts_[part * tiles + tile];
      counts_[part * tiles + tile] = uint32_t(at);
      at += here;
    }
  }
  lists_.resize(size_t(sum));
  threads.run(parts, [&](size_t part, int) {
    uint32_t* const next = counts_.data() + part * tiles;
    for (size_t i = order_.size() * part / parts; i < order_.size() * (part + 1) / parts; ++i) {
      const uint32_t index = order_[i].index;
      for_each_tile(splats_, index, order_[i].tiles, columns_, first_tile_, end_tile_,
                    [&](size_t tile) { lists_[next[tile]++] = index; });
    }
  });
  return true;
}

}  // namespace maq
