#include "scene/look_raster.h"

#include <algorithm>
#include <chrono>

#include "core/error.h"

namespace maq {
namespace {

constexpr int kStripRows = LookRaster::kMultiple;
constexpr size_t kChannels = LookRaster::kChannels;

int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

// Where the pixels of a level are.
struct LevelLayout {
  LevelLayout(const ViewToShade& view, int level)
      : width(size_t(view.window.width_px) >> level), is_folded(level == 0 && view.layout.is_folded) {}

  // From one 2x2 to the next, and of its pixels (0, 0), (0, 1), (1, 0), (1, 1) from the first.
  size_t cell() const { return is_folded ? 4 * kChannels : 2 * kChannels; }
  size_t below() const { return is_folded ? 2 * kChannels : width * kChannels; }
  // Of the first 2x2 in a row of them.
  size_t row_of_cells(size_t row) const { return 2 * row * width * kChannels; }

  size_t width;
  bool is_folded;
};

}  // namespace

void LookRaster::shade(const ViewToShade& view, WorkerThreads& threads) {
  const RasterWindow& window = view.window;
  const ZBuffer& buffer = view.buffer;
  const int width = window.width_px, height = window.height_px;
  if (width % kMultiple != 0 || height % kMultiple != 0) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "A raster of ", width, " x ", height,
                " pixels cannot be halved four times; its sides must be multiples of ", kMultiple, ".");
  }
  if (window.left_px < 0 || window.top_px < 0 || width < 0 || height < 0 ||
      width > buffer.width_px() - window.left_px || height > buffer.height_px() - window.top_px) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "A raster of ", width, " x ", height, " pixels from (", window.left_px,
                ", ", window.top_px, ") on is not inside of a picture of ", buffer.width_px(), " x ",
                buffer.height_px(), " pixels.");
  }
  const size_t pixels = size_t(width) * size_t(height);
  for (int level = 0; level < kLevels; ++level) {
    keys_[level].resize(pixels >> (2 * level));
    levels_[level].resize(kChannels * (pixels >> (2 * level)));
  }
  scratch_.resize(size_t(threads.count()));
  for (Scratch& scratch : scratch_) {
    scratch.shaded = scratch.varied = 0;
    scratch.shade_ns = scratch.reduce_ns = 0;
    scratch.constant.reserve(size_t(width) * kStripRows);
    scratch.varying.reserve(size_t(width) * kStripRows);
  }
  threads.run(size_t(height / kStripRows), [&](size_t strip, int worker) {
    Scratch& scratch = scratch_[size_t(worker)];
    const int top = int(strip) * kStripRows;
    const int64_t begin = now_ns();
    shade_strip(view, top, scratch);
    const int64_t between = now_ns();
    reduce_strip(view, top);
    fill_strip(view, top);
    scratch.shade_ns += between - begin;
    scratch.reduce_ns += now_ns() - between;
  });
  shaded_ = varying_ = 0;
  shade_ns_ = reduce_ns_ = 0;
  for (const Scratch& scratch : scratch_) {
    shaded_ += scratch.shaded;
    varying_ += scratch.varied;
    shade_ns_ += scratch.shade_ns / threads.count();
    reduce_ns_ += scratch.reduce_ns / threads.count();
  }
}

