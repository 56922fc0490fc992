#include "scene/render/descriptor_raster.h"

#include <algorithm>

#include "core/clock.h"
#include "core/error.h"

namespace maq {
namespace {

constexpr int kStripRows = DescriptorRaster::kMultiple;

}  // namespace

void DescriptorRaster::shade(const View& view, WorkerThreads& threads) {
  const RasterWindow& window = view.window;
  const int width = window.width_px, height = window.height_px;
  if (width % kMultiple != 0 || height % kMultiple != 0) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "A raster of ", width, " x ", height,
                " pixels cannot be halved four times; its sides must be multiples of ", kMultiple, ".");
  }
  if (window.left_px < 0 || window.top_px < 0 || width < 0 || height < 0 ||
      width > view.buffer.width_px() - window.left_px || height > view.buffer.height_px() - window.top_px) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "A raster of ", width, " x ", height, " pixels from (", window.left_px,
                ", ", window.top_px, ") on is not inside of a picture of ", view.buffer.width_px(), " x ",
                view.buffer.height_px(), " pixels.");
  }
  const size_t pixels = size_t(width) * size_t(height);
  for (int level = 0; level < kLevels; ++level) {
    keys_[level].resize(pixels >> (2 * level));
    levels_[level].resize(kChannels * (pixels >> (2 * level)));
  }
  scratch_.resize(size_t(threads.count()));
  for (Scratch& scratch : scratch_) {
    scratch.shaded = scratch.shaded_view_dependent = 0;
    scratch.shade_ns = scratch.reduce_ns = 0;
    scratch.constant.reserve(size_t(width) * kStripRows);
    scratch.view_dependent.reserve(size_t(width) * kStripRows);
  }
  threads.run(size_t(height / kStripRows), [&](size_t strip, int worker) {
    Scratch& scratch = scratch_[size_t(worker)];
    const int top = int(strip) * kStripRows;
    const int64_t begin = monotonic_ns();
    shade_strip(view, top, scratch);
    const int64_t between = monotonic_ns();
    reduce_strip(view, top);
    fill_strip(view, top);
    scratch.shade_ns += between - begin;
    scratch.reduce_ns += monotonic_ns() - between;
  });
  shaded_ = view_dependent_ = 0;
  shade_ns_ = reduce_ns_ = 0;
  for (const Scratch& scratch : scratch_) {
    shaded_ += scratch.shaded;
    view_dependent_ += scratch.shaded_view_dependent;
    shade_ns_ += scratch.shade_ns / threads.count();
    reduce_ns_ += scratch.reduce_ns / threads.count();
  }
}

void DescriptorRaster::shade_strip(const View& view, int top, Scratch& scratch) {
  const Scene& scene = view.scene;
  const size_t width = size_t(view.window.width_px);
  // Distance between pixels that are neighbours in a row: side by side, or two of a cell of four.
  const bool is_space_to_depth = view.layout.is_space_to_depth;
  const size_t cell = is_space_to_depth ? 4 * kChannels : 2 * kChannels;
  scratch.constant.clear();
  scratch.view_dependent.clear();
  for (int y = top; y < top + kStripRows; ++y) {
    const DepthKey* from = view.buffer.keys() + size_t(view.window.top_px + y) * size_t(view.buffer.width_px()) +
                           size_t(view.window.left_px);
    DepthKey* const keys = keys_[0].data() + size_t(y) * width;
    std::copy_n(from, width, keys);
    float* const row =
        levels_[0].data() + (is_space_to_depth ? size_t(y / 2) * (width / 2) * cell + (y % 2) * 2 * kChannels
                                               : size_t(y) * width * kChannels);
    for (size_t x = 0; x < width; ++x) {
      float* const to = row + x / 2 * cell + x % 2 * kChannels;
      if (keys[x] == kNoPointKey) {
        std::fill_n(to, kChannels, 0.0f);
        continue;
      }
      const uint32_t point = point_of(keys[x]), index = view.blocks.block_of(point);
      const SceneBlock& block = scene.blocks[index];
      const PointToShade found{index, point - block.first, to};
      (found.point < block.view_dependent ? scratch.view_dependent : scratch.constant).push_back(found);
    }
  }
  scratch.shaded += scratch.constant.size() + scratch.view_dependent.size();
  scratch.shaded_view_dependent += scratch.view_dependent.size();

  for (const bool is_view_dependent : {false, true}) {
    const std::vector<PointToShade>& points = is_view_dependent ? scratch.view_dependent : scratch.constant;
    const auto size_at = [&](size_t begin) { return std::min(kShadedAtOnce, points.size() - begin); };
    if (!points.empty()) prefetch(scene, points.data(), size_at(0), is_view_dependent);
    for (size_t begin = 0; begin < points.size(); begin += kShadedAtOnce) {
      const PointToShade* const some = points.data() + begin;
      const size_t count = size_at(begin), next = begin + count;
      if (next < points.size()) prefetch(scene, points.data() + next, size_at(next), is_view_dependent);
      if (!is_view_dependent) {
        decode_descriptors(scene, some, count, nullptr);
        continue;
      }
      float x[kShadedAtOnce], y[kShadedAtOnce], z[kShadedAtOnce], values[kBasis * kShadedAtOnce];
      find_directions(scene, view.camera_centre, some, count, x, y, z);
      view.basis.evaluate(x, y, z, count, values);
      decode_descriptors(scene, some, count, values);
    }
  }
}

