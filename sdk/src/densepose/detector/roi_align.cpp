#include "densepose/detector/roi_align.h"

#include <algorithm>
#include <cmath>

#include "core/simd_clones.h"

namespace maq {
namespace {

using AxisWeights = RoiAlign::AxisWeights;

void fill_weights(float low, float high, int stride, int pool, int cells, AxisWeights& axis) {
  const float start = low / float(stride) - 0.5f;
  const float extent = high / float(stride) - 0.5f - start;
  const float bin_size = extent / float(pool);
  const int samples = std::max(0, int(std::ceil(extent / float(pool))));

  axis.bins.assign(size_t(pool), {});
  axis.weights.clear();
  axis.first_cell = cells;
  axis.end_cell = 0;
  for (int bin = 0; bin < pool; ++bin) {
    AxisWeights::Bin& out = axis.bins[size_t(bin)];
    out.first_weight = axis.weights.size();
    for (int sample = 0; sample < samples; ++sample) {
      float at = start + float(bin) * bin_size + (float(sample) + 0.5f) * bin_size / float(samples);
      if (at < -1.0f || at > float(cells)) continue;
      at = std::max(at, 0.0f);
      int cell = int(at);
      float fraction = at - float(cell);
      if (cell >= cells - 1) {
        cell = cells - 1;
        fraction = 0;
      }
      if (out.count == 0) out.first_cell = cell;
      const size_t slot = size_t(cell - out.first_cell);
      out.count = std::max(out.count, slot + (fraction > 0 ? 2 : 1));
      axis.weights.resize(out.first_weight + out.count, 0.0f);
      float* weights = axis.weights.data() + out.first_weight + slot;
      weights[0] += (1 - fraction) / float(samples);
      if (fraction > 0) weights[1] += fraction / float(samples);
    }
    if (out.count == 0) continue;
    axis.first_cell = std::min(axis.first_cell, out.first_cell);
    axis.end_cell = std::max(axis.end_cell, out.first_cell + int(out.count));
  }
}

}  // namespace

MAQ_SIMD_CLONES void RoiAlign::run(const FeatureMap& map, const Box& box, int pool, float* output) {
  fill_weights(box.y0, box.y1, map.stride, pool, map.height, rows_);
  fill_weights(box.x0, box.x1, map.stride, pool, map.width, columns_);
  std::fill(output, output + size_t(map.channels) * size_t(pool) * size_t(pool), 0.0f);
  const int width = columns_.end_cell - columns_.first_cell;
  if (width <= 0) return;

  const size_t channels = size_t(map.channels);
  const size_t line_size = size_t(width) * channels;
  line_.resize(line_size);
  float* line = line_.data();
  for (int y = 0; y < pool; ++y, output += size_t(pool) * channels) {
    const AxisWeights::Bin& row = rows_.bins[size_t(y)];
    if (row.count == 0) continue;
    std::fill_n(line, line_size, 0.0f);
    for (size_t i = 0; i < row.count; ++i) {
      const float weight = rows_.weights[row.first_weight + i];
      const size_t first = (size_t(row.first_cell) + i) * size_t(map.width) + size_t(columns_.first_cell);
      const float* cells = map.data + first * channels;
      for (size_t k = 0; k < line_size; ++k) line[k] += weight * cells[k];
    }
    for (int x = 0; x < pool; ++x) {
      const AxisWeights::Bin& column = columns_.bins[size_t(x)];
      float* bin = output + size_t(x) * channels;
      for (size_t i = 0; i < column.count; ++i) {
        const float weight = columns_.weights[column.first_weight + i];
        const float* cell = line + (size_t(column.first_cell - columns_.first_cell) + i) * channels;
        for (size_t c = 0; c < channels; ++c) bin[c] += weight * cell[c];
      }
    }
  }
}

}  // namespace maq