void LookRaster::shade_strip(const ViewToShade& view, int top, Scratch& scratch) {
  const Scene& scene = view.scene;
  const LevelLayout layout(view, 0);
  const size_t width = layout.width;
  scratch.constant.clear();
  scratch.varying.clear();
  for (size_t y = size_t(top); y < size_t(top + kStripRows); ++y) {
    const DepthKey* const from =
        view.buffer.keys() + (size_t(view.window.top_px) + y) * size_t(view.buffer.width_px()) + view.window.left_px;
    DepthKey* const keys = keys_[0].data() + y * width;
    std::copy_n(from, width, keys);
    float* const row = levels_[0].data() + layout.row_of_cells(y / 2) + y % 2 * layout.below();
    for (size_t x = 0; x < width; ++x) {
      float* const to = row + x / 2 * layout.cell() + x % 2 * kChannels;
      if (keys[x] == kNoPointKey) {
        std::fill_n(to, kChannels, 0.0f);
        continue;
      }
      const uint32_t point = point_of(keys[x]), index = view.blocks.block_of(point);
      const SceneBlock& block = scene.blocks[index];
      const PointToShade found{index, point - block.first, to};
      (found.point < block.varying && !view.has_mean_looks ? scratch.varying : scratch.constant).push_back(found);
    }
  }
  scratch.shaded += scratch.constant.size() + scratch.varying.size();
  scratch.varied += scratch.varying.size();

  for (const bool is_varying : {false, true}) {
    const std::vector<PointToShade>& points = is_varying ? scratch.varying : scratch.constant;
    const auto size_at = [&](size_t begin) { return std::min(kShadedAtOnce, points.size() - begin); };
    if (!points.empty()) fetch(scene, points.data(), size_at(0), is_varying);
    for (size_t begin = 0; begin < points.size(); begin += kShadedAtOnce) {
      const PointToShade* const some = points.data() + begin;
      const size_t count = size_at(begin), next = begin + count;
      if (next < points.size()) fetch(scene, points.data() + next, size_at(next), is_varying);
      if (!is_varying) {
        decode_looks(scene, some, count, nullptr);
        continue;
      }
      float x[kShadedAtOnce], y[kShadedAtOnce], z[kShadedAtOnce], values[kBasis * kShadedAtOnce];
      find_directions(scene, view.camera_centre, some, count, x, y, z);
      view.basis.evaluate(x, y, z, count, values);
      decode_looks(scene, some, count, values);
    }
  }
}

void LookRaster::reduce_strip(const ViewToShade& view, int top) {
  for (int level = 1; level < kLevels; ++level) {
    const LevelLayout fine(view, level - 1), coarse(view, level);
    const size_t offsets[4] = {0, kChannels, fine.below(), fine.below() + kChannels};
    for (size_t y = size_t(top) >> level; y < size_t(top + kStripRows) >> level; ++y) {
      const DepthKey* const above = keys_[level - 1].data() + 2 * y * fine.width;
      const DepthKey* const under = above + fine.width;
      DepthKey* const keys = keys_[level].data() + y * coarse.width;
      const float* const from = levels_[level - 1].data() + fine.row_of_cells(y);
      float* const to = levels_[level].data() + y * coarse.width * kChannels;
      for (size_t x = 0; x < coarse.width; ++x) {
        const DepthKey four[4] = {above[2 * x], above[2 * x + 1], under[2 * x], under[2 * x + 1]};
        const size_t of_first = four[1] < four[0] ? 1 : 0, of_last = four[3] < four[2] ? 3 : 2;
        const size_t best = four[of_last] < four[of_first] ? of_last : of_first;
        keys[x] = four[best];
        // Of four without a point the first is all 0.
        std::memcpy(to + x * kChannels, from + x * fine.cell() + offsets[best], kChannels * sizeof(float));
      }
    }
  }
}

void LookRaster::fill_strip(const ViewToShade& view, int top) {
  for (int level = kLevels - 2; level >= 0; --level) {
    const LevelLayout fine(view, level), coarse(view, level + 1);
    for (size_t y = size_t(top) >> level; y < size_t(top + kStripRows) >> level; ++y) {
      const DepthKey* const keys = keys_[level].data() + y * fine.width;
      const float* const from = levels_[level + 1].data() + y / 2 * coarse.width * kChannels;
      float* const to = levels_[level].data() + fine.row_of_cells(y / 2) + y % 2 * fine.below();
      for (size_t x = 0; x < fine.width; ++x) {
        if (keys[x] != kNoPointKey) continue;
        std::copy_n(from + x / 2 * kChannels, kColours, to + x / 2 * fine.cell() + x % 2 * kChannels);
      }
    }
  }
}

}  // namespace maq