void DescriptorRaster::reduce_strip(const View& view, int top) {
  const size_t width = size_t(view.window.width_px);
  for (int level = 1; level < kLevels; ++level) {
    const size_t columns = width >> level, fine_columns = 2 * columns;
    // Where the four pixels of a finer level's 2x2 are, from the first of them on.
    const bool is_space_to_depth = level == 1 && view.layout.is_space_to_depth;
    const size_t right = kChannels, below = is_space_to_depth ? 2 * kChannels : fine_columns * kChannels;
    const size_t offsets[4] = {0, right, below, below + right};
    const size_t cell = is_space_to_depth ? 4 * kChannels : 2 * kChannels;
    for (int y = top >> level; y < (top + kStripRows) >> level; ++y) {
      const DepthKey* const above = keys_[level - 1].data() + 2 * size_t(y) * fine_columns;
      const DepthKey* const under = above + fine_columns;
      DepthKey* const keys = keys_[level].data() + size_t(y) * columns;
      const float* const from = levels_[level - 1].data() + 2 * size_t(y) * fine_columns * kChannels;
      float* const to = levels_[level].data() + size_t(y) * columns * kChannels;
      for (size_t x = 0; x < columns; ++x) {
        const DepthKey four[4] = {above[2 * x], above[2 * x + 1], under[2 * x], under[2 * x + 1]};
        const size_t of_first = four[1] < four[0] ? 1 : 0, of_last = four[3] < four[2] ? 3 : 2;
        const size_t best = four[of_last] < four[of_first] ? of_last : of_first;
        keys[x] = four[best];
        // If none of the four has a point, the first is all 0.
        std::memcpy(to + x * kChannels, from + x * cell + offsets[best], kChannels * sizeof(float));
      }
    }
  }
}

void DescriptorRaster::fill_strip(const View& view, int top) {
  const size_t width = size_t(view.window.width_px);
  // Uses all scales, whichever the refiner reads: a hole has the colour of the finest scale with a point there.
  constexpr int last = kLevels - 1;
  for (int level = last; level >= 0; --level) {
    const size_t columns = width >> level;
    const bool is_space_to_depth = level == 0 && view.layout.is_space_to_depth;
    const size_t cell = is_space_to_depth ? 4 * kChannels : 2 * kChannels;
    for (int y = top >> level; y < (top + kStripRows) >> level; ++y) {
      const DepthKey* const keys = keys_[level].data() + size_t(y) * columns;
      float* const row =
          levels_[level].data() + (is_space_to_depth ? size_t(y / 2) * (columns / 2) * cell + (y % 2) * 2 * kChannels
                                                     : size_t(y) * columns * kChannels);
      const float* const coarser =
          level < last ? levels_[level + 1].data() + size_t(y / 2) * (columns / 2) * kChannels : nullptr;
      for (size_t x = 0; x < columns; ++x) {
        if (keys[x] != kNoPointKey) continue;
        const float* const from = coarser != nullptr ? coarser + x / 2 * kChannels : view.scene.background.data();
        std::copy_n(from, kColours, row + x / 2 * cell + x % 2 * kChannels);
      }
    }
  }
}

}  // namespace maq
