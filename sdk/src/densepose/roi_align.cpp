#include "densepose/roi_align.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/simd_clones.h"

namespace maq {
namespace {

// Bilinear samples, their mean over a bin and the zero outside of the map all separate into rows and columns, so a RoI
// is A_y F A_x^T with two sparse matrices. This is one of them: for each bin, the cells it draws on and their weights.
struct AxisWeights {
  struct Bin {
    int first_cell = 0;
    std::vector<float> weights;  // of the cells from first_cell on; empty when the bin lies outside of the map
  };
  std::vector<Bin> bins;
  int first_cell = 0;  // over all bins
  int end_cell = 0;
};

AxisWeights axis_weights(float low, float high, int stride, int pool, int cells) {
  const float start = low / float(stride) - 0.5f;
  const float extent = high / float(stride) - 0.5f - start;
  const float bin_size = extent / float(pool);
  const int samples = std::max(0, int(std::ceil(extent / float(pool))));

  AxisWeights axis;
  axis.bins.resize(size_t(pool));
  axis.first_cell = cells;
  for (int bin = 0; bin < pool; ++bin) {
    AxisWeights::Bin& out = axis.bins[size_t(bin)];
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
      if (out.weights.empty()) out.first_cell = cell;
      const size_t slot = size_t(cell - out.first_cell);
      out.weights.resize(std::max(out.weights.size(), slot + (fraction > 0 ? 2 : 1)), 0.0f);
      out.weights[slot] += (1 - fraction) / float(samples);
      if (fraction > 0) out.weights[slot + 1] += fraction / float(samples);
    }
    if (out.weights.empty()) continue;
    axis.first_cell = std::min(axis.first_cell, out.first_cell);
    axis.end_cell = std::max(axis.end_cell, out.first_cell + int(out.weights.size()));
  }
  return axis;
}

}  // namespace

MAQ_SIMD_CLONES void roi_align(const FeatureMap& map, const Box& box, int pool, float* output) {
  const AxisWeights rows = axis_weights(box.y0, box.y1, map.stride, pool, map.height);
  const AxisWeights cols = axis_weights(box.x0, box.x1, map.stride, pool, map.width);
  std::fill(output, output + size_t(map.channels) * size_t(pool) * size_t(pool), 0.0f);
  const int width = cols.end_cell - cols.first_cell;
  if (width <= 0) return;

  const size_t channels = size_t(map.channels);
  const size_t line_size = size_t(width) * channels;
  std::vector<float> line(line_size);
  for (int y = 0; y < pool; ++y, output += size_t(pool) * channels) {
    const AxisWeights::Bin& row = rows.bins[size_t(y)];
    if (row.weights.empty()) continue;
    std::fill(line.begin(), line.end(), 0.0f);
    for (size_t i = 0; i < row.weights.size(); ++i) {
      const float weight = row.weights[i];
      const size_t first = (size_t(row.first_cell) + i) * size_t(map.width) + size_t(cols.first_cell);
      const float* cells = map.data + first * channels;
      for (size_t k = 0; k < line_size; ++k) line[k] += weight * cells[k];
    }
    for (int x = 0; x < pool; ++x) {
      const AxisWeights::Bin& col = cols.bins[size_t(x)];
      float* bin = output + size_t(x) * channels;
      for (size_t i = 0; i < col.weights.size(); ++i) {
        const float weight = col.weights[i];
        const float* cell = line.data() + (size_t(col.first_cell - cols.first_cell) + i) * channels;
        for (size_t c = 0; c < channels; ++c) bin[c] += weight * cell[c];
      }
    }
  }
}

}  // namespace maq
